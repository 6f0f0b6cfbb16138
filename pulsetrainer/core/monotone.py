"""Where an operator with weights of either sign has an inverse: the input ranges with monotone branches.

Held within [a, b], an operator remembers nothing of what lies outside, and its branches there are those of
the triangle of cells with both thresholds in [a, b]. Where all of them rise, or all fall, the restricted
operator is one of polarity 1 or -1 with an exact inverse, although single weights may be negative.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.errors import ArgumentError


class Range(NamedTuple):
    """An input range in which the operator can be inverted, and the operator held within it."""

    operator: Preisach  # on the range; it starts after ``lead``
    # inputs to go through first: the low end of all, then the high and the low end of the range
    lead: tuple[float, float, float]


def invertible_range(whole: Preisach, tolerance: float) -> Range:
    """Return the range of the input over which the output moves most, all branches in it monotone.

    A branch may turn back by ``tolerance``, the error of the fit in the output unit, and still counts as
    monotone: there the inverse stays where it is until the branch goes on. ArgumentError if there is no
    range.
    """
    best, size = None, 0.0
    for sign in (1, -1):
        masses = sign * whole.masses
        grid = whole.plane.everett_grid(whole.plane.everett_nodes(masses))
        worst = _turning_back(2.0 * grid)
        for a, b in zip(*np.nonzero(worst <= tolerance), strict=True):
            if b - a >= 2 and grid[b, a] > size:
                best, size = (int(a), int(b), sign), float(grid[b, a])
    if best is None:
        raise ArgumentError(
            "no range of the input has monotone branches, so this model has no inverse",
            hint="fit the part of the range that you need",
        )
    a, b, sign = best
    edges = whole.plane.edges[a : b + 1]
    plane = Plane(edges)
    i, j = whole.plane.cell_indices
    inside = (i < b) & (j >= a)
    lead = (whole.low, float(edges[-1]), float(edges[0]))
    rest = float(whole(np.asarray(lead))[-1])
    raw = Preisach(plane, sign * whole.weights[inside], signed=True)
    offset = rest + sign * raw.total
    return Range(Preisach(plane, raw.weights, offset, polarity=sign, signed=True), lead)


def _turning_back(rises: FloatArray) -> FloatArray:
    """How far any branch within edges a .. b turns back, (n, n) over a and b; infinite where b <= a.

    ``rises`` (n, n) holds below its diagonal the rise of the output between edges column and row.
    """
    n = rises.shape[0]
    up = np.zeros((n, n))  # [k, l]: from edge k up to edge l
    down = np.zeros((n, n))  # [k, l]: from edge k down to edge l
    for k in range(n):
        branch = rises[k:, k]
        up[k, k:] = np.maximum.accumulate(np.maximum.accumulate(branch) - branch)
        branch = rises[k, k::-1]
        down[k, k::-1] = np.maximum.accumulate(np.maximum.accumulate(branch) - branch)
    # of all turns within a .. b: rising ones from a on, falling ones up to b
    worst_up = np.maximum.accumulate(up[::-1], axis=0)[::-1]
    worst_down = np.maximum.accumulate(down, axis=0).T
    a, b = np.indices((n, n))
    return np.where(b > a, np.maximum(worst_up, worst_down), np.inf)
