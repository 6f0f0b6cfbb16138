"""The noise of a record as it is: its spectrum, and how it grows with the output's level.

The noise is n_t = s_t x_t, where s follows the level of the output and x is stationary with the density S(f).
Both are estimated from a residual from which all that weights and causes could explain has been removed. That
removes some noise too. White probes that are treated in the same way show how much is missing at each
frequency, and it is put back. Bands of the spectrum are medians, so that a single line does not count as
noise. A sum c'n then has the variance

    sum over f of S(f) |FFT(s c)(f)|^2 / N

with the record padded with as many zeros, so that its ends do not meet. How large the noise is, whatever a
model still misses, is estimated by ``quiet_square``. It looks where the input rests or is slow, octave by
octave, and leaves out the largest averages. Noise slower than these octaves is extrapolated from them.

How far the sums of squares of two fits may differ although neither is better, ``doubt`` says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.diagnosis.design import Bins
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.thresholds import CHI_SQUARE_MEDIAN, LIMITS, TINY

_EXPONENTIAL_MEDIAN = float(np.log(2.0))  # of a line of a periodogram, of its mean


@dataclass(frozen=True)
class Noise:
    """Noise of the averages of some records."""

    bins: Bins
    scale: FloatArray  # (count,) local size, mean square one
    frequency: FloatArray  # (m,) cycles an average, rising
    density: FloatArray  # (m,) variance of an average if all frequencies were like this one

    def at(self, frequency: FloatArray) -> FloatArray:
        """Density at some frequencies (k,), cycles an average."""
        known = np.log(np.maximum(self.density, TINY))
        return np.exp(np.interp(np.log(np.maximum(frequency, TINY)), np.log(self.frequency), known))

    def covariance(self, columns: FloatArray) -> FloatArray:
        """Covariance (k, k) of what noise has along columns (count, k)."""
        total = np.zeros((columns.shape[1], columns.shape[1]))
        for own, at in self.bins.places:
            size = scipy.fft.next_fast_len(2 * (int(at[-1]) + 1), real=True)
            spread = np.zeros((columns.shape[1], size))
            spread[:, at] = (columns[own] * self.scale[own, None]).T
            lines = scipy.fft.rfft(spread, axis=1)
            twice = np.full(lines.shape[1], 2.0)
            twice[0] = 1.0
            if size % 2 == 0:
                twice[-1] = 1.0
            lines *= np.sqrt(twice * self.at(scipy.fft.rfftfreq(size)) / size)
            real = lines.view(np.float64)
            total += real @ real.T
        return total


def noise_in(
    residual: FloatArray,
    project: Callable[[FloatArray], FloatArray],
    axes: FloatArray,
    bins: Bins,
    level: FloatArray,
    rng: np.random.Generator,
) -> Noise:
    """Return the noise of a residual (count,) at averaged outputs ``level`` (count,).

    ``project`` takes from columns (count, k) what was taken from the residual; what goes along ``axes``
    (count, m), orthonormal, causes could explain: what is left is taken for noise.
    """

    def free(columns: FloatArray) -> FloatArray:
        left = project(columns)
        return np.asarray(left - axes @ (axes.T @ left))

    left = free(residual[:, None])
    scale = _scale(left[:, 0], bins, level)
    probes = free(rng.standard_normal((bins.count, LIMITS.probes)) * scale[:, None])
    frequency, lines, white = _lines(np.hstack((left, probes)) / scale[:, None], bins)
    edges = _edges(frequency)
    values, middles = [], []
    for begin, end in pairwise(edges):
        band, known = lines[begin:end], float(white[begin:end].mean())
        if known < LIMITS.least_seen and end < frequency.size:
            continue  # taken away almost whole: the bands beside it tell more
        mean = (
            float(np.median(band)) / _EXPONENTIAL_MEDIAN
            if end - begin >= LIMITS.median_lines
            else float(band.mean())
        )
        values.append(mean / max(known, LIMITS.least_left))
        middles.append(float(np.exp(np.mean(np.log(frequency[begin:end])))))
    return Noise(bins, scale, np.asarray(middles), np.asarray(values))


def _scale(left: FloatArray, bins: Bins, level: FloatArray) -> FloatArray:
    """Local size (count,) of noise by the level of the output, from differences of neighbours."""
    apart = np.append(np.diff(left), 0.0) ** 2
    apart[np.append(np.diff(bins.record), 1) != 0] = np.nan
    middles, medians = _by_level(level, np.isfinite(apart), lambda own: float(np.median(apart[own])))
    sizes = [median / CHI_SQUARE_MEDIAN for median in medians]
    if not sizes or max(sizes) <= 0.0:
        return np.ones(left.size)
    square = np.interp(level, middles, np.maximum(sizes, LIMITS.least_left * max(sizes)))
    return np.asarray(np.sqrt(square / square.mean()))


def _by_level(
    level: FloatArray, counts: BoolArray, size: Callable[[BoolArray], float]
) -> tuple[list[float], list[float]]:
    """Middles of groups of levels, and the size of what counts there; groups of few rows are left out."""
    low, high = float(level.min()), float(level.max())
    group = np.clip((level - low) / max(high - low, TINY) * LIMITS.groups, 0, LIMITS.groups - 1).astype(int)
    found = [(k, counts & (group == k)) for k in range(LIMITS.groups)]
    full = [(k, own) for k, own in found if np.count_nonzero(own) >= LIMITS.least_rows]
    return [low + (k + 0.5) / LIMITS.groups * (high - low) for k, _ in full], [size(own) for _, own in full]


def _lines(columns: FloatArray, bins: Bins) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Frequencies (m,), and there the periodograms of the first column and of the mean of the others."""
    found: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for own, at in bins.places:
        size = int(at[-1]) + 1
        spread = np.zeros((columns.shape[1], size))
        window = scipy.signal.windows.hann(size, sym=False)
        spread[:, at] = columns[own].T * window[at]
        power = np.abs(scipy.fft.rfft(spread, axis=1)) ** 2 / max(float(window @ window), TINY)
        found.append((scipy.fft.rfftfreq(size)[1:], power[0, 1:], power[1:, 1:].mean(axis=0)))
    frequency, lines, white = (np.concatenate(one) for one in zip(*found, strict=True))
    order = np.argsort(frequency, kind="stable")
    return frequency[order], lines[order], white[order]


