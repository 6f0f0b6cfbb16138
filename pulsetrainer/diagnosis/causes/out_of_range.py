"""the input leaves the identified range: found on the raw data."""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import BoolArray
from pulsetrainer.diagnosis.causes.base import OfTheRecord
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.raw import Firing, Raw

_SLACK = 0.01  # of the range: noise may carry an input this far beyond the end
_LEFT_OVER = 0.25  # of the samples with weight: a mask must leave at least this share


class OutOfRange(OfTheRecord):
    """The input leaves the identified range."""

    id = "out-of-range"
    title = "the {input} leaves the identified range"
    formula = "u outside the range of the model"
    signature = "samples beyond the model's first or last edge"
    excitation = "any"
    order = 5
    family = "out-of-range"
    size = "beyond the range of the model, at most"
    texts = sentences("""
        gate: the {input} leaves {low:.4g} .. {high:.4g}{in_u} in {count:.0f} of its samples, by up to
            {beyond:.3g}{in_u}
    """)

    def gate(self, raw: Raw) -> Firing | None:
        """Input beyond the range; what it leaves in the memory lasts until the other end is reached."""
        u, weight, slack = raw.record.input, raw.record.sample_weight, _SLACK * raw.reach
        above, below = u > raw.high + slack, u < raw.low - slack
        outside = above | below
        if not outside.any():
            return None
        beyond = float(np.max(np.maximum(raw.low - u, u - raw.high)))
        lasting = _lasting(above, u <= raw.low + slack) | _lasting(below, u >= raw.high - slack)
        # an input that never comes to the other end leaves hardly any: then what is outside must do
        mask = lasting if weight[~lasting].sum() > _LEFT_OVER * weight.sum() else outside
        count = float(np.count_nonzero(outside))
        figures = {"count": count, "low": raw.low, "high": raw.high, "beyond": beyond}
        return Firing(self.id, "gate", beyond, "{u}", figures, mask)


def _lasting(begins: BoolArray, ends: BoolArray) -> BoolArray:
    """From every sample that ``begins`` to the next that ``ends``, which is not in it."""
    number = np.arange(begins.size)
    last_begin = np.maximum.accumulate(np.where(begins, number, -1))
    last_end = np.maximum.accumulate(np.where(ends, number, -1))
    return np.asarray(last_begin > last_end)
