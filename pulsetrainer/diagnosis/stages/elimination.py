"""Backward elimination: no cause that the others have made superfluous.

From the model with all causes each is taken out in turn. While the one that is missed least makes no relevant
difference, it is dropped. So is one without which time that was left out is predicted better: it was accepted
before the others, and does harm beside them. A single cause has proved itself against the baseline,
and goes only if it does harm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis.causes.unlisted import Unlisted
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.stages import screened
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state without superfluous causes, and for each that stays the model without it."""
    current, without = _eliminated(state)
    state = replace(state, current=current, without=without)
    return screened.stage(state) if set(current.names) != set(state.p_values) else state


def _eliminated(state: State) -> tuple[Fitted, dict[str, Fitted]]:
    current = state.current
    while current.terms:
        single = len(current.terms) == 1
        without = [state.baseline] if single else [current.without(term) for term in current.terms]
        spare = _harmful(state, current, without) if single else _spare(state, current, without)
        if spare is None:
            return current, {t.cause.id: one for t, one in zip(current.terms, without, strict=True)}
        current = spare
    return current, {}


def _spare(state: State, current: Fitted, without: Sequence[Fitted]) -> Fitted | None:
    """The one of the models with one cause less that is no worse; None where all of them are."""
    weakest = min(without, key=lambda fitted: fitted.squares)
    if weakest.squares - current.squares < state.floor.relevant:
        return weakest
    # a learned curve can do what a listed cause does: that is then no better, and may yet be true
    return None if Unlisted.id in current.names else _harmful(state, current, without)


def _harmful(state: State, current: Fitted, without: Sequence[Fitted]) -> Fitted | None:
    """The one of the models with one cause less that predicts best, if better than with all of them.

    Both blocks that alternate and whole pieces of the time must say so.
    """
    best = min(without, key=state.held_out.error)
    if not state.held_out.gain(best, current, state.floor) < 0:  # NaN: it cannot be told
        return None
    fewer, more = (np.sum(state.held_out.pieces(one, LIMITS.pieces)) for one in (best, current))
    return best if fewer <= more else None
