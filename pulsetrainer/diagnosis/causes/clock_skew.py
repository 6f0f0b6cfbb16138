"""the clocks of input and output run at different rates: y(t (1 + e))."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Taken, Values
from pulsetrainer.diagnosis.causes.frame import Frame

_TRIED = (1e-5, 1e-4)  # the errors of a good and of a bad crystal
_SLIP = 1.0  # time steps over the longest record: its mean, half a step, may be due to moments of sampling


class ClockSkew(Cause):
    """A relative error of the output's clock."""

    id = "clock-skew"
    title = "the clocks of {input} and {output} run at different rates"
    formula = "y(t (1 + e))"
    signature = "the output runs further and further ahead or behind as the record goes on"
    excitation = "fast reversals at the beginning and at the end"
    source = "Ljung, System Identification, 1999, section 14.1"
    stage = "output"
    order = 150
    family = "skew"
    parameters = (Quantity("skew", "1", -0.01, 0.01, 1e-6, "share by which the {output}'s clock is slow"),)
    lasting = False
    corrects = True

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        return [[(one,)] for one in _TRIED]

    def can_be_told(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether the clocks part by more than the moments of sampling do."""
        return any(abs(values[0]) * f.input.size >= _SLIP for f in frames)

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        t = frame.time_s
        return np.interp(t * (1.0 + values[0]), t, y)

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) on the clock of the input; what it did not reach is not known."""
        t = taken.time_s
        return np.interp(t / (1.0 + values[0]), t, y, right=np.nan)
