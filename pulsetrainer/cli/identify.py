"""``pulsetrainer identify``: from runs to a model."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from pulsetrainer.cli.console import Screen, plain
from pulsetrainer.cli.options import AsJson, Force, Out
from pulsetrainer.cli.settings import variable


class Reading(StrEnum):
    """How the weights are read."""

    continuous = "continuous"
    relay = "relay"


class Method(StrEnum):
    """How weights and offset are found."""

    joint = "joint"
    alternating = "alternating"


_MOST_LEVELS = 500  # 400 take three minutes and 1.4 GB


def identify(
    runs: Annotated[list[Path], typer.Argument(help="Runs to fit together.", metavar="RUN.h5...")],
    out: Out,
    levels: Annotated[
        int,
        typer.Option(
            min=2, max=_MOST_LEVELS, help="Levels of the Preisach plane.", envvar=variable("levels")
        ),
    ] = 48,
    reading: Annotated[
        Reading,
        typer.Option("--reading", help="How the weights are read: continuous, or relay as in the paper."),
    ] = Reading.continuous,
    operator: Annotated[Reading | None, typer.Option("--operator", hidden=True)] = None,
    method: Annotated[Method, typer.Option(help="joint, or alternating as in the paper.")] = Method.joint,
    smoothing: Annotated[
        str | None,
        typer.Option(
            metavar="auto|0|NUMBER",
            help="Length below which the density is smoothed, share of the input range; "
            "auto: by held-out blocks (default; 0 with relay).",
        ),
    ] = None,
    bootstrap: Annotated[
        int,
        typer.Option(
            min=0, max=10_000, help="Refits to resampled blocks, for 90 % intervals; 200 take about a minute."
        ),
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the resampling.")] = 0,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Fit a Preisach model to one or several runs.

    Example: pulsetrainer identify run.h5 -o model.h5
    """
    from pulsetrainer.steps import preflight

    preflight.check_files(outputs=(out,), force=force, artefacts=runs)
    smooth = _smoothing(smoothing)
    from pulsetrainer.steps import identify as flow
    from pulsetrainer.steps.show import shown

    screen = Screen("identify", as_json=json)
    options = flow.Options(
        tuple(runs),
        out,
        levels,
        (operator or reading).value,
        method.value,
        smooth,
        bootstrap,
        seed,
        force,
    )
    with screen.working("fitting") as context:
        result = flow.run(options, context)
    screen.result(plain(result))
    sure = {}
    if result.output_uncertainty is not None:
        sure["output known within"] = (
            f"{result.output_uncertainty:.2g} {shown(result.output_unit)} (90 % band)"
        )
    unit = shown(result.output_unit)
    screen.facts(
        f"{result.output}: Preisach model of {result.levels} levels, {result.cells} cells",
        {
            "fit": f"{result.fit_rms_percent:.3f} % rms, {result.fit_max_percent:.2f} % max, of the span",
            "fit rms": f"{result.fit_rms:.4g} {unit}".rstrip(),
            "offset y0": f"{result.offset:.4g} {unit}".rstrip(),
            "cells switched": f"{result.coverage_percent:.1f} %",
            "smoothing": f"{result.smoothing:.3g} of the range" if result.smoothing else "none",
            "loop": "falling" if result.polarity < 0 else "rising",
            **sure,
            "took": f"{result.seconds:.2f} s, {result.iterations} iterations",
        },
    )


def _smoothing(text: str | None) -> float | Literal["auto"] | None:
    """Read --smoothing: auto, or a number in 0..1."""
    if text is None or text == "auto":
        return None if text is None else "auto"
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0 <= value <= 1:
        raise typer.BadParameter(f"must be auto or a number in 0..1, got {text!r}", param_hint="--smoothing")
    return value
