"""``pulsetrainer import``: records from any bench become runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, Force


def import_(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="CSV, TSV, .npz, .npy, .mat or .wav; several are parts of one run.", metavar="FILE.csv..."
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "-o", "--out", help="File to write; '{name}.h5' makes a run of each file.", show_default=False
        ),
    ],
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
    no_time: Annotated[bool, typer.Option("--no-time", help="Only the order of the samples counts.")] = False,
    resample: Annotated[
        str | None,
        typer.Option(
            metavar="even|HZ",
            help="Make the time steps even: at the median step, or at a rate. Default: left as they are.",
            show_default=False,
        ),
    ] = None,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Make a run of a record measured elsewhere.

    Example: pulsetrainer import scope.csv --input current_A --output force_N -o run.h5
    """
    from pulsetrainer.steps import preflight

    outputs = preflight.import_groups(files, out)
    preflight.check_files(outputs=outputs, force=force, others=files)
    preflight.check_timing(time_column, rate, no_time=no_time, resampled=resample is not None)
    even_rate = _rate(resample)
    from pulsetrainer.steps import import_ as flow

    screen = Screen("import", as_json=json)
    options = flow.Options(
        files=tuple(files),
        output=out,
        input_column=input_column,
        output_column=output_column,
        time_column=time_column,
        reference_column=reference_column,
        input_unit=input_unit,
        output_unit=output_unit,
        rate_Hz=rate,
        no_time=no_time,
        resample=even_rate,
        force=force,
    )
    with screen.working(f"reading {', '.join(path.name for path in files)}") as context:
        result = flow.run(options, context)
    screen.result(result)
    for one in result.runs:
        known = {name: value for name, value in one.facts.items() if value is not None}
        screen.facts(f"{one.output}: {', '.join(Path(name).name for name in one.report.files)}", known)


def _rate(text: str | None) -> float | None:
    """Read --resample: 0 for even, a rate, or nothing."""
    if text is None or text == "even":
        return None if text is None else 0.0
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0 < value < float("inf"):
        raise typer.BadParameter(f"must be even or a positive rate, got {text!r}", param_hint="--resample")
    return value
