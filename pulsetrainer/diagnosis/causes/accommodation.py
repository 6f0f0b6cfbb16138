"""the loops drift over repeated cycles: (y + a LP(y; path of u)) / (1 + a)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame

_TRIED = 0.05  # amplitude
_TRIED_PATHS = (7.0, 20.0, 60.0)  # ranges of the input: some loops, dozens, a whole record
_STRETCH = 200.0  # decay lengths in one sum: more would overflow exp


class Accommodation(Cause):
    """A low-pass of the output along the path of the input."""

    id = "accommodation"
    title = "the loops drift over repeated cycles"
    formula = "(y + a LP(y; path of u)) / (1 + a)"
    signature = "the loop moves with the number of cycles, not with time"
    excitation = "twenty equal cycles at two rates"
    source = "Della Torre, Magnetic Hysteresis, 1999, chapter 5: accommodation"
    stage = "output"
    order = 60
    family = "slow memory"
    scales = True
    needs_time = False
    parameters = (
        Quantity(
            "amplitude",
            "1",
            -0.5,
            1.0,
            0.002,
            "the part that follows over cycles, relative to the part at once",
        ),
        Quantity("path", "{u}", 2.0, 700.0, 0.3, "travel of the {input} in which 63 % of it follows"),
    )

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        return [[(_TRIED, path * frames[0].reach)] for path in _TRIED_PATHS]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        done = frame.path / values[1]
        share = np.diff(done, prepend=0.0)
        # LP(y) = exp(-s) (y0 + integral of y exp(s') ds'), with exp kept small by an origin per stretch
        slow = np.empty_like(y)
        last, begin = float(frame.remembered(self.id, y[:1])[0]), 0
        while begin < y.size:
            origin = done[begin - 1] if begin else 0.0
            end = max(int(np.searchsorted(done, origin + _STRETCH)), begin + 1)
            grown = np.exp(done[begin:end] - origin)
            slow[begin:end] = (last + np.cumsum(y[begin:end] * grown * -np.expm1(-share[begin:end]))) / grown
            last, begin = float(slow[end - 1]), end
        frame.remember(self.id, slow[-1:])
        return (y + values[0] * slow) / (1.0 + values[0])
