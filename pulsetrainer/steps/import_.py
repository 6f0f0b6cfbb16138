"""Import: the parts of a record, read from tables, become one run, with a report of what was read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.artefacts import BoolArray, FloatArray, Run
from pulsetrainer.artefacts.run import seam_of
from pulsetrainer.artefacts.time_steps import BLOCK, GAP, gaps_of, steps_of
from pulsetrainer.artefacts.units import counted, in_units, same_units, with_seconds, with_unit
from pulsetrainer.core import held, input_noise
from pulsetrainer.core.coverage import coverage, little_words, minor_coverage
from pulsetrainer.core.excitations import MOST_SAMPLES
from pulsetrainer.core.identification import CLEAR, correlation_of
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.errors import ArgumentError, DataError, UsageError

LEVELS = 48  # of the plane whose coverage is reported, over the record's own range
_JUMP, _FEW_JUMPS = 0.5, 3  # share of the range, and how many of them: more are how it was driven
_EVEN = 0.05  # of the range: no other step is larger
_LEAST = 2  # samples between two gaps: of fewer there is no step to resample


@dataclass(frozen=True, slots=True)
class Report:
    """What was read, in numbers: the record as it was, before any resampling."""

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
    minor_percent: float  # of those within the range, told apart by minor loops, not the major one alone
    every: int  # the last six figures are those of every so many samples: 1 below a million


@dataclass(frozen=True, slots=True)
class Imported:
    """A run, what there is to say about its making, and the record as it was."""

    run: Run
    report: Report
    notes: tuple[str, ...]


def import_parts(parts: Sequence[Run], *, resample: float | Literal["even"] | None = None) -> Imported:
    """Join the parts of a record, in their order, and make its time steps even if ``resample`` says so.

    It is a rate in Hz, ``"even"`` for that of the median step, None to leave the time stamps as they are.

    ArgumentError for another word; UsageError where the run has no time to resample, or the rate would make
    too many samples; DataError where the parts differ in units, or only some have a time or a reference.
    """
    if isinstance(resample, str) and resample != "even":
        raise ArgumentError(f"`resample` must be a rate in Hz or 'even', got {resample!r}", hint="try 'even'")
    read = [as_read(part) for part in parts]
    parts = [part for part, _ in read]
    run, notes = joined(parts)
    report = report_of(run, resampled=resample is not None)
    notes = (*notes, *(said for _, told in read for said in told), *_jumps(run))
    if (said := little_words(report.coverage_percent / 100.0)) and not _still(run.signal, report):
        notes = (*notes, f"{run.signal}: {said}")
    if run.gap_words:
        notes = (*notes, f"{run.signal}: {run.gap_words}")
    if resample is not None:
        signal = run.signal
        del run
        rate_Hz = None if resample == "even" else float(resample)
        run, _ = joined([resampled(one, rate_Hz) for part in parts for one in part.parts(_LEAST)])
        run = replace(run, signal=signal)
    return Imported(run, report, (*notes, *_still(run.signal, report), *_notes_on_time(run.signal, report)))


def as_read(run: Run) -> tuple[Run, list[str]]:
    """Return a run without the readings that its logger repeated, and notes that say so.

    Rows without a new input are left out. Rows without a new output stay, as the input has moved on, but are
    ``masked``.
    """
    notes = []
    new = held.input_readings(run.input, run.output)
    if new is not None:
        notes.append(_repeated(run, run.input_quantity, new, "are left out"))
        run = replace(
            run,
            time_s=None if run.time_s is None else run.time_s[new],
            input=run.input[new],
            output=run.output[new],
            reference=None if run.reference is None else run.reference[new],
        )
    new = held.output_readings(run.input, run.output)
    if new is not None:
        notes.append(_repeated(run, run.output_quantity, new, "count in no fit"))
        run = replace(run, masked=~new)
    return run, notes


def _repeated(run: Run, quantity: str, new: BoolArray, what: str) -> str:
    return (
        f"the {quantity} in {run.signal} is new in one of {1.0 / np.mean(new):.3g} rows only, as its logger "
        f"repeats each reading: the {np.count_nonzero(~new)} rows between {what}"
    )


def report_of(whole: Run, *, resampled: bool = False) -> Report:
    """Return what a run holds, in numbers."""
    steps = steps_of(whole.time_s) if whole.time_s is not None else None
    gaps = gaps_of(whole.time_s, whole.seam)
    low, high = float(whole.input.min()), float(whole.input.max())
    every = input_noise.every(whole.input.size)
    u, y = whole.input[::every], whole.output[::every]
    cleaned = input_noise.clean(u)
    correlation = correlation_of([Record(u, y)])
    direction = "rising" if correlation > 0 else "falling"
    plane = Plane.uniform(low, high, LEVELS) if high > low else None
    covered = np.zeros(1) if plane is None else coverage(plane, [cleaned.input])
    return Report(
        samples=whole.input.size,
        seconds=float(whole.time_s[-1] - whole.time_s[0]) if whole.time_s is not None else None,
        rate_Hz=1.0 / steps.median if steps else None,
        even=steps.even if steps else None,
        shortest_step_s=steps.shortest if steps else None,
        longest_step_s=steps.longest if steps else None,
        gaps=gaps.number if steps else None,
        longest_gap_s=gaps.longest_s if steps else None,
        resampled=resampled and steps is not None,
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
        minor_percent=0.0
        if plane is None
        else 100.0 * minor_coverage(plane, [cleaned.input], cleaned.dead_band),
        every=every,
    )


def _still(name: str, report: Report) -> list[str]:
    return [
        f"the {what} of {name} never moves: it is {with_unit(f'{low:g}', unit)} throughout"
        for what, (low, high), unit in (
            ("input", report.input_range, report.input_unit),
            ("output", report.output_range, report.output_unit),
        )
        if not high > low
    ]


def _jumps(run: Run) -> list[str]:
    """Say where an input that moves evenly jumps and stays there, as where a piece of a record is missing."""
    reach = float(np.ptp(run.input))
    found: list[int] = []
    for part in run.slices:
        at, other = _far_steps(run.input[part], _JUMP * reach)
        lonely = at.size <= _FEW_JUMPS and np.all(np.diff(at) > 1)  # else a staircase, or a wild sample
        if not lonely or other > _EVEN * reach:
            return []
        found += [(part.start or 0) + int(k) + 1 for k in at]
    if not found:
        return []
    if run.time_s is None:
        where = "at " + ", ".join(f"sample {k + 1}" for k in found)
    else:  # counted from its beginning: a time stamp may hold a date
        since = run.time_s[found] - run.time_s[0]
        where = ", ".join(map(with_seconds, since.tolist())) + " after its first sample"
    share = 100.0 * abs(float(run.input[found[0]] - run.input[found[0] - 1])) / reach
    said = f"the input of {run.signal} jumps by {share:.0f} % of its range from one sample to the next, "
    return [f"{said}{where}: if the device was not driven so, a piece of the record is missing"]


def _far_steps(inputs: FloatArray, far: float) -> tuple[NDArray[np.int64], float]:
    """Return the steps (k,) of an input (n,) that are larger than ``far``, and the largest of the others."""
    found, other = [np.empty(0, np.int64)], 0.0
    for k in range(0, inputs.size - 1, BLOCK):
        step = np.abs(np.diff(inputs[k : k + BLOCK + 1]))
        large = step > far
        found.append(k + np.flatnonzero(large))
        other = max(other, float(step[~large].max(initial=0.0)))
    return np.concatenate(found), other


def _notes_on_time(name: str, report: Report) -> list[str]:
    notes = []
    if report.gaps:
        filled = ", filled with straight lines where the input went on" if report.resampled else ""
        longest = with_seconds(report.longest_gap_s or 0.0)
        gaps = f"{counted(report.gaps, 'gap')} (more than 1.5 usual time steps)"
        notes.append(f"{name} has {gaps}, the longest of {longest}{filled}")
    if report.even is False and not report.resampled:
        ends = (report.shortest_step_s or 0.0, report.longest_step_s or 0.0)
        steps = " to ".join(map(with_seconds, ends))
        notes.append(
            f"the time stamps of {name} are uneven, steps of {steps}; kept as they are "
            "(`resample` even makes them even)"
        )
    return notes


def resampled(run: Run, rate_Hz: float | None) -> Run:
    """Return a run on even time steps, straight between samples; None: at its median step.

    UsageError where the run has no time, or the rate is not positive or would make too many samples.
    """
    if run.time_s is None:
        raise UsageError("a run without time cannot be resampled", hint="give `time` or `rate_Hz`")
    if rate_Hz is not None and not 0 < rate_Hz < np.inf:
        raise UsageError(
            f"`resample` must be a rate above 0, got {rate_Hz:g} Hz", hint="for instance `resample` 1000"
        )
    step = steps_of(run.time_s).median if rate_Hz is None else 1.0 / rate_Hz
    with np.errstate(over="ignore"):  # then it is infinite
        count = np.floor((run.time_s[-1] - run.time_s[0]) / step + 1e-9) + 1
    if not 2 <= count <= MOST_SAMPLES:
        raise UsageError(
            f"`resample` to {1.0 / step:.4g} Hz would make {count:.4g} sample{'' if count == 1 else 's'} out "
            f"of the {run.input.size} of {run.signal}, expected from 2 to {MOST_SAMPLES:,}",
            hint=(f"give a {'lower' if count > 2 else 'higher'} rate" if rate_Hz else "give a lower rate")
            + ", or `resample` even for the median time step" * (rate_Hz is not None),
        )
    even = run.time_s[0] + np.arange(int(count)) * step
    measured = run.counts
    return replace(
        run,
        time_s=even,
        input=np.interp(even, run.time_s, run.input),
        output=np.interp(even, run.time_s[measured], run.output[measured]),
        reference=None if run.reference is None else np.interp(even, run.time_s, run.reference),
        masked=None,
    )


def joined(parts: Sequence[Run]) -> tuple[Run, tuple[str, ...]]:
    """Return the parts as one run, with a seam wherever one does not continue the part before; and notes.

    DataError where some parts have a time or a reference and others have none, or their units differ.
    """
    first = parts[0]
    if len(parts) == 1:
        return first, ()
    for part in parts[1:]:
        if not same_units((part.input_unit, part.output_unit), (first.input_unit, first.output_unit)):
            raise DataError(
                f"{part.signal} {in_units(part)}, but {first.signal} {in_units(first)}",
                hint="give `input_unit` and `output_unit`, or import them one by one",
            )
        for name in ("time_s", "reference"):
            if (getattr(part, name) is None) != (getattr(first, name) is None):
                raise DataError(
                    f"of {first.signal} and {part.signal} only one has a {name.removesuffix('_s')}",
                    hint="give `rate_Hz` or `no_time` for all, or import them one by one",
                )
    times, seams, notes = _joined_time(parts)
    ends = np.cumsum([part.input.size for part in parts])
    whole = replace(
        first,
        seam=seam_of(ends[:-1][seams].tolist(), int(ends[-1])),
        time_s=times,
        input=np.concatenate([part.input for part in parts]),
        output=np.concatenate([part.output for part in parts]),
        reference=None
        if first.reference is None
        else np.concatenate([part.reference for part in parts if part.reference is not None]),
        masked=None
        if all(part.masked is None for part in parts)
        else np.concatenate([~part.counts for part in parts]),
        signal=", ".join(part.signal for part in parts),
        left_out_rows=sum(part.left_out_rows for part in parts),
    )
    return whole, notes


def _joined_time(parts: Sequence[Run]) -> tuple[FloatArray | None, list[bool], tuple[str, ...]]:
    """Return the time stamps of all parts, strictly increasing; where there was a pause; notes.

    A part whose clock goes on, one step or less than a gap after the part before, is its continuation.
    After a pause, or where nobody can tell, the memory is another: a seam.
    """
    times: list[FloatArray] = []
    seams: list[bool] = []
    notes: list[str] = []
    for part in parts:
        time_s = part.time_s
        if time_s is None:
            return None, [True] * (len(parts) - 1), ()
        if times:
            step, end = steps_of(times[-1]).median, float(times[-1][-1])
            goes_on = 0 < time_s[0] - end <= GAP * step
            seams.append(not goes_on)
            if time_s[0] <= end:
                notes.append(
                    f"the clock starts again in {part.signal}: its first sample is set {with_seconds(step)} "
                    "after the end of the part before"
                )
                time_s = time_s + (end + step - float(time_s[0]))
        times.append(time_s)
    return np.concatenate(times), seams, tuple(notes)
