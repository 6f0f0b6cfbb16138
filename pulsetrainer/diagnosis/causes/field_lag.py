"""what the hysteresis sees lags behind the input (eddy currents, filling, heat): P[v], tau v' + v = u."""

from __future__ import annotations

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.late import BETWEEN, FirstOrder


class FieldLag(FirstOrder):
    """A first-order lag before the hysteresis."""

    id = "field-lag"
    title = "what the hysteresis sees lags behind the {input} (eddy currents, filling, heat)"
    formula = "P[v], tau v' + v = u"
    signature = "the tips of minor loops shrink as the rate rises; an exponential tail after a stop"
    excitation = "reversals at three rates or more, spanning ten to one, with stops"
    source = "Bertotti, Hysteresis in Magnetism, 1998, chapter 12"
    stage = "input"
    order = 20
    parameters = (
        Quantity("tau", "s", 0.0, 0.5, 0.0005, "time constant of the lag"),
        BETWEEN,
    )

    def on_input(self, u: FloatArray, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        return frame.low_pass(u, values[0], self.id, *values[1:])
