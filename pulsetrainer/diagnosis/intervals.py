"""How sure the parameters of the causes found are: 95 % intervals.

The spread is the larger of two: of the joint refit, linearised, on redrawn noise (a parametric bootstrap);
and of the jackknife over blocks, which also sees what the fitted model misses. To it comes the
discretisation error, as if a fifth of it were aligned, and the moment of sampling: input and output are
taken to belong together to a tenth of a sample step, as converters that are read in turn do.
"""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.answer import Estimate
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.screening import Screen

_STUDENT = 2.26  # 95 % of Student's t with nine degrees of freedom, of ten jackknife blocks
_ALIGNED = 0.2
_MOMENT = 0.1  # sample steps


def estimates_of(
    fitted: Fitted, noise: Screen, held_out: HeldOut, floor: Floor
) -> dict[str, tuple[Estimate, ...]]:
    """Parameters of every cause in the model with their intervals."""
    columns = fitted.projector(fitted.slopes)
    if columns.shape[1] == 0:
        return {}
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    drawn = np.linalg.lstsq(columns / size, noise.draws, rcond=None)[0] / size[:, None]
    variance = np.var(drawn, axis=1)
    left_out = held_out.jackknife(fitted)
    if left_out is not None:
        variance = np.maximum(variance, left_out)
    moment = np.abs(np.linalg.lstsq(columns / size, _late(fitted), rcond=None)[0]) / size
    aligned = _ALIGNED * floor.discretisation * np.sqrt(floor.count) / size
    half = _STUDENT * np.sqrt(variance) + aligned + moment
    found: dict[str, tuple[Estimate, ...]] = {}
    at = 0
    for term in fitted.terms:
        rows = []
        for quantity, value in zip(term.cause.parameters, term.values, strict=True):
            low, high = max(value - half[at], quantity.low), min(value + half[at], quantity.high)
            rows.append(Estimate(quantity.name, value, quantity.unit, float(low), float(high)))
            at += 1
        found[term.cause.id] = tuple(rows)
    return found


def _late(fitted: Fitted) -> FloatArray:
    """What a slightly later sample of the output would change (count,), weights projected off."""
    changes = [_MOMENT * np.gradient(y) for y in fitted.simulator.full(fitted.terms)]
    return fitted.projector(fitted.design.bins.average(changes)[:, None])[:, 0]
