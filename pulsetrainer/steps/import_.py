"""Import: records measured on any bench become runs, with a report of what was read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pulsetrainer.artefacts.time_steps import steps_of
from pulsetrainer.core import input_noise
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.identification import CLEAR, correlation_of
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.files import provenance, run_from_table, store
from pulsetrainer.steps import preflight
from pulsetrainer.steps.show import run_facts

if TYPE_CHECKING:
    from pulsetrainer.artefacts import Run
    from pulsetrainer.steps.context import Context

LEVELS = 48  # of the plane whose coverage is reported, over the record's own range
_LOOKED_AT = 1_000_000  # samples; of a longer record every so many are looked at


@dataclass(frozen=True, slots=True)
class Options:
    """Which files, and which of their columns mean what."""

    files: tuple[Path, ...]
    output: Path  # with {name} in it: one run for each file; else all files are parts of one run
    input_column: str
    output_column: str
    time_column: str | None = None
    reference_column: str | None = None
    input_unit: str | None = None
    output_unit: str | None = None
    rate_Hz: float | None = None
    no_time: bool = False
    resample: float | None = None  # Hz; 0: at the median step; None: time stamps stay as they are
    force: bool = False


@dataclass(frozen=True, slots=True)
class Report:
    """What was read, in numbers: the record as it was, before any resampling."""

    files: tuple[str, ...]
    samples: int
    seconds: float | None  # None: no time, as below
    rate_Hz: float | None  # of the median step
    even: bool | None  # no step but a gap differs from the median one by more than 2 %
    shortest_step_s: float | None
    longest_step_s: float | None  # that is no gap
    gaps: int | None  # steps of more than 1.5 median ones
    longest_gap_s: float | None
    resampled: bool
    input_unit: str
    input_range: tuple[float, float]
    output_unit: str
    output_range: tuple[float, float]
    correlation: float  # of input and output
    polarity: str  # "rising", "falling", or "unclear" where the correlation is weak
    reversals: int  # that are no noise
    false_reversals: int
    input_noise: float | None  # standard deviation, input unit; None where the record cannot tell
    coverage_percent: float  # cells of 48 levels over its own range, switched on and off
    every: int  # the last six figures are those of every so many samples: 1 below a million


@dataclass(frozen=True, slots=True)
class Imported:
    """One run that was written."""

    output: Path
    report: Report
    facts: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Result:
    """What was read; ``output`` and ``facts`` are those of the first run."""

    output: Path
    facts: dict[str, Any]
    runs: tuple[Imported, ...]


def run(options: Options, context: Context) -> Result:
    """Read the files and store the runs; nothing is written before all of them have been read.

    Raises
    ------
    UsageError
        An output exists, or two files would be written to one; the options contradict each other.
    DataError
        A file cannot be read, lacks a column, or holds what is not a number; a unit is none; time does not
        increase.
    """
    groups = preflight.import_groups(options.files, options.output)
    resampled = options.resample is not None
    preflight.check_timing(options.time_column, options.rate_Hz, no_time=options.no_time, resampled=resampled)
    preflight.check_files(outputs=groups, force=options.force, others=options.files)
    read: list[tuple[Path, tuple[Path, ...], Report, Run]] = []
    for k, (target, files) in enumerate(groups.items()):
        read.append((target, files, *_read_group(files, options, context)))
        context.progress(0.7 * (k + 1) / len(groups))
    written = []
    for target, files, report, kept in read:
        _note_time(report, context)
        _store(target, files, kept, options, context)
        written.append(Imported(target, report, _facts(kept, report)))
    context.progress(1.0)
    return Result(written[0].output, written[0].facts, tuple(written))


def _read_group(files: Sequence[Path], options: Options, context: Context) -> tuple[Report, Run]:
    """Return what the files of one run hold, and the run that is kept: no other copy stays in memory."""
    parts = [_read(path, options, context) for path in files]
    whole = parts[0] if len(parts) == 1 else run_from_table.joined(parts, context.note)
    report = report_of(whole, files, resampled=options.resample is not None)
    if options.resample is None:
        return report, whole
    del whole
    evened = [run_from_table.resampled(part, options.resample or None) for part in parts]
    return report, evened[0] if len(evened) == 1 else run_from_table.joined(evened)


def _read(path: Path, options: Options, context: Context) -> Run:
    return run_from_table.read_run(
        path,
        input_column=options.input_column,
        output_column=options.output_column,
        time_column=options.time_column,
        reference_column=options.reference_column,
        input_unit=options.input_unit,
        output_unit=options.output_unit,
        rate_Hz=options.rate_Hz,
        no_time=options.no_time,
        note=context.note,
    )


def _store(target: Path, files: Sequence[Path], whole: Run, options: Options, context: Context) -> None:
    header = provenance.make_header(
        f"{', '.join(path.name for path in files)}, imported",
        argv=context.argv,
        now=context.now(),
        parameters={k: v for k, v in asdict(options).items() if k not in ("files", "output", "force")},
        inputs=provenance.digests(files),
        libraries=provenance.library_versions(),
    )
    store.write(target, whole, header, overwrite=options.force)


def report_of(whole: Run, files: Sequence[Path], *, resampled: bool = False) -> Report:
    """Return what a run holds, in numbers."""
    timed = whole.time_s is not None
    steps = steps_of(whole.time_s) if whole.time_s is not None else None
    low, high = float(whole.input.min()), float(whole.input.max())
    every = -(-whole.input.size // _LOOKED_AT)
    u, y = whole.input[::every], whole.output[::every]
    cleaned = input_noise.clean(u)
    correlation = correlation_of([Record(u, y)])
    direction = "rising" if correlation > 0 else "falling"
    covered = coverage(Plane.uniform(low, high, LEVELS), [cleaned.input]) if high > low else np.zeros(1)
    return Report(
        files=tuple(str(path) for path in files),
        samples=whole.input.size,
        seconds=float(whole.time_s[-1] - whole.time_s[0]) if whole.time_s is not None else None,
        rate_Hz=1.0 / steps.median if steps else None,
        even=steps.even if steps else None,
        shortest_step_s=steps.shortest if steps else None,
        longest_step_s=steps.longest if steps else None,
        gaps=steps.gaps if steps else None,
        longest_gap_s=steps.longest_gap if steps else None,
        resampled=resampled and timed,
        input_unit=whole.input_unit,
        input_range=(low, high),
        output_unit=whole.output_unit,
        output_range=(float(whole.output.min()), float(whole.output.max())),
        correlation=correlation,
        polarity=direction if abs(correlation) >= CLEAR else "unclear",
        reversals=cleaned.kept,
        false_reversals=cleaned.removed,
        input_noise=cleaned.sigma if np.isfinite(cleaned.sigma) else None,
        coverage_percent=100.0 * float(np.mean(covered)),
        every=every,
    )


def _note_time(report: Report, context: Context) -> None:
    """Say what is wrong with the time stamps."""
    names = ", ".join(report.files)
    if report.gaps:
        filled = ", filled with straight lines" if report.resampled else ""
        context.note(f"{names} has {report.gaps} gaps, the longest of {report.longest_gap_s:.3g} s{filled}")
    if (
        report.even is False
        and not report.resampled
        and report.shortest_step_s is not None
        and report.longest_step_s is not None
    ):
        context.note(
            f"the time stamps of {names} are uneven, steps of {1e3 * report.shortest_step_s:.3g} to "
            f"{1e3 * report.longest_step_s:.3g} ms; kept as they are (--resample even makes them even)"
        )


def _facts(whole: Run, report: Report) -> dict[str, Any]:
    """Return the main figures in the order in which a person would ask."""
    shown = run_facts(whole, report.reversals)
    unit = "" if report.input_unit == "1" else f" {report.input_unit}"
    if report.false_reversals:
        shown["noise in the input"] = (
            f"{report.input_noise:.2g}{unit}, {report.false_reversals} more reversals are noise"
        )
    words = {"unclear": "unclear, identify tries both", "rising": "rising", "falling": "falling"}
    shown["loop"] = f"{words[report.polarity]} (correlation {report.correlation:+.2f})"
    shown["coverage_percent"] = report.coverage_percent
    stamps = {True: "even", False: "uneven", None: "none: only the order counts"}[report.even]
    shown["time stamps"] = f"{stamps}, made even" if report.resampled else stamps
    del shown["signal"]  # it is the title
    for name in ("complete", "dropped_samples"):  # of a device, not of a file
        shown.pop(name, None)
    return shown
