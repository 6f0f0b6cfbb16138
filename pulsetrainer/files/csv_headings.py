"""What stands above the rows of a text table: headings, their units, and the preamble of an instrument.

The first line holds headings if it has text where the next one has a number; text behind numbers is a remark,
no heading; what an instrument writes about itself above the table is a comment.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from pulsetrainer.artefacts.units import counted, is_unit, split_unit, symbol_of
from pulsetrainer.errors import DataError
from pulsetrainer.files.csv_cells import is_number, is_text, number, split

_LINES = 3  # names, units, and words below them
_TABLE = 10  # rows of one kind make a table of what stands below a text
_OF_REMARKS = frozenset(["comment", "comments", "remark", "remarks", "kommentar", "bemerkung"])
_STEPS = frozenset(["increment", "tinc", "dt"])  # s, beside the names of an oscilloscope's columns
# what to do where the second line of headings should hold units, and has a word
NO_UNITS = (
    "if the second line holds no units, delete the first, and name the columns by the second; otherwise "
)


class Line(NamedTuple):
    """A line that is no remark: a row of the table, a heading, or what stands above it."""

    number: int  # from 1
    text: str
    cells: list[str]


class Headings(NamedTuple):
    """The names of the columns, and what is below and above them."""

    names: tuple[str, ...]  # column3 where none is written
    units: tuple[str, ...]  # of a second line; empty texts where there is none
    comments: tuple[str, ...]  # above the first row
    first: Line  # the first row
    rows: list[list[str]]
    width: int  # of the rows: a last column of remarks may have no cells
    rate_Hz: float | None  # where a step stands beside them


def column_words(name: str) -> str:
    """Return ``column current_A``, or ``column3`` where no heading names it."""
    return name if re.fullmatch(r"column\d+", name) else f"column {name}"


def cut_preamble(lines: list[Line], remarked: set[int]) -> list[Line]:
    """Take out, in place, what is neither heading nor row: lines above them, and words below the units."""
    cut = [lines.pop(k) for k in _below_the_units([line.cells for line in lines])]
    above = _above(lines, remarked)
    cut += lines[:above]
    del lines[:above]
    return cut


def headings_of(
    path: Path, delimiter: str | None, lines: list[Line], commented: list[tuple[int, str]]
) -> Headings:
    """Return what the lines of a table without its preamble begin with; ``commented``: line and comment.

    DataError where the table lies on its side, has no rows of numbers, or more or fewer columns than names.
    """
    rows = [line.cells for line in lines]
    rate_Hz = _cut_settings(rows)
    heads = _heading_lines(rows)
    if sideways := _headings_of_rows(rows):
        raise DataError(
            f"{path} lies on its side: the first cell of each row is a heading ({', '.join(sideways)})",
            hint="transpose it: one column per quantity, one row per sample",
        )
    if heads == len(rows):
        raise DataError(f"{path} has no rows below its header", hint="export the recording again")
    begin, body = lines[heads], rows[heads:]
    first = _usual_row(rows[0], body) if heads else body[0]
    comments = tuple(comment for count, comment in commented if count < begin.number)
    names = rows[0] if heads else _commented_names(comments, delimiter, len(first))
    names, first = _without_end(names, first)
    unremarked = len(names) == len(first) + 1 and names[-1].lower() in _OF_REMARKS
    if len(names) != len(first) and not any(2 * sum(map(is_number, row)) >= len(row) for row in body):
        raise no_numbers(path, begin)
    if len(names) != len(first) and not unremarked:
        raise DataError(
            f"{path} has {counted(len(names), 'column name')}, but {counted(len(first), 'column')} in line "
            f"{begin.number}",
            hint="correct the header; decimal commas need another delimiter, such as a semicolon",
        )
    units = [cell.strip("()[] ") for cell in rows[1]] if heads == 2 else []
    return Headings(
        names=tuple(name or f"column{k}" for k, name in enumerate(names, 1)),
        units=tuple(units) if len(units) == len(names) else ("",) * len(names),
        comments=comments,
        first=begin,
        rows=body,
        width=len(first),
        rate_Hz=rate_Hz,
    )


def no_numbers(path: Path, line: Line) -> DataError:
    """Return what is wrong with a table of words alone."""
    return DataError(
        f"{path} has no rows of numbers: all of its lines are words or headings, such as line "
        f"{line.number}: {line.text[:60]!r}",
        hint="export what is below the headings too: one column per quantity, one row per sample",
    )


def _below_the_units(rows: list[list[str]]) -> list[int]:
    """Return the line of words between units and numbers, if there is one: Origin's comments, or types."""
    start = _first_row(rows)
    if start < _LINES or len(rows) - start < _TABLE:
        return []
    names, units, words = rows[start - _LINES : start]
    told = [cell for cell in units if cell]
    if not (len(names) == len(units) == len(words) and told and all(map(_says_a_unit, told))):
        return []
    return [] if any(map(is_number, names + words)) or all(map(_says_a_unit, words)) else [start - 1]


