"""Backward elimination: a cause that the others have made superfluous is dropped.

Each cause is taken out of the full model in turn. The least important one is dropped if it makes no relevant
difference. It is also dropped if it makes less than a five hundredth of the difference that all causes make
together, since the formulas of the others are not that exact. Beside a creep faster than any that is
tried, a cause as fast as the samples must make 8 % of it. This is repeated as long as a cause is dropped.

There are two more reasons to drop a cause. A single cause, which has proved itself against the baseline, is
dropped for these only:

- Time that was left out is predicted better without the cause: it was accepted before the others, and does
  harm beside them.
- The cause takes away less than a third of what can be lowered on blocks that were left out. This counts only
  if more than noise is left with the cause or without it: any cause fits a device that is not a Preisach
  operator.

A line of the spectrum is not dropped for these two reasons if it is most of what is left without it, or
stands ten times above the lines near it. No error of a model looks like such a line, however badly blocks
that were left out are predicted for other reasons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis.causes.unlisted import Unlisted
from pulsetrainer.diagnosis.fast_causes import beside_fast_creep
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.lines import is_a_line
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
        spare = None if single else _spare(state, current, without)
        # a learned curve can do what a listed cause does: that is then no better, and may yet be true
        if spare is None and (single or Unlisted.id not in current.names):
            pairs = zip(current.terms, without, strict=True)
            asked = [fewer for term, fewer in pairs if not is_a_line(state, term, current, fewer)]
            spare = _harmful(state, current, asked) or _of_little_use(state, current, asked)
        if spare is None:
            return current, {t.cause.id: one for t, one in zip(current.terms, without, strict=True)}
        current = spare
    return current, {}


def _spare(state: State, current: Fitted, without: Sequence[Fitted]) -> Fitted | None:
    """The best of the models with one cause less, if it is no worse than the full one; else None."""
    of_all, frame = state.baseline.squares - current.squares, state.problem.frames[0]
    missed = [beside_fast_creep(term, current.terms, frame) for term in current.terms]
    least = [LIMITS.imperfect if one else LIMITS.least_share for one in missed]
    spare = [
        fewer
        for fewer, share in zip(without, least, strict=True)
        if fewer.squares - current.squares < max(state.floor.relevant, share * of_all)
    ]
    return min(spare, key=lambda fitted: fitted.squares, default=None)


def _of_little_use(state: State, current: Fitted, without: Sequence[Fitted]) -> Fitted | None:
    """The model without the cause that predicts least, if that is little; else None.

    If only noise is left without a cause too, the blocks left out hold mostly noise, which nothing
    predicts: such a cause is not considered.
    """
    without = [fewer for fewer in without if not (state.is_whole(current) and state.is_whole(fewer))]
    if not without:
        return None
    gains = [state.held_out.gain_told(fewer, current, state.floor) for fewer in without]
    least = int(np.argmin(gains))  # NaN where it cannot be told: that is the least, and no reason
    return without[least] if gains[least] < LIMITS.held_out_kept else None


def _harmful(state: State, current: Fitted, without: Sequence[Fitted]) -> Fitted | None:
    """The model with one cause less that predicts best, if better than the full one; else None.

    Both alternating blocks and whole pieces of the time must show it.
    """
    best = min(without, key=state.held_out.error, default=None)
    if best is None or not state.held_out.gain(best, current, state.floor) < 0:  # NaN: it cannot be told
        return None
    fewer, more = (np.sum(state.held_out.pieces(one)) for one in (best, current))
    return best if fewer <= more else None
