"""the output feeds back into the input: P[u + k y].

The static weights are defined on the range of the input u, but u + k y has a wider range. The weights can
absorb any linear scale of their input, so u + k y is brought back to the range of u. With y- and y+ the
output at the ends of that range,

    v = low + (u - low + k (y - y-)) / (1 + k (y+ - y-) / (high - low)).
"""

from __future__ import annotations

from collections.abc import Sequence

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame

_TRIED = 0.01  # of the range over the span
_LEAST = 0.2  # of the range: a feedback that leaves less of it is not allowed


class LoadDependence(Cause):
    """The moving Preisach model."""

    id = "load-dependence"
    title = "the {output} feeds back into the {input}"
    formula = "P[u + k y]"
    signature = "equal minor loops at different bias are not congruent"
    excitation = "equal minor loops, entered from below and from above"
    source = "Della Torre, Magnetic Hysteresis, 1999, chapter 4: the moving model"
    stage = "input"
    order = 40
    family = "load"
    needs_time = False
    parameters = (Quantity("coefficient", "{u}/{y}", -0.9, 0.9, 2e-3, "added to the {input}, per {output}"),)
    feeds_back = True
    by_contrast = True

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        return [[(_TRIED * frames[0].reach / frames[0].span,)]]

    def on_input(self, u: FloatArray, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        k, (bottom, top) = values[0], frame.ends
        wider = max(1.0 + k * (top - bottom) / frame.reach, _LEAST)
        return frame.low + (u - frame.low + k * (y - bottom)) / wider