def _edges(frequency: FloatArray) -> list[int]:
    """Edges of bands of so many lines and so wide, as numbers of lines."""
    edges = [0]
    while edges[-1] < frequency.size:
        begin = edges[-1]
        wide = int(np.searchsorted(frequency, LIMITS.band * frequency[begin]))
        edges.append(max(wide, begin + LIMITS.least_lines))
    edges[-1] = frequency.size
    if len(edges) > 2 and edges[-1] - edges[-2] < LIMITS.least_lines:
        del edges[-2]
    return edges


class Heard(NamedTuple):
    """Mean square of noise, and the part of it that may as well be a slow error of the model."""

    square: float
    doubtful: float


def quiet_square(residual: FloatArray, bins: Bins, level: FloatArray, speed: FloatArray) -> Heard:
    """Mean square of the noise in a residual (count,), whatever else is in it.

    ``level`` is the averaged output, ``speed`` the absolute rate of the input, (count,) each.
    """
    quiet, trimmed = speed <= LIMITS.rate_edges[0], LIMITS.trimmed
    if np.count_nonzero(quiet) < LIMITS.least_quiet:
        quiet, trimmed = speed <= np.quantile(speed, LIMITS.slowest), LIMITS.trimmed_moving
    bands, slow = _octaves(residual, bins)
    power = np.asarray([_square(band, quiet, level, trimmed) for band in bands])
    # from octave to octave the power changes by 2^(a - 1) if the density goes with f^-a
    last = np.log2(np.maximum(power[-LIMITS.slope_octaves :], TINY))
    step = min(max(float(np.polyfit(np.arange(last.size), last, 1)[0]), -1.0), LIMITS.steepest - 1.0)
    longest = max(int(at[-1]) + 1 for _, at in bins.places)
    more = max(round(np.log2(longest)) - LIMITS.octaves, 1)
    slower = float(power[-1]) * float(np.sum(2.0 ** (step * np.arange(1, more + 1))))
    left = float(np.mean(slow**2))
    sure, usual = (float(power.sum()) + min(left, doubt * slower) for doubt in (1.0, LIMITS.slow_doubt))
    return Heard(usual + _impulses(residual, usual), usual - sure)


