"""the zero drifts slowly with time: y + b t, with a bend, which is stronger at one end if it relaxes.

Drifts slow down as a device warms up, or grow, and most of that happens near one end of the record. What the
bend adds is zero at both ends of a record (0 to T), so the rate is the mean rate from end to end. If the
drift falls by 1/e in the time 1/k, the bend is that of an exponential, with the same size in the middle. This
finer formula is used only where noise cannot make the difference (`stages.exchange`): a slowing that is not
there would move the zero. A drift that is over soon, the model as given tells (`given_drift`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Taken, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.thresholds import TINY

_TRIED = 0.01  # of the span over the record
_MIDDLE = 4.0  # the bend is largest in the middle: a quarter of c T^2
_PLAIN = 2  # parameters of a drift that does not relax ...
_RELAXING = 3  # ... and of one that does
_SLOWING = (-3.0, 3.0, 15.0)  # falls by 1/e in a record that are tried first; a negative one grows
_EARLY = (5.0, 15.0, 50.0)  # the same, where an early drift is searched for: a parabola finds the slower ones
_STRAIGHT = 1e-6  # falls by 1/e in a record: with fewer a double cannot tell it from a parabola


class OffsetDrift(Cause):
    """A zero that moves with time, faster or slower as time goes on."""

    id = "offset-drift"
    title = "the zero of the {output} drifts slowly with time"
    formula = "y + b t + c s(t), s = t (t - T), or -T^2/2 (1 - e^-kt - t/T (1 - e^-kT)) / (1 - e^-kT/2)^2"
    signature = "equal states give different outputs, and the difference grows with time"
    excitation = "the same loop at the beginning, in the middle and at the end"
    source = "Ljung, System Identification, 1999, section 14.1"
    stage = "output"
    order = 140
    family = "drift"
    drifts = True
    strengths = 2
    parameters = (
        Quantity(
            "rate", "{y}/s", -1e6, 1e6, 1e-5, "mean drift of the zero of the {output}, from start to end"
        ),
        Quantity("bend", "{y}/s^2", -1e6, 1e6, 1e-7, "half of what the rate changes by in a second"),
        Quantity(
            "slowing",
            "1/s",
            -1e6,
            1e6,
            1e-5,
            "1 over the time in which the drift falls to 37 %; below 0: grows",
        ),
    )
    lasting = False
    corrects = True
    texts = sentences("""
        against given: relative to the model as given, the zero of the {output} moves by {moved:+.2g}{in_y};
            apart from that, the model leaves {left:.2g}{in_y} (rms). Weights refitted to these recordings
            hide some of the drift
        against given, nothing left: relative to the model as given, the zero of the {output} moves by
            {moved:+.2g}{in_y}; apart from that, the model leaves no more than noise. Weights refitted to
            these recordings hide some of the drift
    """)

    def __init__(self, count: int = _PLAIN) -> None:
        self._count = count
        self.relaxing = OffsetDrift(_RELAXING) if count == _PLAIN else self

    def kinds(self, frames: Sequence[Frame] = ()) -> tuple[Cause, ...]:
        """A drift that relaxes early does not look like a parabola; other causes would be found instead."""
        return (self,) if self.relaxing is self else (self, self.relaxing)

    def coarser(self) -> Cause | None:
        """The same that is a parabola."""
        return OffsetDrift() if self.relaxing is self else None

    def finer(self, frame: Frame, values: Values) -> list[tuple[Cause, float]]:
        """The same that relaxes, or grows."""
        if self.relaxing is self:
            return []
        return [(self.relaxing, times / frame.length_s) for times in _SLOWING]

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        return self.parameters[: self._count]

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        length = frames[0].time_s[-1] + frames[0].dt_s
        size = _TRIED * frames[0].span
        both: list[Values] = [(size / length, 0.0), (0.0, _MIDDLE * size / length**2)]
        if self.relaxing is not self:
            return [both]
        return [[(*values, times / length) for values in both] for times in _EARLY]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        return y + _drift(values, frame.time_s)

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) without the drift since the first sample."""
        return y - _drift(values, taken.time_s)


def _drift(values: Values, time_s: FloatArray) -> FloatArray:
    rate, *more = values
    bend, slowing = (*more, 0.0, 0.0)[:2]  # a diagnosis was once kept without them
    return np.asarray(rate * time_s + bend * _bent(time_s, slowing))


def _bent(time_s: FloatArray, slowing: float) -> FloatArray:
    """Curve (n,) that is 0 at both ends and -T^2/4 in the middle, the parabola of a slowing of 0."""
    last = max(float(time_s[-1]), TINY)
    times, share = abs(slowing) * last, time_s / last
    if times < _STRAIGHT:
        return np.asarray(time_s * (time_s - last))
    gone = share if slowing > 0.0 else 1.0 - share  # one that grows is one that relaxes, run backwards
    below = gone * np.expm1(-times) - np.expm1(-times * gone)
    return np.asarray(-0.5 * last**2 * below / np.expm1(-0.5 * times) ** 2)
