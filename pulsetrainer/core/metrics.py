"""Figures of merit: tracking errors, prediction errors, loop areas."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.errors import ArgumentError


class Tracking(NamedTuple):
    """Errors of a measured output against its target, in percent of ``full``."""

    mean_abs_percent: float
    max_abs_percent: float
    rms_percent: float


def tracking(target: FloatArray, measured: FloatArray, full: float) -> Tracking:
    """Errors of every finite sample of ``measured`` (..., n) against ``target`` (n,).

    Raises
    ------
    ArgumentError
        Nothing was measured, or ``full`` is not positive.
    """
    error = (measured - target)[np.isfinite(measured)]
    if error.size == 0 or not full > 0:
        raise ArgumentError(
            f"no error can be given for {error.size} measured samples and a full force of {full:g}",
            hint="play the waveform again",
        )
    size = np.abs(error) * (100.0 / full)
    return Tracking(float(size.mean()), float(size.max()), float(np.sqrt(np.mean(size**2))))


def loop_area(x: FloatArray, y: FloatArray) -> float:
    """Area enclosed by the closed curve (x, y): |closed integral of y dx|, by the shoelace formula."""
    return abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))) / 2.0


def repeat_spread(measured: FloatArray) -> float:
    """Standard deviation of single measurements around their mean over repeats (r, n); 0 for one repeat."""
    if measured.shape[0] < 2:
        return 0.0
    return float(np.sqrt(np.nanmean(np.nanvar(measured, axis=0, ddof=1))))


class Prediction(NamedTuple):
    """Errors of a predicted output."""

    rms: float  # output unit
    rms_percent: float  # of the span of the measured output
    max_abs: float  # output unit
    max_percent: float


def prediction(measured: FloatArray, predicted: FloatArray) -> Prediction:
    """Errors of ``predicted`` (n,) against ``measured`` (n,).

    Raises
    ------
    ArgumentError
        The measured output does not vary, so that no percentage exists.
    """
    span = float(np.ptp(measured))
    if span == 0:
        raise ArgumentError("the measured output does not vary", hint="check the sensor's wiring")
    error = predicted - measured
    rms, worst = float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())
    return Prediction(rms, 100.0 * rms / span, worst, 100.0 * worst / span)
