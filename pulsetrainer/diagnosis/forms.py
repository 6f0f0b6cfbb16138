"""The dual and the signed form of the static model in a diagnosis.

Direct and signed weights enter the output linearly, so they are refitted beside every cause. Those of the
dual form do not: y = P^-1[u]. There the model as given stays, and what another choice of its weights would
change is a signed operator beside it, small enough that the two are the same to first order:

    y = P^-1[u] + Q[u]

Once the causes are known, P itself is fitted again, to what the hysteresis alone would have given.
"""

from __future__ import annotations

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.core.fit import fit
from pulsetrainer.core.identification import Smoothing
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.extended import seen_input
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


def dual_behind(found: Fitted, model: Model, scale: Scale) -> Preisach:
    """Return P of y = P^-1[u], fitted to what the causes of a fit leave of its records.

    It is in the units of the record and of the polarity of the model.
    """
    problem, terms = found.problem, found.terms
    signals, kept = [], []
    for record, frame, inner, shown in zip(
        problem.records,
        problem.frames,
        found.simulator.inner(terms),
        found.simulator.full(terms),
        strict=True,
    ):
        u = scale.inputs(seen_input(terms, record.output, frame))
        y = model.polarity * scale.outputs(record.output - (shown - inner))
        signals.append((u, y))
        kept.append(record.sample_weight > 0)
    operator = operator_of(model)
    smoothing: Smoothing = model.fit.smoothing if model.fit else "auto"
    fitted = fit(
        signals, operator.low, operator.high, model.levels, smoothing=smoothing, form="dual", kept=kept
    )
    return fitted.identified.operator
