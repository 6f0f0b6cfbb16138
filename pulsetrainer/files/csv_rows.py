"""The rows of a text table, piece by piece: only the columns that are kept stay in memory.

Numpy parses a piece at once. Only where that fails are its comments and blank lines taken out, and only where
that fails too are its cells looked at one by one, to fill what is missing or to name the one to blame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from pulsetrainer.artefacts import FloatArray
from pulsetrainer.artefacts.units import counted
from pulsetrainer.errors import DataError
from pulsetrainer.files.csv_cells import has_thousands, is_number, number, quoted, readable
from pulsetrainer.files.csv_dialect import Dialect, detect
from pulsetrainer.files.csv_encoding import end_of
from pulsetrainer.files.csv_headings import column_words

PIECE = 1 << 21  # characters: numpy and Python hold some ten times as much while they parse them
_SPARE = 1.02  # of the room that the first piece lets expect; what is never written to takes no memory
_GROWTH = 1.125
_ALIKE = 16  # rows with as many decimals: those of the last are no chance
_NO_READING = (9.9e37, 9.91e37)  # IEEE 488.2: an instrument's overload, and its NaN


@dataclass(frozen=True, slots=True)
class Rows:
    """The kept columns of a text, and where in the file their rows are."""

    columns: tuple[FloatArray, ...]  # each (n,)
    shifts: tuple[tuple[int, int], ...]  # (row, line) wherever comments or blank lines change the distance
    misfit: str  # what is wrong with the first row that cannot be read; empty where all can
    remedy: str  # what mends that row, where it tells


def parse(path: Path, dialect: Dialect, keep: Sequence[int] | None = None, piece: int = PIECE) -> Rows:
    """Return the columns whose numbers are in ``keep``, in that order; all by default. Text becomes NaN.

    Text in other columns, a remark for instance, is passed over. A row that is too short or too long, or has
    text in a kept column of numbers, is a misfit: what it lacks is NaN. A ``piece`` has so many characters,
    and the rest of its last line.

    DataError where the decimal sign changes, or thousands are separated: line and column are named; OSError
    where the file cannot be read.
    """
    places = list(range(len(dialect.names)) if keep is None else keep)
    reader = _Reader(path, dialect, frozenset(places), dialect.first_line)
    kept = _Kept(places)
    with path.open(encoding=dialect.encoding, errors="surrogateescape", newline=None) as stream:
        for _ in range(dialect.first_line - 1):
            stream.readline()
        size = path.stat().st_size
        while text := stream.read(piece) + stream.readline():
            values = reader.read(text)
            # a character is a byte, or, in UTF-16, two of them
            kept.append(values, expected=len(values) * size / len(text))
    return Rows(kept.finished(), tuple(reader.shifts), reader.misfit, reader.remedy)


def cell_at(path: Path, line: int, column: int) -> str:
    """Return what stands in a cell of a text: line from 1, column from 0; raises as ``detect``."""
    dialect = detect(path)
    with path.open(encoding=dialect.encoding, errors="surrogateescape", newline=None) as stream:
        text = next(islice(stream, line - 1, None), "")
    return (*dialect.split(readable(text.strip("\r\n"))), *[""] * (column + 1))[column]


def ends_in_a_number(path: Path, dialect: Dialect) -> bool:
    """Whether a file was cut within its last number: no line end, and fewer decimals than in all rows before.

    OSError where it cannot be read.
    """
    text = end_of(path, dialect.encoding)
    rows = [dialect.split(line) for line in text.splitlines() if line.strip()][-_ALIKE:]
    if text.endswith(("\n", "\r")) or len(rows) < _ALIKE:
        return False
    sign = "," if dialect.decimal_comma else "."
    *before, last = [len(cells[-1].partition(sign)[2]) for cells in rows]
    numbers = all(is_number(cells[-1].removesuffix(sign)) for cells in rows)
    return numbers and len(set(before)) == 1 and last < before[0]


def _of_a_comma(cells: Sequence[str]) -> str:
    """Say what to do about a row that is too long for a decimal comma; empty where it cannot be one."""
    pairs = [p for p in pairwise(cells) if p[0].lstrip("+-").isdigit() and p[1].isdigit()]
    if not pairs:
        return ""
    comma, point = ",".join(pairs[-1]), ".".join(pairs[-1])
    mend = f"write {point}, or separate the columns by semicolons"
    return f"if {comma} is a decimal comma, {mend}; otherwise remove a cell"


class _Kept:
    """Columns that grow in place: never a second copy of them."""

    def __init__(self, places: list[int]) -> None:
        self._places = places
        self._columns = [np.empty(0) for _ in places]
        self._rows = 0

    def append(self, values: FloatArray, *, expected: float) -> None:
        """Append the rows (n, columns of the file); ``expected``: how many there may be in the end."""
        end = self._rows + len(values)
        if self._columns and end > self._columns[0].size:
            if self._rows == 0:
                self._columns = [np.empty(max(end, int(_SPARE * expected))) for _ in self._places]
            else:
                for column in self._columns:
                    column.resize(int(_GROWTH * end), refcheck=False)
        for column, place in zip(self._columns, self._places, strict=True):
            column[self._rows : end] = values[:, place]
        self._rows = end

    def finished(self) -> tuple[FloatArray, ...]:
        """Return the columns, and give back the room that was not needed."""
        for column in self._columns:
            column.resize(self._rows, refcheck=False)
        return tuple(self._columns)


@dataclass(slots=True)
class _Reader:
    """Pieces of text into numbers; knows the line it is at and the decimal signs it has seen."""

    path: Path
    dialect: Dialect
    needed: frozenset[int]  # columns that must hold numbers
    line: int  # of the next piece
    shifts: list[tuple[int, int]] = field(default_factory=list)
    row: int = 0
    point: str = ""  # where the first decimal point was, and the first decimal comma
    comma: str = ""
    misfit: str = ""
    remedy: str = ""

    def read(self, text: str) -> FloatArray:
        """Return the rows (n, columns) of the next piece; raises as ``parse``."""
        found = text.removesuffix("\n").split("\n")
        values = self._at_once(found, range(self.line, self.line + len(found)))
        if values is not None:
            self._note_shift(self.line, self.row)
        else:
            rows, places = self._without_remarks(found)
            values = self._at_once(rows, places)
            if values is None:
                values = self._cell_by_cell(rows, places)
        values[np.isin(np.abs(values), _NO_READING)] = np.nan
        self.line += len(found)
        self.row += len(values)
        return values

    def _at_once(self, lines: Sequence[str], places: Sequence[int]) -> FloatArray | None:
        """Return what numpy makes of the lines, if that is beyond doubt: each is a row of as many numbers."""
        dialect = self.dialect
        rows = lines
        if dialect.delimiter and all(line.endswith(dialect.delimiter) for line in lines):
            rows = [line.rstrip(dialect.delimiter) for line in lines]
        if dialect.text_columns or not any(line.strip() for line in rows):
            return None
        if dialect.decimal_comma and dialect.delimiter == ",":  # in quotes
            return None
        if dialect.decimal_comma:
            if any("." in line for line in rows):
                return None
            rows = [line.replace(",", ".") for line in rows]
        try:
            values: FloatArray = np.loadtxt(
                rows, delimiter=dialect.delimiter, comments=None, quotechar='"', ndmin=2
            )
        except ValueError:
            return None
        if values.shape != (len(lines), len(dialect.names)):
            return None
        if not (self.comma if dialect.decimal_comma else self.point):
            sign = "," if dialect.decimal_comma else "."
            k = next((k for k, line in enumerate(lines) if sign in line), None)
            if k is not None:
                self._look_for_signs(places[k], dialect.split(lines[k]))
        return values

    def _without_remarks(self, found: Sequence[str]) -> tuple[list[str], list[int]]:
        """Return the rows without comments and blank lines, and their lines; note where these jump."""
        rows: list[str] = []
        places: list[int] = []
        for count, line in enumerate(found, self.line):
            if line and not line.isspace() and not line.lstrip().startswith(self.dialect.remarks):
                self._note_shift(count, self.row + len(rows))
                rows.append(line)
                places.append(count)
        return rows, places

    def _note_shift(self, line: int, row: int) -> None:
        if not self.shifts or line - row != self.shifts[-1][1] - self.shifts[-1][0]:
            self.shifts.append((row, line))

    def _cell_by_cell(self, lines: Sequence[str], places: Sequence[int]) -> FloatArray:
        """Look at every cell; NaN for what is missing, and for text in a column of text."""
        dialect = self.dialect
        values = np.full((len(lines), len(dialect.names)), np.nan)
        commas = dialect.delimiter == ","
        for row, (count, line) in enumerate(zip(places, lines, strict=True)):
            cells = dialect.split(line)
            if dialect.text_columns.issuperset(range(len(cells), len(dialect.names))):
                cells += [""] * (len(dialect.names) - len(cells))  # no remark
            if len(cells) != len(dialect.names):
                self._first_misfit(
                    f"{self.path} has {counted(len(cells), 'column')} in line {count}, "
                    f"expected {len(dialect.names)}: {', '.join(dialect.names)}",
                    _of_a_comma(cells) if commas and len(cells) > len(dialect.names) else "",
                )
                continue
            for k, cell in enumerate(cells):
                if k not in dialect.text_columns:
                    values[row, k] = self._value(cell, k, count)
            self._look_for_signs(count, cells)
        if self.comma and not dialect.decimal_comma:
            self.dialect = replace(dialect, decimal_comma=True)
        return values

    def _value(self, cell: str, k: int, line: int) -> float:
        """Return the number in a cell, NaN where there is none; the first that is needed is a misfit."""
        value = number(cell, day_first=self.dialect.day_first)
        if value is None and k in self.needed:
            said = f"{self.path} has {self._place(cell, k, line)}: not a number"
            if has_thousands(cell):  # all large values are so: without them the record is another
                raise DataError(said, hint="export it without thousands separators")
            share = cell.removesuffix("%").rstrip()
            self._first_misfit(said, f"write the numbers without %: {share}" if is_number(share) else "")
        return np.nan if value is None else value

    def _first_misfit(self, said: str, remedy: str) -> None:
        if not self.misfit:
            self.misfit, self.remedy = said, remedy

    def _look_for_signs(self, line: int, cells: Sequence[str]) -> None:
        """Note the first decimal point and the first decimal comma; raise DataError where there are both."""
        for k, cell in enumerate(cells):
            # a remark has no decimal sign, a time of day one of its own
            if k in self.dialect.text_columns or ":" in cell:
                continue
            if not self.point and "." in cell and number(cell) is not None:
                self.point = self._place(cell, k, line)
            if not self.comma and "," in cell and number(cell) is not None:
                self.comma = self._place(cell, k, line)
        if self.point and self.comma:
            raise DataError(
                f"{self.path} mixes decimal signs: {self.point}, but {self.comma}",
                hint="export it with one decimal sign",
            )

    def _place(self, cell: str, column: int, line: int) -> str:
        return f"{quoted(cell)} in {column_words(self.dialect.names[column])}, line {line}"
