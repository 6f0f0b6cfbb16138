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
    diagnosis: Annotated[Path, Option(help="Diagnosis of the run.")],
    out: Out,
    delay: Annotated[float, Option(min=0.0, help="Known delay of the output's recorder, s.")] = 0.0,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Take the faults of the measurement out of a run.

    It takes out those that the diagnosis has found; if it found none, there is nothing to correct.

    Example: pulsetrainer correct drifting.h5 --diagnosis drift.h5 -o corrected.h5
    """
    job = Job(context, inputs=(run, diagnosis), outputs=(out,))
    with job.working("correcting"):
        found = job.load(diagnosis, pt.Diagnosis)
        measured = job.load(run, pt.Run)
        try:
            corrected = pt.correct(measured, found, delay_s=delay, names=(str(run), str(diagnosis)))
        except DataError as error:
            from pulsetrainer.files.store import read_header

            made = read_header(diagnosis).provenance.parameters
            model = shlex.quote(str(made.get("model", "model.h5")))
            error.hint = error.hint.replace("MODEL.h5", model)
            raise
        job.save(out, corrected, f"Run corrected for {', '.join(corrected.corrected)}")
    from pulsetrainer.artefacts.units import with_unit

    masked = int((~corrected.counts).sum())
    changed = abs(corrected.output - measured.output)[corrected.counts]  # what is left out was filled in
    most = float(changed[changed >= 0].max(initial=0.0))  # lost samples are not numbers
    payload = {"output": out, "corrected": corrected.corrected, "masked_samples": masked}
    rows = {
        "taken out": ", ".join(corrected.corrected),
        "largest change": with_unit(f"{most:.3g}", corrected.output_unit),
        "samples left out": f"{masked} of {corrected.output.size}",
    }
    if not most and masked == int((~measured.counts).sum()):
        job.notes(["nothing shows what lies between the steps, so the output is left as it was"])
    lasting = "a run that the model is tested on may have the same fault: diagnose and correct it too"
    job.notes([lasting])
    job.show(payload, f"{out}: corrected run", rows)
