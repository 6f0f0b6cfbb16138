"""Figures of merit: tracking and prediction errors, loop areas; how long a residual remembers itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.core.plane import BoolArray, FloatArray, finite_vector, float_array
from pulsetrainer.errors import ArgumentError

_NEARLY_ALL = 0.9  # of the samples


class TargetError(NamedTuple):
    """Errors of a measured output against its target, in percent of ``full``."""

    mean_abs_error_percent: float
    max_abs_error_percent: float
    rms_error_percent: float


def tracking(target: ArrayLike, measured: ArrayLike, full: float) -> TargetError:
    """Errors of every finite sample of ``measured`` (..., n) against ``target`` (n,).

    ArgumentError where nothing was measured, the shapes do not fit, or ``full`` is not positive.
    """
    wanted, got = finite_vector("target", target), float_array("measured", measured)
    if got.shape[-1:] != wanted.shape:
        raise ArgumentError(
            f"measured must have shape (..., {wanted.size}) like the target, got {got.shape}",
            hint="compare at the same samples",
        )
    error = (got - wanted)[np.isfinite(got)]
    if error.size == 0 or not (full > 0 and np.isfinite(full)):
        raise ArgumentError(
            f"no error can be given for {error.size} measured samples and a full force of {full:g}",
            hint="play the waveform again",
        )
    size = np.abs(error) * (100.0 / full)
    return TargetError(float(size.mean()), float(size.max()), root_mean_square(size))


def lacking(target: FloatArray, measured: FloatArray, at: BoolArray) -> float:
    """How far ``measured`` (..., n) stays below ``target`` (n,) in the samples ``at`` (n,); NaN: none is.

    The largest tenth does not count: it is noise.
    """
    lack = (target - measured)[..., at]
    return float(np.nanquantile(lack, _NEARLY_ALL)) if np.isfinite(lack).any() else float("nan")


def root_mean_square(values: FloatArray) -> float:
    """Root of the mean of the squares of all ``values`` (...), in their unit; infinite beyond 1e154."""
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(values**2)))


def correlation_time(residuals: Sequence[FloatArray]) -> float:
    """Return tau = 1 + 2 sum_k rho_k, samples, up to the first autocorrelation rho_k below 2 / sqrt(n).

    White residuals have 1. Several residuals (n,) are taken together, each about its own mean; lags beyond
    a tenth of all samples are not looked at. A residual that is zero has 1.
    """
    n = sum(r.size for r in residuals)
    lags = max(1, n // 10)
    power = np.zeros(lags)
    for residual in residuals:
        if residual.size == 0:
            continue
        e = residual - residual.mean()
        spectrum = np.fft.rfft(e, 2 * e.size)
        own = np.fft.irfft(np.abs(spectrum) ** 2)[: min(lags, e.size)]
        power[: own.size] += own
    if power[0] <= 0:
        return 1.0
    correlation = power / power[0]
    end = int(np.argmax(np.append(correlation, 0.0) < 2.0 / np.sqrt(n)))
    return 1.0 + 2.0 * float(correlation[1:end].sum())


def loop_area(x: ArrayLike, y: ArrayLike) -> float:
    """Area enclosed by the closed curve (x, y): |closed integral of y dx|, by the shoelace formula.

    ArgumentError where x and y are not finite vectors of one length.
    """
    a, b = _pair("x", x, "y", y)
    return abs(float(np.sum(a * np.roll(b, -1) - np.roll(a, -1) * b))) / 2.0


def repeat_spread(measured: ArrayLike) -> float:
    """Standard deviation of single measurements around their mean over repeats (r, n).

    A sample that only one repeat has tells nothing; 0 where all are such.

    ArgumentError where there is no axis of repeats.
    """
    repeats = float_array("measured", measured)
    if repeats.ndim != 2:
        raise ArgumentError(
            f"measured must have shape (r, n), got {repeats.shape}", hint="one row for each repeat"
        )
    told = repeats[:, np.isfinite(repeats).sum(axis=0) > 1]
    return float(np.sqrt(np.mean(np.nanvar(told, axis=0, ddof=1)))) if told.size else 0.0


def mean_over_repeats(measured: FloatArray) -> FloatArray:
    """Mean (n,) over repeats (r, n); a sample that no repeat has is taken between its neighbours."""
    present = np.isfinite(measured)
    count = present.sum(axis=0)
    total = np.where(present, measured, 0.0).sum(axis=0)
    known = np.flatnonzero(count)
    return np.interp(np.arange(count.size), known, total[known] / count[known])


def beats(target: FloatArray) -> int:
    """Number of times a target (n,) that starts a period at its first sample comes round."""
    middle = 0.5 * (target.max() + target.min())
    return max(int(np.sum((target[1:] >= middle) & (target[:-1] < middle))), 1)


class Prediction(NamedTuple):
    """Errors of a predicted output."""

    rms: float  # output unit
    rms_percent: float  # of the span of the measured output
    max_abs: float  # output unit
    max_percent: float


def prediction(measured: ArrayLike, predicted: ArrayLike) -> Prediction:
    """Errors of ``predicted`` (n,) against ``measured`` (n,).

    ArgumentError where they are not finite vectors of one length, or the measured output does not vary, so
    that no percentage exists.
    """
    was, said = _pair("measured", measured, "predicted", predicted)
    span = float(np.ptp(was))
    if span == 0:
        raise ArgumentError(
            f"the measured output does not vary: it is {was[0]:g} in all {was.size} samples",
            hint="check the sensor's wiring",
        )
    error = said - was
    rms, worst = root_mean_square(error), float(np.abs(error).max())
    return Prediction(rms, 100.0 * rms / span, worst, 100.0 * worst / span)


def _pair(name: str, one: ArrayLike, other_name: str, other: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return two finite vectors of one length."""
    a, b = finite_vector(name, one), finite_vector(other_name, other)
    if a.shape != b.shape:
        raise ArgumentError(
            f"{name} and {other_name} must have one shape, got {a.shape} and {b.shape}",
            hint="compare at the same samples",
        )
    return a, b
