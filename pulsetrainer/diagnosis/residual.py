"""Where a residual is large: by rate, level, direction, time and frequency."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import input_noise
from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.thresholds import LIMITS, THIRD

# What a record may lack
RATES, HOLDS, LENGTH, TIME = "rates", "holds", "length", "time"


@dataclass(frozen=True)
class Group:
    """The groups of one quantity: their middles, and the group of every average."""

    name: str
    unit: str  # "{u}" stands for the input's unit
    at: FloatArray
    number: IntArray  # (count,)


def rates(problem: Problem) -> FloatArray:
    """Signed rate of the input (count,), ranges per second, averaged like the output."""
    reach = problem.plane.high - problem.plane.low
    per_record = []
    for record in problem.records:
        width = max(LIMITS.rate_samples, round(LIMITS.rate_s / record.step))
        even = np.convolve(np.pad(record.input, width, mode="edge"), np.ones(width) / width, "same")
        per_record.append(np.gradient(even[width:-width], record.step) / reach)
    return problem.bins.average(per_record)


def groups(problem: Problem) -> list[Group]:
    """How the averages are grouped."""
    rate = rates(problem)
    level = problem.bins.average([r.input for r in problem.records])
    reach = problem.plane.high - problem.plane.low
    speed = np.abs(rate)
    by_rate, at_rate = _by_speed(speed)
    share = (level - problem.plane.low) / reach
    by_level = np.clip((share * LIMITS.groups).astype(np.int64), 0, LIMITS.groups - 1)
    at_level = problem.plane.low + (np.arange(LIMITS.groups) + 0.5) / LIMITS.groups * reach
    count = speed.size
    by_time = np.arange(count) * LIMITS.groups // count
    time = problem.time_s
    at_time = np.asarray([time[by_time == k].mean() for k in range(LIMITS.groups)])
    direction = np.sign(np.where(speed < LIMITS.rate_edges[0], 0.0, rate)).astype(np.int64) + 1
    return [
        Group("rate", "1/s", at_rate, by_rate),  # ranges of the input a second
        Group("level", "{u}", at_level, by_level),
        Group("direction", "1", np.asarray([-1.0, 0.0, 1.0]), direction),
        Group("time", "s", at_time, by_time),
    ]


def _by_speed(speed: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the group of each speed (count,) and the median of each; a rate on an edge is not parted."""
    number = np.digitize(speed, LIMITS.rate_edges).astype(np.int64)

    def medians() -> list[float]:
        return [
            float(np.median(speed[number == k])) if np.any(number == k) else float("nan")
            for k in range(number.max() + 1)
        ]

    for k, (slower, faster) in enumerate(pairwise(medians()), start=1):
        if faster < LIMITS.same_rate * slower:
            number[number == k] = k - 1
    return number, np.asarray(medians())


def rms_by(group: Group, residual: FloatArray) -> FloatArray:
    """The rms residual of each group; NaN where a group is empty."""
    size = np.bincount(group.number, minlength=group.at.size)
    total = np.bincount(group.number, weights=residual**2, minlength=group.at.size)
    return np.sqrt(np.divide(total, size, out=np.full(size.size, np.nan), where=size > 0))


def spectrum(problem: Problem, residual: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frequencies (Hz) and the rms of the residual in third-octave bands around them, longest record."""
    own = problem.bins.record == np.argmax(np.bincount(problem.bins.record))
    one, time = residual[own], problem.bins.time_s[own]
    step = float(np.median(np.diff(time)))
    frequency, density = scipy.signal.welch(one, 1.0 / step, nperseg=min(one.size, LIMITS.welch))
    edges = frequency[1] * 2.0 ** (np.arange(0.0, np.log2(frequency[-1] / frequency[1]) + THIRD, THIRD))
    band = np.digitize(frequency, edges)
    power = np.bincount(band, weights=density, minlength=edges.size + 1) * (frequency[1] - frequency[0])
    used = np.bincount(band, minlength=edges.size + 1)[1:-1] > 0
    used &= edges[1:] <= frequency[-1]  # a band that ends beyond what was sampled holds less than it should
    return np.sqrt(edges[1:] * edges[:-1])[used], np.sqrt(power[1:-1])[used]


def excitation_limits(problem: Problem) -> list[str]:
    """What the records lack for causes to be told apart: rates, holds, length; empty when nothing."""
    lacks = [] if _several_rates(rates(problem)) else [RATES]
    if not any(_holds(record) for record in problem.records):
        lacks.append(HOLDS)
    if problem.bins.time_s.max() < LIMITS.short_s:
        lacks.append(LENGTH)
    return lacks


def _several_rates(rate: FloatArray) -> bool:
    """Whether strokes differ much in how fast they are, by the way that was run in them or by their time.

    The same loops take less time at a higher rate, and run less of the way at a lower one. A stroke has one
    rate, though a sine has all from zero on.
    """
    moving = rate[np.abs(rate) > LIMITS.rate_edges[0]]
    if moving.size <= LIMITS.least_moving:
        return False
    stroke = np.cumsum(np.diff(np.sign(moving), prepend=np.sign(moving[0])) != 0)
    speed = np.abs(moving)
    of_stroke = (np.bincount(stroke, speed**2) / np.bincount(stroke, speed))[stroke]
    order = np.argsort(of_stroke, kind="stable")
    for weight in (speed[order], np.ones(speed.size)):
        share = np.cumsum(weight) / np.sum(weight)
        slow, fast = of_stroke[order[np.searchsorted(share, [LIMITS.slow_quantile, LIMITS.fast_quantile])]]
        if fast >= LIMITS.one_rate * slow:
            return True
    return False


def _holds(record: Record) -> bool:
    """Whether the input rests somewhere: stays within a small share of its range, or within its noise."""
    count = round(LIMITS.hold_s / record.step)
    if count >= record.input.size:
        return False
    least = max(count, 1)
    highest = scipy.ndimage.maximum_filter1d(record.input, least)
    lowest = scipy.ndimage.minimum_filter1d(record.input, least)
    inside = slice(least // 2, record.input.size - least // 2)
    reach = float(np.ptp(record.input))
    noise = input_noise.estimate(record.input)
    band = max(LIMITS.hold_within * reach, LIMITS.hold_noise * noise if np.isfinite(noise) else 0.0)
    return bool(np.any(highest[inside] - lowest[inside] <= band))


def wander(residual: FloatArray, measured: FloatArray) -> float:
    """Sum of squares of a residual (count,) that a gain and an offset of each tenth of the time take away.

    ``measured`` (count,) is the output. A static error, or one that follows the input, hardly has any.
    """
    pieces = zip(*(np.array_split(x, LIMITS.wander_pieces) for x in (residual, measured)), strict=True)
    found = 0.0
    for left, level in pieces:
        columns = np.linalg.qr(np.stack((np.ones(left.size), level - level.mean()), axis=1))[0]
        found += float(np.sum((columns.T @ left) ** 2))
    return found


def shortest(values: FloatArray, share: float) -> int:
    """Length of the shortest stretch of values (n,) that holds a share of their sum, to a hundredth of n."""
    total = np.concatenate(([0.0], np.cumsum(values)))
    for length in np.unique(np.linspace(1, values.size, LIMITS.stretches).astype(int)).tolist():
        if np.max(total[length:] - total[:-length]) >= share * total[-1]:
            return int(length)
    return values.size
