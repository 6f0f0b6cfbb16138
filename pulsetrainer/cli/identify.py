"""``pulsetrainer identify``: from runs to a model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, BadParameter, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Out, Overwrite, setting, word_or_number
from pulsetrainer.steps.arguments import MOST_FITTED, check_once

Reading = Literal["continuous", "relay"]


def identify(
    context: Context,
    runs: Annotated[list[Path], Argument(help="Runs to fit together.", metavar="RUN.h5...")],
    out: Out,
    levels: Annotated[
        int | None,
        setting(
            "levels",
            "--levels",
            "Levels of the Preisach plane; default: 48, fewer for a short record.",
            min=2,
            max=MOST_FITTED,
        ),
    ] = None,
    form: Annotated[
        Literal["auto", "direct", "dual", "signed"],
        Option(
            help="direct: the output lags; dual: it leads, roles exchanged; signed: weights of either sign; "
            "auto: by held-out blocks."
        ),
    ] = "auto",
    reading: Annotated[
        Reading, Option("--reading", help="How the weights are read: continuous, or relay as in the paper.")
    ] = "continuous",
    operator: Annotated[Reading | None, Option("--operator", hidden=True)] = None,
    method: Annotated[
        Literal["joint", "alternating"], Option(help="joint, or alternating as in the paper.")
    ] = "joint",
    smoothing: Annotated[
        str | None,
        Option(
            metavar="auto|0|NUMBER",
            help="Length below which the density is smoothed, as a share of the input range; "
            "auto: by held-out blocks (default; 0 with relay).",
        ),
    ] = None,
    bootstrap: Annotated[
        int,
        Option(
            min=0, max=10_000, help="Refits to resampled blocks, for 90 % intervals; 200 take about a minute."
        ),
    ] = 0,
    seed: Annotated[int, Option(min=0, help="Seed of the resampling.")] = 0,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Fit a Preisach model to one or several runs.

    Example: pulsetrainer identify run.h5 -o model.h5
    """
    check_once(runs)
    if bootstrap == 1:
        raise BadParameter("must be 0, or from 2 to 10000, got 1", param_hint="--bootstrap")
    job = Job(context, inputs=runs, outputs=(out,))
    length = word_or_number(smoothing, "auto", "--smoothing", "auto or a number from 0 to 1", least=0, most=1)

    with job.working("fitting") as progress:
        loaded = [job.load(path, pt.Run) for path in runs]  # before the verb, which is slow to import
        model = pt.identify(
            loaded,
            levels=levels,
            form=form,
            reading=operator or reading,
            method=method,
            smoothing=length,
            bootstrap=bootstrap,
            seed=seed,
            names=list(map(str, runs)),
            progress=progress,
        )
        job.save(out, model, f"Preisach model of {', '.join(path.stem for path in runs)}")
    assert model.fit is not None
    job.notes(model.fit.notes)
    if model.fit.warning:
        job.screen.line("warning: ", model.fit.warning)
    from pulsetrainer.report.results import identified

    job.show(*identified(out, model, job.seconds))
