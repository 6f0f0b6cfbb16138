"""Fewer points, the same picture: a long record drawn by its extremes."""

from __future__ import annotations

from typing import Final

import numpy as np

from pulsetrainer.core.plane import FloatArray, IntArray

MOST_POINTS: Final = 4000
MOST_OF_A_LOOP: Final = 4 * MOST_POINTS  # or a fast stroke of a long record becomes a straight line
_FAR = 4.0  # times as far off its bin as the farthest usually is: no noise, and no fast stretch either


def extremes(values: FloatArray, most: int = MOST_POINTS) -> IntArray:
    """Return at most ``most`` sample numbers that keep the envelope of a series (n,).

    The samples are cut into bins of equal length; of each bin stay the least, the greatest, and the first
    that is NaN (so that a gap stays a gap). First and last sample stay. A record that is short enough stays
    whole; ``most`` is at least 5.
    """
    n = values.size
    if n <= most:
        return np.arange(n)
    size = -(-n // max(1, (most - 2) // 3))
    starts = np.arange(0, n, size)
    padded = np.full(starts.size * size, np.nan)
    padded[:n] = values
    table = padded.reshape(starts.size, size)
    hole = np.isnan(table)
    gap = starts + np.argmax(hole, axis=1)
    picked = (
        np.array([0, n - 1]),
        # of a bin that is all NaN both are its first sample
        starts + np.argmin(np.where(hole, np.inf, table), axis=1),
        starts + np.argmax(np.where(hole, -np.inf, table), axis=1),
        gap[hole.any(axis=1) & (gap < n)],
    )
    return np.unique(np.concatenate(picked))


def path(x: FloatArray, y: FloatArray, most: int = MOST_OF_A_LOOP) -> IntArray:
    """Return at most ``most`` sample numbers that keep the course of a curve in the plane.

    The samples are cut into bins of equal length. Of each stays the sample nearest to the bin's mean, so
    that noise makes no kinks; where the means of x turn back, the one at the tip; and one that lies far off
    its bin, such as a wild sample. The least and the greatest of both series stay, and where the curve
    begins, ends, and breaks off. A curve that is short enough stays whole. ``x`` and ``y`` (n,) are in the
    order of time, NaN is a gap, and ``most`` is at least 30.
    """
    n = x.size
    lost = np.isnan(x) | np.isnan(y)
    if n <= most or lost.all():
        return np.arange(min(n, most))
    size = -(-n // max(1, (most - 6) // 4))
    starts = np.arange(0, n, size)
    picked = [np.array([0, n - 1])]
    off = np.zeros((starts.size, size))  # squared distance from the mean of the bin
    for values in (x, y):
        table = np.full(starts.size * size, np.nan)
        table[:n] = np.where(lost, np.nan, values)
        low, high = np.nanmin(table), np.nanmax(table)
        picked.append(np.array([np.nanargmin(table), np.nanargmax(table)]))
        table = (table.reshape(starts.size, size) - low) / ((high - low) or 1.0)
        hole = np.isnan(table)
        means = np.where(hole, 0.0, table).sum(axis=1) / np.maximum((~hole).sum(axis=1), 1)
        if values is x:
            steps = np.diff(means)
            turns = 1 + np.flatnonzero(steps[1:] * steps[:-1] < 0.0)
            up = np.where(steps[turns - 1] > 0.0, 1.0, -1.0)[:, np.newaxis]
            picked.append(
                starts[turns] + np.argmax(np.where(hole[turns], -np.inf, up * table[turns]), axis=1)
            )
        off += np.where(hole, np.nan, (table - means[:, np.newaxis]) ** 2)
    some = np.flatnonzero(~np.isnan(off).all(axis=1))
    picked.append(starts[some] + np.nanargmin(off[some], axis=1))
    farthest = np.nanmax(off[some], axis=1)
    wild = some[farthest > _FAR**2 * np.median(farthest)]
    picked.append(starts[wild] + np.nanargmax(off[wild], axis=1))
    breaks = np.flatnonzero(lost & ~np.concatenate((np.array([False]), lost[:-1])))
    picked.append(breaks[: starts.size])
    return np.unique(np.concatenate(picked))
