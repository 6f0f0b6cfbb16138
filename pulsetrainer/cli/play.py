"""``pulsetrainer play``: press a pulse and record the force."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, Force, Out, Port


def play(
    drive: Annotated[Path, typer.Argument(help="Waveform made by invert.")],
    out: Out,
    port: Port = None,
    repeats: Annotated[int, typer.Option(help="How often each of the two drives is played.")] = 5,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Press a pulse and record the force.

    The compensated and the scaled current take turns.

    Example: pulsetrainer play drive.h5 -o played.h5
    """
    from pulsetrainer.flows import play as flow

    screen = Screen("play", as_json=json)
    with screen.working(f"playing {drive.name}") as context:
        result = flow.run(flow.Options(drive, out, port, repeats, force), context)
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
