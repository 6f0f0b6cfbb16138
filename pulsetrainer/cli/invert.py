"""``pulsetrainer invert``: from a pulse to the current that presses it."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, Force, Out, positive
from pulsetrainer.cli.settings import variable


class Inversion(StrEnum):
    """How the model is inverted."""

    continuous = "continuous"
    closest_match = "closest-match"
    extended = "extended"


def invert(
    waveform: Annotated[
        str, typer.Argument(help="A name of the library (normal, bifid, ...) or a CSV file.")
    ],
    model: Annotated[Path, typer.Option(help="Model to invert.")],
    out: Out,
    method: Annotated[
        Inversion | None,
        typer.Option(
            help="continuous (default), closest-match as in the paper, or extended (default if it is).",
            show_default=False,
        ),
    ] = None,
    force_min: Annotated[
        float | None,
        typer.Option(help="Force at the foot of the pulse, N; default: the lowest.", show_default=False),
    ] = None,
    force_max: Annotated[
        float | None, typer.Option(help="Force at its top, N; default: the highest.", show_default=False)
    ] = None,
    beat: Annotated[
        str | None,
        typer.Option(
            metavar="N|mean",
            help="Beat of a recorded pulse: its number from 1, or the mean. Default: all is one period.",
            show_default=False,
        ),
    ] = None,
    periods: Annotated[
        int, typer.Option(min=1, help="Periods to play; the first is not scored.", envvar=variable("periods"))
    ] = 4,
    slew: Annotated[
        float,
        typer.Option(
            callback=positive, help="Fastest the drive may move, A/s.", envvar=variable("slew_A_per_s")
        ),
    ] = 30.0,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Find the current that presses a pulse.

    Both the compensated one and, to compare, the merely scaled one with the same extremes.

    Example: pulsetrainer invert normal --model model.h5 -o drive.h5
    """
    from pulsetrainer.steps import preflight

    preflight.waveform_file(waveform)
    preflight.check_beat(beat)
    preflight.check_force_range(force_min, force_max)
    preflight.check_files(outputs=(out,), force=force, artefacts=(model,))
    from pulsetrainer.steps import invert as flow

    screen = Screen("invert", as_json=json)
    options = flow.Options(
        waveform=waveform,
        model=model,
        output=out,
        inversion=method.value if method else None,
        beat=beat,
        force_min=force_min,
        force_max=force_max,
        periods=periods,
        slew_A_per_s=slew,
        force=force,
    )
    with screen.working(f"inverting {waveform}") as context:
        result = flow.run(options, context)
    screen.result(result)
    force_range, current = result.force_range, result.current_range
    screen.facts(
        f"{result.output}: {result.name} by {result.inversion} inversion",
        {
            "length": f"{result.seconds:.2f} s, {result.samples} samples",
            "force": f"{force_range[0]:.3f} .. {force_range[1]:.3f} {result.output_unit}",
            "current": f"{current[0]:.3f} .. {current[1]:.3f} {result.input_unit}",
            "out of reach": f"{result.clipped_samples} samples",
            "expected error": f"{result.predicted_max_error_percent:.3f} % max of full force, by the model",
        },
    )
