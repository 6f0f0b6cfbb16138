"""Which way a loop runs, from the major loop of a fitted operator; ``report.facts`` puts it in words."""

from __future__ import annotations

from typing import Literal

import numpy as np

from pulsetrainer.core.dual import Dual
from pulsetrainer.core.operator import Preisach

Loop = Literal["counterclockwise", "clockwise", "butterfly", "none"]

OPEN = 0.002  # of the output's span: a loop that is nowhere wider is none
_MIRRORED = {"counterclockwise": "clockwise", "clockwise": "counterclockwise"}
CROSSED = 0.05  # of the loop's area: what runs the other way and is less is no crossing
_POINTS = 257


def loop_of(operator: Preisach | Dual, doubt: float = 0.0) -> Loop:
    """Return the direction of the major loop, of a falling output that of its mirror image.

    Counterclockwise: the output lags, it is higher on the way down. Clockwise: the output leads. Butterfly:
    both, the loop crosses itself. A loop that is nowhere wider than ``doubt``, the rms error of the fit in
    the output unit, is none.
    """
    up = np.linspace(operator.low, operator.high, _POINTS)
    y = operator(np.concatenate((up, up[::-1])))
    rising, falling = y[:_POINTS], y[_POINTS:][::-1]
    wide = operator.polarity * (falling - rising)
    if np.abs(wide).max() <= max(OPEN * float(np.ptp(y)), doubt):
        return "none"
    lags, leads = float(np.maximum(wide, 0.0).sum()), float(np.maximum(-wide, 0.0).sum())
    if leads <= CROSSED * (lags + leads):
        return "counterclockwise"
    return "clockwise" if lags <= CROSSED * (lags + leads) else "butterfly"


def drawn(loop: str, polarity: int) -> str:
    """Return which way a loop runs in a drawing; ``loop_of`` tells it of a rising output."""
    return _MIRRORED.get(loop, loop) if polarity < 0 else loop
