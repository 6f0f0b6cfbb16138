"""Fewer points, the same picture: a long record drawn by its extremes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]

MOST_POINTS: Final = 4000


def extremes(*series: FloatArray, most: int = MOST_POINTS) -> IntArray:
    """Return at most ``most`` sample numbers that keep the envelope of every series.

    The samples are cut into bins of equal length; of each bin stay the sample where each series is
    least, where it is greatest, and the first that is NaN (so that a gap stays a gap). First and
    last sample stay. A record that is short enough stays whole.

    Parameters
    ----------
    series
        Arrays of one length n, drawn over time or against each other.
    most
        The most points to keep; at least 3 per series and two more.

    """
    n = series[0].size
    if n <= most:
        return np.arange(n)
    bins = max(1, (most - 2) // (3 * len(series)))
    size = -(-n // bins)
    starts = np.arange(0, n, size)
    picked = [np.array([0, n - 1])]
    for values in series:
        padded = np.full(starts.size * size, np.nan)
        padded[:n] = values
        table = padded.reshape(starts.size, size)
        hole = np.isnan(table)
        # of a bin that is all NaN each of the three is its first sample
        picked += [
            starts + np.argmin(np.where(hole, np.inf, table), axis=1),
            starts + np.argmax(np.where(hole, -np.inf, table), axis=1),
        ]
        gap = starts + np.argmax(hole, axis=1)
        picked.append(gap[hole.any(axis=1) & (gap < n)])
    kept: IntArray = np.unique(np.concatenate(picked))
    return kept
