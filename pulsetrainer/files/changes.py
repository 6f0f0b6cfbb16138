"""A script of changes for a session: a table with the column t_s and any of rate, amplitude and pulse."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from pulsetrainer.errors import DataError

_COLUMNS = ("t_s", "rate", "amplitude", "pulse")


def read_changes(path: Path) -> list[tuple[float, float | None, float | None, str | None]]:
    """Return time (s), rate, amplitude (%) and pulse of each line; None where nothing changes.

    Raises
    ------
    DataError
        The file cannot be read, or a line is not one of these.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = csv.DictReader(line for line in stream if not line.startswith("#"))
            unknown = set(rows.fieldnames or ()) - set(_COLUMNS)
            if unknown or "t_s" not in (rows.fieldnames or ()):
                raise DataError(
                    f"{path} has the columns {', '.join(rows.fieldnames or ('none',))}; expected t_s and any "
                    "of rate, amplitude, pulse",
                    hint="write a header such as: t_s,rate,amplitude,pulse",
                )
            return [_change(path, rows.line_num, row) for row in rows]
    except (OSError, UnicodeError, csv.Error) as error:
        raise DataError(f"{path} cannot be read: {error}", hint="give a table of text") from error


def _change(
    path: Path, line: int, row: dict[str, str | None]
) -> tuple[float, float | None, float | None, str | None]:
    said = {name: (value or "").strip() for name, value in row.items() if name in _COLUMNS}
    numbers: list[float | None] = []
    for name in _COLUMNS[:3]:
        text = said.get(name, "")
        try:
            numbers.append(float(text) if text else None)
        except ValueError:
            numbers.append(math.nan)
        if numbers[-1] is not None and not math.isfinite(numbers[-1]):
            raise DataError(f"{path}, line {line}: {name} is {text!r}, expected a number", hint="correct it")
    time_s, rate, amplitude = numbers
    if time_s is None or time_s < 0:
        raise DataError(f"{path}, line {line}: t_s must not be negative or empty", hint="give a time in s")
    return time_s, rate, amplitude, said.get("pulse") or None


def read_answers(path: Path) -> list[str]:
    """Return the answers of a quiz, one pulse name a line, or raise DataError; empty lines do not count."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeError) as error:
        raise DataError(
            f"{path} cannot be read: {error}", hint="give a text file, one name a line"
        ) from error
    return [line.strip() for line in lines if line.strip()]
