"""``pulsetrainer capture``: play an excitation and record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, DryRun, Force, LimitCurrent, LimitForce, Out, Port, positive
from pulsetrainer.cli.settings import variable

if TYPE_CHECKING:
    from pulsetrainer.steps.capture import Plan


def capture(
    signal: Annotated[
        str,
        typer.Argument(help="identification, diagnostic, or a CSV file with the columns t_s and current_A."),
    ],
    out: Out,
    port: Port = None,
    levels: Annotated[
        int,
        typer.Option(min=2, help="Levels whose cells the signal shall switch.", envvar=variable("levels")),
    ] = 48,
    current_max: Annotated[
        float, typer.Option(callback=positive, help="Top of the range, A.", envvar=variable("current_max_A"))
    ] = 1.5,
    speed: Annotated[
        float,
        typer.Option(
            callback=positive,
            help="Speed of the identification signal, A/s.",
            envvar=variable("speed_A_per_s"),
        ),
    ] = 0.75,
    rate: Annotated[
        float, typer.Option(callback=positive, help="Samples a second, Hz.", envvar=variable("rate_Hz"))
    ] = 1000.0,
    condition: Annotated[bool, typer.Option(help="Go around the major loop once before recording.")] = True,
    repeats: Annotated[int, typer.Option(min=1, help="How often the signal is played, without a pause.")] = 1,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the recording into this output that was cut off.")
    ] = False,
    limit_current: LimitCurrent = None,
    limit_force: LimitForce = None,
    dry_run: DryRun = False,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Play a signal on the device and record current and force.

    Example: pulsetrainer capture identification -o run.h5
    """
    from pulsetrainer.steps import preflight

    preflight.signal_file(signal)
    preflight.check_port(port)
    preflight.check_files(outputs=() if resume else (out,), force=force)
    if resume:
        preflight.check_resumable(out)
    from pulsetrainer.device.device import Limits
    from pulsetrainer.steps import capture as flow

    screen = Screen("capture", as_json=json)
    limits = Limits(limit_current, limit_force)
    options = flow.Options(
        signal,
        out,
        port,
        levels,
        current_max,
        speed,
        rate,
        condition,
        repeats,
        resume,
        limits,
        dry_run,
        force,
    )
    if dry_run:
        _show(screen, flow.plan(options))
        return
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
            **({"parts": result.parts} if result.parts > 1 else {}),
            "cells switched": f"{result.coverage_percent:.1f} %",
        },
    )


def _show(screen: Screen, plan: Plan) -> None:
    """Say what would be played."""
    screen.result(plan)
    screen.facts(
        f"would play {plan.signal} on {plan.port} and write {plan.output}; nothing was done",
        {
            "length": f"{plan.seconds:.1f} s, {plan.samples} samples, {plan.rate_Hz:g} a second",
            "current": f"{plan.peak_current_A:.3f} A at most, {plan.rms_current_A:.3f} A rms",
            "reversals": plan.reversals,
            "cells switched": f"{plan.coverage_percent:.1f} %",
        },
    )
