"""The baseline: a Prandtl-Ishlinskii model of 48 plays with non-negative weights.

    y = y0 + s sum_k w_k P_k(u),     w_k >= 0,     s = 1 or -1, whichever fits better

P_k is the play of half-width r_k = k range / 96, k = 0..47; w by scipy's nnls, y0 by centring (Krejci and
Kuhnen, IEE Proc. Control Theory Appl. 148, 2001, 185-192). It is what most people would try first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

FloatArray = NDArray[np.float64]
PLAYS = 48


def play(u: FloatArray, half_width: float, start: float) -> FloatArray:
    """Output (n,) of a play: dragged along when the input is more than ``half_width`` away."""
    at, path = start, []
    for value in u.tolist():
        at = min(max(at, value - half_width), value + half_width)
        path.append(at)
    return np.asarray(path)


@dataclass(frozen=True)
class PrandtlIshlinskii:
    """A fitted model."""

    half_widths: FloatArray
    weights: FloatArray
    offset: float
    sign: int
    start: float

    @classmethod
    def fit(cls, u: FloatArray, y: FloatArray, known: NDArray[np.bool_]) -> PrandtlIshlinskii:
        """Fit samples (n,) where ``known``; the others only move the plays."""
        half_widths = np.ptp(u) * np.arange(PLAYS) / (2 * PLAYS)
        start = 0.5 * float(u.min() + u.max())
        columns = np.stack([play(u, r, start) for r in half_widths], axis=1)[known]
        centred, middle = columns - columns.mean(axis=0), float(y[known].mean())
        fits = {sign: nnls(centred, sign * (y[known] - middle)) for sign in (1, -1)}
        sign = min(fits, key=lambda s: fits[s][1])
        weights = fits[sign][0]
        return cls(half_widths, weights, middle - sign * float(columns.mean(axis=0) @ weights), sign, start)

    def __call__(self, u: FloatArray) -> FloatArray:
        """Output (n,) for an input (n,)."""
        total = np.full(u.size, self.offset)
        for r, weight in zip(self.half_widths, self.weights, strict=True):
            if weight > 0:
                total += self.sign * weight * play(u, r, self.start)
        return total
