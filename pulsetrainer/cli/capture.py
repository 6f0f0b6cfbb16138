"""``pulsetrainer capture``: play an excitation and record."""

from __future__ import annotations

from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, Force, Out, Port


def capture(
    signal: Annotated[
        str,
        typer.Argument(help="identification, diagnostic, or a CSV file with the columns t_s and current_A."),
    ],
    out: Out,
    port: Port = None,
    levels: Annotated[int, typer.Option(help="Levels whose cells the signal shall switch.")] = 48,
    current_max: Annotated[float, typer.Option(help="Top of the range, A.")] = 1.5,
    speed: Annotated[float, typer.Option(help="Speed of the identification signal, A/s.")] = 0.75,
    rate: Annotated[float, typer.Option(help="Samples a second, Hz.")] = 1000.0,
    condition: Annotated[bool, typer.Option(help="Go around the major loop once before recording.")] = True,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Play a signal on the device and record current and force.

    Example: pulsetrainer capture identification -o run.h5
    """
    from pulsetrainer.flows import capture as flow

    screen = Screen("capture", as_json=json)
    options = flow.Options(signal, out, port, levels, current_max, speed, rate, condition, force)
    with screen.working(f"capturing {signal}") as context:
        result = flow.run(options, context)
    if result.dropped_samples:
        screen.note(f"{result.dropped_samples} samples were lost on the wire; the rest is right")
    screen.result(result)
    current, force_range = result.current_range_A, result.force_range_N
    screen.facts(
        f"{result.output}: {result.signal} on {result.serial}, firmware {result.firmware}",
        {
            "samples": f"{result.samples} in {result.seconds:.1f} s, {result.rate_Hz:g} a second",
            "current": f"{current[0]:.3f} .. {current[1]:.3f} A",
            "force": f"{force_range[0]:.3f} .. {force_range[1]:.3f} N",
            "reversals": result.reversals,
            "cells switched": f"{result.coverage_percent:.1f} %",
        },
    )
