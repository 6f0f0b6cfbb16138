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


def directions(axes: Axes, x: FloatArray, y: FloatArray) -> None:
    """Draw an arrow on the longest stroke up of ``x`` (n,) and on the longest one down, with ``y`` (n,)."""
    kept = path(x, y)
    x, y = x[kept], y[kept]
    strokes = list(pairwise(turns(x)))
    for sign in (1.0, -1.0):
        longest = max(strokes, key=lambda ends: sign * (x[ends[1]] - x[ends[0]]), default=(0, 0))
        stroke = slice(longest[0], longest[1] + 1)
        way, height = sign * x[stroke], y[stroke]
        if not way[-1] > way[0]:
            continue
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
