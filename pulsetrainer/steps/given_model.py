"""What the records say of the model as given: another condition, or the wrong kind of model.

The search for causes refits the weights; here the model stays as it is, and the answer of the search is
turned where it must be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import Cause, Diagnosis, Model, Parameter, Run
from pulsetrainer.core import input_noise
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import condition, velocity
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.steps.modelling import predict, start_of

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.answer import Answer

_UNTIMED = (
    "The records have no time: only what depends on the order of the samples was tried (load-dependence, "
    "accommodation, step, condition-change, and the gates on the raw data), nothing that depends on rate."
)
_ANEW = (
    "Identify the device in this condition (pulsetrainer identify RUN.h5 -o model.h5) and diagnose with that "
    "model."
)
_SPEED_MATTERS = 0.6  # f(v) must leave less than this share of what f(sign v) leaves


def judged(
    diagnosis: Diagnosis, answer: Answer, records: Sequence[Record], model: Model, first: Run
) -> Diagnosis:
    """Add what the records say of the model as given: another condition, or the wrong kind of model."""
    timed = all(record.timed for record in records)
    low, high = float(model.edges[0]), float(model.edges[-1])
    # records have polarity 1: what the model says is turned alike; noise in the input is no motion
    core = [
        Record(input_noise.clean(r.input).input, r.output, r.sample_weight, start_of(r.input, low, high))
        for r in records
    ]
    said = [
        model.polarity * predict(model, one.input, r.step, one.start)
        for r, one in zip(records, core, strict=True)
    ]
    residuals = [one.output - p for one, p in zip(core, said, strict=True)]
    kept = [one.sample_weight > 0 for one in core]
    evidence: list[str] = []
    if not timed:
        evidence.append(_UNTIMED)
    compared = velocity.compare(core, [r.step for r in records], residuals)
    wrong = velocity.warning(compared, first.input_quantity, first.output_quantity)
    if wrong:
        diagnosis = _of_another_kind(diagnosis, core, residuals, compared, wrong)
        evidence.append(wrong)
    measured = np.concatenate([one.output[k] for one, k in zip(core, kept, strict=True)])
    predicted = np.concatenate([p[k] for p, k in zip(said, kept, strict=True)])
    refitted, extended = root_mean_square(answer.baseline.residual), root_mean_square(answer.final.residual)
    if not wrong and condition.left_by(measured, predicted, answer.noise) <= extended:
        # the search works on fewer levels: what it finds there is no fault of the model as given
        diagnosis = _cleared(diagnosis, _by_contrast(answer))
        evidence.append("The model as given leaves less than any extension on the levels of the search.")
    changed = condition.change(measured, predicted, refitted, answer.noise)
    if changed is not None and changed.is_everything:
        diagnosis, said_besides = _overshadowed(diagnosis, answer, changed)
        evidence += said_besides
    causes, verdict = diagnosis.causes, diagnosis.verdict
    if changed is not None and verdict != "condition-change":
        found = _condition(changed, model.polarity, first)
        causes = (found, *(one for one in causes if one.cause != found.cause))
        verdict = found.cause
        evidence.append(f"{found.cause}: {found.text}")
    return replace(diagnosis, verdict=verdict, causes=causes, evidence=(*evidence, *diagnosis.evidence))


def _overshadowed(
    diagnosis: Diagnosis, answer: Answer, changed: condition.Change
) -> tuple[Diagnosis, list[str]]:
    """Return a diagnosis without the causes that only repair the rest that a changed condition leaves."""
    cleared = _cleared(diagnosis, _by_contrast(answer))
    pairs = zip(diagnosis.causes, cleared.causes, strict=True)
    gone = [before.cause for before, after in pairs if before.found > after.found]
    if not gone:
        return diagnosis, []
    left = 100.0 * root_mean_square(answer.baseline.residual) / changed.span
    said = (
        f"The change is {100.0 * changed.explains:.2f} % of the squared error. {' and '.join(gone)} would "
        f"lower what is left, {left:.2g} % of the span: too little beside it to be named."
    )
    return replace(cleared, next_experiment=_ANEW), [said]


def _condition(changed: condition.Change, polarity: int, first: Run) -> Cause:
    """Return the finding that the device is not in the condition of the model."""
    offset, unit = polarity * changed.offset, first.output_unit
    named = "" if unit == "1" else f" {unit}"
    sure, wide = 1.96 * changed.offset_error, 1.96 * changed.gain_error
    return Cause(
        cause="condition-change",
        found=True,
        p_value=0.0,
        explains_percent=100.0 * changed.explains,
        held_out_gain_percent=float("nan"),
        parameters=(
            Parameter("offset", offset, unit, offset - sure, offset + sure),
            Parameter("gain", changed.gain, "1", changed.gain - wide, changed.gain + wide),
        ),
        text=(
            "a Preisach model of the records' own fits them, the one given does not: the device is in "
            f"another condition (load, configuration, zero). {_difference(changed, polarity, named)}"
        ),
    )


def _difference(changed: condition.Change, polarity: int, named: str) -> str:
    """Say how the output differs from the model's: what is within 1 % of the span is unchanged."""
    shift = f"shifted by {polarity * changed.shift:.2g}{named} on average"
    if not changed.gain_matters and not changed.shape_matters:
        return (
            f"Its output is {shift}; gain and shape are unchanged ({100.0 * changed.gain:+.1f} %, "
            f"{changed.left:.2g}{named} rms); set the zero again before each use, or identify it again"
        )
    return (
        f"Its output is {shift}, {1.0 + changed.gain:.3f} times that of the model, and differs in shape by "
        f"{changed.left:.2g}{named} rms; identify it again in this condition"
    )


def _of_another_kind(
    diagnosis: Diagnosis,
    records: Sequence[Record],
    residuals: Sequence[FloatArray],
    compared: velocity.Comparison,
    wrong: str,
) -> Diagnosis:
    """Return a diagnosis in which causes that were sought on top of the wrong model are not found.

    Where the speed matters and not only the direction, the force is a viscous one; else it has no name here.
    """
    direction = velocity.compare(records, [None] * len(records), residuals)
    cleared = _cleared(diagnosis)
    if compared.velocity > _SPEED_MATTERS * direction.velocity:
        return replace(cleared, verdict="unknown")
    explains = 100.0 * (1.0 - (compared.velocity / compared.preisach) ** 2)
    viscous = Cause("viscous", True, 0.0, explains, float("nan"), text=wrong)
    others = tuple(one for one in cleared.causes if one.cause != "viscous")
    return replace(cleared, verdict="viscous", causes=(viscous, *others))


def _by_contrast(answer: Answer) -> list[str]:
    """Causes that equal inputs with unequal outputs show, whatever the model."""
    return [f.cause.id for f in answer.findings if f.by_contrast]


def _cleared(diagnosis: Diagnosis, told: Sequence[str] = ()) -> Diagnosis:
    """Return a diagnosis in which only what was read off the raw data, and what is ``told``, stays found."""
    known = library()
    causes = tuple(
        one if known[one.cause].stage == "record" or one.cause in told else replace(one, found=False)
        for one in diagnosis.causes
    )
    verdict = next((one.cause for one in causes if one.found), "none")
    gone = tuple(f"{one.cause}: " for one in causes if not one.found)
    evidence = tuple(
        said for said in diagnosis.evidence if not said.startswith((*gone, "With the causes found"))
    )
    return replace(
        diagnosis,
        verdict=verdict,
        causes=causes,
        evidence=evidence,
        extended=None,
        extended_percent=diagnosis.static_percent,
    )
