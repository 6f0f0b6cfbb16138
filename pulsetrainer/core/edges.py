"""Where the edges of a plane should lie: evenly, or crowded where the output changes.

An even plane of n_h levels knows nothing finer than range / n_h. A steep loop, such as that of electrical
steel, changes by half of its span within an eighth of the range: its edges are placed at even steps of

    C(u) = (F(u) + (u - low) / (high - low)) / 2

where F is the share of the output's variation that lies below u, over all branches: half of the edges
follow the input, half the output.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from pulsetrainer.core.input_noise import real_turns
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.record import Record

# Where half of the output's variation happens within less than this share of the range, edges crowd.
STEEP = 0.15
_BINS = 192  # of the histogram of the output's variation
_COARSE = 48  # bins on which the steepness is judged
_SWING = 0.02  # of the range: turns below it end no branch


def variation(records: Sequence[Record], low: float, high: float, bins: int) -> FloatArray:
    """Variation of the output (bins,) in even bins of the input, over all branches of all records.

    A branch is read along its input, sorted, at the ends of the bins: noise of the output within a bin
    does not count.
    """
    ends = np.linspace(low, high, bins + 1)
    total = np.zeros(bins)
    for record in records:
        kept = record.counts
        u, y = record.input[kept], record.output[kept]
        if u.size < 2:
            continue
        turns = real_turns(u, _SWING * (high - low))
        for a, b in pairwise(np.unique(np.concatenate(([0], turns, [u.size - 1]))).tolist()):
            order = np.argsort(u[a : b + 1], kind="stable")
            total += np.abs(np.diff(np.interp(ends, u[a : b + 1][order], y[a : b + 1][order])))
    return total


def steepness(records: Sequence[Record], low: float, high: float) -> float:
    """Smallest share of the input's range in which half of the output's variation happens, 0..0.5."""
    sizes = np.sort(variation(records, low, high, _COARSE))[::-1]
    whole = float(sizes.sum())
    if whole <= 0:
        return 0.5
    share = np.concatenate(([0.0], np.cumsum(sizes) / whole))
    return float(np.interp(0.5, share, np.arange(_COARSE + 1) / _COARSE))


def plane_for(records: Sequence[Record], low: float, high: float, n_h: int) -> Plane:
    """Return a plane of ``n_h`` levels over [low, high]: its edges even, or crowded where the loop is steep.

    ArgumentError for fewer than 2 levels, or a range that is zero or not finite.
    """
    even = Plane.uniform(low, high, n_h)
    if steepness(records, low, high) >= STEEP:
        return even
    sizes = variation(records, low, high, _BINS)
    along = np.concatenate(([0.0], np.cumsum(sizes) / sizes.sum()))
    mixed = 0.5 * (along + np.linspace(0.0, 1.0, _BINS + 1))
    edges = np.interp(np.linspace(0.0, 1.0, n_h + 1), mixed, np.linspace(low, high, _BINS + 1))
    edges[-1] = high  # the sum may be off by its rounding
    return Plane(edges)


def thinned(plane: Plane, n_h: int) -> Plane:
    """Return a plane of at most ``n_h`` levels whose edges crowd where those of ``plane`` do."""
    if plane.n_h <= n_h:
        return plane
    at = np.linspace(0.0, plane.n_h, n_h + 1)
    return Plane(np.interp(at, np.arange(plane.n_h + 1), plane.edges))
