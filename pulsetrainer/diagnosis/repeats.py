"""Whether a cause repeats: whether it predicts whole pieces of the time that were left out of the fit."""

from __future__ import annotations

from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.thresholds import LIMITS


def repeats(held_out: HeldOut, before: Fitted, after: Fitted) -> bool:
    """Tell whether ``after`` predicts whole pieces of the time better than ``before``.

    The gain on pieces that were left out must be a good share of that of the fit, and on no piece may the
    error rise. A record too short to leave pieces out does not tell, and what is not told does not repeat.
    """
    first, second = held_out.pieces(before, LIMITS.pieces), held_out.pieces(after, LIMITS.pieces)
    if min(first.size, second.size) < LIMITS.pieces:
        return False
    gains, fit = first - second, before.squares - after.squares
    return bool(gains.sum() >= LIMITS.repeated * fit and gains.min() >= -LIMITS.piece_worse * fit)
