"""the output is late by a fixed time: P[u(t - d)].

The operator does not know time, so P[u(t - d)] is its output shifted by d. Shifting the output is the better
of the two: an input interpolated between samples loses the tips of its loops, which the memory keeps long.
"""

from __future__ import annotations

import math

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Frame, Late, Quantity, Values, remember, remembered


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
        before = remembered(frame.past, self.id, y[:0])
        whole = np.concatenate((before, y))
        steps = values[0] / frame.dt_s
        remember(frame.past, self.id, whole[-math.ceil(steps) - 1 :])
        at = np.maximum(np.arange(len(before), len(whole)) - steps, 0.0)
        first = at.astype(np.int64)
        then = np.minimum(first + 1, len(whole) - 1)
        share = (at - first).reshape(-1, *[1] * (y.ndim - 1))
        return np.asarray((1.0 - share) * whole[first] + share * whole[then])
