"""the output is cut off by its range: found on the raw data."""

from __future__ import annotations

from pulsetrainer.diagnosis.causes.base import Cause


class Saturation(Cause):
    """The output is cut off by its range; see ``gates``."""

    id = "saturation"
    title = "the output is cut off by its range"
    formula = "min(y, y_max)"
    signature = "exactly repeated maxima, on one side"
    excitation = "the whole range"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 0
    family = "saturation"
    lasting = False
