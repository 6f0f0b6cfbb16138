"""Times of day and time stamps in the cells of a table, as seconds.

ISO 8601, year first with slashes, day first with points. A date with slashes and the year last is the one of
two countries: its order is told from the first and the last rows of the file, never from one cell.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import UTC, datetime
from typing import Any

from pulsetrainer.artefacts.units import SECONDS

_TIME = r"(\d{1,2}):([0-5]\d)(?::([0-5]\d(?:[.,]\d+)?))?(?: ?([AaPp])[Mm])?"
_CLOCK = re.compile(_TIME)
_SHORT = re.compile(r"\d+:\d\d")
_DATE = re.compile(r"\d{4}([-/.])\d{1,2}\1\d{1,2}|\d{1,2}([-/.])\d{1,2}\2\d{4}")
_MINUTES = re.compile(r"(\b)(\d+):([0-5]\d[.,]\d+)(\b)")
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d+)?)?(Z|[+-]\d\d:?\d\d)?")
_YEAR_FIRST = re.compile(rf"(\d{{4}})[/-](\d{{1,2}})[/-](\d{{1,2}}),?[T ]{_TIME}")
_POINTS = re.compile(rf"(\d{{1,2}})\.(\d{{1,2}})\.(\d{{4}}),? {_TIME}")
_UNIX = (("ms", 1e12), ("us", 1e15), ("ns", 1e18))  # counts since 1970, in 2001
_IN_2001_S = 1e9  # counts in s since 1970; days, hours and minutes are counted from elsewhere
_DECADES = 4.0  # times those: in 2096
_SPREADSHEET_DAYS = (30_000.0, 60_000.0)  # since 1900, in 1982 and 2064
_RATE = re.compile(
    r"(?i:\b(?:(?P<rate>sampl\w*[ _-]?(?:rate|frequency))|(?:sampl\w*[ _-]?(?:interval|period)|delta_x)))"
    r"\W*(?:\((?P<above>[^()]+)\)\W*)?(?P<number>\d+(?:[.,]\d*)?(?:[eE][-+]?\d+)?)\s*(?P<unit>[A-Za-z\u00b5/]*)"
)
_OF_RATE = {"": 1.0} | {
    f"{prefix}{unit}": factor
    for prefix, factor in (("", 1.0), ("k", 1e3), ("M", 1e6))
    for unit in ("Hz", "S/s", "Sa/s")
}
_SLASHES = re.compile(rf"(\d{{1,2}})/(\d{{1,2}})/(\d{{4}}),? {_TIME}")


def seconds(cell: str, *, day_first: bool | None = None) -> float | None:
    """Return a time of day in seconds since midnight, a stamp in seconds since 1970, None for other text.

    ``day_first`` is the order of a date with slashes; None is any that exists.
    """
    if found := _CLOCK.fullmatch(cell) or _MINUTES.fullmatch(cell):
        # 12:34 may be minutes and seconds too; a share of a second tells
        return _of_day(found.groups()) if found[3] else None
    if _ISO.fullmatch(cell):
        return _since_1970(cell)
    if found := _YEAR_FIRST.fullmatch(cell):
        return _stamp(found[1], found[2], found[3], found.groups()[3:])
    if found := _POINTS.fullmatch(cell):
        return _stamp(found[3], found[2], found[1], found.groups()[3:])
    if found := _SLASHES.fullmatch(cell):
        orders = ((1, 2), (2, 1)) if day_first is None else ((2, 1) if day_first else (1, 2),)
        readings = [_stamp(found[3], found[month], found[day], found.groups()[3:]) for month, day in orders]
        return next((reading for reading in readings if reading is not None), None)
    return None


def how_to_write(cell: str) -> str:
    """Say how minutes and seconds, or a date alone, are written so that they are read; empty: other text."""
    if _SHORT.fullmatch(cell):
        return "write minutes and seconds with the hour, 0:00:05, or in seconds, 5"
    dated = "write the time in seconds, or a date with its time of day, 2024-05-01T00:00:00"
    return dated if _DATE.fullmatch(cell) else ""


def day_first(columns: Iterable[tuple[str, ...]]) -> bool | None:
    """Return the order of the dates with slashes in columns of cells, None where there are none or both fit.

    Of two orders that give a date in every row, the one is right whose rows span less time: a record goes
    from one day to the next rather than from month to month.
    """
    for cells in columns:
        dates = [cell for cell in cells if _SLASHES.fullmatch(cell)]
        spans = {}
        for order in (False, True):
            read = [seconds(date, day_first=order) for date in dates]
            times = [time for time in read if time is not None]
            if dates and len(times) == len(dates):
                spans[order] = max(times) - min(times)
        if len(spans) == len(set(spans.values())) > 0:
            return min(spans, key=spans.__getitem__)
    return None


def unit_of_count(value: float, heading: str) -> str:
    """Return in what a count is, told by its size: since 1970, or a spreadsheet's days; empty: in neither.

    The latter stand below a heading of a date.
    """
    low, high = _SPREADSHEET_DAYS
    if low < value < high and re.search("date|datum", heading, re.IGNORECASE):
        return "d"
    return next((unit for unit, least in _UNIX if least <= value <= _DECADES * least), "")


def is_since_1970(value: float, unit: str) -> bool:
    """Return whether a time in a unit (empty: s) is one of 2001 to 2096, told by its size."""
    one = SECONDS.get(unit, 0.0)
    return one <= 1.0 and _IN_2001_S <= one * value <= _DECADES * _IN_2001_S


def stated_rate(comments: Iterable[str]) -> tuple[float, str] | None:
    """Return the rate in Hz that comments state, or state as a step, and their words; None: they do not."""
    told = {}
    for found in filter(None, map(_RATE.search, comments)):
        size = float(found["number"].replace(",", "."))
        factor = (_OF_RATE if found["rate"] else SECONDS).get(found["unit"] or found["above"] or "")
        if factor is not None and size > 0:
            told[size * factor if found["rate"] else 1.0 / (size * factor)] = found[0].strip()
    return next(iter(told.items())) if len(told) == 1 else None


def _of_day(time: tuple[str | Any, ...]) -> float:
    """Return the seconds since midnight of hour, minute, second and the letter of a half of the day."""
    hour, minute, second, half = time
    count = int(hour or 0)
    if half:
        count = count % 12 + 12 * (half in "Pp")
    return 3600.0 * count + 60.0 * int(minute) + float((second or "0").replace(",", "."))


def _stamp(year: str, month: str, day: str, time: tuple[str | Any, ...]) -> float | None:
    midnight = _since_1970(f"{year}-{int(month):02}-{int(day):02}")
    of_day = _of_day(time)
    return None if midnight is None or of_day >= 86_401 else midnight + of_day


def _since_1970(text: str) -> float | None:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:  # the 31st of February
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
