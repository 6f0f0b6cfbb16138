"""From named columns of a table to a run: its time and its units.

Time stamps are taken as they are. What a file says about its time, and what was made of it, is in the notes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pulsetrainer.artefacts import FloatArray, Run
from pulsetrainer.artefacts.units import SECONDS, check_unit, split_unit
from pulsetrainer.errors import DataError
from pulsetrainer.files.table import Table, read_table
from pulsetrainer.files.timing import check_timing

_TIME_NAMES = frozenset(
    ["t", "time", "zeit", "temps", "tiempo", "tempo", "t_s", "time_s", "times", "timestamp"]
)
_COUNTED = 16  # rows; of fewer nobody can tell that they are merely counted
_BLOCK = 1 << 18  # samples at a time where a copy of a long record would be in the way


class TableRun(NamedTuple):
    """The run in a table, and what there is to say about how it was read."""

    run: Run
    notes: tuple[str, ...]


def run_from_table(
    path: Path | str,
    *,
    input: str,  # noqa: A002 - the name of the run's field
    output: str,
    time: str | None = None,
    reference: str | None = None,
    input_unit: str | None = None,
    output_unit: str | None = None,
    rate_Hz: float | None = None,
    no_time: bool = False,
) -> TableRun:
    """Read a run out of a file: named columns, and no more of it than these in memory.

    Without ``time`` and ``rate_Hz`` the time is the file's own rate, a column named so, or, in a text, the
    first column where that is neither input, output nor reference; otherwise the run has no time and only
    its order counts. A first column that just counts its rows is not used as time. Time may be in ms or us.

    Raises
    ------
    UsageError
        More than one of a time column, a rate and ``no_time`` is given, or the rate is not positive.
    DataError
        The file is no table, a column is missing or not finite, a unit is not known, there are fewer than
        two rows, or time does not increase (the line is named).
    """
    check_timing(time, rate_Hz, no_time=no_time)
    wanted = [name for name in (input, output, reference) if name is not None]
    automatic = rate_Hz is None and not no_time
    table = read_table(path, lambda head: _needed(head, wanted, time, automatic=automatic))
    columns = {name: np.ascontiguousarray(table.check_finite(name)) for name in wanted}
    rows = table.rows
    notes: tuple[str, ...] = ()
    if rows < 2:
        raise DataError(
            f"{table.path} has {rows} row, a run needs two or more", hint="export the record again"
        )
    time_s: FloatArray | None = None
    if rate_Hz is not None:
        time_s = np.arange(rows) / rate_Hz
    elif time is not None:
        time_s = seconds(table, time)
    elif not no_time:
        time_s, notes = _own_time(table, [table.index(name) for name in wanted])
    run = Run(
        time_s=time_s,
        input=columns[input],
        output=columns[output],
        reference=None if reference is None else columns[reference],
        input_unit=_unit(table, input, input_unit, "`input_unit`"),
        output_unit=_unit(table, output, output_unit, "`output_unit`"),
        input_quantity=split_unit(table.names[table.index(input)])[0],
        output_quantity=split_unit(table.names[table.index(output)])[0],
        signal=table.path.name,
    )
    return TableRun(run, notes)


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


def _own_time(table: Table, used: Collection[int]) -> tuple[FloatArray | None, tuple[str, ...]]:
    """Return the time that a file has by itself, if it has one, and a note if it has none."""
    if table.rate_Hz is not None:
        return np.arange(table.rows) / table.rate_Hz, ()
    free = _free(table, used)
    if not free:
        note = f"{table.path} has no time column: its samples have an order only (give `time` or `rate_Hz`)"
        return None, (note,)
    name = table.names[free[0]]
    if _just_counts(table.columns[name]):
        note = (
            f"the column {name} of {table.path} just counts the rows, so it is not used as time: the samples "
            f"have an order only (if it is in seconds, give `time` {name})"
        )
        return None, (note,)
    return seconds(table, name), ()


def _just_counts(values: FloatArray) -> bool:
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
            f"the time column {name} of {table.path} is in {unit!r}, expected s, ms, us, min or h",
            hint="convert it to seconds, choose another `time` column, or give a `rate_Hz`",
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
            hint="drop the repeated rows, or give a `rate_Hz` instead of the time"
            if same
            else "sort the rows, choose another `time` column, give a `rate_Hz`, or cut the file into parts",
        )
    return time_s
