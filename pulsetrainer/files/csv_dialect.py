"""How a text file is a table: its delimiter, decimal sign, header and comments.

Every rule is explicit: the delimiter is the one that makes most cells numbers; a comma is a decimal sign
only where something else separates; the first line is a header if it has text where the next one has a
number; a column that begins with text, as in most rows, is one of text; text behind numbers is a remark,
no heading; what an instrument writes about itself above the table is a comment. What a cell says is known to
``csv_cells``, and the rows themselves are read by ``csv_rows``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pulsetrainer.artefacts.units import counted, is_unit, split_unit, symbol_of
from pulsetrainer.errors import DataError, NotAnArtefactError
from pulsetrainer.files import time_stamps as stamps
from pulsetrainer.files.csv_cells import COMMA_DECIMAL, MISSING, is_number, is_text, number, readable, split
from pulsetrainer.files.input_file import likely_kind

_DELIMITERS = ("\t", ";", ",", "|", None)  # None: blanks
_REMARKS = ("#", "%", "//")  # and a semicolon where it separates nothing
_SAMPLE_LINES = 200
_LAST_BYTES = 4096
_HEADS = 3  # lines: names, units, and words below them
_TABLE = 10  # rows of one kind make a table of what stands below a text
_REMARK_HEADINGS = frozenset(["comment", "comments", "remark", "remarks", "kommentar", "bemerkung"])
_STEPS = frozenset(["increment", "tinc", "dt"])  # s, beside the names of an oscilloscope's columns
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_JSON = re.compile(rb'\s*(\{\s*"|\[\s*[\[{])')
_READ_KINDS = "CSV, TSV, .npz, .npy, .mat or .wav"
_ROW_END = re.compile(rb"\d[;,\t]?\r?\n")
_SIGNED_DELIMITER = re.compile(r"sep=(.)")  # what a spreadsheet writes for other spreadsheets

_ALIKE = 16  # rows with as many decimals: those of the last are no chance
_Line = tuple[int, str]  # its number, from 1, and its text


class _Row(NamedTuple):
    """A line that is no remark: a row of the table, a heading, or what stands above it."""

    number: int  # of the line, from 1
    text: str
    cells: list[str]


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
    remarks: tuple[str, ...] = _REMARKS  # what a line that is no row begins with
    rate_Hz: float | None = None  # where the heading says a step
    day_first: bool | None = None  # in dates with slashes

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


def column_words(name: str) -> str:
    """Return ``column current_A``, or ``column3`` where no heading names it."""
    return name if re.fullmatch(r"column\d+", name) else f"column {name}"


def detect(path: Path) -> Dialect:
    """Return how a file is to be read.

    DataError where it is no text, or no table; OSError where it cannot be read.
    """
    encoding = _encoding(path)
    declared, lines, above = _first_lines(path, encoding)
    comments = [(count, _remark(text)) for count, text in above if len(lines) < 3 or count < lines[2][0]]
    delimiter = declared or _delimiter([line for _, line in lines])
    remarks = _REMARKS if delimiter == ";" else (*_REMARKS, ";")
    comments += [(count, _remark(line)) for count, line in lines if line.startswith(remarks)]
    rows = [
        _Row(count, line, split(line, delimiter)) for count, line in lines if not line.startswith(remarks)
    ]
    if not rows:
        raise DataError(f"{path} is empty", hint="export the recording again")
    aside = _below_the_units([row.cells for row in rows])
    comments += [(rows[k].number, rows[k].text.strip()) for k in aside]
    rows = [row for k, row in enumerate(rows) if k not in aside]
    remarked = {count for count, _ in above}
    start = _above([row.cells for row in rows], [row.number - 1 in remarked for row in rows])
    comments += [(row.number, row.text.strip()) for row in rows[:start]]
    dialect = _with_header(path, encoding, delimiter, rows[start:], sorted(comments))
    return replace(dialect, remarks=remarks)


def cell_at(path: Path, line: int, column: int) -> str:
    """Return what stands in a cell of a text: line from 1, column from 0; raises as ``detect``."""
    dialect = detect(path)
    with path.open(encoding=dialect.encoding, errors="surrogateescape", newline=None) as stream:
        text = next(islice(stream, line - 1, None), "")
    return (*dialect.split(readable(text.strip("\r\n"))), *[""] * (column + 1))[column]


def _first_lines(path: Path, encoding: str) -> tuple[str | None, list[_Line], list[_Line]]:
    """Return the delimiter that a file declares, its first lines, and the remarks among them."""
    declared: str | None = None
    lines: list[_Line] = []
    remarks: list[_Line] = []
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


# how files begin that are no tables, whatever their names
_FOREIGN = {b"PK\3\4": "an Excel workbook, or a zip file", b"%PDF": "a PDF", b"<!do": "a web page"}
_FOREIGN |= dict.fromkeys((b"<!DO", b"<htm", b"<HTM"), "a web page")


def _encoding(path: Path) -> str:
    with path.open("rb") as stream:
        start = stream.read(4096)
    if start.startswith(_UTF16_MARKS):
        return "utf-16"
    if found := _FOREIGN.get(start.lstrip()[:4]):
        raise DataError(f"{path} is {found}, not a table", hint="export the recording as CSV, and give that")
    if path.suffix.lower() == ".json" or _JSON.match(start):
        raise DataError(f"{path} is JSON, which is not read", hint=f"export it as {_READ_KINDS}")
    low, high = start[: 2 * _TABLE : 2], start[1 : 2 * _TABLE : 2]
    if high and not any(high) and all(low):  # without its mark
        return "utf-16-le"
    ends = start.rstrip(b"\0")  # with them: what a crash left
    if b"\0" in (ends if _ROW_END.search(ends) else start):
        hint = "export the recording as CSV"
        if kind := likely_kind(path):
            hint = f"it is a {kind} already, and only tables are read here: see `pulsetrainer show {path}`"
        elif start.startswith(b"\x89HDF"):
            hint = NotAnArtefactError.foreign_hint
        raise DataError(f"{path} is not a text file", hint=hint)
    return "utf-8-sig"


def _delimiter(lines: list[str]) -> str | None:
    """Return the delimiter that makes the largest share of cells numbers, the first of equals."""
    # the first line may be a header, and more may stand above it
    body = lines[len(lines) // 2 :] if len(lines) > 2 * _TABLE else lines[1:] or lines

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


def _below_the_units(rows: list[list[str]]) -> list[int]:
    """Return the line of words between units and numbers, if there is one: Origin's comments, or types."""
    start = _first_row(rows)
    if start < _HEADS or len(rows) - start < _TABLE:
        return []
    names, units, words = rows[start - _HEADS : start]
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


