"""the output falls with heat: y - k h (y - y0) + b h, tau h' = (u - u0)^2 - h.

Neither u0 nor y0 is the zero of the data, which may lie anywhere. Two kinds are tried. For a device that is
driven one way, u0 is the lower end of the input's range and y0 the output of empty memory. For one that is
driven both ways, u0 is the middle of the input's range and y0 the middle of the output's. Heat may also move
the zero (b), or act about another y0. That is put in only where noise cannot make the difference
(`stages.exchange`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, OfKinds, Quantity, Values, spread
from pulsetrainer.diagnosis.causes.frame import Frame

_TRIED = 0.02  # coefficient
_FASTEST_S = 5.0  # that of a wire: anything faster is creep
_SLOWEST = 0.43  # of the record: anything slower is drift
_RATIO = 3.0  # from one time constant to the next: those of a wire, a coil, an iron core
_BOUNDS = (0.01, 3.2)  # of the record: between these a refit moves the time constant
_NOT_COLD = 0.05  # of the heat that the largest input would lead to
_PLAIN = 2  # parameters, if the zero does not move
_BOTH_WAYS = 0.5  # of the range: the input at which a device that is driven both ways stays cold


class ThermalDrift(OfKinds):
    """A gain that falls with heat."""

    id = "thermal-drift"
    title = "the {output} falls with a slow average of the squared {input}, as with heat"
    formula = "y - k h (y - y0) + b h, tau h' = (u - u0)^2 - h"
    signature = (
        "the error is proportional to the output, follows a slow average of the squared input "
        "and recovers at rest"
    )
    excitation = "a long time at the top, a long rest, and the same loop before and after"
    source = "Incropera, Fundamentals of Heat and Mass Transfer, chapter 5: lumped capacitance"
    stage = "output"
    order = 50
    family = "slow gain"
    scales = True
    number = "cold"
    meant = "the {input} at which nothing heats, as a share of its range"
    tried = (0.0, _BOTH_WAYS)  # share of the input's range at which nothing heats
    drifts = True
    common = True
    parameters = (
        Quantity(
            "coefficient", "1/({u})^2", -1.1, 1.1, 0.002, "share of the {output} lost, per squared {input}"
        ),
        Quantity("tau", "s", 1.0, 300.0, 0.5, "time constant of the heat"),
        Quantity("shift", "{y}/({u})^2", -1.1, 1.1, 0.002, "change of its zero, per squared {input}"),
    )

    def __init__(self, kind: float | None = None, *, moves_zero: bool = False) -> None:
        super().__init__(kind)
        self.moves_zero = moves_zero

    def constants(self) -> tuple[tuple[str, float, str], ...]:
        """Return at which input it is cold, which only the plain formula of the first kind leaves open."""
        return ((self.number, self.kind, "1"),) if self.moves_zero else super().constants()

    def restored(self, values: Values) -> tuple[Cause, Values]:
        """Return the cause and its parameters: with the shift of a zero there are four values."""
        if len(values) <= _PLAIN + 1:
            kind, own = values[:-_PLAIN], values[-_PLAIN:]
            return ThermalDrift(*kind), own
        return ThermalDrift(values[0], moves_zero=True), values[1:]

    def finer(self, frame: Frame, values: Values) -> list[tuple[Cause, float]]:
        """The same that moves the zero."""
        return [] if self.moves_zero else [(ThermalDrift(self.kind, moves_zero=True), 0.0)]

    @property
    def wears_about(self) -> float:
        """In a short record a gain that wears off about the same zero looks like heat."""
        return self.kind

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        strength, tau, shift = self.parameters
        hottest = (1.0 - self.kind) ** 2  # heat of the largest input, squared ranges
        low, high = (share * frame.length_s for share in _BOUNDS)
        one, other = (replace(q, low=q.low / hottest, high=q.high / hottest) for q in (strength, shift))
        known = (one, replace(tau, low=min(tau.low, low), high=high), other)
        return known if self.moves_zero else known[:_PLAIN]

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        slowest = _SLOWEST * frames[0].length_s
        # heat of an input that uses all of its range is of the size of that range squared
        strength = _TRIED / frames[0].reach ** 2
        return [[(strength, tau)] for tau in spread(_FASTEST_S, slowest, _RATIO)]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        return self._weakened(y, values, frame, 0.0)

    def variants(self, y: FloatArray, values: Values, frame: Frame) -> list[FloatArray]:
        """A coil that was not quite cold: no record tells what was played before it."""
        return [self._weakened(y, values, frame, _NOT_COLD * float(np.max(self._power(frame))))]

    def _weakened(self, y: FloatArray, values: Values, frame: Frame, begin: float) -> FloatArray:
        """Output of a coil whose heat begins at ``begin``."""
        squared = self._power(frame)
        if frame.is_first:  # the first sample already heats
            squared = np.append(begin, squared)
        heat = frame.low_pass(squared, values[1], "heat")[-y.size :]
        about = frame.zero + self.kind * (frame.ends[1] - frame.ends[0])
        coefficient, _, *shift = values
        return np.asarray(y - heat * (coefficient * (y - about) - sum(shift)))

    def _power(self, frame: Frame) -> FloatArray:
        """What heats: (n,) squared input, from where it is cold, input unit squared."""
        return np.asarray((frame.input - frame.low - self.kind * frame.reach) ** 2)
