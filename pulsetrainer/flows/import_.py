"""Import: a table measured on any bench becomes a run."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pulsetrainer.artefacts import output, provenance, store, table
from pulsetrainer.flows.show import facts

if TYPE_CHECKING:
    from pulsetrainer.flows.context import Context


@dataclass(frozen=True, slots=True)
class Options:
    """Which table, and which of its columns mean what."""

    file: Path
    output: Path
    input_column: str
    output_column: str
    time_column: str | None = None
    reference_column: str | None = None
    input_unit: str | None = None
    output_unit: str | None = None
    rate_Hz: float | None = None
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """What was read."""

    output: Path
    facts: dict[str, Any]


def run(options: Options, context: Context) -> Result:
    """Read the table and store the run.

    Raises
    ------
    UsageError
        The output exists.
    DataError
        The table cannot be read, lacks a column, or holds what is not a number; time does not increase.
    """
    output.check_output(options.output, options.force)
    run_ = table.run_from_table(
        table.read_table(options.file),
        input_column=options.input_column,
        output_column=options.output_column,
        time_column=options.time_column,
        reference_column=options.reference_column,
        input_unit=options.input_unit,
        output_unit=options.output_unit,
        rate_Hz=options.rate_Hz,
    )
    context.progress(0.7)
    header = provenance.make_header(
        f"{options.file.name}, imported",
        argv=context.argv,
        now=context.now(),
        parameters={k: v for k, v in asdict(options).items() if k not in ("file", "output", "force")},
        inputs=provenance.digests([options.file]),
        libraries=provenance.library_versions(),
    )
    store.write(options.output, run_, header, force=options.force)
    context.progress(1.0)
    return Result(options.output, facts(run_))
