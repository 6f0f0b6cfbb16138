"""Equal loops: a cause that the weights can absorb is sought where they cannot.

The weights can absorb a feedback of the output into the input almost entirely, so that no refit shows it. But
all minor loops between the same two turns are congruent in a Preisach model, whatever its weights; their
differences are tested by exchanging the loops, in standard errors over them, at p of at most 0.001. The cause
is dropped if its strength runs into its bound, or if the rest of the record contradicts it: with it in the
model the sum of squares must not rise by a relevant amount. The test is not made if much is unexplained or
jagged, since either makes equal loops differ (decision 042), nor for the dual form, whose loops between equal
turns of the input are not congruent.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis import congruency
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fitting import weights_for
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with the causes that only equal loops show."""
    whole = state.is_whole(state.current)
    if not whole or state.jagged or state.problem.base is not None:
        return state
    for cause in library().values():
        if cause.by_contrast and cause.id not in state.current.names:
            state = _tested(state, cause)
    return state


def _tested(state: State, cause: Cause) -> State:
    current = state.current
    held = congruency.fitted_contrast(state.problem, current, cause, state.question.rng)
    if held is None or held.p_value > LIMITS.contrast_p_max or held.at_bound:
        return state
    terms = in_order((*current.terms, Term(cause, (held.value,))))
    extended = weights_for(state.problem, terms, current, rebuild=True)
    if extended.squares - current.squares > state.floor.relevant:
        return state
    return replace(
        state,
        current=extended,
        without={**state.without, cause.id: current},
        p_values={**state.p_values, cause.id: held.p_value},
        by_contrast={**state.by_contrast, cause.id: (held.estimate(cause),)},
    )
