"""Intervals: how sure the parameters are, in 95 of 100.

The spread of each parameter is the larger of two: that of joint refits, linearised, on redrawn noise (a
parametric bootstrap), and that of leaving out each tenth of the record in turn (a jackknife over blocks),
which also sees what the fitted model misses. Three errors are added to it, as independent ones:

- the error of the levels, as if a fifth of it were aligned with the parameter;
- the effect of a fifth of a sample step, since input and output are not read at the same moment: each has its
  filter, and converters are read in turn;
- how far other formulas, as plausible as those of the library, move the estimate (``Cause.variants``,
  ``Cause.alternatives``).

The interval of the moment of a sudden change holds all moments that fit as well (``moments``). A cause that
equal loops show has the interval of those loops.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.extended import Term, shown_output
from pulsetrainer.diagnosis.finding import Estimate
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.moments import profile
from pulsetrainer.diagnosis.screening import Screen
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY


def stage(state: State) -> State:
    """Return the state with 95 % intervals of all parameters."""
    known = estimates_of(state.current, state.scores, state.held_out, state.floor)
    return replace(state, estimates=state.in_its_units(known))


def estimates_of(
    fitted: Fitted, noise: Screen, held_out: HeldOut, floor: Floor
) -> dict[str, tuple[Estimate, ...]]:
    """Parameters of every cause in the model with their intervals."""
    columns = fitted.projector(fitted.slopes)
    if columns.shape[1] == 0:
        return {}
    size = np.maximum(np.linalg.norm(columns, axis=0), TINY)
    with np.errstate(over="ignore", invalid="ignore"):  # a parameter that changes nothing lies anywhere
        turned = np.linalg.pinv(columns / size) / size[:, None]
        assert noise.noise is not None
        variance = np.diagonal(noise.noise.covariance(fitted.projector(turned.T)))
        left_out = held_out.jackknife(fitted)
        if left_out is not None:
            variance = np.maximum(variance, left_out)
        others = np.stack([_late(fitted), *_otherwise(fitted)], axis=1)
        systematic = np.linalg.norm(np.linalg.lstsq(columns / size, others, rcond=None)[0], axis=1) / size
        aligned = LIMITS.aligned * floor.discretisation * np.sqrt(floor.count) / size
        half = np.sqrt(LIMITS.student**2 * variance + aligned**2 + systematic**2)
    found: dict[str, tuple[Estimate, ...]] = {}
    frame, at = fitted.problem.frames[0], 0
    for term in fitted.terms:
        rows = []
        for quantity, value in zip(term.cause.quantities(frame), term.values, strict=True):
            low, high = max(value - half[at], quantity.low), min(value + half[at], quantity.high)
            rows.append(Estimate(quantity.name, value, quantity.unit, float(low), float(high)))
            at += 1
        if term.cause.sudden:
            low, high = profile(fitted, term).interval(noise.noise, floor)
            low, high = min(low, term.values[-1]), max(high, term.values[-1])
            wide = frame.dt_s  # it lies anywhere between two samples
            rows[-1] = replace(rows[-1], lower=low - wide, upper=high + wide)
        found[term.cause.id] = tuple(rows)
    return found


def _late(fitted: Fitted) -> FloatArray:
    """What a slightly later sample of the output would change (count,), weights projected off."""
    changes = [LIMITS.moment * np.gradient(y) for y in fitted.simulator.full(fitted.terms)]
    return fitted.projector(fitted.design.bins.average(changes)[:, None])[:, 0]


def _otherwise(fitted: Fitted) -> list[FloatArray]:
    """What other plausible formulas of the causes would change (count,), weights projected off."""
    inner, frames = fitted.simulator.inner(fitted.terms), fitted.simulator.frames
    found = []
    for k, term in enumerate(fitted.terms):
        for cause in term.cause.alternatives():
            terms = (*fitted.terms[:k], Term(cause, term.values), *fitted.terms[k + 1 :])
            both = zip(fitted.simulator.full(terms), fitted.simulator.full(fitted.terms), strict=True)
            changes = fitted.design.bins.average([other - own for other, own in both])
            found.append(fitted.projector(changes[:, None])[:, 0])
        if term.cause.stage != "output":
            continue
        before = [shown_output(fitted.terms[:k], y, frame) for y, frame in zip(inner, frames, strict=True)]
        each = [
            [other - term.cause.on_output(y, term.values, frame) for other in others]
            for y, frame in zip(before, frames, strict=True)
            for others in [term.cause.variants(y, term.values, frame)]
        ]
        columns = [fitted.design.bins.average(list(one)) for one in zip(*each, strict=True)]
        found += [fitted.projector(column[:, None])[:, 0] for column in columns]
    return found
