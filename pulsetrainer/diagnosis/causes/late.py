"""Causes by which the output is late, or the input was recorded late: one time constant or delay each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values, sampled
from pulsetrainer.diagnosis.causes.frame import Frame

_UNEVEN = 0.75  # of a time step: two columns may be read half a step apart, and an input be held besides
_BETWEEN = (0.7, -0.7)  # tried first: nearly the later sample, nearly the earlier one
BETWEEN = Quantity(
    "between",
    "1",
    -1.0,
    1.0,
    0.02,
    "what it sees between two samples: 0 a straight line, 1 the later sample, -1 the earlier one",
    whole=True,
)


class OneTime(Cause):
    """A cause with one time constant or delay, before or after the output."""

    family = "lag"
    _tried_s: ClassVar[tuple[float, ...]] = (0.002, 0.01, 0.03)  # a sensor's, a coil's, a slow one's

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        return sampled(self.parameters, frame)

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try, none shorter than a time step."""
        return [[(one,)] for one in sorted({max(s, frames[0].dt_s) for s in self._tried_s})]


class Late(OneTime):
    """A cause by which the output is late."""

    scales = True
    widens = True
    common = True


class FirstOrder(Late):
    """A first-order lag; what it sees between two samples is a parameter of the finer formula.

    A table does not say whether an amplifier held the input or ramped it. To a lag of few time steps that is
    half a step, which would be taken for another cause, such as a force by speed (decision 148).
    """

    def __init__(self, *, is_finer: bool = False) -> None:
        self._is_finer = is_finer

    def as_fine_as(self, other: FirstOrder) -> FirstOrder:
        """Return the same with as many parameters as another has."""
        return type(self)(is_finer=other._is_finer)

    def coarser(self) -> Cause | None:
        return type(self)() if self._is_finer else None

    def finer(self, frame: Frame, values: Values) -> list[tuple[Cause, float]]:
        tried = () if self._is_finer or not frame.shows_between(values[0]) else _BETWEEN
        return [(type(self)(is_finer=True), between) for between in tried]

    def restored(self, values: Values) -> tuple[Cause, Values]:
        return type(self)(is_finer=len(values) > 1), values

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        time, between = self.parameters
        return *sampled((time,), frame), *[between] * self._is_finer


class RecordedLate(OneTime):
    """A fault by which the input is recorded late: no device answers before it is asked."""

    lasting = False
    corrects = True
    comes_before = True
    excitation = "reversals at three rates or more, spanning ten to one, with stops"
    source = "Ljung, System Identification, 1999, section 14.1"

    def can_be_told(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether it is late by more than the moments of sampling may be."""
        return any(values[0] >= _UNEVEN * frame.dt_s / frame.averaged for frame in frames)
