"""Which way a loop goes: an arrow on a stroke up and on a stroke down."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.report.fewer_points import path
from pulsetrainer.report.style import VERMILION

_WIGGLE = 0.05  # of the range of an input: smaller strokes are not looked at for an arrow
_ENDS = (0.44, 0.56)  # of a stroke: where an arrow begins and ends
_AS_LONG = 0.95  # of the longest stroke: of those the slowest has most points, so that its arrow lies on it


def directions(axes: Axes, x: FloatArray, y: FloatArray) -> None:
    """Draw an arrow on a longest stroke up of ``x`` (n,) and on a longest one down, with ``y`` (n,)."""
    kept = path(x, y)
    x, y = x[kept], y[kept]
    strokes = list(pairwise(turns(x)))
    for sign in (1.0, -1.0):
        lengths = [sign * (x[last] - x[first]) for first, last in strokes]
        longest = max(lengths, default=0.0)
        if not longest > 0.0:
            continue
        long = [ends for ends, length in zip(strokes, lengths, strict=True) if length >= _AS_LONG * longest]
        first, last = max(long, key=lambda ends: ends[1] - ends[0])
        way, height = sign * x[first : last + 1], y[first : last + 1]
        so_far = np.maximum.accumulate(way)
        tail, head = (int(np.searchsorted(so_far, way[0] + share * (way[-1] - way[0]))) for share in _ENDS)
        style = {"arrowstyle": "-|>", "color": VERMILION, "mutation_scale": 18.0, "linewidth": 1.5}
        axes.annotate(
            "", (sign * way[head], height[head]), (sign * way[tail], height[tail]), arrowprops=style, zorder=5
        )


def turns(x: FloatArray) -> list[int]:
    """Return where ``x`` (n,) turns, its ends too; wiggles smaller than a share of its range are none."""
    width = _WIGGLE * float(np.ptp(x))
    found, extreme, way = [0], 0, 0.0
    for k, value in enumerate(x.tolist()):
        back = value - x[extreme]
        if way == 0.0 and abs(back) > width:
            way, extreme = float(np.sign(back)), k
        elif way and back * way >= 0.0:
            extreme = k
        elif way and abs(back) > width:
            found.append(extreme)
            way, extreme = -way, k
    return [*found, extreme]
