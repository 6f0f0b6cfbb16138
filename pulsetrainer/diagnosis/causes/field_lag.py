"""what the hysteresis sees lags behind the input (in a coil, eddy currents): P[v], tau v' + v = u."""

from __future__ import annotations

from collections.abc import Sequence

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values, low_pass, sampled

_TRIED_S = (0.002, 0.01, 0.03)  # a sensor's, a coil's, a slow one's; no shorter than a time step


class FieldLag(Cause):
    """A first-order lag before the hysteresis."""

    id = "field-lag"
    title = "what the hysteresis sees lags behind the {input} (in a coil, eddy currents)"
    formula = "P[v], tau v' + v = u"
    signature = "the tips of minor loops shrink as the rate rises; an exponential tail after a stop"
    excitation = "reversals at three rates or more, spanning ten to one, with stops"
    source = "Bertotti, Hysteresis in Magnetism, 1998, chapter 12"
    stage = "input"
    order = 20
    family = "lag"
    widens = True
    common = True
    parameters = (Quantity("tau", "s", 0.0, 0.5, 0.0005, "time constant of the lag"),)

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """Return the parameters with the bounds that a record sets."""
        return sampled(self.parameters, frame)

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        return [[(one,)] for one in sorted({max(s, frames[0].dt_s) for s in _TRIED_S})]

    def on_input(self, u: FloatArray, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Input (n,) that the hysteresis sees."""
        return low_pass(u, values[0], frame.dt_s, frame.past, self.id)
