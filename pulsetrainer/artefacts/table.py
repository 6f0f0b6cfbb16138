"""Tables from any bench: CSV, TSV, semicolons, decimal commas, comments, with or without a header.

What a file is taken for is decided in ``table_text``, by explicit rules. Units are what a header says:
``current_A``, ``Force (N)``, ``time [ms]``, ``Kraft / N``, or a line of units below it.
"""

from __future__ import annotations

import csv
import difflib
import io
import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts.kinds import FloatArray, Run
from pulsetrainer.artefacts.output import replacing
from pulsetrainer.artefacts.table_text import Dialect, detect, parse
from pulsetrainer.errors import ArgumentError, DataError, UsageError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[(\[](?P<unit>[^()\[\]]*)[)\]]\s*$")
_DIVIDED = re.compile(r"^(?P<name>.*\S)\s+/\s+(?P<unit>\S+)\s*$")
_SUFFIXED = re.compile(r"^(?P<name>.+)_(?P<unit>[^_\s]{1,6})$")
# a suffix is a unit only if it is one: "coil_current" is a name
_UNIT_NAMES = """
    s ms us µs min h A mA uA kA V mV kV N mN kN Nm mNm T mT m mm um µm nm Pa kPa MPa bar mbar mmHg
    deg rad C °C degC K Hz kHz W g kg A/m kA/m m/s mm/s rad/s N/A % percent
"""
_UNITS = frozenset(_UNIT_NAMES.split())
_SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0}
_WRITTEN_ROWS = 1 << 14


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of numbers, their names and units as the header has them, and the comments above them."""

    path: Path
    names: tuple[str, ...]
    values: FloatArray  # (rows, columns); NaN in columns of text
    units: Mapping[str, str]  # by name, where the header says one
    comments: tuple[str, ...]
    text_names: frozenset[str] = frozenset()  # columns of text
    shifts: Sequence[tuple[int, int]] = field(
        default=((0, 1),)
    )  # (row, line) wherever their distance changes

    def column(self, name: str) -> FloatArray:
        """Return a column (rows,) by its name, or by the name without its unit, whatever the case.

        Raises
        ------
        DataError
            There is no such column, or it holds text.
        """
        return self.values[:, self.index(name)]

    def unit(self, name: str) -> str:
        """Return the unit of a column, empty where the header says none.

        Raises
        ------
        DataError
            There is no such column, or it holds text.
        """
        return self.units.get(self.names[self.index(name)], "")

    def line_of(self, row: int) -> int:
        """Return the line of the file that holds a row."""
        first_row, line = self.shifts[bisect_right(self.shifts, row, key=lambda shift: shift[0]) - 1]
        return line + row - first_row

    def check_finite(self, name: str) -> FloatArray:
        """Return a column in which every value is finite.

        Raises
        ------
        DataError
            A value is NaN, infinite or missing: line and column are named.
        """
        values = self.column(name)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise DataError(
                f"{self.path} has {values[bad[0]]} in column {name}, line {self.line_of(int(bad[0]))} "
                f"({bad.size} of {values.size} rows are not finite)",
                hint="remove those rows, or export the record again",
            )
        return values

    def index(self, name: str) -> int:
        """Return the place of a column of numbers.

        Raises
        ------
        DataError
            There is no such column (the nearest names are offered), or it holds text.
        """
        bare = [_split_unit(own)[0].lower() for own in self.names]
        if name in self.names:
            k = self.names.index(name)
        elif bare.count(name.lower()) == 1:
            k = bare.index(name.lower())
        else:
            near = difflib.get_close_matches(name, self.names, n=3, cutoff=0.3) or list(self.names)[:8]
            raise DataError(
                f"{self.path} has no column {name!r}; it has {', '.join(self.names)}",
                hint=f"did you mean {' or '.join(repr(n) for n in near)}?",
            )
        if self.names[k] in self.text_names:
            raise DataError(
                f"{self.path} has text, not numbers, in column {self.names[k]}, as in line {self.line_of(0)}",
                hint="name another column",
            )
        return k


def _split_unit(heading: str) -> tuple[str, str]:
    """Return name and unit of a column heading; no unit where it says none."""
    for pattern in (_BRACKETED, _DIVIDED):
        if (found := pattern.match(heading)) and found["name"]:
            return found["name"].strip(), found["unit"].strip()
    suffixed = _SUFFIXED.match(heading)
    if suffixed and suffixed["unit"] in _UNITS:
        return suffixed["name"], suffixed["unit"]
    return heading, ""


def read_table(path: Path | str) -> Table:
    """Read a table of numbers.

    Raises
    ------
    DataError
        The file cannot be read, is empty or no table, has two columns of one name, or holds text in a column
        of numbers or two decimal signs (line and column are named).
    """
    path = Path(path)
    try:
        dialect = detect(path)
        if len(set(dialect.names)) < len(dialect.names):
            twice = next(name for name in dialect.names if dialect.names.count(name) > 1)
            raise DataError(f"{path} has two columns named {twice!r}", hint="rename one of them")
        values, rows = parse(path, dialect)
    except OSError as error:
        raise DataError(
            f"{path} cannot be read: {error.strerror or error}", hint="check the name and its permissions"
        ) from error
    except UnicodeError as error:
        raise DataError(f"{path} is not a text file: {error}", hint="export the record as CSV") from error
    except (csv.Error, ValueError, IndexError) as error:  # quotes that do not close, cells without end
        raise DataError(
            f"{path} is no table of numbers: {error}", hint="export it as CSV with one column a quantity"
        ) from error
    return Table(
        path,
        dialect.names,
        values,
        _units(dialect),
        dialect.comments,
        frozenset(dialect.names[k] for k in dialect.text_columns),
        tuple(rows.shifts),
    )


def _units(dialect: Dialect) -> dict[str, str]:
    """Return the unit of each column that has one, in its heading or in the line below."""
    pairs = zip(dialect.names, dialect.units, strict=True)
    units = {name: _split_unit(name)[1] or below for name, below in pairs}
    return {name: unit for name, unit in units.items() if unit}


def write_table(
    path: Path | str, columns: Mapping[str, ArrayLike], *, comments: Sequence[str] = (), force: bool = False
) -> None:
    """Write columns as CSV: a header of their names, numbers that read back to the last bit.

    Raises
    ------
    UsageError
        The file exists and ``force`` is not set, or its folder is missing or not writable.
    DataError
        The disk is full or failed.
    ArgumentError
        The columns differ in length.
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
        replacing(path, force=force) as temporary,
        temporary.open("w", encoding="utf-8", newline="\n") as out,
    ):
        out.writelines(f"# {line}\n" for comment in comments for line in comment.splitlines())
        out.write(header.getvalue())
        rows = zip(*(map(repr, array.tolist()) for array in arrays), strict=True)
        while block := list(islice(rows, _WRITTEN_ROWS)):
            out.write("".join(f"{','.join(row)}\n" for row in block))


