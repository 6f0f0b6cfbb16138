"""The record's own units: no decision depends on seconds, amperes or newtons.

Causes are sought in the following units, and reported in those of the record:

    (u - low) / (high - low),    (y - mean of y) / span of y,    t / second,

so that a record whose time, input or output is multiplied by a number, or shifted, gives the same answer.
The second of a record follows from how fast its input moves: it is 4.3 crossings of its range at the typical
rate, which is the geometric mean over equal pieces of the input's path. Holds have no path, so they do not
count; noise is taken off the input before. A record in which the input hardly moves, such as a step and a
long hold, has no such rate: its second is a share of its length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.core import input_noise
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record, counted_output
from pulsetrainer.diagnosis.finding import Estimate
from pulsetrainer.diagnosis.raw import as_fast_as_its_hum
from pulsetrainer.diagnosis.thresholds import LIMITS

# Powers of input, output and time in every unit that a cause speaks of
_POWERS: Mapping[str, tuple[float, float, float]] = {
    "1": (0, 0, 0),
    "{u}": (1, 0, 0),
    "{y}": (0, 1, 0),
    "s": (0, 0, 1),
    "Hz": (0, 0, -1),
    "1/s": (0, 0, -1),
    "{y}/s": (0, 1, -1),
    "{y}/s^2": (0, 1, -2),
    "{u}/{y}": (1, -1, 0),
    "{y} s/{u}": (-1, 1, 1),
    "{y} (s/{u})^0.5": (-0.5, 1, 0.5),
    "{y} (s/{u})^2": (-2, 1, 2),
    "1/({u})^2": (-2, 0, 0),
    "{y}/({u})^2": (-2, 1, 0),
    "({u})^2": (2, 0, 0),
    "({y})^2": (0, 2, 0),
    "{u}/s": (1, 0, -1),
    "({u} s)^0.5": (0.5, 0, 0.5),
}


@dataclass(frozen=True)
class Scale:
    """What one is in the units of a record."""

    low: float = 0.0  # input unit: the lower end of the range that was identified
    reach: float = 1.0  # input unit: that range
    zero: float = 0.0  # output unit
    span: float = 1.0  # output unit
    second: float = 1.0  # s

    def of_unit(self, unit: str) -> float:
        """Return what one of ``unit`` is in the unit of the record."""
        by_input, by_output, by_time = _POWERS[unit]
        return float(self.reach**by_input * self.span**by_output * self.second**by_time)

    def shrunk(self, record: Record) -> Record:
        """Return a record in its own units, in no more steps than causes need."""
        step = None if record.dt_s is None else record.dt_s / self.second
        reference = None if record.reference is None else (record.reference - self.low) / self.reach
        one = replace(
            record,
            input=(record.input - self.low) / self.reach,
            output=(record.output - self.zero) / self.span,
            dt_s=step,
            reference=reference,
        )
        return one if step is None else _slower(one, step)

    def restored(self, record: Record) -> Record:
        """Return a record in the units that it was measured in."""
        return replace(
            record,
            input=self.inputs(record.input),
            output=self.outputs(record.output),
            dt_s=None if record.dt_s is None else record.dt_s * self.second,
            reference=None if record.reference is None else self.inputs(record.reference),
        )

    def inputs(self, values: FloatArray) -> FloatArray:
        """Return inputs (n,) in their unit."""
        return self.low + self.reach * values

    def outputs(self, values: FloatArray) -> FloatArray:
        """Return outputs (n,), of polarity 1, in their unit."""
        return self.zero + self.span * values

    def estimate(self, one: Estimate) -> Estimate:
        """Return a parameter in its unit."""
        factor = self.of_unit(one.unit)
        return replace(one, value=factor * one.value, lower=factor * one.lower, upper=factor * one.upper)

    def places(self, values: FloatArray, unit: str) -> FloatArray:
        """Return places (n,) on an axis in its unit: an input is told from its own zero."""
        return self.inputs(values) if unit == "{u}" else values * self.of_unit(unit)


def scale_of(records: Sequence[Record], low: float, high: float, second: float) -> Scale:
    """Return the scale of some records: gates have looked at them, and what they masked has no weight."""
    y = counted_output(records)
    bottom, top = np.quantile(y, LIMITS.span_quantiles) if y.size else (0.0, 0.0)
    span = float(top - bottom) or (float(np.ptp(y)) if y.size else 0.0) or 1.0
    return Scale(low, high - low, float(np.mean(y)) if y.size else 0.0, span, second)


def second_of(
    records: Sequence[Record], stamps: Sequence[FloatArray | None], low: float, high: float
) -> float:
    """Return what a second is for the search of causes, s; 1 where the records have no time."""
    if not all(record.timed for record in records):
        return 1.0
    times = [record.time_s if known is None else known for record, known in zip(records, stamps, strict=True)]
    length = sum(float(one[-1]) for one in times)
    pieces = np.concatenate(
        [_pieces(record.input, one, high - low) for record, one in zip(records, times, strict=True)]
    )
    typical = _geometric_mean(pieces) / LIMITS.path_piece if pieces.size else length
    return max(LIMITS.crossings * typical, length / LIMITS.most_seconds)


def _geometric_mean(values: FloatArray) -> float:
    """Geometric mean of values (k,); times a power of two it is exactly as many times larger."""
    middle = float(np.median(values))
    return middle * float(np.exp(np.mean(np.log(values / middle))))


def _pieces(values: FloatArray, time_s: FloatArray, reach: float) -> FloatArray:
    """Times (k,) that equal pieces of the input's path took, s."""
    u = input_noise.clean(values).input
    path = np.append(0.0, np.cumsum(np.abs(np.diff(u)))) / reach
    # half a piece short of the end, where rounding cannot decide how many there are
    marks = np.arange(0.0, path[-1] - 0.5 * LIMITS.path_piece, LIMITS.path_piece)
    took = np.diff(np.interp(marks, path, time_s))
    return np.asarray(took[took > 0])


def _slower(record: Record, step: float) -> Record:
    """Return a record that is no faster than causes need, averaged down."""
    wanted = min(1.0 / LIMITS.fastest_Hz, record.input.size * step / LIMITS.most_samples)
    per = max(1, round(wanted / step))
    if per > 1:
        per = as_fast_as_its_hum(record, per, LIMITS.relevant_noise / np.sqrt(per))
    if per == 1:
        return record
    cut = record.input.size // per * per

    def averaged(x: FloatArray) -> FloatArray:
        return np.asarray(x[:cut].reshape(-1, per).mean(axis=1))

    return Record(
        averaged(record.input),
        averaged(record.output),
        np.where(averaged(record.sample_weight) < 1.0, 0.0, 1.0),
        dt_s=step * per,
        reference=None if record.reference is None else averaged(record.reference),
        averaged=per,
    )
