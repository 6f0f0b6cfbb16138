"""Backward elimination: no cause that the others have made superfluous.

From the model with all causes each is taken out in turn. While the one that is missed least makes no relevant
difference, it is dropped. A single cause stays: it has proved itself against the baseline.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.stages import screened
from pulsetrainer.diagnosis.state import State


def stage(state: State) -> State:
    """Return the state without superfluous causes, and for each that stays the model without it."""
    current, without = _eliminated(state)
    state = replace(state, current=current, without=without)
    return screened.stage(state) if set(current.names) != set(state.p_values) else state


def _eliminated(state: State) -> tuple[Fitted, dict[str, Fitted]]:
    current = state.current
    while len(current.terms) > 1:
        without = [current.without(term) for term in current.terms]
        weakest = min(without, key=lambda fitted: fitted.squares)
        if weakest.squares - current.squares >= state.floor.relevant:
            return current, {t.cause.id: one for t, one in zip(current.terms, without, strict=True)}
        current = weakest
    return current, {term.cause.id: state.baseline for term in current.terms}
