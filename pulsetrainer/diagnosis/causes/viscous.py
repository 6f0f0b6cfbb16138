"""the output has a part proportional to the speed of the input: y + c LP(u'; tau)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import (
    Cause,
    Frame,
    Quantity,
    Values,
    low_pass,
    remember,
    remembered,
    sampled,
)

_TRIED = 0.01  # of the span at the usual speed
_FILTERS = (0.25, 2.0)  # time steps: a force that follows the speed at once, and one that trails it
_NO_SPEED = 1e-12  # ranges a second: an input at rest


class Viscous(Cause):
    """A term proportional to the rate of the input, which may trail it."""

    id = "viscous"
    title = "the {output} has a part proportional to the speed of the {input}"
    formula = "y + c LP(u'; tau)"
    signature = "the output jumps when the rate changes at equal input, with no tail beyond its filter"
    excitation = "changes of rate at equal input"
    source = "Bouc, Acustica 24, 1971; Ikhouane and Rodellar, 2007"
    stage = "output"
    order = 90
    family = "viscous"
    widens = True
    common = True
    parameters = (
        Quantity("coefficient", "{y} s/{u}", -1e6, 1e6, 1e-5, "{output} per speed of the {input}"),
        Quantity("filter", "s", 0.0, 0.05, 1e-4, "time by which it trails the speed"),
    )

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        coefficient, trailing = self.parameters
        return coefficient, *sampled((trailing,), frame)

    def restored(self, values: Values) -> tuple[Cause, Values]:
        """Return the cause and its parameters; models were once kept without the filter."""
        return self, (values[0], *(values[1:] or (0.0,)))

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        speed = max(float(np.std(np.gradient(f.input, f.dt_s))) for f in frames)
        force = _TRIED * frames[0].span / max(speed, _NO_SPEED)
        return [[(force, steps * frames[0].dt_s)] for steps in _FILTERS]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        # the rate before the sample, not around it: at a turn the output jumps after the turn
        before = remembered(frame.past, self.id, frame.input[:1])
        remember(frame.past, self.id, frame.input[-1:])
        speed = np.diff(frame.input, prepend=before) / frame.dt_s
        return y + values[0] * low_pass(speed, values[1], frame.dt_s, frame.past, self.id)

    def variants(self, y: FloatArray, values: Values, frame: Frame) -> list[FloatArray]:
        around = np.gradient(frame.input, frame.dt_s)
        return [y + values[0] * low_pass(around, values[1], frame.dt_s)]
