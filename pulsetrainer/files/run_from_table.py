"""From named columns of a table to a run: its time and its units.

Time stamps are taken as they are. What a file says about its time, and what was made of it, is in the notes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.artefacts import FloatArray, Run
from pulsetrainer.artefacts.units import (
    SECONDS,
    check_unit,
    claimed_unit,
    counted,
    same_units,
    split_unit,
    symbol_of,
)
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files.csv_dialect import cell_at, column_words
from pulsetrainer.files.table import Table, read_table
from pulsetrainer.files.time_stamps import is_since_1970, stated_rate, unit_of_count
from pulsetrainer.files.timing import check_timing

_TIME_NAMES = frozenset(
    ["t", "time", "zeit", "temps", "tiempo", "tempo", "t_s", "time_s", "times", "timestamp"]
)
_LEAVE_OUT = "leave bad rows out with `skip_bad_rows`"
_ROW_NAMES = {"column1", "index", "sample", "row", "no", "nr", "n", "#"}  # the first: it has no name
_DAY_S = 86_400.0
_COUNTERS, _COUNTER = frozenset(["us", "ms"]), 2.0**32  # a microcontroller's
_EXACT = 0.02  # of a step: what rounding of large stamps may be off by
_IN_SECONDS = " in s"  # the heading that `diagnose` asks for: whole seconds under it count no rows
_SLOW_S, _MANY = 1.0, 100  # a step of so much is rare in many rows, and usual for ms taken as seconds
_SUBTRACT = "steps of time are rounded (subtract the first stamp from all, or give `rate_Hz`)"
_USUAL_STEP = 1.0  # times the usual step: so far another step may be off
_SAME_RATE = 0.01  # of a rate: less may be rounding, or a clock
_COUNTED = 16  # rows; of fewer nobody can tell that they are merely counted
_NAMED_UNREAD = 4  # columns: of many nobody reads the names
_BLOCK = 1 << 18  # samples at a time where a copy of a long record would be in the way


class TableRun(NamedTuple):
    """The run in a table, and what there is to say about how it was read."""

    run: Run
    notes: tuple[str, ...]
    read_as: Mapping[str, str]  # which columns were taken for what, and how a text is laid out


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
    read = partial(read_table, path, bad_rows=skip_bad_rows, remedy=_LEAVE_OUT)
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
    columns = {name: np.ascontiguousarray(table.check_finite(name, remedy=_LEAVE_OUT)) for name in wanted}
    if table.rows < 2:
        raise DataError(
            f"{table.path} has {counted(table.rows, 'row')}, a run needs two or more",
            hint="export the record again",
        )
    when = _Time(None, "no time") if no_time else _time(table, wanted, time, rate_Hz, whole)
    _check_distinct(table, input=input, output=output, reference=reference, time=time)
    run = Run(
        time_s=when.s,
        input=columns[input],
        output=columns[output],
        reference=None if reference is None else columns[reference],
        input_unit=_unit(table, input, input_unit, "`input_unit`"),
        output_unit=_unit(table, output, output_unit, "`output_unit`"),
        input_quantity=split_unit(table.names[table.index(input)])[0],
        output_quantity=split_unit(table.names[table.index(output)])[0],
        signal=table.path.name,
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
    place = _own_column(table, used)
    alone = replace(table, columns={table.names[k]: table.columns[table.names[k]] for k in used})
    told_Hz, where = (table.rate_Hz,) * 2, f"{table.path} itself"
    if place is not None and table.names[place] in table.columns:
        name = table.names[place]
        told_Hz, where = _rates_of(table, name), f"the column {name!r} of {table.path}"
    if any(told is None or abs(told / rate_Hz - 1.0) < _SAME_RATE for told in told_Hz):
        return alone, ()
    said = f"{where} says {told_Hz[0]:.6g} Hz, and `rate_Hz` {rate_Hz:g}"
    return alone, (f"{said}: taken as {rate_Hz:g} Hz",)


def _rates_of(table: Table, name: str) -> tuple[float | None, float | None]:
    """Return the rate of a column of time, Hz, by its median step and by its length; None: it is no time."""
    stamps = table.columns[name]
    unit = _unit_of_time(table, name)
    increasing = bool(stamps.size > 1 and np.all(np.isfinite(stamps)) and np.all(np.diff(stamps) >= 0))
    if not unit or unit not in SECONDS or not increasing or stamps[-1] == stamps[0]:
        return None, None
    median, mean = float(np.median(np.diff(stamps))), float(stamps[-1] - stamps[0]) / (stamps.size - 1)
    # stamps that are rounded repeat themselves: the mean alone tells
    return 1.0 / (SECONDS[unit] * (median or mean)), 1.0 / (SECONDS[unit] * mean)


class _Time(NamedTuple):
    """The time of a record: s (n,), where it comes from, and what there is to say of that."""

    s: FloatArray | None
    words: str
    notes: tuple[str, ...] = ()


def _time(
    table: Table, wanted: Sequence[str], time: str | None, rate_Hz: float | None, whole: Table
) -> _Time:
    """Return the time by a rate, in a column, or, where neither is given, what the file has by itself.

    ``whole`` is the table before rows were left out: it tells whether a column counts them.
    """
    rate_Hz = table.rate_Hz if rate_Hz is None and time is None else rate_Hz
    if rate_Hz is not None:
        return _Time(np.arange(table.rows) / rate_Hz, f"time by the rate of {rate_Hz:g} Hz")
    if time is None:
        place = _own_column(table, {table.index(name) for name in wanted})
        if place is None:
            other = "other " * any(_is_called_time(table.names[table.index(name)]) for name in wanted)
            lack = f"{table.path} has no {other}time column"
            return _counted(table, lack, "give `time` or `rate_Hz`", whole=table is whole)
        time = table.names[place]
        # no row is counted in ms; the licensed t_s of seconds does count rows
        counts = _just_counts(whole.columns[time]) and _unit_of_time(table, time) in ("", "s")
        if counts and not time.endswith(_IN_SECONDS):
            lack = f"the column {time} of {table.path} only counts the rows, so it is not used as time"
            return _counted(table, lack, f"if it is in seconds, give `time` {time!r}", whole=table is whole)
    heading = table.names[table.index(time)]
    unit, notes = _taken_as(table, heading)
    table = replace(table, units={**table.units, heading: unit}) if unit else table
    words = f"time from {split_unit(heading)[0]} " + (f"[{unit}]" if unit else "(no unit: taken as s)")
    stamps, again = _begun_again(table.check_finite(time, remedy=_LEAVE_OUT), unit or "s")
    if again:
        table = replace(table, columns={**table.columns, heading: stamps})
        notes = (*notes, f"the time of {table.path} {again}")
    time_s = seconds(table, time, of_record=True)
    step = float(np.median(np.diff(time_s)))
    if not unit and step >= _SLOW_S and time_s.size >= _MANY:
        said = f"the samples of {table.path} are {step:g} s apart if its time is in seconds, as assumed"
        notes = (*notes, f"{said} (if it is in ms, write the heading as '{heading} [ms]')")
    if np.spacing(np.abs(time_s[0])) > _EXACT * step:
        notes = (*notes, f"the stamps of {table.path} have more digits than a number holds: {_SUBTRACT}")
    return _Time(time_s, words, notes)


def _taken_as(table: Table, heading: str) -> tuple[str, tuple[str, ...]]:
    """Return the unit of a column of time, by its heading or its size, and what there is to say of that."""
    unit, first = _unit_of_time(table, heading), float(table.columns[heading][0])
    by_size = "" if unit else unit_of_count(first, heading)
    stamped = is_since_1970(first, unit) and not _as_written(table, heading, 0, "")
    if by_size or stamped:
        told = "days of a spreadsheet" if by_size == "d" else f"{by_size or unit or 's'} since 1970"
        return by_size or unit, (f"the column {heading} of {table.path} is taken as {told}, by its size",)
    if not unit and _unknown_unit(table, heading):
        said = f"the heading {heading!r} of {table.path} has no known unit: taken as seconds"
        return unit, (f"{said} (write the unit in brackets, such as 't [min]')",)
    return unit, ()


def _counted(table: Table, lack: str, remedy: str, *, whole: bool) -> _Time:
    """Return the time of counted rows at the rate that the comments state, else none."""
    stated = stated_rate(table.comments) if whole else None
    if stated is None:
        return _Time(None, "no time", (f"{lack}: only the order of the samples is known ({remedy})",))
    rate_Hz, said = stated
    note = f"{lack}: the rate is that of its comment {said!r}"
    return _Time(np.arange(table.rows) / rate_Hz, f"time by the rate of {rate_Hz:g} Hz", (note,))


def _begun_again(stamps: FloatArray, unit: str) -> tuple[FloatArray, str]:
    """Return times (n,) that go on where a day or a counter began again, and what was done; empty: nothing.

    A step back is midnight where with a day more it is a usual step of the record.
    """
    step = np.diff(stamps)
    back = np.flatnonzero(step < 0)
    whole, said = (_DAY_S, "goes past midnight: a day is added from there on")
    if unit in _COUNTERS:
        whole, said = _COUNTER, "begins again, as a counter of 32 bits does: 2^32 is added from there on"
    elif unit != "s":
        return stamps, ""
    if not back.size or stamps.min() < 0 or stamps.max() >= whole:
        return stamps, ""
    usual = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
    if np.any(np.abs(step[back] + whole - usual) > _USUAL_STEP * usual):
        return stamps, ""
    return stamps + whole * np.cumsum(np.concatenate(([0.0], step < 0))), said


def _read_as(table: Table, time: str, meanings: Mapping[str, tuple[str, str]]) -> dict[str, str]:
    """Say which columns were taken for what, in which units, and of a text how it is laid out."""
    said = [time]
    for meaning, (name, unit) in meanings.items():
        column = split_unit(table.names[table.index(name)])[0]
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
    return check_unit(own, what, f"the heading {table.names[table.index(column)]!r} of {table.path}")


def _other_units(table: Table, meanings: Mapping[str, tuple[str, str]]) -> list[str]:
    """Say which headings name another unit than the one that was given: the numbers are not converted."""
    return [
        f"the heading {table.names[table.index(column)]!r} of {table.path} says {own}, and `{meaning}_unit` "
        f"{unit}: taken as {unit}, not converted"
        for meaning, (column, unit) in meanings.items()
        if (own := table.unit(column)) and not same_units([own], [unit])
    ]


def _times_asked_for(table: Table, meanings: Mapping[str, tuple[str, str]]) -> list[str]:
    """Say which columns look like the time of the record, by name and numbers, and were given a meaning."""
    return [
        f"the column {heading!r} of {table.path} looks like the time, but was given as the {meaning}"
        for meaning, (column, _) in meanings.items()
        if _is_called_time(heading := table.names[table.index(column)])
        and bool(np.all(np.diff(table.columns[heading]) > 0))
    ]


def _not_read(table: Table) -> list[str]:
    """Say which columns of numbers were not read: one of them may be what a model misses."""
    unread = (name for name in table.names if name not in table.columns and name not in table.text_names)
    left = [
        name
        for name in unread
        if name.lower() not in _ROW_NAMES
        and not (_is_called_time(name) and table.units.get(name, "") in SECONDS)  # T_degC is no time
    ]
    more = len(left) - _NAMED_UNREAD
    named = ", ".join(left[:_NAMED_UNREAD]) + (f" and {more} more" if more > 0 else "")
    return [f"columns of {table.path} that were not read: {named}"] if left else []


def _is_called_time(heading: str) -> bool:
    return split_unit(heading)[0].rpartition(".")[2].lower() in _TIME_NAMES


def _needed(table: Table, wanted: Sequence[str], time_column: str | None, *, automatic: bool) -> set[int]:
    """Return the places of the columns that a run is made of."""
    places = {table.index(name) for name in wanted}
    if time_column is not None:
        return places | {table.index(time_column)}
    own = _own_column(table, places) if automatic else None
    return places if own is None else {*places, own}


def _own_column(table: Table, used: Collection[int]) -> int | None:
    """Return the place of the column that may be the file's own time; None where there is none."""
    if table.rate_Hz is not None:
        return None
    words = [split_unit(name)[0].rpartition(".")[2].lower() for name in table.names]
    candidates = [k for k, name in enumerate(table.names) if _is_called_time(name)]
    if table.shifts:  # of a text, where columns have an order: the first, or behind a row's number or date
        passed = words[0] in _ROW_NAMES or table.names[0] in table.text_names
        candidates = [*candidates, 0] if passed else [0]
    free = (k for k in candidates if k not in used and table.names[k] not in table.text_names)
    return next(free, None)


