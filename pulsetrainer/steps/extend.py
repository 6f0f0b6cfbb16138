"""Extend: from a diagnosis to a model with the causes it found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Extension, Model
from pulsetrainer.errors import DataError
from pulsetrainer.files import atomic_write, provenance, store

if TYPE_CHECKING:
    from pulsetrainer.steps.context import Context


@dataclass(frozen=True, slots=True)
class Options:
    """Which diagnosis, of which model."""

    diagnosis: Path
    model: Path
    output: Path
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """The extended model."""

    output: Path
    extensions: tuple[Extension, ...]
    levels: int
    static_percent: float
    extended_percent: float


def run(options: Options, context: Context) -> Result:
    """Write the model with the extensions found and the weights refitted together with them.

    Raises
    ------
    UsageError
        The output exists.
    DataError
        The diagnosis found nothing that extends a model, or is of another model.
    """
    atomic_write.check_output(options.output, options.force)
    diagnosis = store.read(options.diagnosis, Diagnosis)
    model = store.read(options.model, Model)
    extended = diagnosis.extended
    if extended is None:
        why = (
            "was quick, without a refit"
            if diagnosis.quick
            else f"ended with the verdict {diagnosis.verdict!r}, and found no property of the device"
        )
        raise DataError(
            f"{options.diagnosis} {why}: there is nothing to extend the model by",
            hint="run `pulsetrainer diagnose RUN.h5 --model model.h5 -o diagnosis.h5` without --quick, "
            "on a run of `pulsetrainer capture diagnostic`",
        )
    same_range = np.allclose(extended.edges[[0, -1]], model.edges[[0, -1]])
    if not same_range or (extended.input_unit, extended.output_unit) != (model.input_unit, model.output_unit):
        raise DataError(
            f"{options.diagnosis} is of a model over {extended.edges[0]:.4g} .. {extended.edges[-1]:.4g} "
            f"{extended.input_unit}, but {options.model} spans {model.edges[0]:.4g} .. "
            f"{model.edges[-1]:.4g} {model.input_unit}",
            hint="give the model that was diagnosed",
        )
    context.progress(0.5)
    header = provenance.make_header(
        f"Model extended by {', '.join(e.cause for e in extended.extensions)}",
        argv=context.argv,
        now=context.now(),
        inputs=provenance.digests([options.diagnosis, options.model]),
        ancestors=[store.read_header(path) for path in (options.diagnosis, options.model)],
        libraries=provenance.library_versions(),
    )
    store.write(options.output, extended, header, overwrite=options.force)
    context.progress(1.0)
    return Result(
        options.output,
        extended.extensions,
        extended.edges.size - 1,
        diagnosis.static_percent,
        diagnosis.extended_percent,
    )
