"""Turns of the input that fall between two samples.

A triangle wave turns at any moment. The samples on both sides of it miss its tip by up to half a step, the
memory keeps the tip, and the output of the whole way back tells of it. Where the input runs straight up to a
turn and straight on from it, the tip is where the two lines meet. An input that is made of steps, one a
sample, has its tips at samples. A record tells which: its ends, reached again and again, lie at one value.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, finite_vector

_ROUNDING = 1e-6  # of a step: tips so near to a sample lie at it
_AGAIN = 3  # turns at one end of the record tell whether they lie at samples
_STRAIGHT = 0.2  # of the rate beside a turn: by more than this the rate before it must not differ


def reached(values: ArrayLike, time_s: FloatArray | None = None) -> FloatArray:
    """Return the input (n,) with each sharp turn at the point where the lines on both sides meet.

        u*(t) = u_a + r_a (t - t_a) = u_b - r_b (t_b - t)

    with t between the two samples a and b = a + 1, r_a the rate up to the first and r_b that from the second
    on. The extreme sample gets the value u* where the rates before and after change by less than a fifth in
    one step, so that rounded turns stay as they are. All stay where those at the ends of the record agree
    better as they were sampled.

    Parameters
    ----------
    time_s
        Times of the samples (n,); None: even steps.

    Raises
    ------
    ArgumentError
        The input is no finite vector.
    """
    u = finite_vector("input", values)
    t = np.arange(float(u.size)) if time_s is None else time_s
    found = u.copy()
    if u.size < 6:
        return found
    rate = np.diff(u) / np.diff(t)
    a = np.arange(2, u.size - 3)  # the tip lies between this sample and the next
    before, after = rate[a - 1], rate[a + 1]
    turns = (before * after < 0) & (u[a] != u[a + 1])
    straight = (np.abs(before - rate[a - 2]) < _STRAIGHT * np.abs(before)) & (
        np.abs(rate[a + 2] - after) < _STRAIGHT * np.abs(after)
    )
    a, before, after = (one[turns & straight] for one in (a, before, after))
    since = (u[a + 1] - u[a] - after * (t[a + 1] - t[a])) / (before - after)
    between = t[a + 1] - t[a]
    inside = (since >= -_ROUNDING * between) & (since <= (1.0 + _ROUNDING) * between)
    a, before, after, since = (one[inside] for one in (a, before, after, since))
    tip, rising = u[a] + before * since, before > 0
    extreme = np.where((u[a] > u[a + 1]) == rising, a, a + 1)
    step = np.maximum(np.abs(before), np.abs(after)) * (t[a + 1] - t[a])
    ends = [_at_the_end(np.where(rising, tip, -tip), step, side) for side in (rising, ~rising)]
    told = [own for own in ends if own.size >= _AGAIN]
    if told and _scatter(u[extreme], told) <= _scatter(tip, told):
        return found
    # beside a tip the line through it is bent, and meets the next one nearer to the sample
    order = np.argsort(np.abs(tip - u[extreme]), kind="stable")
    found[extreme[order]] = tip[order]
    return found


def _at_the_end(outward: FloatArray, step: FloatArray, side: BoolArray) -> IntArray:
    """Return which turns of one side (k,) lie within one of their steps of the outermost."""
    own = np.flatnonzero(side)
    return own[outward[own] > np.max(outward[own], initial=-np.inf) - step[own]]


def _scatter(values: FloatArray, groups: Sequence[IntArray]) -> float:
    """Sum of distances of values (k,) from the median of each group: some turns of it are meant elsewhere."""
    return sum(float(np.sum(np.abs(values[own] - np.median(values[own])))) for own in groups)
