"""``pulsetrainer play``: press a pulse and record the force."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, DryRun, Force, LimitCurrent, LimitForce, Out, Port
from pulsetrainer.cli.settings import variable

if TYPE_CHECKING:
    from pulsetrainer.steps.play import Plan


def play(
    drive: Annotated[Path, typer.Argument(help="Waveform made by invert.")],
    out: Out,
    port: Port = None,
    repeats: Annotated[
        int,
        typer.Option(min=1, help="How often each of the two drives is played.", envvar=variable("repeats")),
    ] = 5,
    limit_current: LimitCurrent = None,
    limit_force: LimitForce = None,
    dry_run: DryRun = False,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Press a pulse and record the force.

    The compensated and the scaled current take turns.

    Example: pulsetrainer play drive.h5 -o played.h5
    """
    from pulsetrainer.steps import preflight

    preflight.check_port(port)
    preflight.check_files(outputs=(out,), force=force, artefacts=(drive,))
    from pulsetrainer.device.device import Limits
    from pulsetrainer.steps import play as flow

    screen = Screen("play", as_json=json)
    options = flow.Options(drive, out, port, repeats, Limits(limit_current, limit_force), dry_run, force)
    if dry_run:
        _show(screen, flow.plan(options))
        return
    with screen.working(f"playing {drive.name}") as context:
        result = flow.run(options, context)
    if result.dropped_samples:
        screen.note(
            f"{result.dropped_samples} samples were lost on the wire; they are left out of all errors"
        )
    screen.result(result)
    screen.facts(
        f"{result.output}: {result.name} by {result.inversion} inversion on {result.serial}",
        {
            "repeats": f"{result.repeats} of each drive, {result.seconds:.1f} s in all",
            "samples": f"{result.samples} a repeat",
            "lost": f"{result.dropped_samples} samples",
        },
    )


def _show(screen: Screen, plan: Plan) -> None:
    """Say what would be played."""
    screen.result(plan)
    screen.facts(
        f"would play {plan.name} by {plan.inversion} inversion on {plan.port} and write {plan.output}; "
        "nothing was done",
        {
            "repeats": f"{plan.repeats} of each drive, {plan.seconds:.1f} s in all",
            "samples": f"{plan.samples} a repeat, {plan.rate_Hz:g} a second",
            "current": f"{plan.peak_current_A:.3f} A at most, {plan.rms_current_A:.3f} A rms",
        },
    )
