"""``pulsetrainer plot``: a figure of whatever a file holds."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

from typer import Context, Option

from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AnyFile, AsJson, Overwrite
from pulsetrainer.cli.outputs import figure_format
from pulsetrainer.errors import UsageError
from pulsetrainer.files.output_name import free


def plot(
    context: Context,
    file: AnyFile,
    out: Annotated[
        Path | None, Option("-o", "--out", help="File to write; default: a PNG beside the file.")
    ] = None,
    data: Annotated[
        bool, Option("--data", help="Also write what is drawn as a CSV table, beside the figure.")
    ] = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Draw an artefact as PNG, SVG or PDF.

    Example: pulsetrainer plot model.h5
    """
    out = out or file.with_suffix(".png")
    form = figure_format(out, "a figure")
    table = out.with_suffix(".csv") if data else None
    if table is not None and table.exists() and not overwrite and not out.exists():
        other = shlex.quote(str(free(table).with_suffix(out.suffix)))
        raise UsageError(
            f"--data writes its table beside the figure, as {table}, which already exists",
            hint=f"name another figure, such as -o {other}, or give --overwrite to replace the table",
        )
    job = Job(context, inputs=(file,), outputs=(out, table))
    artefact = job.load_any(file)
    from pulsetrainer.errors import DataError
    from pulsetrainer.report import figures, render

    with job.working(f"drawing {file.name}"):
        try:
            picture = render.encode(figures.draw(artefact), form)
        except (ValueError, ArithmeticError) as error:
            raise DataError(
                f"{file} cannot be drawn: {error}", hint=f"look at its values: pulsetrainer show {file}"
            ) from error
        job.write(out, picture)
        if table is not None:
            job.table(table, artefact, file)
    job.screen.result({"output": out, "kind": artefact.kind} | ({"data": table} if data else {}))
    job.screen.whole(f"wrote {out}: the {artefact.kind} in {file}")
    job.wrote(table)
