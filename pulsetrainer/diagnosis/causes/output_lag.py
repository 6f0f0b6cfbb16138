"""the output is smoothed (by a sensor, by its filter): tau y' + y = P[u]."""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.late import BETWEEN, FirstOrder


class OutputLag(FirstOrder):
    """A first-order lag after the hysteresis."""

    id = "output-lag"
    title = "the {output} is smoothed (by a sensor, by its filter)"
    formula = "tau y' + y = P[u]"
    signature = (
        "the loop widens in proportion to rate; an exponential tail after a stop, of the output itself"
    )
    excitation = "reversals at three rates or more, spanning ten to one, with stops"
    source = "Ljung, System Identification, 1999, section 4.2"
    stage = "output"
    order = 100
    in_rows = True
    parameters = (
        Quantity("tau", "s", 0.0, 0.5, 0.0005, "time constant of the smoothing"),
        BETWEEN,
    )

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        return np.apply_along_axis(frame.low_pass, 0, y, values[0], self.id, *values[1:])
