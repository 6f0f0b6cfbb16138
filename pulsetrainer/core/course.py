"""A course: a signal played once or many times, in parts that a device can play in one go.

Between two parts the device is off. Zero current is the low end of the plane, so nothing of the past is left
in the actuator but its negative saturation, and that makes a part easy to continue: going through the
extremes that the memory held, in their order, brings the memory back (Mayergoyz 2003, section 1.2: the state
is the alternating sequence of remembered extremes and nothing else).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.core.excitations import Signal, check_size, through
from pulsetrainer.core.memory import State, negative_saturation, trace, turning_points
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.errors import ArgumentError

_LOW = 0.0  # where the input goes when the device is off
_LONGEST_LEAD_S = 60.0  # a memory of many extremes is gone through faster
MOST_RECORDED = 1_000_000_000  # of one recording: eleven days at 1 kHz, a file of 30 GB
_BLOCK = 1 << 18  # samples traced at a time


@dataclass(frozen=True, slots=True)
class Course:
    """A signal, ``repeats`` times without a pause."""

    signal: Signal
    repeats: int = 1

    def __post_init__(self) -> None:
        if self.repeats < 1:
            raise ArgumentError(f"repeats must be at least 1, got {self.repeats}", hint="give `repeats` 1")
        check_size(self.repeats, self.signal.value.size, MOST_RECORDED)

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.signal.value.size * self.repeats

    @property
    def reversals(self) -> int:
        """Number of times the input turns, where one repeat goes over into the next included."""
        one = self.signal.value
        turns = one[np.append(0, turning_points(one))]
        once, twice = (replace(self.signal, value=np.tile(turns, k)).reversals for k in (1, 2))
        return once + (twice - once) * (self.repeats - 1)

    def values(self, start: int, stop: int) -> FloatArray:
        """Samples ``start`` to ``stop``, (stop - start,)."""
        return self.signal.value.take(np.arange(start, stop), mode="wrap")

    def memory(self, count: int) -> State:
        """Return what the memory holds after ``count`` samples, when it began at the negative saturation.

        Whole repeats after the first change nothing: the input passes the same extremes again.
        """
        one = self.signal.value.size
        if count > one:
            count = one + count % one
        state, high = negative_saturation(_LOW), max(float(self.signal.value.max()), _LOW)
        for start in range(0, count, _BLOCK):
            state = trace(self.values(start, min(start + _BLOCK, count)), state, _LOW, high).final
        return state

    def lead_in(self, count: int, *, speed: float, rest_s: float) -> FloatArray:
        """Samples that bring the memory back as it was after ``count`` samples, from the negative saturation.

        The input moves at ``speed`` (input units a second) and then rests for ``rest_s`` where it was.
        Nothing at all is needed where that is the low end.
        """
        extremes = np.asarray(self.memory(count).extremes)
        if extremes.size == 1:
            return np.zeros(0)
        rate_Hz = self.signal.rate_Hz
        speed = max(speed, float(np.abs(np.diff(extremes)).sum()) / _LONGEST_LEAD_S)
        return np.concatenate(
            (through(extremes, speed, rate_Hz), np.full(round(rest_s * rate_Hz), extremes[-1]))
        )

    def part_end(self, start: int, longest: int) -> int:
        """Return where a part of at most ``longest`` samples ends that begins at ``start``.

        A part ends where the memory is empty, at the low end of the input, if that is in its second half: the
        next one then needs no lead-in.
        """
        if self.size - start <= longest:
            return self.size
        rests = np.flatnonzero(self.values(start, start + longest) <= _LOW)
        if rests.size and rests[-1] + 1 >= longest // 2:
            return start + int(rests[-1]) + 1
        return start + longest
