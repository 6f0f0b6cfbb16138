"""Noise in the measured input: how large it is, and how to take the false reversals out.

A Preisach operator has no defence against input noise: every wiggle is a reversal that it remembers.
The noise is read off fourth differences, whose standard deviation is sqrt(70) times that of white noise
while a smooth or straight input leaves next to nothing in them; the median makes real turns harmless.

A turn is real when the input swings back by more than the noise of n samples can,
h = 2 sigma sqrt(2 ln n) (Donoho and Johnstone, Biometrika 81 (1994) 425-455). Each piece between real
turns is filtered by local parabolas of zero phase (Savitzky and Golay, Anal. Chem. 36 (1964) 1627-1639), then
made monotone: the mean of its running maximum from the left and its running minimum from the right,
which lags on neither side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.core.memory import turning_points
from pulsetrainer.core.plane import FloatArray, IntArray, finite_vector

_FOURTH = np.asarray([1.0, -4.0, 6.0, -4.0, 1.0])  # squares add up to 70
MEDIAN_TO_SIGMA = 1.4826  # of the absolute value of a normal variable
# A dead-band wider than this share of the range would remove motion: the record is too coarse to tell.
_WIDEST = 0.1
# Samples of the local parabolas, the widest first.
_WINDOWS = (31, 21, 15, 9, 5)
# What a filter takes away is noise alone as long as it is not larger than this times what noise would be.
_NOISE_ONLY = 1.1
_LOOKED_AT = 1_000_000  # samples that are enough to count turns


@dataclass(frozen=True, slots=True)
class Cleaned:
    """An input without its false reversals."""

    input: FloatArray  # (n,) input unit; the very input where nothing was removed
    sigma: float  # standard deviation of the noise, input unit; NaN where the record cannot tell
    dead_band: float  # h: swings up to here are noise, input unit
    removed: int  # reversals that are gone
    kept: int  # reversals that are left


def every(samples: int) -> int:
    """Return the step at which a record of so many samples is looked at, where its turns are counted."""
    return -(-samples // _LOOKED_AT)


def estimate(values: ArrayLike) -> float:
    """Standard deviation of white noise on a slowly moving input (n,), input unit.

    sigma = 1.4826 median |fourth differences| / sqrt(70). NaN below 16 samples, and where the dead-band
    it would ask for exceeds a tenth of the range: there the samples are too coarse to tell noise
    from motion.

    ArgumentError where the input is no finite vector.
    """
    u = finite_vector("input", values)
    if u.size < 16:
        return float("nan")
    sigma = white(u)
    scale = float(np.abs(u).max())
    if sigma <= 8 * np.finfo(float).eps * scale:  # the rounding of the differences themselves
        return 0.0
    return sigma if dead_band(sigma, u.size) <= _WIDEST * float(np.ptp(u)) else float("nan")


def white(values: FloatArray) -> float:
    """Standard deviation of the white part of a signal (n,), by its fourth differences; 0 below 5 samples."""
    if values.size < _FOURTH.size:
        return 0.0
    fourth = np.convolve(values, _FOURTH, mode="valid")
    return MEDIAN_TO_SIGMA * float(np.median(np.abs(fourth))) / np.sqrt(70.0)


def dead_band(sigma: float, n: int) -> float:
    """Largest swing h = 2 sigma sqrt(2 ln n) that noise makes among ``n`` samples, input unit."""
    return 2.0 * sigma * float(np.sqrt(2.0 * np.log(max(n, 2))))


def real_turns(values: FloatArray, band: float) -> IntArray:
    """Places (k,) of the extremes between which ``values`` (n,) swings by more than ``band``, in order.

    Each is the first sample of its extreme value; extremes alternate between maxima and minima. One pass over
    all turning points.
    """
    places = np.concatenate(([0], turning_points(values)))
    heights = values[places].tolist()
    turns: list[int] = []
    high = low = 0  # numbers of the extremes since the last real turn
    direction = 0
    for k, height in enumerate(heights):
        if height > heights[high]:
            high = k
        if height < heights[low]:
            low = k
        if direction >= 0 and heights[high] - height > band:
            turns.append(high)
            direction, low, high = -1, k, k
        elif direction <= 0 and height - heights[low] > band:
            turns.append(low)
            direction, low, high = 1, k, k
    return places[np.asarray(turns, dtype=np.int64)]


def clean(values: ArrayLike) -> Cleaned:
    """Return the input (n,) without reversals that are smaller than its own noise.

    ArgumentError if the input is no finite vector.
    """
    u = finite_vector("input", values)
    noise = estimate(u)
    reversals = turning_points(u)[:-1].size
    if not noise > 0:
        return Cleaned(u, noise, 0.0, 0, reversals)
    band = dead_band(noise, u.size)
    turns = real_turns(u, band)
    if turns.size >= reversals:  # every turn is a real one
        return Cleaned(u, noise, band, 0, reversals)
    smooth = monotone_between(u, turns, noise)
    left = turning_points(smooth)[:-1].size  # monotone between real turns, so fewer than before
    return Cleaned(smooth, noise, band, reversals - left, left)


def monotone_between(u: FloatArray, turns: IntArray, sigma: float) -> FloatArray:
    """Replace each piece between turns by a smooth monotone path; a turn gets the mean of its two sides.

    ``turns`` (k,) are their places, rising. Where ``sigma``, the standard deviation of the noise of ``u``
    (n,), is zero or NaN nothing is smoothed. Pieces are filtered one by one, so that a turn is never rounded
    off: at its end a piece is continued by the polynomial of its own last samples.
    """
    total, count = np.zeros(u.size), np.zeros(u.size)
    ends = np.unique(np.concatenate(([0], turns, [u.size - 1]))).tolist()
    for a, b in pairwise(ends):
        piece = u[a : b + 1]
        total[a : b + 1] += _local_polynomial(piece, sigma, u.size) if sigma > 0 else piece
        count[a : b + 1] += 1.0
    smooth = total / count
    for a, b in pairwise(ends):
        smooth[a : b + 1] = _monotone(smooth[a : b + 1])
    return smooth


def _local_polynomial(piece: FloatArray, sigma: float, n: int) -> FloatArray:
    """Filter a piece with the widest window that leaves noise of size ``sigma`` behind, and no more."""
    for window in _WINDOWS:
        if window <= piece.size:
            path = _parabolas(piece, window)
            rest = piece - path
            noise_only = np.std(rest) <= _NOISE_ONLY * sigma
            if noise_only and np.abs(rest).max() <= 0.5 * _NOISE_ONLY * dead_band(sigma, n):
                return path
    return piece


def _parabolas(piece: FloatArray, window: int) -> FloatArray:
    """Local parabolas of a piece; its ends are continued by that of the first and the last window."""
    fit, half = _hat(window), window // 2
    middle = np.convolve(piece, fit[half], mode="valid")
    return np.concatenate((fit[:half] @ piece[:window], middle, fit[half + 1 :] @ piece[-window:]))


@cache
def _hat(window: int) -> FloatArray:
    """Fit (window, window) of a parabola to as many samples; savgol_filter makes it anew for each piece."""
    basis = np.linalg.qr(np.vander(np.arange(window) - window // 2, 3))[0]
    return np.asarray(basis @ basis.T)


def _monotone(piece: FloatArray) -> FloatArray:
    """Mean of the running maximum from the left and the running minimum from the right, or the mirror."""
    sign = 1.0 if piece[-1] >= piece[0] else -1.0
    rising = sign * piece
    left = np.maximum.accumulate(rising)
    right = np.minimum.accumulate(rising[::-1])[::-1]
    return sign * 0.5 * (left + right)
