"""First stroke: asked about again, now that causes are known.

The first stroke of a device that was not cycled before is unlike all later ones, and is left out before
anything is fitted. Where the device creeps, rings or runs in, the later ones differ as well, and hide it.
So it is looked for once more in the output less what the causes add; where it stands apart there, it is left
out, and the search begins anew.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.core.initial_state import first_stroke_words, known_from
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.stages import baseline, elimination, exchange, raw_data, restart, search
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state of a search without first strokes that only the causes found let show."""
    simulator = state.current.simulator
    pairs = zip(simulator.full(state.current.terms), simulator.inner(()), strict=True)
    records, notes = list(state.question.records), []
    for k, (even, (full, plain)) in enumerate(zip(state.problem.records, pairs, strict=True)):
        static = even.output - (full - plain)
        until = known_from(even.input, 0.0, 1.0, static)
        if known_from(even.input, 0.0, 1.0) < until <= LIMITS.first_stroke_most * even.input.size:
            count = int(np.ceil(until / even.input.size * records[k].input.size))
            if records[k].sample_weight[:count].any():
                records[k] = _without(records[k], count)
                where = f"record {k + 1}: " if len(records) > 1 else ""
                words = first_stroke_words(even.input, static, 0.0, 1.0)
                notes.append(f"{where}less what was found, {words}")
    if not notes:
        return state
    question = replace(state.question, records=records, notes=(*state.question.notes, *notes))
    again = baseline.stage(raw_data.stage(question))
    for one in (search, restart, exchange, elimination):
        again = one.stage(again)
    return again


def _without(record: Record, count: int) -> Record:
    """Return the record without weight in its first samples."""
    weight = record.sample_weight.copy()
    weight[:count] = 0.0
    return replace(record, sample_weight=weight)
