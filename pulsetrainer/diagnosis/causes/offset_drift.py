"""the zero drifts slowly with time: y + b t."""

from __future__ import annotations

from collections.abc import Sequence

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Taken, Values

_TRIED = 0.01  # of the span over the record


class OffsetDrift(Cause):
    """A zero that moves in proportion to time."""

    id = "offset-drift"
    title = "the zero of the {output} drifts slowly with time"
    formula = "y + b t"
    signature = "equal states give different outputs, and the difference grows with time"
    excitation = "the same loop at the beginning, in the middle and at the end"
    source = "Ljung, System Identification, 1999, section 14.1"
    stage = "output"
    order = 140
    family = "drift"
    drifts = True
    parameters = (Quantity("rate", "{y}/s", -1e6, 1e6, 1e-5, "drift of the zero of the {output}"),)
    lasting = False
    corrects = True

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        return [[(_TRIED * frames[0].span / (frames[0].time_s[-1] + frames[0].dt_s),)]]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) after this cause."""
        return y + values[0] * frame.time_s

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) without the drift since the first sample."""
        return y - values[0] * taken.time_s
