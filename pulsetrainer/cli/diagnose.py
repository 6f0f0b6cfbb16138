"""``pulsetrainer diagnose``: what the model gets wrong, and why."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Out, Overwrite
from pulsetrainer.steps.arguments import check_once


def diagnose(
    context: Context,
    runs: Annotated[list[Path], Argument(help="Runs of the device.", metavar="RUN.h5...")],
    model: Annotated[Path, Option(help="Model to be diagnosed.")],
    out: Out,
    html: Annotated[Path | None, Option(help="Report to write.")] = None,
    quick: Annotated[bool, Option("--quick", help="Only screen: takes seconds, refits nothing.")] = False,
    seed: Annotated[int, Option(min=0, help="Seed of the simulated null distribution.")] = 0,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Find out what a model gets wrong on runs, and why.

    It names the causes, how certain they are, and what to measure next.

    Example: pulsetrainer diagnose diagnostic.h5 --model model.h5 -o diagnosis.h5 --html diagnosis.html
    """
    check_once(runs)
    job = Job(context, inputs=(*runs, model), outputs=(out, html))
    with job.working("diagnosing") as progress:
        # before the verb, which is slow to import
        measured, given = [job.load(path, pt.Run) for path in runs], job.load(model, pt.Model)
        found = pt.diagnose(
            measured,
            given,
            quick=quick,
            seed=seed,
            names=[str(path) for path in (*runs, model)],
            progress=progress,
        )
        from pulsetrainer.files import store
        from pulsetrainer.report.diagnosis_text import sections
        from pulsetrainer.report.results import diagnosed

        header = job.save(out, found, f"Diagnosis of {', '.join(path.stem for path in runs)}")
        known = set(store.read_header(model).provenance.inputs.values())
        own = not known or bool(known & set(header.provenance.inputs.values()))
        commands = next_commands(found, runs, model, out, own=own)
        if html is not None:
            from pulsetrainer.report.diagnosis_html import render_diagnosis

            job.page(html, partial(render_diagnosis, commands=commands), found, header)
    job.notes(found.notes)
    job.screen.result(
        diagnosed(found) | {"next_commands": commands, "output": out, "html": html, "seconds": job.seconds}
    )
    job.screen.parts(sections(found))
    job.wrote(out, html)
    for line in commands:
        job.screen.whole(f"then: {line}")


def next_commands(found: pt.Diagnosis, runs: list[Path], model: Path, out: Path, *, own: bool) -> list[str]:
    """Return the commands to go on with: to extend the model, or to correct the runs and begin again.

    A model that was not identified from its ``own`` runs is not at fault, and stays. After a quick screen
    comes the full diagnosis.
    """
    words: list[list[object]] = []
    if found.next_command == "extend":  # fitted with all faults of the measurement taken out
        words.append(["extend", out, "--model", model, "-o", "extended.h5"])
    if found.next_command == "correct":
        corrected = [f"{run.stem}-corrected.h5" for run in runs]
        pairs = zip(runs, corrected, strict=True)
        words += [["correct", run, "--diagnosis", out, "-o", made] for run, made in pairs]
        again = Path(f"{model.stem}-corrected.h5") if own else model
        words += [["identify", *corrected, "-o", again]] if own else []
        words.append(["diagnose", *corrected, "--model", again, "-o", f"{out.stem}-corrected.h5"])
    if not words and found.quick:
        words.append(["diagnose", *runs, "--model", model, "-o", f"{out.stem}-full.h5"])
    return [shlex.join(["pulsetrainer", *map(str, line)]) for line in words]
