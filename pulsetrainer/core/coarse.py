"""What lies between the steps of a coarse converter, told by the hysteresis that fits them best.

A sample that reads c was anywhere in c - q/2 .. c + q/2. With noise s and a fitted output p the likelihood of
that is Phi((c + q/2 - p)/s) - Phi((c - q/2 - p)/s). It is maximised over the weights by Newton's method: each
sample is fitted to p + m/k with weight k, where m and 1 - k are mean and variance of the noise that the
reading leaves possible, in units of s. Far inside a step a sample hardly counts; at its edge it counts whole;
where the noise is larger than the step all count alike. The noise itself is unknown too, since a step hides
most of it: after each fit s^2 is what the readings leave possible of it, the mean of s^2 (m^2 + 1 - k).

Source: Tobin, Econometrica 26, 1958, 24-36; Dempster, Laird, Rubin, J. R. Stat. Soc. B 39, 1977, section 4.2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import special

from pulsetrainer.core.identification import identify
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.record import Record

_ROUNDS = 8  # of Newton's method, and of the noise
_AGAIN = 3  # ... in which smoothing is chosen again: steps taken for what they are not had chosen the first
_LEAST_NOISE = 0.05  # of a step: keeps the edges of a step finite
_MOST_NOISE = 0.35  # of a step: with more the averages of the readings are right as they are
_DIFFERENCES = (3, 20.0)  # third ones, and their variance for white noise: 1 + 9 + 9 + 1
_TAIL = 6.0  # standard deviations beyond an edge: farther out the edge itself is wanted
_LEAST_COUNT = 1e-3  # that a sample counts at least: keeps the fit regular


def between_steps(record: Record, plane: Plane, step: float) -> FloatArray:
    """Return the expected output (n,) of a record whose output comes in steps, or as it is if none tells it.

    Noise that carries it over its steps averages them out; a hysteresis that leaves as much does not tell.

    ConvergenceError where a fit does not settle.
    """
    noise = _noise(record.output, step)
    if noise > _MOST_NOISE * step:
        return record.output
    found = identify([record], plane, smoothing="auto")
    fitted = found.operator(record.input, record.start)
    for number in range(_ROUNDS):
        mean, count = _left_possible(record.output - fitted, step, noise)
        wanted = replace(record, output=fitted + mean / count, sample_weight=record.sample_weight * count)
        found = identify([wanted], plane, smoothing="auto" if number == _AGAIN else found.smoothing)
        square = np.average(mean**2 + noise**2 * (1.0 - count), weights=record.sample_weight)
        noise = max(float(np.sqrt(square)), _LEAST_NOISE * step)
        fitted = found.operator(record.input, record.start)
    if noise > _MOST_NOISE * step:
        return record.output
    return fitted + _left_possible(record.output - fitted, step, noise)[0]


def _noise(y: FloatArray, step: float) -> float:
    """White noise (rms) besides the error of the steps."""
    order, power = _DIFFERENCES
    squares = float(np.mean(np.diff(y, order) ** 2)) / power - step**2 / 12.0
    return float(np.sqrt(max(squares, (_LEAST_NOISE * step) ** 2)))


def _left_possible(apart: FloatArray, step: float, noise: float) -> tuple[FloatArray, FloatArray]:
    """Mean of the noise that readings ``apart`` (n,) from the fit leave possible, and what each counts."""
    low, high = (apart - 0.5 * step) / noise, (apart + 0.5 * step) / noise
    flip = low > 0  # both ends on one side: the tail that has digits left
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    near = high > -_TAIL
    a, b = np.where(near, low, -1.0), np.where(near, high, 1.0)
    share = special.ndtr(b) - special.ndtr(a)
    at = [np.exp(-0.5 * np.minimum(x**2, 700.0)) / np.sqrt(2.0 * np.pi) for x in (a, b)]
    mean = (at[0] - at[1]) / share
    count = mean**2 - (a * at[0] - b * at[1]) / share
    mean, count = np.where(near, mean, high), np.where(near, count, 1.0)
    return noise * np.where(flip, -mean, mean), np.clip(count, _LEAST_COUNT, 1.0)
