"""the output comes in coarse steps: found on the raw data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.core.censored import between_steps
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import OfTheRecord, Taken, Values
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.raw import Firing, Raw, spacing_of, values_of
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.floor import Floor

_COARSE = 0.004  # of the span: finer steps harm no fit
_USED = 2  # times that each value occurs, on average: in a short record all values may differ without steps
_MOST = (0.05, 0.95)  # quantiles of the steps between values: half their difference is the spread


class Quantisation(OfTheRecord):
    """The output comes in coarse steps."""

    id = "quantisation"
    title = "the {output} comes in coarse steps"
    formula = "q round(y / q)"
    signature = "the distinct values are evenly spaced"
    excitation = "slow ramps"
    order = 2
    family = "quantisation"
    jagged = True
    corrects = True
    leaves = ("saturation", "stick-slip")
    size = "of one step of the {output}"
    texts = sentences("""
        gate: the output changes in steps of {step:.4g}{in_y}, {percent:.2g} % of its span
        background: steps of {size:.4g}{in_y}, which the noise averages out: reported, but not a verdict
    """)

    def gate(self, raw: Raw) -> Firing | None:
        """Distinct values that are far apart, and come again."""
        y = raw.record.output
        step, span = spacing_of(y), float(np.ptp(y))
        values = values_of(y)
        coarse = _COARSE * span <= step < LIMITS.state * span
        if not coarse or _USED * values.size > y.size:
            return None
        figures = {"step": step, "percent": PERCENT * step / span}
        spread = 0.5 * float(np.ptp(np.quantile(np.diff(values), _MOST)))
        return Firing(self.id, "gate", step, "{y}", figures, spread=spread)

    def is_background(self, sizes: Sequence[float], floor: Floor) -> bool:
        """Return whether noise carries the output over its steps, so that they average out."""
        return sizes[0] <= LIMITS.coarse_noise * floor.single

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) between the steps, where the hysteresis that fits them best expects it."""
        return np.where(np.isfinite(y), between_steps(*taken.known(y), values[0]), np.nan)
