"""the force falls as the coil heats: y (1 - k h), tau h' = u^2 - h."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values, low_pass

_TRIED = 0.01  # coefficient
_TRIED_S = (5.0, 15.0, 40.0)  # a wire's, a coil's, an iron core's
_NOT_COLD = 0.05  # of the heat that the largest input would lead to


class ThermalDrift(Cause):
    """A gain that falls with heat."""

    id = "thermal-drift"
    title = "the force falls as the coil heats"
    formula = "y (1 - k h), tau h' = u^2 - h"
    signature = (
        "the error is proportional to the output, follows the filtered square of the input "
        "and recovers on cooling"
    )
    excitation = "a long heating, a long rest, and the same loop before and after"
    source = "Incropera, Fundamentals of Heat and Mass Transfer, chapter 5: lumped capacitance"
    stage = "output"
    order = 50
    family = "slow gain"
    parameters = (
        Quantity("coefficient", "1/({u})^2", -0.5, 0.5, 0.001),
        Quantity("tau", "s", 1.0, 300.0, 0.5),
    )

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        return [[(_TRIED, tau)] for tau in _TRIED_S]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) after this cause."""
        return _weakened(y, values, frame, 0.0)

    def variants(self, y: FloatArray, values: Values, frame: Frame) -> list[FloatArray]:
        """A coil that was not quite cold: no record tells what was played before it."""
        return [_weakened(y, values, frame, _NOT_COLD * float(np.max(frame.input**2)))]


def _weakened(y: FloatArray, values: Values, frame: Frame, begin: float) -> FloatArray:
    """Output of a coil whose heat begins at ``begin``."""
    squared = frame.input**2
    if frame.past is None or not frame.past.before:  # the first sample already heats
        squared = np.append(begin, squared)
    heat = low_pass(squared, values[1], frame.dt_s, frame.past, "heat")[-y.size :]
    return np.asarray(y * (1.0 - values[0] * heat))
