"""First stroke: looked at again, now that causes are known.

The first stroke of a device that was not cycled before differs from all later ones, and is left out before
anything is fitted. If the device creeps, rings or runs in, the later strokes differ as well, and hide the
first one. So it is looked for once more in the output less what the causes add. If it stands out there, it is
left out, and the search begins again.

A first stroke of which the model misses three times as much as of all that follows is left out as well, as in
`evaluate`: in a record with a single stroke from that end there is nothing to compare it with.

If neither tells, the search is tried without it in two cases: where more than noise is left, since the first
stroke may have kept the causes from being found; and where more than half of what the causes explain lies
within first strokes. There, one that could not be compared with others looks like heat, or like a drift of
the zero that ends with it. The result counts if it leaves only noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.core.initial_state import known_from, left_out_words, second_stroke
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.diagnosis.fitting import added
from pulsetrainer.diagnosis.stages import baseline, raw_data, whole_search
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state of a search without first strokes that are unlike the later ones."""
    current, records = state.current, state.problem.records
    moved = added(current.simulator, current.terms)
    static = [even.output - one for even, one in zip(records, moved, strict=True)]
    inputs = [even.input for even in records]
    apart = [known_from(u, 0.0, 1.0, y) for u, y in zip(inputs, static, strict=True)]
    known = [known_from(u, 0.0, 1.0) for u in inputs]
    second = [second_stroke(u, 0.0, 1.0) for u in inputs]
    missed = [until if _misses(state, k, until) else 0 for k, until in enumerate(second)]
    counts = [a if a > k else m for a, k, m in zip(apart, known, missed, strict=True)]
    again = _without(state, counts)
    if again is not None:
        return again
    may_be_one = _explains_only(state, second) or _changes_within(state, second)
    if state.jagged or (state.is_whole(state.current) and not may_be_one):
        return state
    again = _without(state, second)
    return again if again is not None and again.is_whole(again.current) else state


def _misses(state: State, record: int, until: int) -> bool:
    """Whether what the model leaves is far larger in the first ``until`` samples of a record than later."""
    number = state.problem.bins.number[record]
    first, later = (np.unique(part[part >= 0]) for part in (number[:until], number[until:]))
    if first.size < LIMITS.first_stroke_least or not later.size:
        return False
    left = state.current.residual
    return root_mean_square(left[first]) > LIMITS.first_stroke_missed * root_mean_square(left[later])


def _explains_only(state: State, second: Sequence[int]) -> bool:
    """Whether most of what the causes explain lies before the ``second`` stroke of each record."""
    gain = state.baseline.residual**2 - state.current.residual**2
    bins = zip(state.problem.bins.number, second, strict=True)
    first = np.unique(np.concatenate([number[:until] for number, until in bins]))
    return float(gain[first[first >= 0]].sum()) > LIMITS.first_stroke_share * max(float(gain.sum()), 0.0)


def _changes_within(state: State, second: Sequence[int]) -> bool:
    """Whether a sudden change was found before the ``second`` stroke of a record."""
    moments = [term.values[-1] for term in state.current.terms if term.cause.sudden]
    return any(
        frame.begin_s < moment < frame.begin_s + (until - 1) * frame.dt_s
        for moment in moments
        for frame, until in zip(state.problem.frames, second, strict=True)
        if until
    )


def _without(state: State, counts: Sequence[int]) -> State | None:
    """Search again without the first ``counts`` samples of the records; None if none can be left out."""
    records, notes = list(state.question.records), []
    for k, (count, even) in enumerate(zip(counts, state.problem.records, strict=True)):
        weight = records[k].sample_weight.copy()
        own = int(np.ceil(count / even.input.size * weight.size))
        step = weight.size / even.input.size  # less than that is only rounded otherwise
        if count > LIMITS.first_stroke_most * even.input.size or weight[:own].sum() <= max(step, 1.0):
            continue
        weight[:own] = 0.0
        records[k] = replace(records[k], sample_weight=weight)
        where = f"{_called(state, k)}: " if len(records) > 1 else ""
        notes.append(f"{where}less what was found, {left_out_words(own)}")
    if not notes:
        return None
    question = replace(state.question, records=records, notes=(*state.question.notes, *notes))
    return whole_search.stage(baseline.stage(raw_data.stage(question)))


def _called(state: State, k: int) -> str:
    """Return what a person calls a record, or its number."""
    names = state.question.given.names if state.question.given else ()
    return names[k] if names else f"record {k + 1}"
