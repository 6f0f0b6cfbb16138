"""the output is smoothed (by a sensor, by its filter): tau y' + y = P[u]."""

from __future__ import annotations

from collections.abc import Sequence

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values, low_pass, sampled

_TRIED_S = (0.002, 0.01, 0.03)  # a sensor's, a coil's, a slow one's; no shorter than a time step


class OutputLag(Cause):
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
    family = "lag"
    widens = True
    common = True
    parameters = (Quantity("tau", "s", 0.0, 0.5, 0.0005, "time constant of the smoothing"),)

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """Return the parameters with the bounds that a record sets."""
        return sampled(self.parameters, frame)

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try."""
        return [[(one,)] for one in sorted({max(s, frames[0].dt_s) for s in _TRIED_S})]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) after this cause."""
        return low_pass(y, values[0], frame.dt_s, frame.past, self.id)
