"""the output has a part proportional to the speed of the input: y + c u'."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values, remember, remembered

_TRIED = 0.01  # of the span at the usual speed
_NO_SPEED = 1e-12  # ranges a second: an input at rest


class Viscous(Cause):
    """A term proportional to the rate of the input."""

    id = "viscous"
    title = "the {output} has a part proportional to the speed of the {input}"
    formula = "y + c u'"
    signature = "the output jumps at once when the rate changes at equal input, without a tail"
    excitation = "changes of rate at equal input"
    source = "Bouc, Acustica 24, 1971; Ikhouane and Rodellar, 2007"
    stage = "output"
    order = 90
    family = "viscous"
    widens = True
    common = True
    parameters = (Quantity("coefficient", "{y} s/{u}", -1e6, 1e6, 1e-5),)

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        speed = max(float(np.std(np.gradient(f.input, f.dt_s))) for f in frames)
        return [[(_TRIED * frames[0].span / max(speed, _NO_SPEED),)]]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) after this cause."""
        # the rate before the sample, not around it: at a turn the output jumps after the turn
        before = remembered(frame.past, self.id, frame.input[:1])
        remember(frame.past, self.id, frame.input[-1:])
        return y + values[0] * np.diff(frame.input, prepend=before) / frame.dt_s
