"""``pulsetrainer import``: records from any bench become runs."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Context, Option

from pulsetrainer.cli.console import plain
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Overwrite, word_or_number
from pulsetrainer.steps.arguments import check_once

if TYPE_CHECKING:
    from pulsetrainer.steps.import_ import Imported

_RATES_HZ = {"least": sys.float_info.min, "most": sys.float_info.max}  # above 0, and finite


def import_(
    context: Context,
    files: Annotated[
        list[Path],
        Argument(
            help="CSV, TSV, .npz, .npy, .mat or .wav; several are parts of one run.", metavar="FILE.csv..."
        ),
    ],
    out: Annotated[
        Path, Option("-o", "--out", help="File to write; '{name}.h5' writes one run for each file.")
    ],
    input_column: Annotated[str, Option("--input", help="Column of the input, by its heading or number.")],
    output_column: Annotated[str, Option("--output", help="Column of the output, by its heading or number.")],
    time_column: Annotated[
        str | None, Option("--time", help="Column of the time; default: the first one.")
    ] = None,
    reference_column: Annotated[str | None, Option("--reference", help="Column of the reference.")] = None,
    input_unit: Annotated[str | None, Option(help="Unit of the input; default: from the header.")] = None,
    output_unit: Annotated[str | None, Option(help="Unit of the output; default: from the header.")] = None,
    rate: Annotated[float | None, Option(help="Sample rate, Hz, instead of a time column.")] = None,
    no_time: Annotated[
        bool, Option("--no-time", help="Ignore time: only the order of the samples counts.")
    ] = False,
    resample: Annotated[
        str | None,
        Option(
            metavar="even|HZ",
            help="Make the time steps even: at the median step, or at a rate. Default: left as they are.",
        ),
    ] = None,
    skip_bad_rows: Annotated[
        bool,
        Option(
            "--skip-bad-rows",
            help="Leave out rows with a blank cell, NaN or text, or too few cells; they are counted.",
        ),
    ] = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Turn a record measured elsewhere into a run.

    Example: pulsetrainer import scope.csv --input current_A --output force_N -o run.h5
    """
    from pulsetrainer.files.input_file import outputs_of
    from pulsetrainer.files.timing import check_timing

    check_once(files)
    groups = outputs_of(files, out)
    must = "the word even or a rate above 0 in Hz"
    even = word_or_number(resample, "even", "--resample", must, **_RATES_HZ)
    jobs = [Job(context, tables=group, outputs=(target,)) for target, group in groups.items()]
    check_timing(time_column, rate, no_time=no_time, resampled=even is not None)
    from pulsetrainer.files.run_from_table import runs_from_tables
    from pulsetrainer.steps.import_ import import_parts

    read: list[tuple[Imported, Mapping[str, str]]] = []
    with jobs[0].working(f"reading {', '.join(path.name for path in files)}") as progress:
        tables = runs_from_tables(
            files,
            input=input_column,
            output=output_column,
            time=time_column,
            reference=reference_column,
            input_unit=input_unit,
            output_unit=output_unit,
            rate_Hz=rate,
            no_time=no_time,
            skip_bad_rows=skip_bad_rows,
        )
        for group in groups.values():
            parts = [next(tables) for _ in group]  # the groups are in the order of the files
            jobs[0].notes([note for part in parts for note in part.notes])
            read.append((import_parts([part.run for part in parts], resample=even), parts[0].read_as))
            del parts
            progress(0.7 * len(read) / len(groups))
        # nothing is written before all of them have been read
        for job, (target, group), (one, _) in zip(jobs, groups.items(), read, strict=True):
            job.notes(one.notes)
            job.uses(*group)
            job.save(target, one.run, f"{', '.join(path.name for path in group)}, imported")
        progress(1.0)
    _show(jobs[0], groups, read)


def _show(
    job: Job, groups: dict[Path, tuple[Path, ...]], read: list[tuple[Imported, Mapping[str, str]]]
) -> None:
    from pulsetrainer.report.results import imported

    facts = [{**how, **imported(one.run, one.report)} for one, how in read]
    runs = [
        {"output": target, "report": {"files": group} | plain(one.report), "facts": figures}
        for (target, group), (one, _), figures in zip(groups.items(), read, facts, strict=True)
    ]
    job.screen.result({"output": runs[0]["output"], "facts": facts[0], "runs": runs})
    for (target, group), figures in zip(groups.items(), facts, strict=True):
        job.screen.facts(f"{target}: {', '.join(path.name for path in group)}", figures)
