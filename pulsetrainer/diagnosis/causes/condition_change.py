"""gain or offset differs from record to record: y + b + g (y - y0), with b and g of each but the first.

y0 is the output of empty memory.

The records may also differ from the model as given. The search for causes refits the weights, so it finds
nothing wrong with a record that a Preisach model of its own describes well. If the model as given is far off
and the refitted one is not, that is the finding: load, configuration or zero have changed. The gain and the
offset that bring the given prediction to the record say how: y = (1 + g) M(u) + b.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.evidence import sentences

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.finding import Estimate

_TRIED = 0.003  # of the span, and of the gain
# Against the model as given
_FAR = 0.01  # of the output's span: a model nearer than this is not in question
_REFITTED = 0.2  # of what the given weights leave: refitted ones must leave less, on blocks left out too
_ALL_BUT = 0.001  # of the squared error: if a change leaves less, what it leaves does not count
_GAIN = 2.0 * _FAR  # a gain of this size, about the middle of the output, makes a model far off
_OF_SHIFT = 0.5  # of the shift: a shape that differs by more has changed as well
_BLOCKS = 10  # of the jackknife: neighbouring samples are not independent


class ConditionChange(Cause):
    """A gain and an offset of each later record."""

    id = "condition-change"
    title = "gain or offset of the later records differs from that of the first"
    formula = "y + b + g (y - y0), b and g of each record but the first"
    signature = "each record agrees with itself, but they differ from one another"
    excitation = "the same signal twice, in the two conditions"
    source = "Lei et al., Phil. Trans. R. Soc. A 378, 2020: one fit for each protocol"
    stage = "output"
    order = 110
    family = "condition"
    needs_time = False
    strengths = 2
    parameters = (
        Quantity("offset", "{y}", -1e6, 1e6, 1e-4, "added to the {output}, beside what the gain changes"),
        Quantity("gain", "1", -0.9, 0.9, 1e-4, "change of the gain, as a share of it"),
    )
    lasting = False
    texts = sentences("""
        shifted: a Preisach model fitted to these recordings describes them, but the given one does not: the
            device is in another condition (load, configuration, zero). Its output is shifted by
            {shift:.2g}{in_y} on average; gain and shape hardly differ ({gain:+.1f} %, {left:.2g}{in_y} rms).
            Reset the zero before each use, or identify it again
        changed: a Preisach model fitted to these recordings describes them, but the given one does not: the
            device is in another condition (load, configuration, zero). Its output is shifted by
            {shift:.2g}{in_y} on average, its gain differs by {gain:+.1f} %, and its shape by {left:.2g}{in_y}
            rms. Identify it again in this condition
        reversed: the {output} falls where the model rises: {times:.3f} times what the model says, and an
            offset, leave {left:.2g}{in_y} rms. The sensor or the coil is connected the wrong way round, or
            the model is of another device. Identify it again
        each: the model as given is off by {given:.2g} % of the span (rms); against it the {output} is shifted
            by {shift:+.2g}{in_y} on average and has {times:.3f} times the gain
    """)

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """Offset and gain of the second record, then those of each later one, by its number."""
        later = range(2, frame.records)
        more = [replace(q, name=f"{q.name} {k + 1}") for k in later for q in self.parameters]
        return (*self.parameters, *more)

    def strengths_of(self, parameters: Sequence[Estimate]) -> Sequence[Estimate]:
        return parameters

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        tried = np.diag(np.tile((_TRIED * frames[0].span, _TRIED), len(frames) - 1)).tolist()
        return [[tuple(one) for one in tried]] if tried else []

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        if frame.record == 0:
            return y
        offset, gain = values[2 * frame.record - 2 : 2 * frame.record]
        return y + offset + gain * (y - frame.zero)


@dataclass(frozen=True)
class Change:
    """Gain and offset of the records against the model, with their standard errors over blocks."""

    gain: float
    gain_error: float
    offset: float  # output unit
    offset_error: float
    explains: float  # share of the given model's squared error that refitted weights take away
    left: float  # rms of what gain and offset alone leave, output unit
    shift: float  # mean of measured less predicted, output unit; the offset is that where the model is 0
    span: float  # of the records, output unit

    @property
    def is_everything(self) -> bool:
        """Whether it leaves so little that nothing else can be named before the device is identified anew."""
        return self.explains > 1.0 - _ALL_BUT

    @property
    def kind(self) -> str:
        """Which text says it: gain and shape are unchanged within 1 % of the span, and half of the shift."""
        if self.gain < -1.0:
            return "reversed"
        least = min(_FAR * self.span, _OF_SHIFT * abs(self.shift))
        return "shifted" if abs(self.gain) <= _GAIN and self.left <= least else "changed"


def left_by(measured: FloatArray, predicted: FloatArray | float, noise_rms: float) -> float:
    """Rms error of a prediction (n,) or (), less the white noise of single samples, output unit."""
    return float(np.sqrt(max(float(np.mean((measured - predicted) ** 2)) - noise_rms**2, 0.0)))


def is_near(measured: FloatArray, predicted: FloatArray, noise_rms: float) -> bool:
    """Whether a prediction (n,) leaves less than 1 % of the span, apart from the white noise of samples."""
    return bool(left_by(measured, predicted, noise_rms) < _FAR * np.ptp(measured))


def follows(refitted_rms: float, given_rms: float) -> bool:
    """Whether refitted weights leave so much less than the given ones that the given ones are at fault."""
    return refitted_rms <= _REFITTED * given_rms


def against_model(
    measured: FloatArray, predicted: FloatArray, refitted_rms: float, noise_rms: float
) -> Change | None:
    """Return how the condition changed, or None where it did not.

    ``predicted`` (n,) is what the model as given says, ``refitted_rms`` what it leaves when its weights are
    fitted to these very records, and ``noise_rms`` the white noise of single samples, nobody's fault; both in
    the output unit.
    """
    given = left_by(measured, predicted, noise_rms)
    if is_near(measured, predicted, noise_rms) or not follows(refitted_rms, given):
        return None
    return _carried_over(measured, predicted, refitted_rms, given)


def turned_over(measured: FloatArray, predicted: FloatArray, noise_rms: float) -> Change | None:
    """Return the change of a device whose output (n,) falls where the model rises, or None if it does not.

    Weights are not negative, so refitted ones cannot describe it: a negative gain stands in their place.
    """
    gain, offset = carried(measured, predicted)
    left = left_by(measured, gain * predicted + offset, noise_rms)
    # of an output that is all noise nothing is left, and nothing can be told
    if gain >= 0.0 or left >= _REFITTED * left_by(measured, measured.mean(), noise_rms):
        return None
    return _carried_over(measured, predicted, left, left_by(measured, predicted, noise_rms))


def _carried_over(
    measured: FloatArray, predicted: FloatArray, refitted_rms: float, given_rms: float
) -> Change:
    gain, offset = carried(measured, predicted)
    parts = np.array_split(np.arange(measured.size), _BLOCKS)
    without = np.stack([carried(np.delete(measured, p), np.delete(predicted, p)) for p in parts])
    spread = np.sqrt(_BLOCKS - 1) * without.std(axis=0)
    return Change(
        float(gain - 1.0),
        float(spread[0]),
        float(offset),
        float(spread[1]),
        1.0 - (refitted_rms / given_rms) ** 2,
        root_mean_square(measured - gain * predicted - offset),
        float(np.mean(measured - predicted)),
        float(np.ptp(measured)),
    )


def carried(measured: FloatArray, predicted: FloatArray) -> FloatArray:
    """Gain and offset (2,) that bring the prediction to the measurement."""
    middle = float(predicted.mean())
    about = predicted - middle
    squares = float(about @ about)
    gain = float(about @ measured) / squares if squares > 0.0 else 0.0
    return np.asarray((gain, float(measured.mean()) - gain * middle))
