"""From named columns of a table to a run: its time, its units, its parts.

Time stamps are taken as they are. Uneven ones stay uneven unless ``resampled`` is asked for; what a file says
about its time, and what was made of it, goes to the ``note`` of the caller.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pulsetrainer.artefacts import FloatArray, Run
from pulsetrainer.artefacts.time_steps import GAP, steps_of
from pulsetrainer.artefacts.units import SECONDS, check_unit, split_unit
from pulsetrainer.core.signals import MOST_SAMPLES
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files.table import Table, read_table
from pulsetrainer.files.timing import check_timing

Note = Callable[[str], None]

_TIME_NAMES = frozenset(
    ["t", "time", "zeit", "temps", "tiempo", "tempo", "t_s", "time_s", "times", "timestamp"]
)
_COUNTED = 16  # rows; of fewer nobody can tell that they are merely counted
_BLOCK = 1 << 18  # samples at a time where a copy of a long record would be in the way


def _silent(_text: str) -> None:
    """Say nothing."""


def read_run(
    path: Path | str,
    *,
    input_column: str,
    output_column: str,
    time_column: str | None = None,
    reference_column: str | None = None,
    input_unit: str | None = None,
    output_unit: str | None = None,
    rate_Hz: float | None = None,
    no_time: bool = False,
    note: Note = _silent,
) -> Run:
    """Read a run out of a file: named columns, and no more of it than these in memory.

    Without ``time_column`` and ``rate_Hz`` the time is the file's own rate, a column named so, or, in a
    text, the first column where that is neither input, output nor reference; otherwise the run has no time
    and only its order counts. A first column that merely counts its rows is no time. Time may be in ms or us.

    Raises
    ------
    UsageError
        More than one of a time column, a rate and ``no_time`` is given, or the rate is not positive.
    DataError
        The file is no table, a column is missing or not finite, a unit is none, there are fewer than two
        rows, or time does not increase (the line is named).
    """
    check_timing(time_column, rate_Hz, no_time=no_time)
    wanted = [name for name in (input_column, output_column, reference_column) if name is not None]
    table = read_table(
        path, lambda head: _needed(head, wanted, time_column, automatic=rate_Hz is None and not no_time)
    )
    columns = {name: np.ascontiguousarray(table.check_finite(name)) for name in wanted}
    rows = table.rows
    if rows < 2:
        raise DataError(
            f"{table.path} has {rows} row, a run needs two or more", hint="export the record again"
        )
    time_s = None
    if rate_Hz is not None:
        time_s = np.arange(rows) / rate_Hz
    elif time_column is not None:
        time_s = seconds(table, time_column)
    elif not no_time:
        time_s = _own_time(table, [table.index(name) for name in wanted], note)
    return Run(
        time_s=time_s,
        input=columns[input_column],
        output=columns[output_column],
        reference=None if reference_column is None else columns[reference_column],
        input_unit=_unit(table, input_column, input_unit, "input unit"),
        output_unit=_unit(table, output_column, output_unit, "output unit"),
        input_quantity=split_unit(table.names[table.index(input_column)])[0],
        output_quantity=split_unit(table.names[table.index(output_column)])[0],
        signal=table.path.name,
    )


def _unit(table: Table, column: str, given: str | None, what: str) -> str:
    """Return the unit that was given, or that of the heading; 1 where there is none."""
    if given is not None:
        return check_unit(given, what)
    own = table.unit(column)
    if not own:
        return "1"
    return check_unit(own, what, f"the heading {table.names[table.index(column)]!r} of {table.path}")


def _needed(table: Table, wanted: Sequence[str], time_column: str | None, *, automatic: bool) -> set[int]:
    """Return the places of the columns that a run is made of."""
    places = {table.index(name) for name in wanted}
    if time_column is not None:
        return places | {table.index(time_column)}
    return places | set(_free(table, places)[:1]) if automatic else places


def _free(table: Table, used: Collection[int]) -> list[int]:
    """Return the places of the columns that may be the file's own time."""
    if table.rate_Hz is not None:
        return []
    if table.shifts:
        candidates = [0]  # of a text, where columns have an order
    else:
        words = [split_unit(name)[0].rpartition(".")[2].lower() for name in table.names]
        candidates = [k for k, word in enumerate(words) if word in _TIME_NAMES]
    return [k for k in candidates if k not in used and table.names[k] not in table.text_names]


def _own_time(table: Table, used: Collection[int], note: Note) -> FloatArray | None:
    """Return the time that a file has by itself, if it has one."""
    if table.rate_Hz is not None:
        return np.arange(table.rows) / table.rate_Hz
    free = _free(table, used)
    if not free:
        note(f"{table.path} has no time: only the order of its samples counts (give --time or --rate)")
        return None
    name = table.names[free[0]]
    if _merely_counts(table.columns[name]):
        note(
            f"the column {name} of {table.path} merely counts the rows, so it is no time: only the order of "
            f"the samples counts (if it is seconds, give --time {name})"
        )
        return None
    return seconds(table, name)