def run_from_table(
    table: Table,
    *,
    input_column: str,
    output_column: str,
    time_column: str | None = None,
    reference_column: str | None = None,
    input_unit: str | None = None,
    output_unit: str | None = None,
    rate_Hz: float | None = None,
) -> Run:
    """Make a run of named columns.

    Without ``time_column`` and ``rate_Hz`` the time is the first column, where that is neither input, output
    nor reference; otherwise the run has no time and only its order counts. Time may be in ms or us.

    Raises
    ------
    UsageError
        Both a time column and a rate are given, or the rate is not positive.
    DataError
        A column is missing or not finite, there are fewer than two rows, or time does not increase (the line
        is named).
    """
    if time_column is not None and rate_Hz is not None:
        raise UsageError(
            f"both a time column ({time_column}) and a rate ({rate_Hz:g} Hz) were given",
            hint="give --time or --rate, not both",
        )
    if rate_Hz is not None and not 0 < rate_Hz < np.inf:
        raise UsageError(f"the rate must be positive, got {rate_Hz:g} Hz", hint="for instance --rate 1000")
    wanted = [name for name in (input_column, output_column, reference_column) if name is not None]
    columns = {name: table.check_finite(name) for name in wanted}
    rows = table.values.shape[0]
    if rows < 2:
        raise DataError(
            f"{table.path} has {rows} row, a run needs two or more", hint="export the record again"
        )
    time_s = None
    if rate_Hz is not None:
        time_s = np.arange(rows) / rate_Hz
    elif time_column is not None:
        time_s = _time(table, time_column)
    elif all(table.index(name) != 0 for name in wanted):
        time_s = _time(table, table.names[0])
    return Run(
        time_s=time_s,
        input=columns[input_column],
        output=columns[output_column],
        reference=None if reference_column is None else columns[reference_column],
        input_unit=input_unit or table.unit(input_column) or "1",
        output_unit=output_unit or table.unit(output_column) or "1",
        input_quantity=_split_unit(table.names[table.index(input_column)])[0],
        output_quantity=_split_unit(table.names[table.index(output_column)])[0],
        signal=table.path.name,
    )


def _time(table: Table, name: str) -> FloatArray:
    """Return a column as strictly increasing seconds."""
    unit = table.unit(name)
    if unit not in _SECONDS:
        raise DataError(
            f"{table.path} gives the time {name} in {unit!r}, which is not one of s, ms, us, min, h",
            hint="name another --time column, or give --rate",
        )
    time_s = table.check_finite(name) * _SECONDS[unit]
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if back.size:
        row = int(back[0]) + 1
        raise DataError(
            f"the time in {table.path}, column {name}, does not increase at line {table.line_of(row)}: "
            f"{time_s[row]:g} s after {time_s[row - 1]:g} s",
            hint="name the --time column, sort the rows, drop repeated ones, or give --rate instead",
        )
    return time_s
