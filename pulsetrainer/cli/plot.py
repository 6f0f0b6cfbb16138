"""``pulsetrainer plot``: a figure of whatever a file holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, Force, Out


def plot(
    file: Annotated[Path, typer.Argument(help="Any file this program wrote.", metavar="FILE.h5")],
    out: Out,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Draw an artefact as PNG, SVG or PDF.

    Example: pulsetrainer plot model.h5 -o model.png
    """
    from pulsetrainer.steps import preflight

    preflight.figure_form(out, "a figure")
    preflight.check_files(outputs=(out,), force=force, artefacts=(file,))
    from pulsetrainer.steps import plot as flow

    screen = Screen("plot", as_json=json)
    with screen.working(f"drawing {file.name}") as context:
        result = flow.run(flow.Options(file, out, force), context)
    screen.result(result)
    screen.whole(f"wrote {result.output}: a {result.kind}")
