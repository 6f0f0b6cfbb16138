"""Records of one input: whether what is left comes again, or differs from record to record.

The model predicts the same for the same input, so what is left of two such records differs by what their
outputs differ by. With r1 and r2 what is left of them, without its means, and s the noise,

    share = <r1 r2> / (<r1^2 + r2^2> / 2 - s^2)

is the part of it that comes again. It is the device's, which the model cannot follow; the rest comes from
something that was not recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT, TINY

AGAIN, DIFFERS = "comes again", "differs"


def told(state: State) -> list[Evidence]:
    """Return what the two records whose inputs are most alike say of what is left, or nothing.

    What is in doubt is left, too.
    """
    if len(state.problem.records) == 1 or state.question.quick or not state.believed.unexplained:
        return []
    state = state.believed
    same = [pair for pair in _pairs(state) if pair[0] <= LIMITS.same_input]
    if not same:
        return []
    _, one, other = min(same, key=lambda pair: pair[0])
    share = min(max(common(one, other, state.floor.quick.white), 0.0), 1.0)
    if share >= LIMITS.comes_again:
        return [Evidence(AGAIN, figures={"share": PERCENT * share})]
    return [Evidence(DIFFERS, figures={"share": PERCENT * (1.0 - share)})] if share < LIMITS.half else []


def _pairs(state: State) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Yield of every two records, laid over each other, how far their inputs are apart, and what is left."""
    bins = state.problem.bins
    inputs = bins.average([record.input for record in state.problem.records])
    of_all = (inputs, state.current.residual, np.ones(bins.count))
    for one, other in combinations(range(len(bins.number)), 2):
        u1, left1, there1 = (bins.even(values, one) for values in of_all)
        u2, left2, there2 = (bins.even(values, other) for values in of_all)
        first, second = _aligned(u1, u2)
        both = (there1[first] > 0) & (there2[second] > 0)
        if np.count_nonzero(both) >= LIMITS.half * max(u1.size, u2.size):
            apart = root_mean_square((u1[first] - u2[second])[both])
            yield apart, left1[first][both], left2[second][both]


def common(first: FloatArray, second: FloatArray, noise: float) -> float:
    """Return the share of two residuals (m,) that is the same in both, of what is more than noise (rms)."""
    one, other = first - first.mean(), second - second.mean()
    each = 0.5 * float(np.mean(one**2 + other**2)) - noise**2
    return float(np.mean(one * other)) / max(each, TINY)


def _aligned(first: FloatArray, second: FloatArray) -> tuple[slice, slice]:
    """Return the parts of two signals that lie over each other where these move most alike."""
    size = first.size + second.size - 1
    one, other = np.diff(first, append=first[-1]), np.diff(second, append=second[-1])
    across = scipy.fft.irfft(scipy.fft.rfft(one, size) * np.conj(scipy.fft.rfft(other, size)), size)
    lag = int(np.argmax(across))
    lag -= size if lag >= first.size else 0
    count = min(first.size - max(lag, 0), second.size - max(-lag, 0))
    return slice(max(lag, 0), max(lag, 0) + count), slice(max(-lag, 0), max(-lag, 0) + count)
