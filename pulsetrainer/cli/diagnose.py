"""``pulsetrainer diagnose``: what the model gets wrong, and why."""

from __future__ import annotations

import re
import shlex
from functools import partial
from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Out, Overwrite, Report
from pulsetrainer.files.output_name import free
from pulsetrainer.steps.arguments import check_once


def diagnose(
    context: Context,
    runs: Annotated[list[Path], Argument(help="Runs of the device.", metavar="RUN.h5...")],
    model: Annotated[Path, Option(help="Model to be diagnosed.")],
    out: Out,
    html: Report = None,
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
        from pulsetrainer.report.diagnosis_results import diagnosed
        from pulsetrainer.report.diagnosis_text import sections

        header = job.save(out, found, f"Diagnosis of {', '.join(path.stem for path in runs)}")
        known = set(store.read_header(model).provenance.inputs.values())
        own = not known or bool(known & set(header.provenance.inputs.values()))
        commands = next_commands(found, runs, model, out, own=own, html=html)
        if html is not None:
            from pulsetrainer.report.diagnosis_html import render_diagnosis

            job.page(html, partial(render_diagnosis, commands=commands), found, header)
    job.one_device({model: given}, dict(zip(runs, measured, strict=True)))
    job.notes([*found.notes, *_before_correction(runs, measured, model, known)])
    if found.quick and given.fit is not None and given.fit.warning:  # the full diagnosis tells it itself
        job.notes([f"{model}: {given.fit.warning}"])
    job.screen.result(
        diagnosed(found) | {"next_commands": commands, "output": out, "html": html, "seconds": job.seconds}
    )
    job.screen.parts(sections(found))
    job.wrote(out, html)
    for number, line in enumerate(commands, start=1):
        which = f" {number} of {len(commands)}" if len(commands) > 1 else ""
        job.screen.whole(f"then{which}: {line}")


def _before_correction(runs: list[Path], measured: list[pt.Run], model: Path, known: set[str]) -> list[str]:
    """Say of which runs the model is that of the time before they were corrected; ``known``: its inputs."""
    from pulsetrainer.files import store

    return [
        f"{model} was identified from the run that {path} was corrected from, so it holds what was taken out "
        f"({', '.join(run.corrected)}): identify it from {path}, and diagnose with that model"
        for path, run in zip(runs, measured, strict=True)
        if run.corrected and known & set(store.read_header(path).provenance.inputs.values())
    ]


def next_commands(
    found: pt.Diagnosis, runs: list[Path], model: Path, out: Path, *, own: bool, html: Path | None = None
) -> list[str]:
    """Return the commands to go on with: to extend the model, or to correct the runs and begin again.

    A model that was not identified from its ``own`` runs is not at fault, and stays, but for one of another
    condition. After a quick screen comes the full diagnosis. No command overwrites a file.
    """
    words: list[list[object]] = []
    pages = (out, html) if html is not None else (out,)
    if found.next_command == "extend":  # fitted with all faults of the measurement taken out
        words.append(["extend", out, "--model", model, "-o", _extended(model)])
    elif found.next_command == "correct":
        corrected = [_beside(run, "corrected") for run in runs]
        pairs = zip(runs, corrected, strict=True)
        words += [["correct", run, "--diagnosis", out, "-o", made] for run, made in pairs]
        words += _again(corrected, model, pages, "corrected", anew=own)
    elif found.verdict == "condition-change" and len(found.records) == 1:
        # of several, some may be the model's
        words += _again(runs, model, pages, "anew", anew=True)
    if not words and found.quick:
        words += _again(runs, model, pages, "full", anew=False)
    return [shlex.join(["pulsetrainer", *map(str, line)]) for line in words]


def _again(
    runs: list[Path], model: Path, pages: tuple[Path, ...], called: str, *, anew: bool
) -> list[list[object]]:
    """Return the words that diagnose runs again, with a model identified ``anew`` from them or as it is.

    ``pages`` are the diagnosis that was written and, where one was wanted, its report.
    """
    again = _beside(model, called) if anew else model
    words: list[list[object]] = [["identify", *runs, "-o", again]] if anew else []
    options = zip(("-o", "--html"), pages, strict=False)
    made = [word for option, path in options for word in (option, _beside(path, called))]
    return [*words, ["diagnose", *runs, "--model", again, *made]]


def _beside(path: Path, called: str) -> Path:
    """Return a name in this folder that is like another one, and neither taken nor that one itself."""
    stem = re.sub(rf"-{called}(-\d+)?$", "", path.stem)
    return free(Path(f"{stem}-{called}{path.suffix}"), but=path.name)


def _extended(model: Path) -> Path:
    """Return a name in this folder for a model that is extended: ``a-extended`` of ``a-model``."""
    stem = model.stem.replace("model", "extended")
    return free(Path(f"{stem}.h5" if "extended" in stem else f"{stem}-extended.h5"))
