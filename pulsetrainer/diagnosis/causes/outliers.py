"""single samples are wrong: found on the raw data."""

from __future__ import annotations

from pulsetrainer.diagnosis.causes.base import Cause


class Outliers(Cause):
    """Single samples are wrong; see ``gates``."""

    id = "outliers"
    title = "single samples are wrong"
    formula = "y + wild error"
    signature = "isolated samples far from both neighbours"
    excitation = "any"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 2
    family = "outliers"
    lasting = False