def burstiness(residual: FloatArray, bins: Bins, level: FloatArray) -> float:
    """Kurtosis of a residual (count,) within its octaves, each with the weight of its power.

    It is 3 for normal noise of any spectrum, and larger for what comes and goes or jumps, however slow it is.
    Noise that grows with the output's ``level`` (count,) is brought to one size first.
    """
    bands = np.asarray(_octaves(residual / _scale(residual, bins, level), bins)[0])
    power = bands.var(axis=1)
    return float(
        np.average(scipy.stats.kurtosis(bands, axis=1, fisher=False), weights=np.maximum(power, TINY))
    )


def _impulses(residual: FloatArray, usual: float) -> float:
    """Mean square of averages that stand alone, far out of noise of the ``usual`` size: heavy tails."""
    size = np.abs(residual)
    beside = np.maximum(np.append(size[1:], 0.0), np.append(0.0, size[:-1]))
    alone = (size > LIMITS.impulse * np.sqrt(usual)) & (size > LIMITS.alone * beside)
    return float(np.sum(residual[alone] ** 2)) / residual.size


def _octaves(residual: FloatArray, bins: Bins) -> tuple[list[FloatArray], FloatArray]:
    """Octaves (count,) of a signal from its highest frequency down, and what is slower (count,)."""
    bands = [np.zeros(bins.count) for _ in range(LIMITS.octaves + 1)]
    for own, at in bins.places:
        spread = np.zeros(int(at[-1]) + 1)
        spread[at] = residual[own]
        lines, frequency = scipy.fft.rfft(spread), scipy.fft.rfftfreq(spread.size)
        upper = 1.0
        for k, band in enumerate(bands):
            lower = 0.5 ** (k + 2) if k < LIMITS.octaves else -1.0
            inside = (frequency > lower) & (frequency <= upper)
            band[own] = scipy.fft.irfft(np.where(inside, lines, 0.0), spread.size)[at]
            upper = lower
    return bands[:-1], bands[-1]


def _square(band: FloatArray, quiet: BoolArray, level: FloatArray, trimmed: float) -> float:
    """Mean square of a band by its medians where it is quiet, at each level of the output."""
    middles, squares = _by_level(level, quiet, lambda own: _trimmed(band[own], trimmed))
    if not squares:
        return _trimmed(band, trimmed)
    return float(np.interp(level, middles, squares).mean())


def _trimmed(values: FloatArray, share: float) -> float:
    """Mean square of normal values, told without the largest ones."""
    squares = np.sort(values**2)
    kept = max(round((1.0 - share) * values.size), 1)
    edge = float(scipy.stats.norm.isf(0.5 * share))
    expected = 1.0 - 2.0 * edge * float(scipy.stats.norm.pdf(edge)) / (1.0 - share)
    return float(squares[:kept].mean()) / expected


def doubt(fitted: Fitted, other: Fitted, noise: Noise | None) -> float:
    """Difference of squares of two fits that tells nothing: of noise, and of what lies between samples."""
    if noise is None:
        return 0.0
    apart = fitted.projector((other.simulated - fitted.simulated)[:, None])
    return _by_chance(noise, apart) + _between_samples(fitted, apart[:, 0])


def _by_chance(noise: Noise, apart: FloatArray) -> float:
    """Difference of squares of two models that noise exceeds once in twenty, if neither is better.

    Of squares |e + d|^2 - |e|^2 with e noise and d (count, 1) the difference of the models, 2 d'e is chance.
    """
    return 2.0 * LIMITS.once_in_twenty * float(np.sqrt(noise.covariance(apart)[0, 0]))


def _between_samples(fitted: Fitted, apart: FloatArray) -> float:
    """Difference of squares of two models, ``apart`` (count,), that what happens between samples can make.

    A turn of the input lies anywhere between two samples, and what is cut off there looks like a share of the
    second difference of the output: the formulas of short lags differ by just that (decision 101).
    """
    bent = [np.diff(y, 2, prepend=y[:1], append=y[-1:]) for y in fitted.simulator.full(fitted.terms)]
    cut = fitted.projector(fitted.problem.bins.average(bent)[:, None])[:, 0]
    return 2.0 * LIMITS.cut_turns * abs(float(apart @ cut))
