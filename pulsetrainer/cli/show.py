"""``pulsetrainer show``: what is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.evaluate import tables
from pulsetrainer.cli.options import AsJson


def show(
    file: Annotated[Path, typer.Argument(help="Any file this program wrote.", metavar="FILE.h5")],
    json: AsJson = False,
) -> None:
    """Say what is in a file.

    Its kind, its main figures, and the commands it came from.

    Example: pulsetrainer show model.h5
    """
    from pulsetrainer.steps import preflight

    preflight.check_files(artefacts=(file,))
    from pulsetrainer.artefacts import Evaluation
    from pulsetrainer.steps import show as flow

    screen = Screen("show", as_json=json)
    with screen.working("reading") as context:
        result = flow.run(flow.Options(file), context)
    header = result.header
    screen.result(
        {
            "file": file,
            "kind": result.kind,
            "title": header.title,
            "created": header.created,
            "history": header.history,
            "facts": result.facts,
        }
    )
    title = f"{file}: {result.kind}, {header.title}, {header.created}"
    known = {name: value for name, value in result.facts.items() if value is not None}
    if isinstance(result.artefact, Evaluation):
        screen.facts(title, {})
        tables(screen, result.artefact)
    else:
        screen.facts(title, known)
    screen.whole("\n".join(["history", *(f"  {line}" for line in header.history)]))
