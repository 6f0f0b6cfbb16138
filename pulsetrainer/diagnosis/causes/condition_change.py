"""gain or offset differs from record to record: y (1 + g) + b in all records but the first."""

from __future__ import annotations

from collections.abc import Sequence

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values


class ConditionChange(Cause):
    """One gain and offset for the later records."""

    id = "condition-change"
    title = "gain or offset differs from record to record"
    formula = "y (1 + g) + b in all records but the first"
    signature = "records agree within themselves and differ between one another"
    excitation = "the same signal twice, in the two conditions"
    source = "Lei et al., Phil. Trans. R. Soc. A 378, 2020: one fit for each protocol"
    stage = "output"
    order = 110
    family = "condition"
    strengths = 2
    parameters = (
        Quantity("offset", "{y}", -1e6, 1e6, 1e-3),
        Quantity("gain", "1", -0.9, 0.9, 1e-4),
    )
    lasting = False

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        return [[(0.003 * frames[0].span, 0.0), (0.0, 0.003)]] if len(frames) > 1 else []

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) after this cause."""
        return y if frame.record == 0 else y * (1.0 + values[1]) + values[0]
