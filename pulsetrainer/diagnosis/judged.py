"""What the model as given predicts for the records, before any weight is refitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from pulsetrainer.core import input_noise
from pulsetrainer.core.initial_state import estimated_start, reaches_an_end, start_of
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record, counted
from pulsetrainer.diagnosis import fitting, velocity
from pulsetrainer.diagnosis.causes import condition_change
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.prediction import operator_of, predict
from pulsetrainer.diagnosis.state import Given, State


@dataclass(frozen=True)
class Judged:
    """What the model as given says of the records, all of polarity 1."""

    records: list[Record]
    said: list[FloatArray]  # (n,) of each record
    speed: velocity.Comparison
    polarity: int
    noise: float  # rms of single samples, output unit: nobody's fault

    @cached_property
    def residuals(self) -> list[FloatArray]:
        """Measured less predicted output (n,) of each record."""
        return [one.output - p for one, p in zip(self.records, self.said, strict=True)]

    @cached_property
    def measured(self) -> FloatArray:
        """Outputs (n,) with weight, records one after another."""
        return self.kept([one.output for one in self.records])

    @cached_property
    def predicted(self) -> FloatArray:
        """What the model says of them (n,)."""
        return self.kept(self.said)

    def kept(self, signals: Sequence[FloatArray]) -> FloatArray:
        """Return the samples with weight of one signal per record, one after another (n,)."""
        return counted(self.records, signals)

    def left_by(self, said: FloatArray) -> float:
        """Rms error of a prediction (n,), less the noise, output unit."""
        return condition_change.left_by(self.measured, said, self.noise)

    def is_near(self, said: FloatArray) -> bool:
        """Whether a prediction (n,) leaves less than 1 % of the span, apart from the noise."""
        return condition_change.is_near(self.measured, said, self.noise)


def judge(state: State, given: Given) -> Judged:
    """Predict the records; noise in the input is no motion."""
    low, high, model = state.question.low, state.question.high, given.model
    core = [
        replace(r, input=input_noise.clean(r.input).input, start=start_of(r.input, low, high))
        for r in map(state.scale.restored, state.problem.records)
    ]
    if not any(reaches_an_end(one.input, low, high) for one in core):
        # a wrong guess of what came before would look like another zero
        turned = [replace(one, output=model.polarity * one.output) for one in core]
        before, _ = estimated_start(operator_of(model), turned)
        core = [replace(one, start=before) for one in core]
    said = [model.polarity * predict(model, one.input, one.dt_s, one.start) for one in core]
    return _judged(core, said, model.polarity, state.scale.span * state.floor_left.noise)


def _judged(records: list[Record], said: list[FloatArray], polarity: int, noise: float) -> Judged:
    """Compare with a function of the velocity as well."""
    left = [one.output - p for one, p in zip(records, said, strict=True)]
    return Judged(records, said, velocity.compare(records, [r.dt_s for r in records], left), polarity, noise)


def whole_and_each(judged: Judged) -> Iterator[tuple[int | None, Judged]]:
    """Yield all records, then each of several with its number: of two one may be turned over."""
    yield None, judged
    for k, (record, said) in enumerate(zip(judged.records, judged.said, strict=True)):
        if len(judged.records) > 1:
            yield k, _judged([record], [said], judged.polarity, judged.noise)


def added(state: State, terms: Sequence[Term]) -> list[FloatArray]:
    """Return what causes add to the output of each record (n,), output unit."""
    return [state.scale.span * one for one in fitting.added(state.current.simulator, terms)]
