"""Restart: the wrong one of a family may hide a second cause.

If a device has a field lag and a resonance, a delay explains most of both. What the delay leaves looks like
more lag, so that the resonance is never found. So a cause may still be significant although its family is in
the model. The search then begins again with that cause in place of the other, and the better of the two
results is kept (decision 044).
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit
from pulsetrainer.diagnosis.stages import search
from pulsetrainer.diagnosis.state import State


def stage(state: State) -> State:
    """Return the better of two searches: this one, and one that begins with another cause of a family."""
    scores = state.scores.scores
    left = next((s for s in scores if s.cause.family in state.families and state.significant(s)), None)
    if left is None:
        return state
    others = [term for term in state.current.terms if term.cause.family != left.cause.family]
    terms = (*others, Term(left.cause, left.start))
    known = {term.cause.id: state.p_values[term.cause.id] for term in others} | {left.cause.id: left.p_value}
    first = refit(state.problem, terms, state.current, rebuild=True)
    found = search.stage(replace(state, current=first, p_values=known))
    return state if state.current.squares - found.current.squares < state.floor.relevant else found
