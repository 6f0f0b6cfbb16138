"""What a cell of a text table says: a number, however it is written, nothing, or text.

Times of day and ISO 8601 time stamps are numbers: seconds.
"""

from __future__ import annotations

import csv
import re

import numpy as np

from pulsetrainer.files import time_stamps as stamps

_FORTRAN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)[dD][+-]?\d+")
COMMA_DECIMAL = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}([.,' \u00a0\u202f])\d{3}(\1\d{3})*([.,]\d+)?")
MISSING = frozenset(["", "-", "--", "na", "n/a", "#n/a", "null", "none", "nan"])
_SHOWN = 30  # characters of a cell in a message
_MINUS = "\N{MINUS SIGN}"


def split(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line, stripped."""
    if '"' in line:
        text = line if delimiter else line.replace("\t", " ").strip()
        cells = next(csv.reader([text], delimiter=delimiter or " ", skipinitialspace=True))
        return [cell.strip() for cell in cells]
    if delimiter is None:
        return line.split()
    return [cell.strip() for cell in line.split(delimiter)]


def number(cell: str, *, day_first: bool | None = None) -> float | None:
    """Return the number in a cell, NaN where it says that the value is missing, None where it is text.

    A comma in a cell is a decimal sign: where commas separate, only quotes can hold one. A time of day is in
    seconds since midnight, a time stamp in seconds since 1970; ``day_first`` is the order of its date if
    that has slashes.
    """
    try:
        # Python reads 1_000 as a number; no instrument writes it
        return None if "_" in cell else float(cell)
    except ValueError:
        if COMMA_DECIMAL.fullmatch(cell):
            return float(cell.replace(",", "."))
        if cell.lower() in MISSING:
            return np.nan
        if cell.startswith(_MINUS):  # of a word processor
            return number("-" + cell[1:])
        if _FORTRAN.fullmatch(cell):
            return float(re.sub("[dD]", "e", cell))
        return stamps.seconds(cell, day_first=day_first)


def has_thousands(cell: str) -> bool:
    """Whether a cell that is no number would be one without its separators of thousands: ``1.021,0``."""
    return _THOUSANDS.fullmatch(cell) is not None


def is_text(cell: str) -> bool:
    """Whether a cell is neither a number nor empty, nor would be a number without separators."""
    return number(cell) is None and not has_thousands(cell)


def is_number(cell: str) -> bool:
    """Whether a number stands in a cell: not text, not nothing."""
    return cell.lower() not in MISSING and not is_text(cell)


def quoted(cell: str) -> str:
    """Return a cell as a message shows it: in quotes, and not all of a long one."""
    return repr(readable(cell) if len(cell) <= _SHOWN else f"{readable(cell)[: _SHOWN - 1]}…")


def readable(line: str) -> str:
    """Return a line in which bytes that are not UTF-8 are read as Western Windows letters."""
    if line.isascii():
        return line
    raw = line.encode("utf-8", "surrogateescape")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")
