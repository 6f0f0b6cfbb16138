"""Turns of the input that fall between two samples.

A triangle wave turns at any moment. The samples on both sides of it miss its tip by up to half a step, the
memory keeps the tip, and the output of the whole way back tells of it. Where the input runs straight up to a
turn and straight on from it, the tip is where the two lines meet. An input that is made of steps, one a
sample, has its tips at samples. Which of the two it is, the ends of the record tell, which are reached again
and again, and the output. A device that remembers its output keeps no tips of its input.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.core.input_noise import clean
from pulsetrainer.core.memory import turning_points
from pulsetrainer.core.plane import BoolArray, FloatArray, ends_of, finite_vector
from pulsetrainer.core.wild import fits_better, left_by_a_quick_fit

_AGAIN = 3  # turns within one step of an end of the record: they are meant to end there
_SAME = 0.02  # of a step
_STRAIGHT = 0.2  # of the rate beside a turn: by more than this the rate before it must not differ


def reached(values: ArrayLike, time_s: FloatArray | None = None) -> FloatArray:
    """Return the input (n,) with each sharp turn at the point where the lines on both sides meet.

        u*(t) = u_a + r_a (t - t_a) = u_b - r_b (t_b - t)

    with t between the two samples a and b = a + 1, r_a the rate up to the first and r_b that from the second
    on. The extreme sample gets the value u* where the rates before and after change by less than a fifth in
    one step, so that rounded turns stay as they are. Without ``time_s`` (n,) the steps are even.
    ArgumentError if the input is no finite vector.
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
    inside = (since >= 0) & (since <= t[a + 1] - t[a])
    a, before, since = (one[inside] for one in (a, before, since))
    tip, rising = u[a] + before * since, before > 0
    extreme = np.where((u[a] > u[a + 1]) == rising, a, a + 1)
    # beside a tip the line through it is bent, and meets the next one nearer to the sample
    order = np.argsort(np.abs(tip - u[extreme]), kind="stable")
    found[extreme[order]] = tip[order]
    return found


def at_their_tips(
    signals: Sequence[tuple[FloatArray, FloatArray]],
    times: Sequence[FloatArray | None],
    kept: Sequence[BoolArray],
) -> list[FloatArray]:
    """Return the inputs of some records (n,) with their turns as ``reached``, where the records say so.

    A device that is driven sample by sample never sees tips between samples: then the turns at an end of the
    record agree better as they were measured, and the inputs as they were measured leave less of the outputs.

    ``signals`` are input and output of each record, both (n,); a record without ``times`` (n,) stays as it
    is. Outputs count in the ``kept`` samples (n,).
    """
    measured = [u for u, _ in signals]
    tips = [u if t is None else reached(u, t) for u, t in zip(measured, times, strict=True)]
    tips = [u if _ends_lie_at_samples(u, tip) else tip for u, tip in zip(measured, tips, strict=True)]
    if all(map(np.array_equal, tips, measured)):
        return measured
    if not any(own.any() for own in kept):
        return tips
    lost = [(np.zeros(own.size, dtype=bool), ~own) for own in kept]
    if not fits_better(signals, tips, lost) or _remembers_its_output(signals, kept):
        return measured
    return tips


def _remembers_its_output(
    signals: Sequence[tuple[FloatArray, FloatArray]], kept: Sequence[BoolArray]
) -> bool:
    """Whether the inputs (n,) follow from the outputs (n,) better than the outputs from the inputs.

    Each side is measured by its own span. As an input, the output would be remembered with its noise.
    """
    lost = [~own for own in kept]
    swapped = [(clean(y).input, u) for u, y in signals]
    return left_by_a_quick_fit(swapped, lost) / _span([u for u, _ in signals]) < left_by_a_quick_fit(
        signals, lost
    ) / _span([y for _, y in signals])


def _span(signals: Sequence[FloatArray]) -> float:
    """Return the range of some signals together; infinity where they never move."""
    low, high = ends_of(signals)
    return high - low or float("inf")


def _ends_lie_at_samples(u: FloatArray, tips: FloatArray) -> bool:
    """Whether most turns at the ends of an input (n,) lie at one value as measured, fewer at their tips."""
    turns = turning_points(u)[:-1]
    step = np.maximum(np.abs(u[turns] - u[turns - 1]), np.abs(u[turns + 1] - u[turns]))
    near = [turns[u[turns] > u.max() - step], turns[u[turns] < u.min() + step]]
    told = [own for own in near if own.size >= _AGAIN]
    measured, moved = (sum(_alike(one[own], float(np.median(step))) for own in told) for one in (u, tips))
    return measured > moved and measured > 0.5 * sum(own.size for own in told)


def _alike(values: FloatArray, step: float) -> int:
    """How many of the values (k,) are the same, within a small share of a step."""
    return int(np.count_nonzero(np.abs(values - np.median(values)) < _SAME * step))
