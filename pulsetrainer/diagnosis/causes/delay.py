"""the output is late by a fixed time: P[u(t - d)].

The operator does not know time, so P[u(t - d)] is its output shifted by d. To shift the output is better than
to shift the input: an input interpolated between samples loses the tips of its loops, and the memory keeps
that error for long.
"""

from __future__ import annotations

import math

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.late import Late


class Delay(Late):
    """A pure transport delay."""

    id = "delay"
    title = "the {output} is late by a fixed time"
    formula = "P[u(t - d)]"
    signature = (
        "dead time after every stop or jump, then an exact copy; the phase falls in proportion to frequency"
    )
    excitation = "fast reversals followed by holds"
    source = "Ljung, System Identification, 1999, section 4.2"
    stage = "output"
    order = 45
    in_rows = True
    parameters = (Quantity("delay", "s", 0.0, 0.2, 0.0005, "by which the {output} is late"),)

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        before = frame.remembered(self.id, y[:0])
        steps = values[0] / frame.dt_s
        late = math.ceil(steps)
        whole = np.concatenate((before, y)) if len(before) else y
        frame.remember(self.id, whole[-late - 1 :])
        if late == 0:
            return y
        still = min(max(late - len(before), 0), len(y))  # of these nothing has arrived but the first value
        count, first = len(y) - still, len(before) + still - late
        shown = np.empty(y.shape)
        shown[:still] = whole[0]
        arrived = shown[still:]
        np.multiply(whole[first : first + count], 1.0 - (late - steps), out=arrived)
        arrived += (late - steps) * whole[first + 1 : first + 1 + count]
        return shown
