"""Whole search: causes are sought, exchanged and dropped, in this order, wherever a search is made again."""

from __future__ import annotations

from pulsetrainer.diagnosis.stages import elimination, exchange, restart, search
from pulsetrainer.diagnosis.state import State

ORDER = (search, restart, exchange, elimination)


def stage(state: State) -> State:
    """Return the state with all causes that a search from here finds."""
    for one in ORDER:
        state = one.stage(state)
    return state
