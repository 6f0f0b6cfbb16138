"""the input leaves the range that was identified: found on the raw data."""

from __future__ import annotations

from pulsetrainer.diagnosis.causes.base import Cause


class OutOfRange(Cause):
    """The input leaves the range that was identified; see ``gates``."""

    id = "out-of-range"
    title = "the input leaves the range that was identified"
    formula = "u outside the levels"
    signature = "samples beyond the model's first or last level"
    excitation = "any"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 4
    family = "out-of-range"
    lasting = False
