"""Extend: from a diagnosis to a model with the causes it found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Model
from pulsetrainer.errors import DataError


def extend(model: Model, diagnosis: Diagnosis, *, names: Sequence[str] = ()) -> Model:
    """Extend a model by the causes that a diagnosis of it found.

    Its weights are those refitted together with the causes, on the runs that were diagnosed. What was added
    is in ``extensions`` of the new model; what it gains on blocks that were not fitted is in
    ``held_out_gain_percent`` of the diagnosis.

    Parameters
    ----------
    names
        Names of the model and of the diagnosis, for messages.

    Raises
    ------
    DataError
        The diagnosis found nothing that extends a model, or is of another model.

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
    model_name, diagnosis_name = names or ("the model", "the diagnosis")
    extended = diagnosis.extended
    if extended is None:
        why = (
            "only screened for causes and fitted none"
            if diagnosis.quick
            else f"ended with the verdict {diagnosis.verdict!r} and found no property of the device"
        )
        raise DataError(
            f"{diagnosis_name} {why}: there is nothing to extend the model by",
            hint="diagnose without `quick`, on a run of `pulsetrainer capture diagnostic`",
        )
    same_range = np.allclose(extended.edges[[0, -1]], model.edges[[0, -1]])
    if not same_range or (extended.input_unit, extended.output_unit) != (model.input_unit, model.output_unit):
        raise DataError(
            f"{diagnosis_name} is of a model over {extended.edges[0]:.4g} .. {extended.edges[-1]:.4g} "
            f"{extended.input_unit}, but {model_name} spans {model.edges[0]:.4g} .. {model.edges[-1]:.4g} "
            f"{model.input_unit}",
            hint="give the model that was diagnosed",
        )
    return extended
