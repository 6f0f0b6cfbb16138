"""The dual and the signed form of the static model in a diagnosis.

Direct and signed weights enter the output linearly, so they are refitted beside every cause. Those of the
dual form do not: y = P^-1[u]. There the model as given stays, with a signed operator Q beside it. Q stands
for the change that another choice of the weights would make; it is small, so that to first order the two are
the same:

    y = P^-1[u] + Q[u]

Once the causes are known, the static part of every form is identified again, from the output that the
hysteresis alone would have given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.core import input_noise
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.fit import Fitted as StaticFit
from pulsetrainer.core.fit import fit
from pulsetrainer.core.forms import Form
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import BoolArray, FloatArray, Plane
from pulsetrainer.diagnosis.extended import Term, seen_input
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.diagnosis.problem import Static
from pulsetrainer.diagnosis.scale import Scale


def base_of(model: Model, scale: Scale) -> Static | None:
    """Return the static operator that weights only correct, in the units of ``scale``; None: they are all."""
    if model.form != "dual":
        return None
    operator = operator_of(model)

    def base(u: FloatArray) -> FloatArray:
        # an input cause may lead a little beyond the range, where the operator ends
        seen = np.clip(scale.inputs(u), operator.low, operator.high)
        return (model.polarity * operator(seen) - scale.zero) / scale.span

    return base


def static_behind(
    found: Fitted, known: Sequence[Term], model: Model, scale: Scale, *, levels: Plane | None = None
) -> StaticFit:
    """Return the static part of a model in the form of ``model``, fitted to what causes leave of the records.

    It is identified as any model is, with its own smoothing and polarity, and its own levels where none are
    given, in the units of the record.
    What causes that are not ``known`` (properties of the device, and faults of the measurement that can be
    taken out of a record) did to the records is taken out but for its mean: where the zero will be on another
    day nobody knows, and its mean is the best guess.
    """
    problem, terms = found.problem, found.terms
    signals, kept = [], []
    for record, frame, inner, shown, kept_by in zip(
        problem.records,
        problem.frames,
        found.simulator.inner(terms),
        found.simulator.full(terms),
        found.simulator.full(known),
        strict=True,
    ):
        u = input_noise.clean(scale.inputs(seen_input(terms, record.output, frame))).input
        passing = float(np.mean(shown - kept_by))
        y = model.polarity * scale.outputs(record.output - (shown - inner) + passing)
        signals.append((u, y))
        kept.append(record.counts)
    operator, form = operator_of(model), cast("Form", model.form)
    return fit(signals, operator.low, operator.high, model.levels, form=form, kept=kept, levels=levels)


def levels_of(model: Model) -> Plane:
    """Return the plane on which the weights of a model lie."""
    given = operator_of(model)
    return given.inner.plane if isinstance(given, Dual) else given.plane


def completed(
    found: Preisach,
    covered: BoolArray,
    model: Model,
    inputs: Sequence[FloatArray],
    counts: Sequence[BoolArray],
) -> tuple[Preisach, BoolArray]:
    """Return a static part with the cells of a model where inputs (n,) never ``covered`` it (q,), and those.

    Both lie on the levels of the model. Where the inputs count (n,) those cells hardly change, so they only
    shift the output, which the offset undoes.
    """
    both = replace(found, weights=np.where(covered, found.weights, model.weights))
    apart = [(found(u) - both(u))[one] for u, one in zip(inputs, counts, strict=True)]
    shift = float(np.mean(np.concatenate(apart)))
    return replace(both, offset=both.offset + shift), covered | model.covered
