"""Tables from any bench: text of any dialect, .npz, .mat, .wav.

What a text is taken for is decided in ``csv_dialect``, by explicit rules, and its rows are read by
``csv_rows``; what is no text is read by ``array_files``. Units are what a header says: ``current_A``,
``Force (N)``, ``time [ms]``, ``Kraft / N``, ``B/T``, ``t in min``, or a line of units below it.
"""

from __future__ import annotations

import csv
import difflib
import io
import re
from bisect import bisect_right
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pulsetrainer.artefacts import LARGEST, FloatArray, beyond_all_quantities
from pulsetrainer.artefacts.units import counted, is_unit, split_unit, symbol_of
from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.files.array_files import Columns, reader_of
from pulsetrainer.files.atomic_write import replacing
from pulsetrainer.files.csv_cells import number, quoted
from pulsetrainer.files.csv_dialect import Dialect, detect
from pulsetrainer.files.csv_encoding import end_of
from pulsetrainer.files.csv_headings import column_words
from pulsetrainer.files.csv_rows import cell_at, ends_in_a_number, parse
from pulsetrainer.files.input_file import unreadable
from pulsetrainer.files.time_stamps import how_to_write

_WRITTEN_ROWS = 1 << 14
_NAMED = 5  # bad rows
_MOST_BAD = 0.99  # of the rows: with more of them bad, the table is not what it was taken for
_WITH_UNIT = re.compile(r"[-+]?\d[\d.,]*\s*([^\d\s.,].*)")  # a cell
_ONE_OF_THESE = "name one of these, or give its number: 1 is the first"
_AGAIN = "export the recording again"


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of numbers, their names and units as the header has them, and the comments above them."""

    path: Path
    names: tuple[str, ...]
    columns: Mapping[str, FloatArray]  # those that were kept, each (rows,); NaN where there is text
    units: Mapping[str, str]  # by name, where the header says one
    comments: tuple[str, ...]
    text_names: frozenset[str] = frozenset()  # columns of text
    # (row, line) wherever their distance changes; empty where the file has no lines
    shifts: Sequence[tuple[int, int]] = ()
    rate_Hz: float | None = None  # where the file itself says one
    layout: str = ""  # of a text, in words: what separates its columns, and its decimal sign
    cut: bool = False  # a text that ends within its last number
    left_out: Mapping[str, str] = field(default_factory=dict)  # of a file of arrays: why each is no column

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return next((column.size for column in self.columns.values()), 0)

    def column(self, name: str) -> FloatArray:
        """Return a column (rows,) by its name, or by the name without its unit, whatever the case.

        Raises as ``index``.
        """
        return self.columns[self.heading(name)]

    def heading(self, name: str) -> str:
        """Return the heading of a column as it stands in the file; raises as ``index``."""
        return self.names[self.index(name)]

    def unit(self, name: str) -> str:
        """Return the unit of a column, empty where the header says none; raises as ``index``."""
        return self.units.get(self.heading(name), "")

    def place(self, row: int) -> str:
        """Say where a row is: the line of a text, the row of anything else."""
        return f"line {self.line_of(row)}" if self.shifts else f"row {row + 1}"

    def line_of(self, row: int) -> int:
        """Return the line of the file that holds a row."""
        first_row, line = self.shifts[bisect_right(self.shifts, row, key=lambda shift: shift[0]) - 1]
        return line + row - first_row

    def bad_rows(self) -> NDArray[np.int64]:
        """Return the rows in which a number is missing or not finite, in a column that was kept."""
        finite = [np.isfinite(column) for column in self.columns.values()]
        return np.flatnonzero(~np.logical_and.reduce(finite))

    def mostly(self, bad: NDArray[np.int64]) -> bool:
        """Whether so many rows (k,) are bad that there is no use in leaving them out."""
        return bad.size > _MOST_BAD * self.rows

    def places(self, rows: NDArray[np.int64]) -> str:
        """Say where the first of these rows (k,) are: ``lines 7, 9, 11``."""
        word = "line" if self.shifts else "row"
        where = [self.place(int(row)).removeprefix(word) for row in rows[:_NAMED]]
        return f"{word}{'s' if rows.size > 1 else ''}{','.join(where)}{', ...' if rows.size > _NAMED else ''}"

    def check_finite(self, name: str, *, remedy: str = _AGAIN) -> FloatArray:
        """Return a column in which every value is finite; ``remedy`` is what may be done but removing rows.

        DataError where a value is NaN, infinite or missing: line and column are named.
        """
        name = self.heading(name)
        values = self.columns[name]
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size == values.size:
            raise DataError(
                f"{self.path} has no numbers in {column_words(name)}: all {values.size} rows lack one",
                hint=f"name another column; it has {', '.join(self.names)}",
            )
        if bad.size:
            value = values[bad[0]]
            if np.isnan(value):
                value = self._cell(name, int(bad[0])) if self.shifts else "NaN"
            raise DataError(
                f"{self.path} has {value} in {column_words(name)}, {self.place(int(bad[0]))} "
                f"({_lacking(bad.size, values.size)}: {self.places(bad)})",
                hint=f"remove {'that row' if bad.size == 1 else 'those rows'}, "
                f"or {_AGAIN if self.mostly(bad) else remedy}",
            )
        if said := beyond_all_quantities(values):
            first = self.place(int(np.argmax(np.abs(values) > LARGEST)))
            raise DataError(
                f"{self.path}, {column_words(name)}, {said}: the first is in {first}",
                hint="correct or remove those rows",
            )
        return values

    def _cell(self, name: str, row: int) -> str:
        """Return what stands in the cell of a text that is no number."""
        cell = cell_at(self.path, self.line_of(row), self.index(name))
        value = number(cell)
        overload = " (an overload)" if value is not None and np.isfinite(value) else ""
        return f"{quoted(cell)}{overload}" if cell else "a blank cell"

    def index(self, name: str) -> int:
        """Return the place of a column of numbers; ``force_N`` is the heading ``force [N]`` too.

        Where no heading is a number, ``2`` is the second column.

        DataError where there is no such column (similar names are offered), or it holds text.
        """
        exact = [split_unit(own)[0] for own in self.names]
        bare = [own.lower() for own in exact]
        wanted, unit = split_unit(name)
        units = [self.units.get(own) for own in self.names]
        alike = (
            [own == name for own in self.names],
            [own == name for own in exact],
            [own == name.lower() for own in bare],
            [bool(unit) and pair == (wanted.lower(), unit) for pair in zip(bare, units, strict=True)],
        )
        k = next((which.index(True) for which in alike if which.count(True) == 1), None)
        if k is None:
            k = {str(number): place for place, number in enumerate(range(1, len(self.names) + 1))}.get(name)
        if k is None:
            raise self._no_column(name)
        if self.names[k] in self.text_names:
            raise self._of_text(k)
        return k

    def _of_text(self, k: int) -> DataError:
        """Return what is wrong with a column of text; it may be of numbers, each with its unit."""
        cell = cell_at(self.path, self.line_of(0), k) if self.shifts else ""
        hint = how_to_write(cell) or (
            "numbers must stand there; times may be numbers, 12:34:56.7, 2024-05-01T12:34:56 or "
            "01.05.2024 12:34:56"
        )
        if (found := _WITH_UNIT.fullmatch(cell)) and is_unit(found[1]):
            heading = f"{split_unit(self.names[k])[0]} [{found[1]}]"
            hint = f"remove the unit from the cells, and write it in the heading: {heading!r}"
            if (own := self.units.get(self.names[k])) and own != symbol_of(found[1]):
                hint = (
                    f"the heading says {own}: write the numbers in {own}, not in {found[1]}, as plain numbers"
                )
        said = f"{self.path} has text, not numbers, in {column_words(self.names[k])}"
        return DataError(f"{said}: {quoted(cell)} in {self.place(0)}", hint=hint)

    def _no_column(self, name: str) -> DataError:
        """Return what is wrong with a name that no column has, or that several have."""
        same = [own for own in self.names if own.lower().startswith(f"{split_unit(name)[0].lower()}#")]
        if name.strip() and same:
            return DataError(
                f"{self.path} has {len(same)} columns with the heading {name!r}; they are "
                f"called {', '.join(same)}",
                hint=f"choose by the name with its number: {' or '.join(map(repr, same))}",
            )
        if name in self.left_out:
            return DataError(
                f"{self.path}: {name} is no column, it has {self.left_out[name]}; columns: "
                + ", ".join(self.names),
                hint="save the quantities as rows of real numbers, all of one length",
            )
        if len(self.names) == 1:
            return DataError(
                f"{self.path} has no column {name!r}; it has a single one, {self.names[0]}",
                hint="give a table with a column for each quantity",
            )
        near = [own for own in self.names if name.strip() and name.lower() in own.lower()]
        near = near or difflib.get_close_matches(name, self.names, n=3, cutoff=0.5)
        # a short name is hardly like a heading with a unit
        near = near or [own for own in self.names if _alike(split_unit(name)[0], split_unit(own)[0])]
        hint = f"did you mean {' or '.join(repr(n) for n in near)}?" if near else _ONE_OF_THESE
        bare_numbers = self.names == tuple(f"column{k}" for k in range(1, len(self.names) + 1))
        return DataError(
            f"{self.path} has no column {name!r}; "
            + ("it has no headings: its columns are called " if bare_numbers else "it has ")
            + ", ".join(self.names),
            hint="name columns by number: 1 is the first" if bare_numbers else hint,
        )


def _lacking(bad: int, rows: int) -> str:
    return _share(bad, rows, "lacks a number", "lack a number")


def _share(some: int, rows: int, is_so: str, are_so: str) -> str:
    return f"{some} of {counted(rows, 'row')} {is_so if some == 1 else are_so}"


def _alike(one: str, other: str) -> bool:
    return bool(difflib.get_close_matches(one.lower(), [other.lower()], cutoff=0.5))


def numbered(names: Sequence[str]) -> tuple[str, ...]:
    """Return headings with a number behind the name wherever several columns have one heading.

    ``t, Volt (V), Volt (V)`` become ``t, Volt#1 (V), Volt#2 (V)``.
    """
    found: list[str] = []
    for k, name in enumerate(names):
        if names.count(name) > 1:
            bare, unit = split_unit(name)
            behind = f" [{unit}]" if unit and bare == name else name.removeprefix(bare)
            found.append(f"{bare}#{names[: k + 1].count(name)}{behind}")
        else:
            found.append(name)
    return tuple(found)


def read_table(
    path: Path | str,
    keep: Callable[[Table], Collection[int]] | None = None,
    *,
    bad_rows: bool = False,
    remedy: str = _AGAIN,
) -> Table:
    """Read a table of numbers, a text of any size piece by piece.

    ``keep`` gets the table without its numbers and returns the places of the columns that are to stay in
    memory; all by default. With ``bad_rows`` a row of too few or too many cells, or with text in a column of
    numbers, lacks numbers; without, ``remedy`` is what may be done but removing such rows,
    if anything.

    DataError where the file cannot be read, is empty or no table, has bad rows, or two decimal signs (line
    and column are named).
    """
    path = Path(path)
    try:
        reader = reader_of(path)
        if reader is not None:
            table = _of_arrays(path, reader(path))
            names = [table.names[k] for k in keep(table)] if keep else table.names
            return replace(table, columns={name: table.columns[name] for name in names})
        dialect = detect(path)
        dialect = replace(dialect, names=numbered(dialect.names))
        table = _head(path, dialect)
        kept = sorted(set(keep(table))) if keep else list(range(len(table.names)))
        rows = parse(path, dialect, kept)
        table = replace(table, cut=ends_in_a_number(path, dialect))
    except OSError as error:
        raise unreadable(path, error) from error
    except UnicodeError as error:
        raise DataError(f"{path} is not a text file: {error}", hint="export the recording as CSV") from error
    except (csv.Error, ValueError, IndexError) as error:  # quotes that do not close, cells without end
        raise DataError(
            f"{path} is not a table of numbers: {error}", hint="export it as CSV, one column per quantity"
        ) from error
    columns = {table.names[k]: column for k, column in zip(kept, rows.columns, strict=True)}
    table = replace(table, columns=columns, shifts=rows.shifts)
    if rows.misfit and not bad_rows:
        bad = table.bad_rows()
        if bad.size and bad[0] == table.rows - 1 and end_of(path, dialect.encoding).endswith("\0"):
            raise DataError(
                f"{path} ends in zero bytes, in {table.place(table.rows - 1)}: the recorder stopped there",
                hint=f"cut the file after line {table.line_of(table.rows - 1) - 1}"
                + (remedy and f", or {remedy}"),
            )
        mend = rows.remedy or f"correct or remove {'that line' if bad.size == 1 else 'those lines'}"
        raise DataError(
            f"{rows.misfit} ({_share(bad.size, table.rows, 'is bad', 'are bad')}: {table.places(bad)})",
            hint=mend + (remedy and f", or {_AGAIN if table.mostly(bad) else remedy}"),
        )
    return table


def _head(path: Path, dialect: Dialect) -> Table:
    return Table(
        path,
        dialect.names,
        {},
        _units(dialect),
        dialect.comments,
        frozenset(dialect.names[k] for k in dialect.text_columns),
        ((0, dialect.first_line),),
        dialect.rate_Hz,
        dialect.words,
    )


def _of_arrays(path: Path, columns: Columns) -> Table:
    names = tuple(columns.values)
    units = {name: symbol_of(columns.units.get(name) or split_unit(name)[1]) for name in names}
    named = {name: unit for name, unit in units.items() if unit}
    return Table(path, names, columns.values, named, (), rate_Hz=columns.rate_Hz, left_out=columns.left_out)


def _units(dialect: Dialect) -> dict[str, str]:
    """Return the unit of each column that has one: in its heading, in the line below, or of time stamps."""
    pairs = zip(dialect.names, dialect.units, strict=True)
    units = {name: symbol_of(split_unit(name)[1] or below) for name, below in pairs}
    units |= {dialect.names[k]: "s" for k in dialect.stamped}
    return {name: unit for name, unit in units.items() if unit}


def write_table(
    path: Path | str,
    columns: Mapping[str, ArrayLike],
    *,
    comments: Sequence[str] = (),
    overwrite: bool = False,
) -> None:
    """Write columns as CSV: a header of their names, numbers that read back to the last bit.

    UsageError where the file exists and ``overwrite`` is not set, or its folder is missing or not writable;
    DataError where the disk is full or failed; ArgumentError where the columns differ in length.
    """
    arrays = [np.atleast_1d(np.asarray(column, dtype=np.float64)) for column in columns.values()]
    if len({array.shape for array in arrays}) != 1 or arrays[0].ndim != 1:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(columns, arrays, strict=True))
        raise ArgumentError(
            f"a table needs columns of one length: {shapes}", hint="this is a bug in the caller"
        )
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(columns)
    with (
        replacing(path, overwrite=overwrite) as temporary,
        temporary.open("w", encoding="utf-8", newline="\n") as out,
    ):
        out.writelines(f"# {line}\n" for comment in comments for line in comment.splitlines())
        out.write(header.getvalue())
        # a whole number without a point reads back the same
        rows = zip(*((repr(x).removesuffix(".0") for x in array.tolist()) for array in arrays), strict=True)
        while block := list(islice(rows, _WRITTEN_ROWS)):
            out.write("".join(f"{','.join(row)}\n" for row in block))
