"""Equal loops: a cause that the weights can absorb is sought where they cannot.

The weights can absorb a feedback of the output into the input almost entirely, so that no refit shows it. But
in a Preisach model all minor loops between the same two turns are congruent, whatever its weights.
Differences between such loops are therefore tested, in standard errors over the loops, by exchanging the
loops among each other; p must be at most 0.001. The cause is dropped if its strength runs into its bound. It
is also dropped if the rest of the record contradicts it, that is, if the sum of squares rises by a relevant
amount with it in the model.

The test is not made if more than noise is unexplained, or if the output is jagged, that is, sticks or comes
in coarse steps: either makes equal loops differ (decision 042). Nor is it made for the dual form, whose loops
between equal turns of the input are not congruent.
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
