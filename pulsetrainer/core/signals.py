"""Excitations: references that make an actuator show its hysteresis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pulsetrainer.core.memory import turning_points
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class Signal:
    """A reference to be played: even samples at ``rate_Hz``."""

    value: FloatArray  # (n,) input unit
    rate_Hz: float
    name: str

    @property
    def time_s(self) -> FloatArray:
        """Times of the samples (n,)."""
        return np.arange(self.value.size) / self.rate_Hz

    @property
    def duration_s(self) -> float:
        """Length of the signal."""
        return self.value.size / self.rate_Hz

    @property
    def reversals(self) -> int:
        """Number of times the signal turns."""
        return max(turning_points(self.value).size - 1, 0)


def through(points: FloatArray, speed: float, rate_Hz: float) -> FloatArray:
    """Samples of a path that visits ``points`` (k,) in turn at constant ``speed``, input units per second."""
    distance = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(points)))))
    count = int(np.ceil(distance[-1] / speed * rate_Hz)) + 1
    path = np.interp(np.arange(count) * (speed / rate_Hz), distance, points)
    # a turn between two samples would be cut short: put it on the nearest sample
    path[np.minimum(np.round(distance / speed * rate_Hz).astype(np.int64), count - 1)] = points
    return path


def identification(low: float, high: float, *, n_h: int, speed: float, rate_Hz: float) -> Signal:
    """First-order reversal curves from the top of the range to every level of an ``n_h``-level plane.

    low -> high -> L_n-1 -> high -> L_n-2 -> ... -> L_0: every relay of the plane is switched on and off,
    each by a curve of its own, which fixes the Everett function at every node (Mayergoyz 2003, section
    1.3). The signal has 2 n_h reversals and visits the finest loops first.

    Parameters
    ----------
    low, high
        Range of the input; the signal begins and ends at ``low``.
    n_h
        Number of levels.
    speed
        Input units per second: slow against the actuator's own dynamics.
    rate_Hz
        Sample rate of the reference.

    Raises
    ------
    ArgumentError
        An empty range, fewer than 2 levels, or a speed or rate that is not positive.
    """
    if not (speed > 0 and rate_Hz > 0):
        raise ArgumentError(
            f"speed and rate must be positive, got {speed:g} and {rate_Hz:g}", hint="0.75 A/s, 1000 Hz"
        )
    levels = Plane.uniform(low, high, n_h).levels
    bottoms = levels[-2::-1]
    turns = np.empty(2 * n_h + 1)
    turns[0], turns[1::2], turns[2::2] = low, high, bottoms
    return Signal(through(turns, speed, rate_Hz), rate_Hz, "identification")


def conditioning(low: float, high: float, *, speed: float, rate_Hz: float, rest_s: float) -> FloatArray:
    """Samples of one major loop low -> high -> low and a rest: it leaves a known memory behind."""
    loop = through(np.asarray([low, high, low]), speed, rate_Hz)
    return np.concatenate((loop, np.full(round(rest_s * rate_Hz), low)))