def _above(rows: list[list[str]], parted: list[bool]) -> int:
    """Return how many lines stand above the table and its headings: what an instrument says about itself.

    The table is the rows of one kind up to the end of the sample, ten or more. Rows of numbers above,
    or headings of another count, are in error, and 0 is returned. Names stand directly above their units:
    ``parted`` says above which lines there is a remark.
    """
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
        if not (other or all(kinds[head - 1][:named])) or (head < start and parted[head]):
            break
        head -= 1
    misfit = 0 < head == start and len(kinds[head - 1]) > 1 and all(kinds[head - 1])
    return 0 if misfit else head


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


def _headings_of_rows(rows: list[list[str]]) -> list[str]:
    """Return the headings of a table that lies on its side: few rows of numbers, a heading before each."""
    heads = [row[0] for row in rows]
    few = 1 < len(rows) < len(rows[0]) and len(set(heads)) == len(rows)
    named = few and any(split_unit(head)[1] for head in heads)
    return heads if named and all(_begins_with_text(row, rows[0]) for row in rows) else []


def _no_numbers(path: Path, line: _Row) -> DataError:
    return DataError(
        f"{path} has no rows of numbers: all of its lines are words or headings, such as line "
        f"{line.number}: {line.text[:60]!r}",
        hint="export what is below the headings too: one column per quantity, one row per sample",
    )


def _is_heading(row: list[str]) -> bool:
    """Whether a line has text and no number; a remark has no unit."""
    return any(map(is_text, row)) and not any(map(is_number, row))


def _numbers(names: list[str], below: list[str]) -> bool:
    """Whether a line numbers the channels above their units: ``x-axis,1,2`` over ``second,Volt,Volt``."""
    numbered = is_text(names[0]) and all(len(name) == 1 and name.isdigit() for name in names[1:])
    return numbered and len(names) == len(below) > 1 and all(is_unit(symbol_of(cell)) for cell in below)


