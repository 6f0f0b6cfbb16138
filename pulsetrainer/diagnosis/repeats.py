"""Whether a cause repeats, that is, predicts whole pieces of time that were left out of the fit."""

from __future__ import annotations

import numpy as np

from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.thresholds import LIMITS


def repeats(held_out: HeldOut, before: Fitted, after: Fitted) -> bool:
    """Tell whether ``after`` predicts whole pieces of the time better than ``before``."""
    return repeated(held_out, before, after) >= LIMITS.repeated


def repeated(held_out: HeldOut, before: Fitted, after: Fitted) -> float:
    """Return the share of the gain of the fit that is found on whole pieces of the time that were left out.

    It is 0 where the error rises on any piece, or at any rates told from the others. A record too short to
    leave pieces out does not tell, and what is not told does not repeat.
    """
    first, second = held_out.pieces(before, LIMITS.pieces), held_out.pieces(after, LIMITS.pieces)
    if min(first.size, second.size) < LIMITS.pieces:
        return 0.0
    gains, fit = first - second, before.squares - after.squares
    first_at, second_at = held_out.rates(before, LIMITS.rates), held_out.rates(after, LIMITS.rates)
    told = min(first_at.size, second_at.size)  # a part that the larger model cannot do without tells nothing
    if min(gains.min(), (first_at[:told] - second_at[:told]).min(initial=np.inf)) < -LIMITS.piece_worse * fit:
        return 0.0
    return float(gains.sum() / fit) if fit > 0 else 0.0
