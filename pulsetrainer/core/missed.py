"""What a model misses along the path of one input, and what that says of another input: for ``transfer``.

    missed(t) = c + tau dz/dt(t) + sum_k d_k sqrt(A_k / A) s_k(t) + noise

z is the output over its span, s_k in [-1, 1] the state of cell k of a coarse Preisach plane. A zero (c), a
lag (tau) and a density (d) are normal variables of known deviation, so what is missed is one as well, and
certain only where the first input went: Gaussian regression (Rasmussen, Williams 2006, chapter 2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pulsetrainer.core.memory import negative_saturation, trace
from pulsetrainer.core.operator import rows
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, Plane

# Standard deviations before anything is known, of the output's span: zero, lag (s), density, and noise.
# The density is held so stiff that one path cannot explain by it what is not of the plane.
_ZERO, _LAG_S, _DENSITY, _NOISE = 0.01, 0.005, 0.01, 0.003
_LEVELS = 24
_CHUNK = 256  # samples whose relays are spread over the plane at one time


@dataclass(frozen=True, slots=True)
class Path:
    """Where an input led: for each of m samples how fast the output goes, and the relays."""

    rate: FloatArray  # (m,) of the output over its span, 1/s
    relays: FloatArray  # (m, n_q) s_k sqrt(A_k / A)

    @classmethod
    def of(cls, ends: tuple[float, float], values: FloatArray, rate: FloatArray, at: IntArray) -> Path:
        """Path of an input (n,) over a range, at some of its samples (m,); ``rate`` (n,) as the field."""
        plane = Plane.uniform(*ends, _LEVELS)
        way = trace(values, negative_saturation(plane.low), plane.low, plane.high)
        chosen = rows(plane, way, at)
        risen = [
            plane.adjoint(chosen[begin : begin + _CHUNK].toarray()) for begin in range(0, at.size, _CHUNK)
        ]
        share = np.sqrt(plane.areas / plane.areas.sum())
        return cls(rate[at], (np.concatenate(risen) - 1.0) * share)

    def __getitem__(self, some: BoolArray) -> Path:
        """Return the path at some of its samples only."""
        return Path(self.rate[some], self.relays[some])

    def covariance_with(self, other: Path) -> FloatArray:
        """Covariance (m, k) of what is missed here and there, span squared."""
        lag = np.outer(self.rate, _LAG_S**2 * other.rate)
        return _ZERO**2 + lag + _DENSITY**2 * (self.relays @ other.relays.T)

    @property
    def variance(self) -> FloatArray:
        """Variance (m,) of what is missed before anything is known, span squared."""
        return _ZERO**2 + (_LAG_S * self.rate) ** 2 + _DENSITY**2 * np.sum(self.relays**2, axis=1)


def elsewhere(known: Path, missed: FloatArray, new: Path) -> tuple[FloatArray, FloatArray]:
    """Expected miss (k,) on a new path, given the miss (m,) on a known one, and its variance (k,)."""
    between = new.covariance_with(known)
    noisy = known.covariance_with(known) + _NOISE**2 * np.eye(known.rate.size)
    solved = np.linalg.solve(noisy, np.column_stack((missed, between.T)))
    return between @ solved[:, 0], new.variance - np.sum(between * solved[:, 1:].T, axis=1)


def told_by_the_rest(known: Path, missed: FloatArray, part: IntArray) -> float:
    """Share of what is missed (m,), in squares, that each part (m,) of a path is told by the other parts.

    Where nothing is missed all of it is told.
    """
    expected = np.empty_like(missed)
    for number in np.unique(part):
        held = part == number
        expected[held], _ = elsewhere(known[~held], missed[~held], known[held])
    left, all_of_it = float(np.sum((missed - expected) ** 2)), float(np.sum(missed**2))
    return 1.0 - left / all_of_it if all_of_it > 0 else 1.0
