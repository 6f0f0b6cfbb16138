"""The time of a table: the rate of the file, a column that is called time, or none.

Time stamps are taken as they are, in the unit that the heading, or their size, says.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.artefacts import FloatArray
from pulsetrainer.artefacts.time_steps import BLOCK, steps_of
from pulsetrainer.artefacts.units import SECONDS, claimed_unit, counted, split_unit, symbol_of
from pulsetrainer.errors import DataError
from pulsetrainer.files.csv_cells import quoted
from pulsetrainer.files.csv_headings import NO_UNITS, column_words
from pulsetrainer.files.csv_rows import cell_at
from pulsetrainer.files.table import Table
from pulsetrainer.files.time_stamps import how_to_write, is_since_1970, stated_rate, unit_of_count

LEAVE_OUT = "leave bad rows out with `skip_bad_rows`"
ROW_NAMES = {"column1", "index", "sample", "row", "no", "nr", "n", "#"}  # the first: it has no name
_TIME_NAMES = frozenset(
    ["t", "time", "zeit", "temps", "tiempo", "tempo", "t_s", "time_s", "times", "timestamp"]
)
_DATES = frozenset(["date", "datum", "fecha", "data", "datetime", "date time", "date/time"])
# whose time it is, or that it has no unit, where its unit would stand
_CLOCKS = frozenset(["utc", "gmt", "local", "epoch", "unix", "1"])
_DAY_S = 86_400.0
_COUNTERS, _COUNTER = frozenset(["us", "ms"]), 2.0**32  # a microcontroller's
_EXACT = 0.02  # of a step: what rounding of large stamps may be off by
_SUFFIX = "_s"  # under it rows are counted, too, as in the licensed loops of steel; not under 'time [s]'
_SLOW_S, _MANY = 0.2, 100  # a step of so much is rare in many rows, and usual for ms taken as seconds
_SUBTRACT = "steps of time are rounded (subtract the first stamp from all, or give `rate_Hz`)"
_USUAL_STEP = 1.0  # times the usual step: so far another step may be off
_HOUR_S = 3600.0  # that a clock is set back by for winter time ...
_SOME, _FEW = 0.5, 4.0  # ... where with an hour more a step is from so many to so many usual ones
_COUNTED = 16  # rows; of fewer nobody can tell that they are merely counted


class Time(NamedTuple):
    """The time of a record: s (n,), where it comes from, and what there is to say of that."""

    s: FloatArray | None
    words: str
    notes: tuple[str, ...] = ()


def time_of(
    table: Table, wanted: Sequence[str], time: str | None, rate_Hz: float | None, whole: Table
) -> Time:
    """Return the time by a rate, in a column, or, where neither is given, what the file has by itself.

    ``whole`` is the table before rows were left out: it tells whether a column counts them.
    """
    rate_Hz = table.rate_Hz if rate_Hz is None and time is None else rate_Hz
    if rate_Hz is not None:
        return Time(np.arange(table.rows) / rate_Hz, f"time by the rate of {rate_Hz:g} Hz")
    if time is None:
        place = own_column(table, {table.index(name) for name in wanted})
        if place is None:
            other = "other " * any(is_called_time(table.heading(name)) for name in wanted)
            unread, remedy = _unread(table)
            lack = f"{table.path} has no {other}time column{unread}"
            return _counted(table, lack, remedy, whole=table is whole)
        time = table.names[place]
        counts = _just_counts(whole.columns[time])
        if counts and (not (unit := unit_of_time(table, time)) or (unit == "s" and time.endswith(_SUFFIX))):
            lack = f"the column {time} of {table.path} only counts the rows, so it is not used as time"
            return _counted(table, lack, f"if it is in seconds, give `time` {time!r}", whole=table is whole)
    heading = table.heading(time)
    unit, notes = _taken_as(table, heading)
    table = replace(table, units={**table.units, heading: unit}) if unit else table
    name = split_unit(heading)[0]
    words = f"time from {name} " + (f"[{unit}]" if unit else "(no unit: taken as s)")
    stamps, again = _begun_again(table.check_finite(time, remedy=LEAVE_OUT), unit or "s")
    if again:
        table = replace(table, columns={**table.columns, heading: stamps})
        notes = (*notes, f"the time of {table.path} {again}")
    time_s = seconds(table, time, of_record=True)
    step = steps_of(time_s).median if time_s.size > 1 else np.nan
    dated = is_since_1970(float(stamps[0]), unit)  # in ms it would be another year
    if not unit and not dated and step >= _SLOW_S and time_s.size >= _MANY:
        said = f"the samples of {table.path} are {step:g} s apart if its time is in seconds, as assumed"
        notes = (*notes, f"{said} (if it is in ms, write the heading as '{name} [ms]')")
    if np.spacing(np.abs(time_s[0])) > _EXACT * step:
        notes = (*notes, f"the stamps of {table.path} have more digits than a number holds: {_SUBTRACT}")
    return Time(time_s, words, notes)


def _unread(table: Table) -> tuple[str, str]:
    """Say that the column of the date is text, how no time is written that can be read; and what to do."""
    texts = (own for own in table.names if own in table.text_names)
    name = next((own for own in texts if is_called_time(own) or own.lower() in _DATES), None)
    if name is None or not table.shifts:
        return "", "give `time` or `rate_Hz`"
    cell = cell_at(table.path, table.line_of(0), table.names.index(name))
    remedy = f"{how_to_write(cell) or 'give another `time`'}, or give `rate_Hz`"
    return f" (its {column_words(name)} could not be read as time: {quoted(cell)})", remedy


def _taken_as(table: Table, heading: str) -> tuple[str, tuple[str, ...]]:
    """Return the unit of a column of time, by its heading or its size, and what there is to say of that."""
    unit, first = unit_of_time(table, heading), float(table.columns[heading][0])
    by_size = "" if unit else unit_of_count(first, heading)
    stamped = is_since_1970(first, unit) and not _as_written(table, heading, 0, "")
    if by_size or stamped:
        told = "days of a spreadsheet" if by_size == "d" else f"{by_size or unit or 's'} since 1970"
        return by_size or unit, (f"the column {heading} of {table.path} is taken as {told}, by its size",)
    if not unit and _unknown_unit(table, heading):
        said = f"the heading {heading!r} of {table.path} has no known unit: taken as seconds"
        return unit, (f"{said} (write the unit in brackets, such as 't [min]')",)
    return unit, ()


def _counted(table: Table, lack: str, remedy: str, *, whole: bool) -> Time:
    """Return the time of counted rows at the rate that the comments state, else none."""
    stated = stated_rate(table.comments) if whole else None
    if stated is None:
        return Time(None, "no time", (f"{lack}: only the order of the samples is known ({remedy})",))
    rate_Hz, said = stated
    note = f"{lack}: the rate is that of its comment {said!r}"
    return Time(np.arange(table.rows) / rate_Hz, f"time by the rate of {rate_Hz:g} Hz", (note,))


def _begun_again(stamps: FloatArray, unit: str) -> tuple[FloatArray, str]:
    """Return times (n,) that go on where a day or a counter began again, and what was done; empty: nothing.

    A step back is midnight where with a day more it is a usual step of the record.
    """
    back = np.flatnonzero(stamps[1:] < stamps[:-1])
    whole, said = (_DAY_S, "goes past midnight: a day is added from there on")
    if unit in _COUNTERS:
        whole, said = _COUNTER, "begins again, as a counter of 32 bits does: 2^32 is added from there on"
    elif unit != "s":
        return stamps, ""
    if not back.size or stamps.min() < 0 or stamps.max() >= whole:
        return stamps, ""
    step = np.diff(stamps)
    usual = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
    if np.any(np.abs(step[back] + whole - usual) > _USUAL_STEP * usual):
        return stamps, ""
    return stamps + whole * np.cumsum(np.concatenate(([0.0], step < 0))), said


def seconds(table: Table, name: str, *, of_record: bool = False) -> FloatArray:
    """Return a column as strictly increasing seconds (n,).

    Rows of a record may be left out, and its time is in seconds where its unit is not known.

    DataError where its unit is none of time, a value is not finite, or it does not increase: the line is
    named.
    """
    name = table.heading(name)
    unit = unit_of_time(table, name) or ("" if of_record else _unknown_unit(table, name))
    if unit not in SECONDS:
        expected = "expected s, ms, us, ns, min, h or d"
        other = ", choose another `time` column, or give a `rate_Hz`" * of_record
        if not split_unit(table.heading(name))[1] and name in table.units:
            raise DataError(
                f"{table.path} has two lines of headings; the second should hold units, but {unit!r} below "
                f"{name!r} is not a unit of time, {expected}",
                hint=f"{NO_UNITS}write a unit in place of {unit!r}, such as s",
            )
        raise DataError(
            f"the time {column_words(name)} of {table.path} is in {unit!r}, {expected}",
            hint=f"convert it to seconds{other}",
        )
    stamps = table.check_finite(name, remedy=LEAVE_OUT) if of_record else table.check_finite(name)
    time_s = stamps if SECONDS[unit] == 1.0 else stamps * SECONDS[unit]
    back = np.flatnonzero(time_s[1:] <= time_s[:-1])
    if back.size:
        row = int(back[0]) + 1
        this, before = (
            _as_written(table, name, k, f"{stamps[k]:.15g} {unit or 's'}") for k in (row, row - 1)
        )
        raise DataError(
            f"the time in {table.path}, {column_words(name)}, does not increase at {table.place(row)}: "
            f"{this} after {before} ({counted(back.size, 'such row')})",
            hint=_remedy(table, time_s, back, dated=":" in this, of_record=of_record),
        )
    return time_s


def _remedy(table: Table, time_s: FloatArray, back: NDArray[np.intp], *, dated: bool, of_record: bool) -> str:
    """Say what to do about times that do not increase behind the samples ``back``; ``dated``: stamps."""
    row = int(back[0]) + 1
    instead = ", or give a `rate_Hz` instead of the time" * of_record
    if all(column[row] == column[row - 1] for column in table.columns.values()):
        return f"drop the repeated rows{instead}"
    if dated and _is_winter_time(np.diff(time_s), back):
        return (
            "the clock may have been set back for winter time: add an hour to the rows from there on, or "
            f"write the stamps with their offset from UTC (2024-10-27T02:00:00+01:00){instead}"
        )
    if time_s[row] != time_s[row - 1]:
        other = "; if two records follow each other, cut the file in two; else choose another `time` column, "
        return "if the rows are out of order, sort them" + f"{other}or give a `rate_Hz`" * of_record
    return f"delete a row that is there twice; if the times are rounded, write them with more digits{instead}"


def _is_winter_time(step: FloatArray, back: NDArray[np.intp]) -> bool:
    """Whether each step back of steps (n,), s, is a usual one, or a few, after an hour more."""
    usual = float(np.median(step))
    late = step[back] + _HOUR_S
    few = (late >= _SOME * usual) & (late <= _FEW * usual)
    return bool(usual > 0.0 and np.all(few & ((step[back] < 0.0) | (usual >= _HOUR_S))))


def rates_of(table: Table, name: str) -> tuple[float | None, float | None]:
    """Return the rate of a column of time, Hz, by its median step and by its length; None: it is no time."""
    stamps = table.columns[name]
    unit = unit_of_time(table, name)
    increasing = bool(stamps.size > 1 and np.all(np.isfinite(stamps)) and np.all(np.diff(stamps) >= 0))
    if not unit or unit not in SECONDS or not increasing or stamps[-1] == stamps[0]:
        return None, None
    median, mean = float(np.median(np.diff(stamps))), float(stamps[-1] - stamps[0]) / (stamps.size - 1)
    # stamps that are rounded repeat themselves: the mean alone tells
    return 1.0 / (SECONDS[unit] * (median or mean)), 1.0 / (SECONDS[unit] * mean)


def own_column(table: Table, used: Collection[int]) -> int | None:
    """Return the place of the column that may be the file's own time; None where there is none."""
    if table.rate_Hz is not None:
        return None
    words = [split_unit(name)[0].rpartition(".")[2].lower() for name in table.names]
    candidates = [k for k, name in enumerate(table.names) if is_called_time(name)]
    if table.shifts:  # of a text, where columns have an order: the first, or behind a row's number or date
        passed = words[0] in ROW_NAMES or table.names[0] in table.text_names
        candidates = [*candidates, 0] if passed else [0]
    free = (k for k in candidates if k not in used and table.names[k] not in table.text_names)
    return next(free, None)