def _says_a_unit(cell: str) -> bool:
    return is_unit(symbol_of(cell.strip("()[] "))) and not is_number(cell)


def _begins_with_text(row: list[str], last: list[str]) -> bool:
    """Whether a line would be a row but for text in its first cell."""
    return len(row) == len(last) > 1 and is_text(row[0]) and all(map(is_number, row[1:]))


def _first_row(rows: list[list[str]]) -> int:
    """Return where the rows of one kind begin, whatever bad rows are among them."""
    last = rows[-1]
    start = next((k for k, row in enumerate(rows) if _tells_as_much(row, last)), len(rows))
    while start and _is_row(rows[start - 1], last):
        start -= 1
    return start


def _tells_as_much(row: list[str], last: list[str]) -> bool:
    """Whether a line has numbers wherever the last row has some, and text only where that has text."""
    return len(row) == len(last) and all(
        is_number(cell) if is_number(below) else is_text(below) or not is_text(cell)
        for cell, below in zip(row, last, strict=True)
    )


def _is_row(row: list[str], last: list[str]) -> bool:
    """Whether a line is a row as the last one is: text in it stands above text or nothing, or is a remark.

    A remark, or a reading that failed, stands behind a number; where the others have none, theirs may lack a
    cell.
    """
    text = [is_text(cell) for cell in row]
    if len(row) != len(last):
        return len(row) > len(last) and not any(text[: len(last)]) and all(text[len(last) :])
    told = not text[0] and any(map(is_number, row))
    return told or not any(here and is_number(below) for here, below in zip(text, last, strict=True))


def _above(lines: list[Line], remarked: set[int]) -> int:
    """Return how many lines stand above the table and its headings: what an instrument says about itself.

    The table is the rows of one kind up to the end of the sample, ten or more. Rows of numbers above,
    or headings of another count, are in error, and 0 is returned. Names stand directly above their units,
    with no line between that is in ``remarked``.
    """
    rows = [line.cells for line in lines]
    kinds = [[is_text(cell) for cell in row] for row in rows]
    start = _first_row(rows)
    if start > 1 and _begins_with_text(rows[start - 1], rows[-1]) and all(kinds[start - 2]):
        start -= 1  # a bad row below its heading, and no remark above it
    words = (any(kind) or not any(row) for kind, row in zip(kinds[:start], rows, strict=False))
    if len(rows) - start < _TABLE or not all(words):
        return 0
    named = _filled_width(rows[-1])
    head = start
    while head > max(start - 2, 0) and len(kinds[head - 1]) >= named:
        line = rows[head - 1]
        other = _is_heading(line) if head == start else _numbers(line, rows[head])
        parted = head < start and lines[head].number - 1 in remarked
        if parted or not (other or all(kinds[head - 1][:named])):
            break
        head -= 1
    misfit = 0 < head == start and len(kinds[head - 1]) > 1 and all(kinds[head - 1])
    return 0 if misfit else head