def _with_header(
    path: Path, encoding: str, delimiter: str | None, lines: list[_Row], commented: list[_Line]
) -> Dialect:
    """Return the dialect, with what the lines above the first row say."""
    rows = [line.cells for line in lines]
    decimal_comma = any(COMMA_DECIMAL.fullmatch(cell) for row in rows[1:] or rows for cell in row)
    rate = _cut_settings(rows)
    text = [[is_text(cell) for cell in row] for row in rows]
    heads = _heading_lines(text, rows)
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
    unremarked = len(names) == len(first) + 1 and names[-1].lower() in _REMARK_HEADINGS
    if len(names) != len(first) and not any(2 * sum(map(is_number, row)) >= len(row) for row in body):
        raise _no_numbers(path, begin)
    if len(names) != len(first) and not unremarked:
        raise DataError(
            f"{path} has {counted(len(names), 'column name')}, but {counted(len(first), 'column')} in line "
            f"{begin.number}",
            hint="correct the header; decimal commas need another delimiter, such as a semicolon",
        )
    columns = [_filled(k, body) for k in range(len(names))]
    stated = None if columns[0] else stamps.stated_rate(comments)  # where the time would be there is nothing
    of_text = frozenset(k for k, cells in enumerate(columns) if _mostly_text(cells))
    if unremarked:
        of_text |= {len(first)}
    if len(of_text) == len(names):
        raise _no_numbers(path, begin)
    units = [cell.strip("()[] ") for cell in rows[1]] if heads == 2 else []
    return Dialect(
        encoding=encoding,
        delimiter=delimiter,
        decimal_comma=decimal_comma,
        names=tuple(name or f"column{k + 1}" for k, name in enumerate(names)),
        units=tuple(units) if len(units) == len(names) else ("",) * len(names),
        comments=comments,
        first_line=begin.number,
        text_columns=of_text,
        stamped=frozenset(k for k, cells in enumerate(columns) if _is_stamped(cells)),
        rate_Hz=stated[0] if stated else rate,
        day_first=stamps.day_first(_columns(body, delimiter, _tail(path, encoding).splitlines())),
    )


def _usual_row(names: list[str], body: list[list[str]]) -> list[str]:
    """Return the first row, or the first that fits the names if most rows do: the first may be a bad one."""
    fitting = [row for row in body if len(_without_end(names, row)[1]) == len(_without_end(names, row)[0])]
    return fitting[0] if 2 * len(fitting) > len(body) else body[0]


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


def _columns(rows: list[list[str]], delimiter: str | None, last: list[str]) -> list[tuple[str, ...]]:
    """Return the columns of the first rows and the last lines, as far as these are rows of the same kind."""
    width = len(rows[0])
    below = (split(line, delimiter) for line in last if line.strip())
    whole = [row for row in (*rows, *below) if len(row) == width]
    return list(zip(*whole, strict=True))


def _tail(path: Path, encoding: str) -> str:
    """Return the text in the last few kilobytes of a file, from the beginning of a line on."""
    with path.open("rb") as stream:
        start = max(path.stat().st_size - _LAST_BYTES, 0)
        stream.seek(start)
        text = stream.read().decode("utf-16-le" if encoding.startswith("utf-16") else "utf-8", "replace")
    return text[text.find("\n") + 1 if start else 0 :]


def ends_in_zeros(path: Path, dialect: Dialect) -> bool:
    """Whether a file ends in zero bytes, as a crash leaves it; OSError where it cannot be read."""
    return _tail(path, dialect.encoding).endswith("\0")


def ends_in_a_number(path: Path, dialect: Dialect) -> bool:
    """Whether a file was cut within its last number: no line end, and fewer decimals than in all rows before.

    OSError where it cannot be read.
    """
    text = _tail(path, dialect.encoding)
    rows = [dialect.split(line) for line in text.splitlines() if line.strip()][-_ALIKE:]
    if text.endswith(("\n", "\r")) or len(rows) < _ALIKE:
        return False
    sign = "," if dialect.decimal_comma else "."
    *before, last = [len(cells[-1].partition(sign)[2]) for cells in rows]
    return (
        len(set(before)) == 1
        and last < before[0]
        and all(is_number(cells[-1].removesuffix(sign)) for cells in rows)
    )


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
    step = next(
        (value for name, value in zip(names[width:], beside, strict=False) if name.lower() in _STEPS), None
    )
    rows[:2] = [names[:width], units[:width]]
    return 1.0 / step if step else None


def _filled_width(row: list[str]) -> int:
    """Return how many columns a row has, without those that delimiters at its end make."""
    return max((k + 1 for k, cell in enumerate(row) if cell), default=0)


def _heading_lines(text: list[list[bool]], rows: list[list[str]]) -> int:
    """Return how many lines stand above the first row: names, and units below; ``text``: cell is text."""
    below = rows[1] if len(rows) > 1 else []
    if len(rows) > 2 and _numbers(rows[0], below):
        return 2
    if not (all(text[0]) or any(a and is_number(b) for a, b in zip(text[0], below, strict=False))):
        return 0
    return 2 if len(text) > 2 and _is_heading(below) and not all(text[2]) else 1


def _without_end(names: list[str], first: list[str]) -> tuple[list[str], list[str]]:
    """Return header and first row without the columns that only delimiters at the end of a line make."""
    if not names[-1] and (not first[-1] or len(names) == len(first) + 1):
        names = names[:-1]
    while len(first) > len(names) and not first[-1]:
        first = first[:-1]
    return names, first


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
    return [f"column{k + 1}" for k in range(count)]
