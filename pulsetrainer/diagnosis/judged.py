"""What the model as given predicts for the records, before any weight is refitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.core import input_noise
from pulsetrainer.core.initial_state import estimated_start, reaches_an_end, start_of
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import velocity
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.prediction import operator_of, predict
from pulsetrainer.diagnosis.state import Given, State


@dataclass(frozen=True)
class Judged:
    """What the model as given says of the records."""

    records: list[Record]
    residuals: list[FloatArray]
    measured: FloatArray  # (n,) outputs with weight, records one after another
    predicted: FloatArray  # (n,)
    speed: velocity.Comparison
    polarity: int

    def kept(self, signals: Sequence[FloatArray]) -> FloatArray:
        """Return the samples with weight of one signal per record, one after another (n,)."""
        return np.concatenate([y[one.counts] for y, one in zip(signals, self.records, strict=True)])


def judge(state: State, given: Given) -> Judged:
    """Predict the records; noise in the input is no motion."""
    question, model = state.question, given.model
    records = [state.scale.restored(record) for record in state.problem.records]
    core = [
        Record(
            input_noise.clean(r.input).input,
            r.output,
            r.sample_weight,
            start_of(r.input, question.low, question.high),
        )
        for r in records
    ]
    if not any(reaches_an_end(one.input, question.low, question.high) for one in core):
        # a wrong guess of what came before would look like another zero
        turned = [replace(one, output=model.polarity * one.output) for one in core]
        before, _ = estimated_start(operator_of(model), turned)
        core = [replace(one, start=before) for one in core]
    steps = [r.dt_s for r in records]
    # records have polarity 1: what the model says is turned alike
    said = [
        model.polarity * predict(model, one.input, step, one.start)
        for one, step in zip(core, steps, strict=True)
    ]
    residuals = [one.output - p for one, p in zip(core, said, strict=True)]
    kept = [one.counts for one in core]
    return Judged(
        core,
        residuals,
        np.concatenate([one.output[k] for one, k in zip(core, kept, strict=True)]),
        np.concatenate([p[k] for p, k in zip(said, kept, strict=True)]),
        velocity.compare(core, steps, residuals),
        model.polarity,
    )


def whole_and_each(judged: Judged, state: State) -> Iterator[tuple[int | None, Judged]]:
    """Yield all records, then each of several with its number: of two one may be turned over."""
    yield None, judged
    if len(judged.records) == 1:
        return
    steps = [r.dt_s for r in (state.scale.restored(record) for record in state.problem.records)]
    for k, (record, left, step) in enumerate(zip(judged.records, judged.residuals, steps, strict=True)):
        kept = record.counts
        measured, speed = record.output[kept], velocity.compare([record], [step], [left])
        predicted = measured - left[kept]
        yield k, Judged([record], [left], measured, predicted, speed, judged.polarity)


def added(state: State, terms: Sequence[Term]) -> list[FloatArray]:
    """Return what causes add to the output of each record (n,), output unit."""
    simulator = state.current.simulator
    pairs = zip(simulator.full(terms), simulator.inner(()), strict=True)
    return [state.scale.span * (full - plain) for full, plain in pairs]
