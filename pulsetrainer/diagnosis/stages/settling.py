"""Settling: what still settles long after the beginning of a record has a cause.

The after-effects of what a device did before a record decay in it, so the search fits the beginning of each
record freely. A sensor that warms up looks the same, and a free beginning absorbs nearly all of it. So if no
slow cause was found, the records are also fitted without the free beginning. If that leaves relevantly more
after the first fifth of a record, the search is made again without it. The new result counts if it leaves as
little as the old one did.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit, weights_for
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.stages import whole_search
from pulsetrainer.diagnosis.stages.begin import begins_at_rest, late
from pulsetrainer.diagnosis.stages.repetition import SLOW, is_held, may_be_held
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import PERCENT


def stage(state: State) -> State:
    """Return the state of a search without free beginnings, where these hid a cause."""
    if any(term.cause.family in SLOW for term in state.current.terms):
        return state
    at_rest = begins_at_rest(state.problem)
    without = refit(at_rest, state.current.terms, None)
    more = (late(without) - late(state.current)) * state.floor.count
    if more < state.floor.relevant:
        return state
    plain = weights_for(at_rest, (), None)
    again = replace(
        state, problem=at_rest, baseline=plain, current=plain, held_out=HeldOut(at_rest), p_values={}
    )
    again = whole_search.stage(again)
    worse = again.current.squares - state.current.squares > state.floor.relevant
    held = [term for term in again.current.terms if may_be_held(term) and _is_held(again, term)]
    return state if worse or held else again


def _is_held(state: State, term: Term) -> bool:
    without = state.current.without(term)
    gain = state.held_out.gain_told(without, state.current, state.floor)
    return is_held(state, term, without, PERCENT * gain)
