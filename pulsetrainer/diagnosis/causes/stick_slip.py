"""the output sticks, then jumps: y held until |P[u] - y| > F, then a jump that leaves r F."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values


class StickSlip(Cause):
    """A stuck output that lets go at a threshold."""

    id = "stick-slip"
    title = "the output sticks, then jumps"
    formula = "y held until |P[u] - y| > F, then a jump that leaves r F"
    signature = "flat runs and then jumps of equal size on slow ramps"
    excitation = "slow ramps"
    source = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30, 1994"
    stage = "output"
    order = 65
    family = "stick-slip"
    strengths = 0
    parameters = (
        Quantity("force", "{y}", 0.0, 1e6, 0.01),
        Quantity("remainder", "1", 0.0, 0.95, 0.05),
    )

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        return [[(share * frames[0].span, 0.4)] for share in (0.005, 0.01, 0.02, 0.04)]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) after this cause."""
        force, kept = values[0], values[0] * values[1]
        stuck = float(y[0])
        path = []
        for wanted in y.tolist():
            if wanted - stuck > force:
                stuck = wanted - kept
            elif stuck - wanted > force:
                stuck = wanted + kept
            path.append(stuck)
        return np.asarray(path)
