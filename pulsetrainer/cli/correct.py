"""``pulsetrainer correct``: a run without what the measurement did to it."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Out, Overwrite
from pulsetrainer.errors import DataError


def correct(
    context: Context,
    run: Annotated[Path, Argument(help="Run that was diagnosed.", metavar="RUN.h5")],
    out: Out,
    diagnosis: Annotated[Path | None, Option(help="Diagnosis of the run.")] = None,
    delay: Annotated[float, Option(min=0.0, help="Known delay of the output's recorder, s.")] = 0.0,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Take the faults of the measurement out of a run.

    It takes out those that the diagnosis has found, and a delay that you know: --delay needs no diagnosis.

    Example: pulsetrainer correct drifting.h5 --diagnosis drift.h5 -o corrected.h5
    """
    job = Job(context, inputs=(run, *([diagnosis] if diagnosis else [])), outputs=(out,))
    with job.working("correcting"):
        found = job.load(diagnosis, pt.Diagnosis) if diagnosis else None
        measured = job.load(run, pt.Run)
        try:
            corrected = pt.correct(measured, found, delay_s=delay, names=(str(run), str(diagnosis)))
        except DataError as error:
            from pulsetrainer.files.store import read_header

            made = read_header(diagnosis).provenance.parameters if diagnosis else {}
            model = shlex.quote(str(made.get("model", "model.h5")))
            error.hint = error.hint.replace("MODEL.h5", model)
            raise
        job.save(out, corrected, f"Run corrected for {', '.join(corrected.corrected)}")
    from pulsetrainer.report import diagnosis_results as results

    job.notes(results.notes_on(measured, corrected, delay))
    job.show(*results.corrected(out, measured, corrected))
