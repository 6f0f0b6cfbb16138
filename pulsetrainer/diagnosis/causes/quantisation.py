"""the output comes in coarse steps: found on the raw data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.raw import Firing, Raw, spacing_of
from pulsetrainer.diagnosis.thresholds import PERCENT

_COARSE = 0.004  # of the span: finer steps hurt no fit
_USED = 2  # times that each value comes, on average: in a short record all may differ, far apart as they are
_MOST = (0.05, 0.95)  # quantiles of the steps: twice their spread is that of the step


class Quantisation(Cause):
    """The output comes in coarse steps."""

    id = "quantisation"
    title = "the {output} comes in coarse steps"
    formula = "q round(y / q)"
    signature = "the distinct values are evenly spaced"
    excitation = "slow ramps"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 2
    family = "quantisation"
    lasting = False
    jagged = True
    texts: ClassVar[Mapping[str, str]] = {
        "gate": "the output changes in steps of {step:.4g}, {percent:.2g} % of its span"
    }

    def gate(self, raw: Raw) -> Firing | None:
        """Distinct values that are far apart, and come again."""
        y = raw.record.output
        step, span = spacing_of(y), float(np.ptp(y))
        values = np.unique(y)
        if span == 0 or step < _COARSE * span or _USED * values.size > y.size:
            return None
        figures = {"step": step, "percent": PERCENT * step / span}
        spread = 0.5 * float(np.ptp(np.quantile(np.diff(values), _MOST)))
        return Firing(self.id, "gate", step, "{y}", figures, spread=spread)
