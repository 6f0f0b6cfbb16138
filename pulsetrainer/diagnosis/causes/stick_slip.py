"""The output sticks, then jumps: found on the raw data.

Where the output is stuck follows from the exact moment of the last jump, so that no model of the jumps can
be fitted sample by sample; what repeats is their size.
"""

from __future__ import annotations

from pulsetrainer.diagnosis.causes.base import Cause


class StickSlip(Cause):
    """Flat runs and jumps of one size; see ``gates``."""

    id = "stick-slip"
    title = "the output sticks, then jumps"
    formula = "y is held until |P[u] - y| > F, then jumps"
    signature = "flat runs and then jumps of about equal size while the input moves slowly"
    excitation = "slow ramps"
    source = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30, 1994"
    stage = "record"
    order = 5
    family = "stick-slip"
    lasting = False
