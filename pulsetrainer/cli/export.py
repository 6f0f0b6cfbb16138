"""``pulsetrainer export``: the series of a file as a table for any other program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Context, Option

from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AnyFile, AsJson, Overwrite
from pulsetrainer.errors import EndingError

_TABLES = (".csv", ".txt")


def export(
    context: Context,
    file: AnyFile,
    out: Annotated[Path, Option("-o", "--out", help="Table to write, as CSV.", metavar="FILE.csv")],
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Write the series of a file as a table.

    The header has the units. A run, a waveform or a diagnosis gives one row for each sample, a model one for
    each cell of its density, a playback its repeats and an evaluation its waveforms or models in turn.

    Example: pulsetrainer export run.h5 -o run.csv
    """
    if out.suffix.lower() not in _TABLES and (out.is_file() or not out.exists()):
        raise EndingError(out, "a table is written as CSV", ".csv", usual="table")
    job = Job(context, inputs=(file,), outputs=(out,))
    artefact = job.load_any(file)
    with job.working(f"exporting {file.name}"):
        columns = job.table(out, artefact, file)
    from pulsetrainer.artefacts.units import counted

    rows = next(iter(columns.values())).size
    payload = {"output": out, "kind": artefact.kind, "columns": list(columns), "rows": rows}
    job.show(payload, f"wrote {out}: {artefact.kind}, {counted(rows, 'row')}", {"columns": list(columns)})
