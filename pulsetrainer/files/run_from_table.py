"""From named columns of a table to a run: which rows and columns, in which units, at what time.

What was left out or taken for granted is in the notes. Where the time comes from is in ``time_column``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.artefacts import Run
from pulsetrainer.artefacts.units import SECONDS, check_unit, counted, same_units, split_unit
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files.csv_headings import NO_UNITS
from pulsetrainer.files.table import Table, read_table
from pulsetrainer.files.time_column import (
    LEAVE_OUT,
    ROW_NAMES,
    Time,
    is_called_time,
    own_column,
    rates_of,
    time_of,
)
from pulsetrainer.files.timing import check_timing

_SAME_RATE = 0.01  # of a rate: less may be rounding, or a clock
_NAMED_UNREAD = 4  # columns: of many nobody reads the names


class TableRun(NamedTuple):
    """The run in a table, and what there is to say about how it was read."""

    run: Run
    notes: tuple[str, ...]
    read_as: Mapping[str, str]  # which columns were taken for what, and how a text is laid out


def runs_from_tables(paths: Sequence[Path | str], **how: Any) -> Iterator[TableRun]:
    """Read runs out of files, one after the other, each as ``run_from_table``.

    DataError as it; where a later file has other headings, a column is better named by its number.
    """
    for number, path in enumerate(paths):
        try:
            yield run_from_table(path, **how)
        except DataError as error:
            if number and " has no column " in error.message:
                error.hint = (
                    "the headings of the files differ: give the column by its number, counted from 1, if it "
                    "is the same in all, or import the files one by one"
                )
            raise


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
    skip_bad_rows: bool = False,
) -> TableRun:
    """Read a run out of a file: named columns, and no more of it than these in memory.

    Without ``time`` and ``rate_Hz`` the time is the file's own rate, a column named so, or, in a text, the
    first column where that is neither input, output nor reference; otherwise the run has no time and only
    its order counts. A first column that just counts its rows is not used as time. Time may be in ms or us.

    ``skip_bad_rows`` leaves out rows in which a number is missing, not finite or text, or that have too few
    or too many cells; the notes say how many, and where the first ones are.

    UsageError if more than one of a time column, a rate and ``no_time`` is given, the rate is not positive,
    or one column is given two meanings. DataError if the file is no table, a column is missing or not
    finite, nearly all rows would be left out, a unit is not known, there are fewer than two rows, or time
    does not increase (the line is named).
    """
    check_timing(time, rate_Hz, no_time=no_time)
    wanted = [name for name in (input, output, reference) if name is not None]
    read = partial(read_table, path, bad_rows=skip_bad_rows, remedy=LEAVE_OUT)
    if rate_Hz is None:
        table = read(lambda head: _needed(head, wanted, time, automatic=not no_time))
        contradicted: tuple[str, ...] = ()
    else:
        table, contradicted = _read_at_rate(read, wanted, rate_Hz)
    _check_distinct(table, input=input, output=output, reference=reference)
    table, notes = _without_cut_row(table)
    whole = table
    if skip_bad_rows:
        table, bad = _without_bad_rows(table, counted=rate_Hz is not None)
        notes = (*notes, *bad)
    columns = {name: np.ascontiguousarray(table.check_finite(name, remedy=LEAVE_OUT)) for name in wanted}
    if table.rows < 2:
        raise DataError(
            f"{table.path} has {counted(table.rows, 'row')}, a run needs two or more",
            hint="export the record again",
        )
    when = Time(None, "no time") if no_time else time_of(table, wanted, time, rate_Hz, whole)
    _check_distinct(table, input=input, output=output, reference=reference, time=time)
    run = Run(
        time_s=when.s,
        input=columns[input],
        output=columns[output],
        reference=None if reference is None else columns[reference],
        input_unit=_unit(table, input, input_unit, "`input_unit`"),
        output_unit=_unit(table, output, output_unit, "`output_unit`"),
        input_quantity=split_unit(table.heading(input))[0],
        output_quantity=split_unit(table.heading(output))[0],
        signal=table.path.name,
        left_out_rows=whole.rows - table.rows,
    )
    meanings = {"input": (input, run.input_unit), "output": (output, run.output_unit)}
    notes = (*notes, *_times_asked_for(table, meanings), *_other_units(table, meanings), *_not_read(table))
    if reference is not None:
        meanings["reference"] = (reference, run.input_unit)
    return TableRun(run, (*notes, *contradicted, *when.notes), _read_as(table, when.words, meanings))


def _read_at_rate(
    read: Callable[[Callable[[Table], set[int]]], Table], wanted: Sequence[str], rate_Hz: float
) -> tuple[Table, tuple[str, ...]]:
    """Return the table without a time, and a note where the time or the rate that it has is another one."""
    try:
        table = read(lambda head: _needed(head, wanted, None, automatic=True))
    except DataError:  # its time, which nobody asked for, may be what is damaged
        table = read(lambda head: _needed(head, wanted, None, automatic=False))
    used = {table.index(name) for name in wanted}
    place = own_column(table, used)
    alone = replace(table, columns={table.names[k]: table.columns[table.names[k]] for k in used})
    told_Hz, where = (table.rate_Hz,) * 2, f"{table.path} itself"
    if place is not None and table.names[place] in table.columns:
        name = table.names[place]
        told_Hz, where = rates_of(table, name), f"the column {name!r} of {table.path}"
    if any(told is None or abs(told / rate_Hz - 1.0) < _SAME_RATE for told in told_Hz):
        return alone, ()
    said = f"{where} says {told_Hz[0]:.6g} Hz, and `rate_Hz` {rate_Hz:g}"
    return alone, (f"{said}: taken as {rate_Hz:g} Hz",)


def _read_as(table: Table, time: str, meanings: Mapping[str, tuple[str, str]]) -> dict[str, str]:
    """Say which columns were taken for what, in which units, and of a text how it is laid out."""
    said = [time]
    for meaning, (name, unit) in meanings.items():
        column = split_unit(table.heading(name))[0]
        said.append(f"{meaning} from {column} {'without unit' if unit == '1' else f'[{unit}]'}")
    layout = f"{table.layout}, numbers from {table.place(0)} on"
    return {"columns": ", ".join(said)} | ({"layout": layout} if table.layout else {})


def _check_distinct(table: Table, **meanings: str | None) -> None:
    """Raise UsageError where one column is given two meanings."""
    places: dict[int, str] = {}
    for meaning, name in meanings.items():
        if name is None:
            continue
        place = table.index(name)
        if place in places:
            others = [own for k, own in enumerate(table.names) if k != place]
            raise UsageError(
                f"the {places[place]} and the {meaning} are both the column {table.names[place]} of "
                f"{table.path}",
                hint=f"name another column; the others are {', '.join(others) or 'none'}",
            )
        places[place] = meaning


def _without_cut_row(table: Table) -> tuple[Table, tuple[str, ...]]:
    """Return a table without a last row that the end of the file cuts, and a note of it."""
    if not table.cut:
        return table, ()
    note = (
        f"{table.path} ends within {table.place(table.rows - 1)}: its last value is cut, the row was left out"
    )
    return replace(table, columns={name: column[:-1] for name, column in table.columns.items()}), (note,)


def _without_bad_rows(table: Table, *, counted: bool) -> tuple[Table, tuple[str, ...]]:
    """Return a table without the rows in which a number is missing, and a note of how many there were.

    UsageError where the rows are ``counted`` to tell the time: none may be left out. DataError where hardly
    any row would be left.
    """
    bad = table.bad_rows()
    if bad.size == 0:
        return table, ()
    lack, were = ("lacks", "was") if bad.size == 1 else ("lack", "were")
    said = f"{bad.size} of {table.rows} rows of {table.path} {lack} a number"
    if table.mostly(bad):
        raise DataError(
            f"{said}: too many to leave them out ({table.places(bad)})",
            hint="export the recording again as plain numbers, or name other columns",
        )
    if counted or table.rate_Hz is not None:
        raise UsageError(
            f"{said}, and its rows are counted to give the time",
            hint="name a `time` column, or give `no_time`, so that rows can be left out",
        )
    kept = np.delete(np.arange(table.rows), bad)
    columns = {name: column[kept] for name, column in table.columns.items()}
    note = f"{said} and {were} left out: {table.places(bad)}"
    return replace(table, columns=columns, shifts=_shifts_of(table, kept)), (note,)


def _shifts_of(table: Table, kept: NDArray[np.int64]) -> Sequence[tuple[int, int]]:
    """Where the distance between a row and its line changes, when only some rows (k,) are kept."""
    if not table.shifts:
        return ()
    jumps = np.flatnonzero(np.diff(kept) > 1) + 1
    known = np.searchsorted(kept, [row for row, _ in table.shifts])
    places = np.unique(np.concatenate(([0], jumps, known)))
    return tuple((k, table.line_of(int(kept[k]))) for k in places.tolist() if k < kept.size)


def _unit(table: Table, column: str, given: str | None, what: str) -> str:
    """Return the unit that was given, or that of the heading; 1 where there is none."""
    if given is not None:
        return check_unit(given, what)
    own = table.unit(column)
    if not own:
        return "1"
    heading = table.heading(column)
    if split_unit(heading)[1]:
        return check_unit(own, what, f"the heading {heading!r} of {table.path}")
    where = f"the second line of headings of {table.path}, below {heading!r},"
    return check_unit(own, what, where, NO_UNITS)


def _other_units(table: Table, meanings: Mapping[str, tuple[str, str]]) -> list[str]:
    """Say which headings name another unit than the one that was given: the numbers are not converted."""
    return [
        f"the heading {table.heading(column)!r} of {table.path} says {own}, and `{meaning}_unit` "
        f"{unit}: taken as {unit}, not converted"
        for meaning, (column, unit) in meanings.items()
        if (own := table.unit(column)) and not same_units([own], [unit])
    ]


def _times_asked_for(table: Table, meanings: Mapping[str, tuple[str, str]]) -> list[str]:
    """Say which columns look like the time of the record, by name and numbers, and were given a meaning."""
    return [
        f"the column {heading!r} of {table.path} looks like the time, but was given as the {meaning}"
        for meaning, (column, _) in meanings.items()
        if is_called_time(heading := table.heading(column))
        and bool(np.all(np.diff(table.columns[heading]) > 0))
    ]


def _not_read(table: Table) -> list[str]:
    """Say which columns of numbers were not read: one of them may be what a model misses."""
    unread = (name for name in table.names if name not in table.columns and name not in table.text_names)
    left = [
        name
        for name in unread
        if name.lower() not in ROW_NAMES
        and not (is_called_time(name) and table.units.get(name, "") in SECONDS)  # T_degC is no time
    ]
    more = len(left) - _NAMED_UNREAD
    named = ", ".join(left[:_NAMED_UNREAD]) + (f" and {more} more" if more > 0 else "")
    return [f"columns of {table.path} that were not read: {named}"] if left else []


def _needed(table: Table, wanted: Sequence[str], time_column: str | None, *, automatic: bool) -> set[int]:
    """Return the places of the columns that a run is made of."""
    places = {table.index(name) for name in wanted}
    if time_column is not None:
        return places | {table.index(time_column)}
    own = own_column(table, places) if automatic else None
    return places if own is None else {*places, own}
