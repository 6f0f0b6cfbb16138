"""Gates on the raw data.

Before any model is fitted, each record is checked for faults that no model can repair, sample by sample as it
was measured. Such faults of the output are a cut at the end of its range, single wild samples, coarse steps,
and jumps. Those of the input are a recorder that clips it, a driver that does not follow its reference, and
values outside the range that was identified. Each check is a *gate*, and is in the file of its cause; some
gates also use the prediction of the model as given. A gate that fires makes a finding, and the samples that
it names are left out of everything that follows. Their places are filled in by interpolation: some causes are
filters, and wild samples must not reach these. Where the recorder clips the input, nothing follows but the
answer: what else such a record shows may come from that.

Only then is an input that was read in coarse steps interpolated between them. It is not if the output moves
with the steps, which shows that the device saw them. The records are brought to even time steps, and a sharp
turn of the input is moved to where the lines on both sides of it meet. Everything is then put into units of
the record itself: the range of the input, the span of the output, and a second that follows from how fast the
input moves. No decision from here on depends on seconds, amperes or newtons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.core.initial_state import reaches_an_end
from pulsetrainer.core.memory import State
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.core.turns import at_their_tips
from pulsetrainer.core.wild import repaired
from pulsetrainer.diagnosis.causes import fired_on
from pulsetrainer.diagnosis.coarse_input import as_it_moved
from pulsetrainer.diagnosis.prediction import predict
from pulsetrainer.diagnosis.raw import Firing, Raw, evenly
from pulsetrainer.diagnosis.scale import Scale, scale_of, second_of
from pulsetrainer.diagnosis.state import Question


@dataclass(frozen=True)
class Masked:
    """The records after the gates, in their own units, and which gates fired on which record."""

    question: Question
    records: tuple[Record, ...]
    firings: tuple[tuple[int, Firing], ...]
    scale: Scale


def stage(question: Question) -> Masked:
    """Return the records with bad samples masked, and the gates that fired.

    DataError where a record has more gaps than samples.
    """
    low, high = question.low, question.high
    stamps = question.stamps or [None] * len(question.records)
    second = second_of(question.records, stamps, low, high)
    polarity = 1 if question.given is None else question.given.model.polarity
    corrected = question.corrected or [()] * len(question.records)
    raws = [
        Raw(record, low, high, second, times, polarity=polarity, said=_said(question, record, times))
        for record, times in zip(question.records, stamps, strict=True)
    ]
    found = [fired_on(raw, known) for raw, known in zip(raws, corrected, strict=True)]
    masked = [masked_by(record, fired) for record, fired in zip(question.records, found, strict=True)]
    moved = map(as_it_moved, masked)
    even = [evenly(record, times) for record, times in zip(moved, stamps, strict=True)]
    times = [one.time_s if one.timed else None for one in even]
    inputs = at_their_tips([(one.input, one.output) for one in even], times, [one.counts for one in even])
    even = [replace(one, input=u) for one, u in zip(even, inputs, strict=True)]
    scale = scale_of(even, low, high, second)
    firings = tuple((k, one) for k, fired in enumerate(found) for one in fired)
    return Masked(question, tuple(scale.shrunk(record) for record in even), firings, scale)


def _said(question: Question, record: Record, stamps: FloatArray | None) -> FloatArray | None:
    """Return what the model as given predicts for a record (n,); None where its memory is not known."""
    if question.given is None or not reaches_an_end(record.input, question.low, question.high):
        return None
    return followed(question.given.model, record, stamps, None)


def followed(model: Model, record: Record, stamps: FloatArray | None, start: State | None) -> FloatArray:
    """Output (n,) that a model predicts for a record of polarity 1, at its own samples.

    ``stamps`` (n,) are their times, None: even ones; ``start`` is as for ``predict``.
    """
    even = evenly(record, stamps)
    said = predict(model, even.input, even.step, start) * model.polarity
    return said if stamps is None else np.interp(stamps, even.time_s, said)


def masked_by(record: Record, firings: Sequence[Firing]) -> Record:
    """Return a record in which samples that gates name have no weight, and are interpolated."""
    weight = record.sample_weight.copy()
    for firing in firings:
        if firing.mask is not None:
            weight[firing.mask] = 0.0
    bad = weight == 0
    output = record.output if bad.all() else repaired(record.output, bad)
    return replace(record, sample_weight=weight, output=output)