def is_called_time(heading: str) -> bool:
    """Return whether a heading is a name of time, with or without a unit."""
    return split_unit(heading)[0].rpartition(".")[2].lower() in _TIME_NAMES


def unit_of_time(table: Table, name: str) -> str:
    """Return the unit of a column of time, empty where the header says none.

    ``min`` may be all of it, and ``d`` stands behind a name, where it is a unit of no other column.
    """
    heading, unit = table.heading(name), table.unit(name)
    bare, _, behind = heading.rpartition("_")
    alone = symbol_of(behind if bare.lower() in _TIME_NAMES else heading)
    return ("" if unit.lower() in _CLOCKS else unit) or (alone if alone in SECONDS else "")


def _unknown_unit(table: Table, name: str) -> str:
    """Return what the heading of a time says in the place of a unit, empty where it is a name alone."""
    heading = table.heading(name)
    bare, _, behind = heading.rpartition("_")
    return claimed_unit(heading) or (behind if bare.lower() in _TIME_NAMES else "")


def _just_counts(values: FloatArray) -> bool:
    """Whether a column is 0, 1, 2, or 1, 2, 3, wherever something stands in it."""
    if values.size < _COUNTED or values[0] not in (0.0, 1.0):
        return False
    parts = ((k, values[k : k + BLOCK]) for k in range(0, values.size, BLOCK))
    return all(
        bool(np.all((part == values[0] + np.arange(k, k + part.size)) | np.isnan(part))) for k, part in parts
    )


def _as_written(table: Table, name: str, row: int, value: str) -> str:
    """Return a time as it stands in the file where it is a time of day or a date there, else its value."""
    cell = cell_at(table.path, table.line_of(row), table.index(name)) if table.shifts else ""
    return cell if ":" in cell else value
