"""the loop widens with the root of the rate (excess loss): P[v], u - v = k sgn(v') sqrt(abs v')."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values, remember, remembered

_TRIED = (0.005, 0.015)  # of the root of the range
_NONE = 3e-8  # of the root of range and time step: a smaller coefficient widens nothing
_PARTS = 4  # of a sample: after a turn the excess moves fast


class RateWidening(Cause):
    """Excess loss: the field trails by the root of its rate."""

    id = "rate-widening"
    title = "the loop widens with the root of the rate (excess loss)"
    formula = "P[v], u - v = k sgn(v') sqrt(abs v')"
    signature = "the loop widens with the root of the rate, not in proportion to it"
    excitation = "reversals at four rates or more"
    source = "Bertotti, Hysteresis in Magnetism, 1998, chapter 12: excess loss"
    stage = "input"
    order = 30
    family = "lag"
    widens = True
    parameters = (Quantity("coefficient", "({u} s)^0.5", 0.0, 0.16, 4e-4),)

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        return [[(one * frames[0].reach ** 0.5,)] for one in _TRIED]

    def on_input(self, u: FloatArray, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Input (n,) that the hysteresis sees."""
        k = values[0]
        if k <= _NONE * (frame.reach * frame.dt_s) ** 0.5:
            return u
        # v' = sgn(e) (e/k)^2 with e = u - v: exact over a part of a sample with u held at its middle value
        per_step = frame.dt_s / _PARTS / k**2
        parts = (np.arange(_PARTS) + 0.5) / _PARTS
        begun, inner = remembered(frame.past, self.id, np.repeat(u[:1], 2)).tolist()
        path = [inner]
        if frame.past is not None and frame.past.before:
            u = np.append(begun, u)
        middles = (u[:-1, None] + np.diff(u)[:, None] * parts).ravel().tolist()
        for middle in middles:
            excess = middle - inner
            inner = middle - excess / (1.0 + abs(excess) * per_step)
            path.append(inner)
        remember(frame.past, self.id, np.asarray([u[-1], inner]))
        return np.asarray(path[::_PARTS])[-frame.input.size :]
