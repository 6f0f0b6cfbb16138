"""the zero drifts slowly with time: y + b t, with a bend and a twist.

Drifts slow down as a device warms up, or grow, and most of that happens near one end. What bend and twist add
is zero at both ends of a record (0 to T), so that the rate is that from end to end. A twist is put in only
where noise cannot make the difference (`stages.exchange`): one that is not there would move the zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Taken, Values
from pulsetrainer.diagnosis.thresholds import TINY

_TRIED = 0.01  # of the span over the record
_MIDDLE = 4.0  # the bend is largest in the middle: a quarter of c T^2
_PLAIN = 2  # parameters, without a twist ...
_TWISTED = 3  # ... and with it


class OffsetDrift(Cause):
    """A zero that moves with time, faster or slower as time goes on."""

    id = "offset-drift"
    title = "the zero of the {output} drifts slowly with time"
    formula = "y + b t + (c + d (t/T - 1/2)) t (t - T)"
    signature = "equal states give different outputs, and the difference grows with time"
    excitation = "the same loop at the beginning, in the middle and at the end"
    source = "Ljung, System Identification, 1999, section 14.1"
    stage = "output"
    order = 140
    family = "drift"
    drifts = True
    strengths = 3
    parameters = (
        Quantity("rate", "{y}/s", -1e6, 1e6, 1e-5, "drift of the zero of the {output}, from end to end"),
        Quantity("bend", "{y}/s^2", -1e6, 1e6, 1e-7, "half of the change of that rate, a second"),
        Quantity("twist", "{y}/s^2", -1e6, 1e6, 1e-7, "change of the bend, from end to end"),
    )
    lasting = False
    corrects = True

    def __init__(self, count: int = _PLAIN) -> None:
        self._count = count

    @cached_property
    def finer(self) -> Cause | None:
        """The same with a twist."""
        return OffsetDrift(_TWISTED) if self._count == _PLAIN else None

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        return self.parameters[: self._count]

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        length = frames[0].time_s[-1] + frames[0].dt_s
        size = _TRIED * frames[0].span
        return [[(size / length, 0.0), (0.0, _MIDDLE * size / length**2)]]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        return y + _drift(values, frame.time_s)

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) without the drift since the first sample."""
        return y - _drift(values, taken.time_s)


def _drift(values: Values, time_s: FloatArray) -> FloatArray:
    rate, *more = values
    bend, twist = (*more, 0.0, 0.0)[:2]  # a diagnosis was once kept without them
    last = max(float(time_s[-1]), TINY)
    return np.asarray(time_s * (rate + (bend + twist * (time_s / last - 0.5)) * (time_s - last)))
