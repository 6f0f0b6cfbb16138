"""the driver does not follow its reference: found on the raw data."""

from __future__ import annotations

import numpy as np

from pulsetrainer.diagnosis.causes.base import OfTheRecord
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.raw import Firing, Raw

_SHARE = 0.02  # of the input's range: a driver with a smaller error is good enough
_WORST = 0.99  # quantile of the error: an error shorter than a hundredth of the record belongs to turns


class CurrentTracking(OfTheRecord):
    """The driver does not follow its reference."""

    id = "current-tracking"
    title = "the driver does not follow its reference"
    formula = "u - reference"
    signature = "input and reference differ by more than their noise"
    excitation = "a recorded reference"
    order = 4
    family = "current-tracking"
    blinded_by = ("clipped-input",)  # what its recorder does not see is no fault of the driver
    size = "from the {input} to its reference; one sample in a hundred is further off"
    texts = sentences(
        "gate: one sample in a hundred of the input is {worst:.3g}{in_u} or more away from its reference"
    )

    def gate(self, raw: Raw) -> Firing | None:
        """Input and reference apart by more than a share of the range."""
        if raw.record.reference is None:
            return None
        error = np.abs(raw.record.input - raw.record.reference)
        worst = float(np.quantile(error, _WORST))
        if worst <= _SHARE * raw.reach:
            return None
        return Firing(self.id, "gate", worst, "{u}", {"worst": worst})
