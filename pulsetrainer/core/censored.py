"""Censored outputs: a reading in coarse steps, or at a rail, gives an interval; a fit does the rest.

A sample of a coarse converter that reads c was anywhere in c - q/2 .. c + q/2, one that is cut off at a rail
anywhere beyond it. With noise s and a fitted output p the likelihood of an interval a .. b is
Phi((b - p)/s) - Phi((a - p)/s). It is maximised over the weights by Newton's method: each sample is fitted to
p + m/k with weight k, where m and 1 - k are mean and variance of the noise that the reading leaves possible,
in units of s. Far inside a step or beyond a rail a sample hardly counts; at an edge it counts whole; where
the noise is larger than the step all count alike. The noise itself is unknown too, since a step hides most of
it: after each fit s^2 is what the readings leave possible of it, the mean of s^2 (m^2 + 1 - k).

Source: Tobin, Econometrica 26, 1958, 24-36; Dempster, Laird, Rubin, J. R. Stat. Soc. B 39, 1977, section 4.2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.identification import identify
from pulsetrainer.core.plane import BoolArray, FloatArray, Plane
from pulsetrainer.core.record import Record

_ROUNDS = 8  # of Newton's method, and of the noise
_AGAIN = 3  # ... in which smoothing is chosen again: steps taken for what they are not had chosen the first
_LEAST_NOISE = 0.05  # of a step: keeps the edges of a step finite
_MOST_NOISE = 0.35  # of a step: with more the averages of the readings are right as they are
_DIFFERENCES = (3, 20.0)  # third ones, and their variance for white noise: 1 + 9 + 9 + 1
_TAIL = 6.0  # standard deviations beyond an edge: farther out the edge itself is wanted
_ENDLESS = 37.0  # standard deviations, for an interval without an end: nothing is left beyond them
_LEAST_LEFT = 0.5  # of the noise beside a rail: no fit leaves less
_DESCRIBED = 2.0  # times that noise: where more is left, nothing tells what lies beyond the rail
_TELLS = 0.05  # that a sample at a rail counts at least, to be told: two and a half standard deviations
_LEAST_COUNT = 1e-3  # that a sample counts at least: keeps the fit regular


def between_steps(record: Record, plane: Plane, step: float) -> FloatArray:
    """Return the expected output (n,) of a record whose output comes in steps, or as it is if none tells it.

    Noise that carries it over its steps averages them out; a hysteresis that leaves as much does not tell.

    ConvergenceError where a fit does not settle.
    """
    noise = _noise(record.output, step)
    if noise > _MOST_NOISE * step:
        return record.output
    half = np.full(record.output.size, 0.5 * step)
    fitted, noise, mean, _ = _likeliest(record, plane, half, half, noise, _LEAST_NOISE * step)
    return record.output if noise > _MOST_NOISE * step else fitted + mean


def beyond_rails(
    record: Record, plane: Plane, up: BoolArray, down: BoolArray, noise: float
) -> FloatArray | None:
    """Return the expected output (n,) of a record that is cut off at an upper and a lower rail.

    ``up`` and ``down`` tell the samples (n,) at each, ``noise`` is that of the others. NaN where a sample
    lies so far beyond that its reading tells next to nothing. None where the hysteresis leaves more than
    noise, so that it does not tell either.

    ConvergenceError where a fit does not settle.
    """
    if noise == 0.0:  # any fit leaves more
        return None
    below, above = (np.where(one, np.inf, 0.0) for one in (down, up))
    fitted, left, mean, count = _likeliest(record, plane, below, above, noise, _LEAST_LEFT * noise)
    if left > _DESCRIBED * noise:
        return None
    return np.where(up | down, np.where(count < _TELLS, np.nan, fitted + mean), record.output)


def _likeliest(
    record: Record, plane: Plane, below: FloatArray, above: FloatArray, noise: float, least: float
) -> tuple[FloatArray, float, FloatArray, FloatArray]:
    """Fitted output (n,), noise, and mean and count (n,) of what readings leave possible at the end.

    Each reading leaves from ``below`` (n,) under it to ``above`` (n,) over it; infinity beyond a rail.
    """
    exact = (below == 0.0) & (above == 0.0)
    beyond = ~np.isfinite(below + above)
    begin = replace(record, sample_weight=np.where(beyond, 0.0, record.sample_weight))
    found = identify([begin], plane, smoothing="auto")
    fitted = found.operator(record.input, record.start)

    def possible() -> tuple[FloatArray, FloatArray]:
        apart = record.output - fitted
        ends = (np.where(exact, end, (apart + beside) / noise) for end, beside in ((-1, -below), (1, above)))
        mean, count = _left_possible(*ends)
        return np.where(exact, apart, noise * mean), np.where(exact, 1.0, count)

    for number in range(_ROUNDS):
        mean, count = possible()
        wanted = replace(record, output=fitted + mean / count, sample_weight=record.sample_weight * count)
        found = identify([wanted], plane, smoothing="auto" if number == _AGAIN else found.smoothing)
        square = np.average(mean**2 + noise**2 * (1.0 - count), weights=record.sample_weight)
        noise = max(float(np.sqrt(square)), least)
        fitted = found.operator(record.input, record.start)
    return fitted, noise, *possible()


def _noise(y: FloatArray, step: float) -> float:
    """White noise (rms) besides the error of the steps."""
    order, power = _DIFFERENCES
    squares = float(np.mean(np.diff(y, order) ** 2)) / power - step**2 / 12.0
    return float(np.sqrt(max(squares, (_LEAST_NOISE * step) ** 2)))


def _left_possible(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of normal noise that lies between ``low`` and ``high`` (n,), and 1 less its variance."""
    flip = low > 0  # both ends on one side: the tail that has digits left
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    near = high > -_TAIL
    a, b = np.where(near, np.maximum(low, -_ENDLESS), -1.0), np.where(near, np.minimum(high, _ENDLESS), 1.0)
    share = scipy.special.ndtr(b) - scipy.special.ndtr(a)
    at = [np.exp(-0.5 * np.minimum(x**2, 700.0)) / np.sqrt(2.0 * np.pi) for x in (a, b)]
    mean = (at[0] - at[1]) / share
    count = mean**2 - (a * at[0] - b * at[1]) / share
    mean, count = np.where(near, mean, high), np.where(near, count, 1.0)
    return np.where(flip, -mean, mean), np.clip(count, _LEAST_COUNT, 1.0)
