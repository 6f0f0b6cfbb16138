"""``pulsetrainer import``: a table from any bench becomes a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, Force, Out


def import_(
    file: Annotated[Path, typer.Argument(help="Table to read.", metavar="FILE.csv")],
    out: Out,
    input_column: Annotated[
        str, typer.Option("--input", help="Column of the input, a current for instance.")
    ],
    output_column: Annotated[
        str, typer.Option("--output", help="Column of the output, a force for instance.")
    ],
    time_column: Annotated[
        str | None,
        typer.Option("--time", help="Column of the time; default: the first one.", show_default=False),
    ] = None,
    reference_column: Annotated[
        str | None, typer.Option("--reference", help="Column of the reference.", show_default=False)
    ] = None,
    input_unit: Annotated[
        str | None, typer.Option(help="Unit of the input; default: from the header.", show_default=False)
    ] = None,
    output_unit: Annotated[
        str | None, typer.Option(help="Unit of the output; default: from the header.", show_default=False)
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Samples a second, instead of a time column.", show_default=False)
    ] = None,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Make a run of a table measured elsewhere.

    Example: pulsetrainer import scope.csv --input current_A --output force_N -o run.h5
    """
    from pulsetrainer.flows import import_ as flow

    screen = Screen("import", as_json=json)
    options = flow.Options(
        file=file,
        output=out,
        input_column=input_column,
        output_column=output_column,
        time_column=time_column,
        reference_column=reference_column,
        input_unit=input_unit,
        output_unit=output_unit,
        rate_Hz=rate,
        force=force,
    )
    with screen.working(f"reading {file.name}") as context:
        result = flow.run(options, context)
    screen.result(result)
    screen.facts(f"{result.output}: {file.name}", result.facts)
