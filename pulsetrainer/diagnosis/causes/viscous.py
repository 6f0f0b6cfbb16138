"""the output has a part that follows the speed of the input: y + c LP(sgn(u') abs(u')^p; tau).

The part may be proportional to the speed, as in a fluid (p = 1), to its root, as excess losses are (1/2), or
to its square, as at an orifice (2). Each power is tried. Where the input has one speed all powers are alike,
and only the first is. A recorder, or a simulation, may take the speed after a sample, or around it: that is a
parameter of the finer formula (decision 148).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, OfKinds, Quantity, Values, sampled
from pulsetrainer.diagnosis.causes.frame import Frame, low_pass

_TRIED = 0.01  # of the span at the usual speed
_FILTERS = (0.25, 2.0)  # time steps: a force that follows the speed at once, and one that trails it
_NO_SPEED = 1e-12  # ranges a second: an input at rest
_PIECE = 0.05  # of the range: a way whose speed is one number
_FEW = 0.1  # of all such pieces: the quickest ...
_MOST = 0.9  # ... to the slowest that count ...
_ONE_SPEED = 1.5  # ... where the latter take less than so many times as long, there is one speed
_LINEAR = 1.0  # power of the speed ...
_ROOT = 0.5  # ... or this ...
_SQUARE = 2.0  # ... or this
_AROUND = 0.5  # the speed before a sample and that after it have as much each
_PLAIN = 2  # parameters of the formula that takes the speed before a sample


class Viscous(OfKinds):
    """A term that follows the rate of the input, or a power of it, and may trail it."""

    id = "viscous"
    title = "the {output} has a part that follows the speed of the {input}"
    formula = "y + c LP(sgn(u') abs(u')^p; tau), p = 1, 1/2 or 2"
    signature = "the output jumps when the rate changes at equal input, with no tail beyond its filter"
    excitation = "changes of rate at equal input"
    source = "Bouc, Acustica 24, 1971; Ikhouane and Rodellar, 2007"
    stage = "output"
    order = 90
    family = "viscous"
    widens = True
    imitates = True
    number = "exponent"
    meant = "power of the speed (1: in proportion to it)"
    tried = (_LINEAR, _ROOT, _SQUARE)
    common = True
    parameters = (
        Quantity(
            "coefficient", "{y} s/{u}", -1e6, 1e6, 1e-5, "{output} per speed of the {input}, to its power"
        ),
        Quantity("filter", "s", 0.0, 0.05, 1e-4, "time by which it trails the speed"),
        Quantity(
            "between",
            "1",
            0.0,
            1.0,
            0.02,
            "where it takes the speed: 0 before each sample, 1 after it, 0.5 around it",
            whole=True,
        ),
    )

    def __init__(self, kind: float | None = None, *, is_finer: bool = False) -> None:
        super().__init__(kind)
        self._is_finer = is_finer

    def constants(self) -> tuple[tuple[str, float, str], ...]:
        return ((self.number, self.kind, "1"),) if self._is_finer else super().constants()

    def coarser(self) -> Cause | None:
        return Viscous(self.kind) if self._is_finer else None

    def finer(self, frame: Frame, values: Values) -> list[tuple[Cause, float]]:
        if self._is_finer or not frame.shows_between(values[1]):
            return []
        return [(Viscous(self.kind, is_finer=True), _AROUND)]

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        coefficient, trailing, between = self.parameters
        unit = coefficient.unit if self.kind == _LINEAR else f"{{y}} (s/{{u}})^{self.kind:g}"
        return replace(coefficient, unit=unit), *sampled((trailing,), frame), *[between] * self._is_finer

    def kinds(self, frames: Sequence[Frame] = ()) -> tuple[Cause, ...]:
        return (self,) if frames and _have_one_speed(frames) else super().kinds()

    def restored(self, values: Values) -> tuple[Cause, Values]:
        """Return the cause and its parameters; models were once kept without the filter."""
        own = values if len(values) > 1 else (*values, 0.0)
        is_finer = len(own) > 1 + _PLAIN
        count = _PLAIN + is_finer
        return Viscous(*own[:-count], is_finer=is_finer), own[-count:]

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        speed = max(float(np.std(np.gradient(f.input, f.dt_s))) for f in frames)
        force = _TRIED * frames[0].span / max(speed, _NO_SPEED) ** self.kind
        return [[(force, steps * frames[0].dt_s)] for steps in _FILTERS]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        # the rate before the sample, not around it: at a turn the output jumps after the turn
        before = frame.remembered(self.id, frame.input[:1])
        frame.remember(self.id, frame.input[-1:])
        speed = np.diff(frame.input, prepend=before) / frame.dt_s
        for after in values[_PLAIN:]:
            speed = (1.0 - after) * speed + after * np.append(speed[1:], speed[-1:])
        return y + values[0] * frame.low_pass(self._power(speed), values[1], self.id)

    def variants(self, y: FloatArray, values: Values, frame: Frame) -> list[FloatArray]:
        around = np.gradient(frame.input, frame.dt_s)
        return [y + values[0] * low_pass(self._power(around), values[1], frame.dt_s)]

    def _power(self, speed: FloatArray) -> FloatArray:
        """Power of the speed (n,), of its sign."""
        return speed if self.kind == _LINEAR else np.sign(speed) * np.abs(speed) ** self.kind


def _have_one_speed(frames: Sequence[Frame]) -> bool:
    """Whether the input has one speed wherever it moves: then the powers differ at turns alone."""
    took = np.concatenate(
        [
            np.diff(np.interp(np.arange(0.0, one.path[-1], _PIECE * one.reach), one.path, one.time_s))
            for one in frames
        ]
    )
    if not took.size:
        return False
    fast, slow = np.quantile(took, [_FEW, _MOST])
    return bool(slow < _ONE_SPEED * fast)