def _is_heading(row: list[str]) -> bool:
    """Whether a line has text and no number; a remark has no unit."""
    return any(map(is_text, row)) and not any(map(is_number, row))


def _numbers(names: list[str], below: list[str]) -> bool:
    """Whether a line numbers the channels above their units: ``x-axis,1,2`` over ``second,Volt,Volt``."""
    numbered = is_text(names[0]) and all(len(name) == 1 and name.isdigit() for name in names[1:])
    return numbered and len(names) == len(below) > 1 and all(is_unit(symbol_of(cell)) for cell in below)


def _filled_width(row: list[str]) -> int:
    """Return how many columns a row has, without those that delimiters at its end make."""
    return max((k for k, cell in enumerate(row, 1) if cell), default=0)


def _cut_settings(rows: list[list[str]]) -> float | None:
    """Take from the headings what is beside the columns, in place; return the rate if a step is there.

    Some oscilloscopes write ``X,CH1,Start,Increment`` over ``Sequence,Volt,0.0,1e-3`` over rows ``0,1.5``.
    """
    if len(rows) < 3:
        return None
    names, units, first = rows[:3]
    width = _filled_width(first)
    beside = [number(cell) for cell in units[width:] if cell]
    if not beside or None in beside or not all(number(cell) is None for cell in units[:width]):
        return None
    steps = [value for name, value in zip(names[width:], beside, strict=False) if name.lower() in _STEPS]
    rows[:2] = [names[:width], units[:width]]
    return 1.0 / steps[0] if steps and steps[0] else None


def _heading_lines(rows: list[list[str]]) -> int:
    """Return how many lines stand above the first row: names, and units below."""
    names, below, third = (*rows, [], [])[:3]
    if len(rows) > 2 and _numbers(names, below):
        return 2
    text = list(map(is_text, names))
    if not (all(text) or any(a and is_number(b) for a, b in zip(text, below, strict=False))):
        return 0
    return 2 if len(rows) > 2 and _is_heading(below) and not all(map(is_text, third)) else 1


def _headings_of_rows(rows: list[list[str]]) -> list[str]:
    """Return the headings of a table that lies on its side: few rows of numbers, a heading before each."""
    heads = [row[0] for row in rows]
    few = 1 < len(rows) < len(rows[0]) and len(set(heads)) == len(rows)
    named = few and any(split_unit(head)[1] for head in heads)
    return heads if named and all(_begins_with_text(row, rows[0]) for row in rows) else []


def _usual_row(names: list[str], body: list[list[str]]) -> list[str]:
    """Return the first row, or the first that fits the names if most rows do: the first may be a bad one."""
    fitting = [row for row in body if len(_without_end(names, row)[1]) == len(_without_end(names, row)[0])]
    return fitting[0] if 2 * len(fitting) > len(body) else body[0]


def _without_end(names: list[str], first: list[str]) -> tuple[list[str], list[str]]:
    """Return header and first row without the columns that only delimiters at the end of a line make."""
    if not names[-1] and (not first[-1] or len(names) == len(first) + 1):
        names = names[:-1]
    return names, first[: max(len(names), _filled_width(first))]


def _commented_names(comments: tuple[str, ...], delimiter: str | None, count: int) -> list[str]:
    """Return names from the last comment, if it is a header (numpy writes it so), or numbers.

    Its mark may be the name of the first column, that of the row's number: ``#,time,current,force``.
    """
    if comments:
        cells = split(comments[-1], delimiter)
        shown = cells[1:] if not cells[0] else cells
        if len(shown) == count - 1 and any(split_unit(cell)[1] for cell in shown):
            cells = ["#", *shown]
        if len(cells) == count and all(number(cell) is None for cell in cells):
            return cells
    return [f"column{k}" for k in range(1, count + 1)]
