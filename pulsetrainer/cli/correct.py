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

_LONG = 0.01  # of the run: no recorder is so late


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

    if results.is_unchanged(measured, corrected):
        why = results.UNSEEN if "quantisation" in corrected.corrected else results.ELSEWHERE
        job.notes([f"{why}, so the output is left as it was"])
    if measured.time_s is not None and delay > _LONG * (measured.time_s[-1] - measured.time_s[0]):
        job.notes(
            [f"{delay:g} s is a long delay for this run; --delay is in seconds: 5 ms are --delay 0.005"]
        )
    job.notes(["a run that the model is tested on may have the same fault: diagnose and correct it too"])
    job.show(*results.corrected(out, measured, corrected))