def _unit_of_time(table: Table, name: str) -> str:
    """Return the unit of a column of time, empty where the header says none; ``min`` may be all of it."""
    alone = symbol_of(table.names[table.index(name)])
    return table.unit(name) or (alone if alone in SECONDS else "")


def _unknown_unit(table: Table, name: str) -> str:
    """Return what the heading of a time says in the place of a unit, empty where it is a name alone."""
    heading = table.names[table.index(name)]
    bare, _, behind = heading.rpartition("_")
    return claimed_unit(heading) or (behind if bare.lower() in _TIME_NAMES else "")


def _just_counts(values: FloatArray) -> bool:
    """Whether a column is 0, 1, 2, or 1, 2, 3, wherever something stands in it."""
    if values.size < _COUNTED or values[0] not in (0.0, 1.0):
        return False
    parts = ((k, values[k : k + _BLOCK]) for k in range(0, values.size, _BLOCK))
    return all(
        bool(np.all((part == values[0] + np.arange(k, k + part.size)) | np.isnan(part))) for k, part in parts
    )


def seconds(table: Table, name: str, *, of_record: bool = False) -> FloatArray:
    """Return a column as strictly increasing seconds (n,).

    Rows of a record may be left out, and its time is in seconds where its unit is not known.

    DataError where its unit is none of time, a value is not finite, or it does not increase: the line is
    named.
    """
    unit = _unit_of_time(table, name) or ("" if of_record else _unknown_unit(table, name))
    if unit not in SECONDS:
        raise DataError(
            f"the time {column_words(name)} of {table.path} is in {unit!r}, expected s, ms, us, ns, min, h "
            "or d",
            hint="convert it to seconds" + ", choose another `time` column, or give a `rate_Hz`" * of_record,
        )
    stamps = table.check_finite(name, remedy=_LEAVE_OUT) if of_record else table.check_finite(name)
    time_s = stamps if SECONDS[unit] == 1.0 else stamps * SECONDS[unit]
    back = np.flatnonzero(time_s[1:] <= time_s[:-1])
    if back.size:
        row = int(back[0]) + 1
        this, before = (
            _as_written(table, name, k, f"{stamps[k]:.15g} {unit or 's'}") for k in (row, row - 1)
        )
        if stamps[row] != stamps[row - 1]:
            hint = "sort the rows"
            other = ", choose another `time` column, give a `rate_Hz`, or cut the file into parts"
        elif all(column[row] == column[row - 1] for column in table.columns.values()):
            hint, other = "drop the repeated rows", ", or give a `rate_Hz` instead of the time"
        else:
            hint = "its time stamps are repeated, or rounded too coarsely: write them with more digits"
            other = ", or give a `rate_Hz` instead of the time"
        raise DataError(
            f"the time in {table.path}, {column_words(name)}, does not increase at {table.place(row)}: "
            f"{this} after {before} ({counted(back.size, 'such row')})",
            hint=hint + other * of_record,
        )
    return time_s


def _as_written(table: Table, name: str, row: int, value: str) -> str:
    """Return a time as it stands in the file where it is a time of day or a date there, else its value."""
    cell = cell_at(table.path, table.line_of(row), table.index(name)) if table.shifts else ""
    return cell if ":" in cell else value
