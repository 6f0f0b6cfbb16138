"""the driver does not deliver the reference: found on the raw data."""

from __future__ import annotations

from pulsetrainer.diagnosis.causes.base import Cause


class CurrentTracking(Cause):
    """The driver does not deliver the reference; see ``gates``."""

    id = "current-tracking"
    title = "the driver does not deliver the reference"
    formula = "u - reference"
    signature = "input and reference differ by more than their noise"
    excitation = "a recorded reference"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 3
    family = "current-tracking"
    lasting = False
