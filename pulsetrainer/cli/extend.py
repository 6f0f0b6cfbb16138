"""``pulsetrainer extend``: a model with the causes a diagnosis found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.diagnose import words_of
from pulsetrainer.cli.options import AsJson, Force, Out


def extend(
    diagnosis: Annotated[Path, typer.Argument(help="Diagnosis of the model.", metavar="DIAGNOSIS.h5")],
    model: Annotated[Path, typer.Option(help="Model that was diagnosed.")],
    out: Out,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Write the model with the causes found, its weights refitted together with them.

    Example: pulsetrainer extend diagnosis.h5 --model model.h5 -o extended.h5
    """
    from pulsetrainer.steps import preflight

    preflight.check_files(outputs=(out,), force=force, artefacts=(diagnosis, model))
    from pulsetrainer.steps import extend as flow

    screen = Screen("extend", as_json=json)
    with screen.working("extending") as context:
        result = flow.run(flow.Options(diagnosis, model, out, force), context)
    screen.result(result)
    rows = {one.cause: "; ".join(words_of(p) for p in one.parameters) for one in result.extensions}
    screen.facts(
        f"{result.output}: extended model of {result.levels} levels",
        rows
        | {"residual": f"{result.static_percent:.3f} % -> {result.extended_percent:.3f} % rms of the span"},
    )
