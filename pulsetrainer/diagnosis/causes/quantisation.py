"""the output comes in coarse steps: found on the raw data."""

from __future__ import annotations

from pulsetrainer.diagnosis.causes.base import Cause


class Quantisation(Cause):
    """The output comes in coarse steps; see ``gates``."""

    id = "quantisation"
    title = "the output comes in coarse steps"
    formula = "q round(y / q)"
    signature = "the distinct values are evenly spaced"
    excitation = "slow ramps"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 1
    family = "quantisation"
    lasting = False
