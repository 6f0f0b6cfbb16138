"""Whether all branches of a loop pass through one point within it, as those of a memristor do at zero.

A resistor with a memory, y = G(w) u with a state w of its own, has no output where it has no input, whatever
its state. The loops of a Preisach operator are widest inside the range. Its weights close a loop only at an
end of the range, or at a gap without any hysteresis (and then the weights describe the record). A butterfly
crosses itself too, but there one branch rises where the other falls.
"""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.thresholds import LIMITS


def pinched_at(level: FloatArray, output: FloatArray, noise: float) -> float | None:
    """Return the input within the range through which all branches pass at one output; None: there is none.

    ``level`` (n,) is the input in units of its range, ``noise`` the rms noise of the output's samples.
    """
    number = np.clip((level * LIMITS.pinch_groups).astype(np.int64), 0, LIMITS.pinch_groups - 1)
    width = np.zeros(LIMITS.pinch_groups)
    for k in np.unique(number):
        own = number == k
        u, y = level[own] - level[own].mean(), output[own] - output[own].mean()
        slope = float(u @ y) / max(float(u @ u), LIMITS.rounding)
        width[k] = np.sqrt(max(float(np.mean((y - slope * u) ** 2)) - noise**2, 0.0))
    told = np.bincount(number, minlength=width.size) >= LIMITS.least_moving
    beside = np.minimum(np.maximum.accumulate(width), np.maximum.accumulate(width[::-1])[::-1])
    inside = np.arange(width.size) + 0.5  # at the tips every loop closes
    told &= np.minimum(inside, width.size - inside) > LIMITS.pinch_inside * width.size
    wide = told & (beside > LIMITS.pinch_beside * float(np.ptp(output)))
    ratio = np.where(wide, width / np.maximum(beside, LIMITS.rounding), 1.0)
    k = int(np.argmin(ratio))
    return (k + 0.5) / LIMITS.pinch_groups if ratio[k] < LIMITS.pinch else None


def crosses(level: FloatArray, output: FloatArray, at: float | None) -> bool:
    """Whether near an input the output (n,) rises with it one way and falls the other, as a butterfly."""
    if at is None:
        return False
    near, way = np.abs(level - at) < LIMITS.pinch_near / LIMITS.pinch_groups, np.gradient(level)
    slopes = [
        float(np.cov(level[own], output[own])[0, 1])
        for own in (near & (way > 0), near & (way < 0))
        if np.count_nonzero(own) >= LIMITS.least_moving
    ]
    return min(slopes, default=0.0) < 0.0 < max(slopes, default=0.0)
