"""the input is recorded late by a fixed time: P[u(t + d)].

The recorder of the input trails that of the output: it reads its channels one after another, or adds a time
stamp later. The operator does not know time, so P[u(t + d)] is its output, moved ahead by d.
"""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Quantity, Taken, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.late import RecordedLate


class LateInput(RecordedLate):
    """An input that is recorded later than the output."""

    id = "late-input"
    title = "the {input} is recorded late by a fixed time: the {output} seems to answer before it"
    formula = "P[u(t + d)]"
    signature = "the output answers before the input moves, by the same time at every rate"
    stage = "output"
    order = 145
    in_rows = True
    parameters = (Quantity("delay", "s", 0.0, 0.2, 0.0005, "by which the {input} is recorded late"),)

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        steps = min(values[0] / frame.dt_s, len(y) - 1.0)
        whole = int(steps)
        last = np.repeat(y[-1:], whole + 1, axis=0)
        ahead = np.concatenate((y[whole:], last))
        return (1.0 - (steps - whole)) * ahead[: len(y)] + (steps - whole) * ahead[1 : len(y) + 1]

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) as late as the input; before it began it is not known."""
        return np.interp(taken.time_s - values[0], taken.time_s, y, left=np.nan)