def _merely_counts(values: FloatArray) -> bool:
    """Whether a column is 0, 1, 2, or 1, 2, 3."""
    if values.size < _COUNTED or values[0] not in (0.0, 1.0):
        return False
    return all(
        np.array_equal(values[k : k + _BLOCK], values[0] + np.arange(k, min(k + _BLOCK, values.size)))
        for k in range(0, values.size, _BLOCK)
    )


def seconds(table: Table, name: str) -> FloatArray:
    """Return a column as strictly increasing seconds (n,).

    Raises
    ------
    DataError
        Its unit is none of time, a value is not finite, or it does not increase: the line is named.
    """
    unit = table.unit(name)
    if unit not in SECONDS:
        raise DataError(
            f"{table.path} gives the time {name} in {unit!r}, which is not one of s, ms, us, min, h",
            hint="give it in one of these; import also takes another --time column, or --rate",
        )
    time_s = table.check_finite(name)
    if SECONDS[unit] != 1.0:
        time_s = time_s * SECONDS[unit]
    back = np.flatnonzero(time_s[1:] <= time_s[:-1])
    if back.size:
        row = int(back[0]) + 1
        same = time_s[row] == time_s[row - 1]
        raise DataError(
            f"the time in {table.path}, column {name}, does not increase at {table.place(row)}: "
            f"{time_s[row]:g} s after {time_s[row - 1]:g} s ({back.size} such rows)",
            hint="drop the repeated rows; import also takes --rate instead of the time"
            if same
            else "sort the rows; import also takes another --time column, --rate, or parts as several files",
        )
    return time_s


def resampled(run: Run, rate_Hz: float | None) -> Run:
    """Return a run on even time steps, straight between samples; None: at its median step.

    Raises
    ------
    UsageError
        The run has no time, or the rate is not positive or would make too many samples.
    """
    if run.time_s is None:
        raise UsageError("a run without time cannot be resampled", hint="give --time or --rate")
    if rate_Hz is not None and not 0 < rate_Hz < np.inf:
        raise UsageError(
            f"the rate must be positive, got {rate_Hz:g} Hz", hint="for instance --resample 1000"
        )
    step = steps_of(run.time_s).median if rate_Hz is None else 1.0 / rate_Hz
    count = int(np.floor((run.time_s[-1] - run.time_s[0]) / step + 1e-9)) + 1
    if not 2 <= count <= MOST_SAMPLES:
        raise UsageError(
            f"resampling to steps of {step:.3g} s would make {count} samples of {run.input.size}",
            hint="choose another rate",
        )
    even = run.time_s[0] + np.arange(count) * step
    return replace(
        run,
        time_s=even,
        input=np.interp(even, run.time_s, run.input),
        output=np.interp(even, run.time_s, run.output),
        reference=None if run.reference is None else np.interp(even, run.time_s, run.reference),
    )


def joined(parts: Sequence[Run], note: Note = _silent) -> Run:
    """Return parts of one run, one after the other, with a seam where one does not go on with the one before.

    Raises
    ------
    DataError
        Some parts have a time or a reference and others have none, or their units differ.
    """
    first = parts[0]
    for part in parts[1:]:
        if (part.input_unit, part.output_unit) != (first.input_unit, first.output_unit):
            raise DataError(
                f"{part.signal} is in {part.input_unit} and {part.output_unit}, but {first.signal} is in "
                f"{first.input_unit} and {first.output_unit}",
                hint="give --input-unit and --output-unit, or import them one by one",
            )
        for name in ("time_s", "reference"):
            if (getattr(part, name) is None) != (getattr(first, name) is None):
                raise DataError(
                    f"of {first.signal} and {part.signal} only one has a {name.removesuffix('_s')}",
                    hint="give --rate or --no-time for all, or import them one by one",
                )
    times, seams = _joined_time(parts, note)
    starts = np.cumsum([part.input.size for part in parts])[:-1]
    seam = np.zeros(sum(part.input.size for part in parts), dtype=bool)
    seam[starts] = seams
    return replace(
        first,
        seam=seam if seam.any() else None,
        time_s=times,
        input=np.concatenate([part.input for part in parts]),
        output=np.concatenate([part.output for part in parts]),
        reference=None
        if first.reference is None
        else np.concatenate([part.reference for part in parts if part.reference is not None]),
        signal=", ".join(part.signal for part in parts),
    )


def _joined_time(parts: Sequence[Run], note: Note) -> tuple[FloatArray | None, list[bool]]:
    """Return the time stamps of all parts, strictly increasing, and before which parts there was a pause.

    A part whose clock goes on, one step or less than a gap after the part before, is its continuation.
    After a pause, or where nobody can tell, the memory is another: a seam.
    """
    times: list[FloatArray] = []
    seams: list[bool] = []
    for part in parts:
        time_s = part.time_s
        if time_s is None:
            return None, [True] * (len(parts) - 1)
        if times:
            step, end = steps_of(times[-1]).median, float(times[-1][-1])
            goes_on = 0 < time_s[0] - end <= GAP * step
            seams.append(not goes_on)
            if time_s[0] <= end:
                note(
                    f"the time of {part.signal} starts anew: it is put {step:.3g} s after the part before it"
                )
                time_s = time_s + (end + step - float(time_s[0]))
        times.append(time_s)
    return np.concatenate(times), seams
