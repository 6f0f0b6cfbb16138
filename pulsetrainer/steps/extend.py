"""Extend: from a diagnosis to a model with the causes it found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Model, Run
from pulsetrainer.artefacts.units import in_units, same_units
from pulsetrainer.errors import DataError
from pulsetrainer.steps.arguments import named
from pulsetrainer.steps.evaluate import evaluate
from pulsetrainer.steps.one_thread import one_thread


@one_thread
def extend(
    model: Model, diagnosis: Diagnosis, *, verify: Run | None = None, names: Sequence[str] = ()
) -> Model:
    """Extend a model by the causes that a diagnosis of it found.

    Its static part is identified again, from what the causes leave of the runs that were diagnosed. What was
    added is in ``extensions`` of the new model; what it gains on blocks that were not fitted is in
    ``held_out_gain_percent`` of the diagnosis.

    Parameters
    ----------
    verify
        A run that was not diagnosed: a cause is added only if that run is predicted better with it.
    names
        Names of the model and of the diagnosis, for messages.

    Raises
    ------
    DataError
        The diagnosis found nothing that extends a model, is of another model or of the very run that is
        to verify it, or no cause helps to predict that run.

    Source: Della Torre, Magnetic Hysteresis, 1999, chapters 3 to 5: the classical model and its extensions.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> model, found = pt.load("tests/data/files-0.1/model.h5"), pt.load("tests/data/files-0.1/diagnosis.h5")
    >>> pt.extend(model, found)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pulsetrainer.errors.DataError: ...
    """
    model_name, diagnosis_name = named(names, ("the model", "the diagnosis"))
    extended = diagnosis.extended
    if diagnosis.model not in ("", model.fingerprint):  # files of 0.1 do not name theirs
        raise DataError(
            f"{model_name} is not the model that {diagnosis_name} is of",
            hint="give the model that was diagnosed (pulsetrainer show DIAGNOSIS.h5 names it), or diagnose "
            "this one: pulsetrainer diagnose RUN.h5 --model MODEL.h5 -o new-diagnosis.h5",
        )
    if extended is None:
        raise _nothing_in(diagnosis, diagnosis_name)
    # the levels of a dual model lie on the output, and a refit moves them
    ends = model.edges[[0, -1]]
    same_range = model.form == "dual" or np.allclose(extended.edges[[0, -1]], ends, atol=1e-8 * np.ptp(ends))
    if not same_range or (extended.input_unit, extended.output_unit) != (model.input_unit, model.output_unit):
        raise DataError(
            f"{diagnosis_name} is of a model over {extended.edges[0]:.4g} .. {extended.edges[-1]:.4g} "
            f"{extended.input_unit}, but {model_name} spans {model.edges[0]:.4g} .. {model.edges[-1]:.4g} "
            f"{model.input_unit}",
            hint="give the model that was diagnosed",
        )
    diagnosed = {one.fingerprint for one in diagnosis.records}
    if verify is not None and any(verify.cut(part).fingerprint in diagnosed for part in verify.slices):
        raise DataError(
            f"the run to verify with is one that {diagnosis_name} was made from: it cannot show what repeats",
            hint="give a run that was not diagnosed",
        )
    _check_of(model, verify or model, model_name)
    extended = replace(extended, coil=model.coil, captured=model.captured, serial=model.serial)
    return extended if verify is None else _verified(model, extended, verify)


def _check_of(model: Model, verify: Run | Model, name: str) -> None:
    """Refuse a run to verify with that is of another device than the model."""
    known = verify.serial and model.serial
    is_of, of = (f"is of {verify.serial}", f"is of {model.serial}") if known else ("", "")
    if not same_units((verify.input_unit, verify.output_unit), (model.input_unit, model.output_unit)):
        is_of, of = in_units(verify), in_units(model)
    if is_of != of:
        said = f"the run to verify with {is_of}, but {name} {of}"
        raise DataError(said, hint="give a run of the same device")


def _nothing_in(diagnosis: Diagnosis, name: str) -> DataError:
    """Say why a diagnosis has nothing to extend a model by, and what to do."""
    if diagnosis.quick:
        why = "only screened for causes and fitted none"
    elif diagnosis.verdict in diagnosis.in_model:
        why = f"found {' and '.join(diagnosis.in_model)}, which the model contains already"
    else:
        why = f"ended with the verdict {diagnosis.verdict!r} and found nothing that would hold in other runs"
    if diagnosis.correctable:
        hint = "take it out of the run: pulsetrainer correct RUN.h5 --diagnosis DIAGNOSIS.h5 -o corrected.h5"
    elif diagnosis.quick:
        hint = "diagnose without `quick`: pulsetrainer diagnose RUN.h5 --model MODEL.h5 -o full.h5"
    elif diagnosis.verdict in ("none", *diagnosis.in_model) or not diagnosis.next_experiment:
        hint = "use the model as it is"
    else:
        hint = f"follow the advice of the diagnosis: {diagnosis.advice[0]}"
    return DataError(f"{name} {why}: there is nothing to extend the model by", hint=hint)


def _verified(model: Model, extended: Model, run: Run) -> Model:
    """Return the extended model without the causes that do not help to predict a run."""
    if run.dt_s is None:
        raise DataError(
            "the run to verify with has no time, and causes need it",
            hint="import it again with `time` COLUMN or `rate_Hz` HZ",
        )

    def error(one: Model) -> float:  # on the samples that count for the extended model too
        return evaluate(run, [extended, one]).models[-1].rms

    best, least = extended, error(extended)
    # with fewer causes it misses the records that were diagnosed by more, and nobody has measured how much
    unknown = extended.seen and replace(extended.seen, rms_percent=nan, max_percent=nan)
    for left_out in extended.extensions:
        kept = tuple(one for one in best.extensions if one is not left_out)
        trial = replace(best, extensions=kept, seen=unknown)
        without = error(trial)
        if without <= least:
            best, least = trial, without
    plain = error(model)
    if not best.extensions or least >= plain:
        named = ", ".join(one.cause for one in extended.extensions)
        one = len(extended.extensions) == 1
        said, them = ("fits, but does", "it") if one else ("fit, but do", "them")
        raise DataError(
            f"{named} {said} not repeat: the run to verify with is predicted to {least:.4g} "
            f"{model.output_unit} (rms) with {them}, and to {plain:.4g} without",
            hint="use the model as it is, or diagnose both runs together",
        )
    return best
