"""How a text file is a table: what separates its columns, its decimal sign, and which columns hold text.

Every rule is explicit: the delimiter is the one that makes most cells numbers; a comma is a decimal sign
only where something else separates; a column that begins with text, as in most rows, is one of text. What
stands above the rows is known to ``csv_headings``, what a cell says to ``csv_cells``; the rows themselves are
read by ``csv_rows``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pulsetrainer.errors import DataError
from pulsetrainer.files import time_stamps as stamps
from pulsetrainer.files.csv_cells import COMMA_DECIMAL, MISSING, is_text, number, readable, split
from pulsetrainer.files.csv_encoding import encoding_of, end_of
from pulsetrainer.files.csv_headings import Line, cut_preamble, headings_of, no_numbers

_DELIMITERS = ("\t", ";", ",", "|", None)  # None: blanks
_REMARKS = ("#", "%", "//")  # and a semicolon where it separates nothing
_SAMPLE_LINES = 200
_SIGNED_DELIMITER = re.compile(r"sep=(.)")  # what a spreadsheet writes for other spreadsheets
_Text = tuple[int, str]  # of a line: its number, from 1, and what it says


@dataclass(frozen=True, slots=True)
class Dialect:
    """What makes a table of a text file."""

    encoding: str
    delimiter: str | None
    decimal_comma: bool
    names: tuple[str, ...]
    units: tuple[str, ...]  # of a second header line; empty texts where there is none
    comments: tuple[str, ...]  # above the first row
    first_line: int  # of the first row
    text_columns: frozenset[int]
    stamped: frozenset[int]  # columns of times of day or time stamps
    remarks: tuple[str, ...]  # what a line that is no row begins with
    rate_Hz: float | None  # where the heading says a step
    day_first: bool | None  # in dates with slashes

    @property
    def words(self) -> str:
        """What separates the columns, and the decimal sign, for a person."""
        known = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", None: "blanks", " ": "blanks"}
        columns = f"{known.get(self.delimiter, repr(self.delimiter))} between the columns"
        return f"{columns}, decimal {'commas' if self.decimal_comma else 'points'}"

    def split(self, line: str) -> list[str]:
        """Return the cells of a line, without those that only delimiters at the end make."""
        cells = split(line, self.delimiter)
        while len(cells) > len(self.names) and not cells[-1]:
            cells.pop()
        return cells


def detect(path: Path) -> Dialect:
    """Return how a file is to be read.

    DataError where it is no text, or no table; OSError where it cannot be read.
    """
    encoding = encoding_of(path)
    declared, found, above = _first_lines(path, encoding)
    delimiter = declared or _delimiter([text for _, text in found])
    remarks = _REMARKS if delimiter == ";" else (*_REMARKS, ";")
    comments = [(k, _remark(text)) for k, text in above if len(found) < 3 or k < found[2][0]]
    comments += [(k, _remark(text)) for k, text in found if text.startswith(remarks)]
    lines = [Line(k, text, split(text, delimiter)) for k, text in found if not text.startswith(remarks)]
    if not lines:
        raise DataError(f"{path} is empty", hint="export the recording again")
    comments += [(line.number, line.text.strip()) for line in cut_preamble(lines, {k for k, _ in above})]
    head = headings_of(path, delimiter, lines, sorted(comments))
    columns = [_filled(k, head.rows) for k in range(len(head.names))]
    of_text = frozenset(k for k, cells in enumerate(columns) if k >= head.width or _mostly_text(cells))
    if len(of_text) == len(columns):
        raise no_numbers(path, head.first)
    # where the time would be there is nothing
    stated = None if columns[0] else stamps.stated_rate(head.comments)
    last = [split(line, delimiter) for line in end_of(path, encoding).splitlines() if line.strip()]
    whole = [row for row in (*head.rows, *last) if len(row) == len(head.rows[0])]
    return Dialect(
        encoding=encoding,
        delimiter=delimiter,
        decimal_comma=any(COMMA_DECIMAL.fullmatch(cell) for one in lines[1:] or lines for cell in one.cells),
        names=head.names,
        units=head.units,
        comments=head.comments,
        first_line=head.first.number,
        text_columns=of_text,
        stamped=frozenset(k for k, cells in enumerate(columns) if _is_stamped(cells)),
        remarks=remarks,
        rate_Hz=stated[0] if stated else head.rate_Hz,
        day_first=stamps.day_first(zip(*whole, strict=True)),
    )


def _first_lines(path: Path, encoding: str) -> tuple[str | None, list[_Text], list[_Text]]:
    """Return the delimiter that a file declares, its first lines, and the remarks among them."""
    declared: str | None = None
    lines: list[_Text] = []
    remarks: list[_Text] = []
    with path.open(encoding=encoding, errors="surrogateescape", newline=None) as stream:
        for count, line in enumerate(stream, 1):
            text = line.strip()
            if count == 1 and (found := _SIGNED_DELIMITER.fullmatch(text)):
                declared = found[1]
            elif text.startswith(_REMARKS):
                remarks.append((count, text))
            elif text:
                lines.append((count, readable(line.strip("\r\n"))))
            if len(lines) == _SAMPLE_LINES:
                break
    return declared, lines, remarks


def _remark(line: str) -> str:
    return readable(line.strip().lstrip("#%/; "))


def _delimiter(lines: list[str]) -> str | None:
    """Return the delimiter that makes the largest share of cells numbers, the first of equals."""
    # the first line may be a header, and more may stand above it
    body = lines[len(lines) // 2 :] if len(lines) > 20 else lines[1:] or lines

    def share(delimiter: str | None) -> float:
        rows = [split(line, delimiter) for line in body]
        if max(map(len, rows), default=0) < 2:
            return -1.0
        cells = [cell for row in rows for cell in row if cell]
        # a blank between thousands may be the delimiter instead
        whole = [not is_text(cell) and (" " not in cell or number(cell) is not None) for cell in cells]
        return float(np.mean(whole)) if cells else 0.0

    shares = [share(delimiter) for delimiter in _DELIMITERS]
    return "," if max(shares) < 0 else _DELIMITERS[int(np.argmax(shares))]


def _filled(column: int, body: list[list[str]]) -> list[str]:
    """Return the cells of a column in which something stands."""
    cells = (row[column] for row in body if len(row) > column)
    return [cell for cell in cells if cell.lower() not in MISSING]


def _mostly_text(cells: list[str]) -> bool:
    """Whether cells begin with text, and half of them or more are."""
    text = list(map(is_text, cells))
    return any(text[:1]) and 2 * sum(text) >= len(text)


def _is_stamped(cells: list[str]) -> bool:
    """Whether the first cell that is no text is a time of day or a time stamp."""
    return stamps.seconds(next((cell for cell in cells if not is_text(cell)), "")) is not None
