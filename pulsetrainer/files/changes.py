"""Texts for a session: a table of changes (t_s and any of rate, amplitude, pulse), and answers to a quiz."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from pathlib import Path

from pulsetrainer.artefacts.units import counted
from pulsetrainer.core.heartbeat import FASTEST_BPM, SLOWEST_BPM
from pulsetrainer.errors import DataError
from pulsetrainer.files.csv_cells import quoted

_COLUMNS = ("t_s", "rate", "amplitude", "pulse")
Row = tuple[float, float | None, float | None, str | None]  # time (s), rate, amplitude (%) and pulse


def read_changes(path: Path, pulses: Sequence[str]) -> list[Row]:
    """Return what changes by each line; None where nothing does.

    DataError where the file cannot be read, or a line is not one of these, comes before the line above it, or
    asks for what a session of these ``pulses`` cannot press.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            lines = [(number, line) for number, line in enumerate(stream, 1) if not line.startswith("#")]
            heading = lines[0][1] if lines else ""
            mark = next((mark for mark in ";\t" if mark in heading), ",")
            rows = csv.DictReader((line for _, line in lines), delimiter=mark)
            unknown = set(rows.fieldnames or ()) - set(_COLUMNS)
            if unknown or "t_s" not in (rows.fieldnames or ()):
                raise DataError(
                    f"{path} has {_columns(rows.fieldnames)}; expected t_s and any of rate, amplitude, pulse",
                    hint="write a header such as: t_s,rate,amplitude,pulse",
                )
            found: list[Row] = []
            for row in rows:
                number = lines[rows.line_num - 1][0]
                found.append(_change(path, number, row, pulses))
                if len(found) > 1 and found[-1][0] < found[-2][0]:
                    raise DataError(
                        f"{path}, line {number}: t_s is {found[-1][0]:g} after {found[-2][0]:g} s, "
                        "expected times that rise",
                        hint="sort the lines by t_s",
                    )
            return found
    except (OSError, UnicodeError, csv.Error) as error:
        why = "it is not a text file" if isinstance(error, UnicodeError) else error
        hint = "write a table with a header such as: t_s,rate,amplitude,pulse"
        raise DataError(f"{path} cannot be read: {why}", hint=hint) from error


def _columns(names: Sequence[str] | None) -> str:
    if not names:
        return "no columns"
    return f"the column{'s' * (len(names) > 1)} {', '.join(names)}"


def _as_number(text: str) -> str:
    """Say how a number is to be written: without its sign or unit, a time in seconds."""
    if found := re.fullmatch(r"(\d+):(\d\d)", text):
        return f"write {60 * int(found[1]) + int(found[2])} (seconds)"
    found = re.fullmatch(r"(\d[\d.]*)\s*[^\d\s]+", text)
    return f"write {found[1]}" if found else "correct it"


def _change(path: Path, line: int, row: dict[str, str | None], pulses: Sequence[str]) -> Row:
    said = {name: (value or "").strip() for name, value in row.items() if name in _COLUMNS}
    numbers: list[float | None] = []
    for name in _COLUMNS[:3]:
        text = said.get(name, "").replace(",", ".")  # where semicolons part the columns
        try:
            numbers.append(float(text) if text else None)
        except ValueError:
            numbers.append(math.nan)
        if numbers[-1] is not None and not math.isfinite(numbers[-1]):
            wrong = f"{path}, line {line}: {name} is {quoted(text)}, expected a number"
            raise DataError(wrong, hint=_as_number(text))
    time_s, rate, amplitude = numbers
    if time_s is None or time_s < 0:
        raise DataError(f"{path}, line {line}: t_s must not be negative or empty", hint="give a time in s")
    if rate is not None and not SLOWEST_BPM <= rate <= FASTEST_BPM:
        raise DataError(
            f"{path}, line {line}: rate is {rate:g}, expected {SLOWEST_BPM:g} to {FASTEST_BPM:g} beats a "
            "minute",
            hint="a usual rate is 75",
        )
    if amplitude is not None and not 0.0 < amplitude <= 100.0:
        raise DataError(
            f"{path}, line {line}: amplitude is {amplitude:g}, expected more than 0 and at most 100 %",
            hint="100 % is all that the model reaches",
        )
    pulse = said.get("pulse") or None
    if pulse is not None and pulse not in pulses:
        raise DataError(
            f"{path}, line {line}: pulse is {pulse!r}, expected one of {', '.join(pulses)}",
            hint="correct it, or add the pulse to `pulses`",
        )
    return time_s, rate, amplitude, pulse


def read_answers(path: Path, choices: Sequence[str], questions: int) -> list[str]:
    """Return the answers of a quiz, one pulse name a line; empty lines do not count.

    DataError where the file cannot be read, a line is none of the ``choices``, or there are fewer than
    ``questions``.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeError) as error:
        why = "it is not a text file" if isinstance(error, UnicodeError) else error
        raise DataError(f"{path} cannot be read: {why}", hint="give a text file, one name a line") from error
    written = {choice.casefold(): choice for choice in reversed(choices)}
    answers = [(number, line.strip()) for number, line in enumerate(lines, 1) if line.strip()]
    for number, said in answers:
        if said.casefold() not in written:
            raise DataError(
                f"{path}, line {number}: the answer is {said!r}, expected one of {', '.join(choices)}",
                hint="write one of these names on each line",
            )
    if len(answers) != questions:
        raise DataError(
            f"{path} has {counted(len(answers), 'answer')} to {questions} questions",
            hint="write one pulse name on each line, as many as questions",
        )
    return [said if said in choices else written[said.casefold()] for _, said in answers]
