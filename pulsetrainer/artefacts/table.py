"""Tables from any bench: CSV, TSV, semicolons, decimal commas, comments, with or without a header.

Nothing is guessed silently: what separates columns is the first of tab, semicolon and comma that occurs
in the last row, a comma is a decimal sign only where tab or semicolon separate, and units are what a
header says, ``current_A``, ``Force (N)``, ``time [ms]``.
"""

from __future__ import annotations

import csv
import difflib
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from pulsetrainer.artefacts.kinds import FloatArray, Run
from pulsetrainer.errors import DataError

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[(\[](?P<unit>[^()\[\]]*)[)\]]\s*$")
_SUFFIXED = re.compile(r"^(?P<name>.+)_(?P<unit>[A-Za-zµ%°][A-Za-z0-9µ%°/^]{0,5})$")
# a suffix is a unit only if it is one: "coil_current" is a name
_UNITS = frozenset(
    [
        "s",
        "ms",
        "us",
        "min",
        "A",
        "mA",
        "kA",
        "V",
        "mV",
        "kV",
        "N",
        "mN",
        "kN",
        "Nm",
        "T",
        "mT",
        "m",
        "mm",
        "um",
        "nm",
        "Pa",
        "kPa",
        "bar",
        "mbar",
        "deg",
        "rad",
        "C",
        "degC",
        "K",
        "Hz",
        "W",
        "mmHg",
        "A/m",
        "kA/m",
        "m/s",
        "mm/s",
    ]
)
_SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0}


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of numbers, their names and units as the header has them, and the comments above them."""

    path: Path
    names: tuple[str, ...]
    values: FloatArray  # (rows, columns)
    units: Mapping[str, str]  # by name, where the header says one
    comments: tuple[str, ...]
    first_line: int  # line of the file that holds the first row

    def column(self, name: str) -> FloatArray:
        """Return a column (rows,) by its name, or by the name without its unit.

        Raises
        ------
        DataError
            There is no such column, or it holds what is not a number.
        """
        return self.values[:, self.index(name)]

    def unit(self, name: str) -> str:
        """Unit of a column, empty where the header says none."""
        return self.units.get(self.names[self.index(name)], "")

    def check_finite(self, name: str) -> FloatArray:
        """Return a column in which every value is finite.

        Raises
        ------
        DataError
            A value is NaN or infinite: line and column are named.
        """
        values = self.column(name)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise DataError(
                f"{self.path} has {values[bad[0]]} in column {name}, line {self.first_line + int(bad[0])} "
                f"({bad.size} of {values.size} rows are not finite)",
                hint="remove those rows, or export the record again",
            )
        return values

    def index(self, name: str) -> int:
        """Return the place of a column.

        Raises
        ------
        DataError
            There is no such column; the nearest names are offered.
        """
        if name in self.names:
            return self.names.index(name)
        bare = [_split_unit(own)[0].lower() for own in self.names]
        if bare.count(name.lower()) == 1:
            return bare.index(name.lower())
        near = difflib.get_close_matches(name, self.names, n=3, cutoff=0.3) or list(self.names)
        raise DataError(
            f"{self.path} has no column {name!r}; it has {', '.join(self.names)}",
            hint=f"did you mean {' or '.join(repr(n) for n in near)}?",
        )


def _split_unit(heading: str) -> tuple[str, str]:
    """Name and unit of a column heading; no unit where it says none."""
    bracketed = _BRACKETED.match(heading)
    if bracketed:
        return bracketed["name"].strip(), bracketed["unit"].strip()
    suffixed = _SUFFIXED.match(heading)
    if suffixed and suffixed["unit"] in _UNITS:
        return suffixed["name"], suffixed["unit"]
    return heading, ""


def read_table(path: Path | str) -> Table:
    """Read a table of numbers.

    Raises
    ------
    DataError
        The file cannot be read, is empty, or holds text in a column of numbers (line and column are named).
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(f"{path} is not a text file: {error.reason}", hint="export it as CSV") from error
    except OSError as error:
        raise DataError(
            f"{path} cannot be read: {error.strerror or error}", hint="check the name and its permissions"
        ) from error
    lines = text.splitlines()
    comments = tuple(line.lstrip("# ").rstrip() for line in lines if line.startswith("#"))
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not numbered:
        raise DataError(f"{path} is empty", hint="export the record again")
    delimiter = _delimiter(numbered[-1][1])
    decimal_comma = delimiter != "," and any("," in line for _, line in islice(numbered, 1, 50))
    heading = next(csv.reader([numbered[0][1]], delimiter=delimiter))
    headed = any(_number(cell, decimal_comma=decimal_comma) is None for cell in heading)
    if headed:
        names = tuple(cell.strip() for cell in heading)
        numbered = numbered[1:]
    else:
        names = tuple(f"column{k + 1}" for k in range(len(heading)))
    if not numbered:
        raise DataError(f"{path} is empty below its header", hint="export the record again")
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise DataError(f"{path} has two columns named {twice!r}", hint="rename one of them")
    values = _values(path, names, numbered, delimiter, decimal_comma=decimal_comma)
    units = {name: unit for name, unit in ((n, _split_unit(n)[1]) for n in names) if unit}
    return Table(path, names, values, units, comments, numbered[0][0])


def _delimiter(line: str) -> str:
    return next((mark for mark in ("\t", ";", ",") if mark in line), ",")


def _number(cell: str, *, decimal_comma: bool) -> float | None:
    try:
        return float(cell.strip().replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return None


def _values(
    path: Path, names: tuple[str, ...], rows: list[tuple[int, str]], delimiter: str, *, decimal_comma: bool
) -> FloatArray:
    """Parse all rows at once; only when that fails look for the cell that is to blame."""
    text = "\n".join(line for _, line in rows)
    try:
        values = np.loadtxt(
            io.StringIO(text.replace(",", ".") if decimal_comma else text), delimiter=delimiter, ndmin=2
        )
    except ValueError as error:
        raise _blame(path, names, rows, delimiter, decimal_comma=decimal_comma) from error
    if values.shape[1] != len(names):
        raise DataError(
            f"{path} has {len(names)} column names, but {values.shape[1]} columns in line {rows[0][0]}",
            hint="mend the header",
        )
    return values


def _blame(
    path: Path, names: tuple[str, ...], rows: list[tuple[int, str]], delimiter: str, *, decimal_comma: bool
) -> DataError:
    """Return the error that names the first line and column that is no number."""
    for number, line in rows:
        cells = next(csv.reader([line], delimiter=delimiter))
        if len(cells) != len(names):
            return DataError(
                f"{path} has {len(cells)} columns in line {number}, expected {len(names)}: "
                f"{', '.join(names)}",
                hint="mend that line, or export the record again",
            )
        for name, cell in zip(names, cells, strict=True):
            if _number(cell, decimal_comma=decimal_comma) is None or (decimal_comma and "." in cell):
                mixed = _number(cell.replace(",", "."), decimal_comma=False) is not None
                what = "another decimal sign than the rest" if mixed else "no number"
                return DataError(
                    f"{path} has {cell!r} in column {name}, line {number}: {what}",
                    hint="mend or remove that line",
                )
    return DataError(f"{path} is no table of numbers", hint="export it as CSV with one column a quantity")


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
    DataError
        A column is missing or not finite, or time does not increase (the line is named).
    """
    wanted = [name for name in (input_column, output_column, reference_column) if name is not None]
    columns = {name: table.check_finite(name) for name in wanted}
    rows = table.values.shape[0]
    time_s = None
    if rate_Hz is not None:
        if not rate_Hz > 0:
            raise DataError(f"the rate must be positive, got {rate_Hz:g} Hz", hint="--rate 1000")
        time_s = np.arange(rows) / rate_Hz
    elif time_column is not None or all(table.names[0] != name for name in wanted):
        time_s = _time(table, time_column or table.names[0])
    quantity = _split_unit(table.names[table.index(input_column)])[0]
    response = _split_unit(table.names[table.index(output_column)])[0]
    return Run(
        time_s=time_s,
        input=columns[input_column],
        output=columns[output_column],
        reference=None if reference_column is None else columns[reference_column],
        input_unit=input_unit or table.unit(input_column) or "1",
        output_unit=output_unit or table.unit(output_column) or "1",
        input_quantity=quantity,
        output_quantity=response,
        signal=table.path.name,
    )


def _time(table: Table, name: str) -> FloatArray:
    """Return a column as strictly increasing seconds."""
    unit = table.unit(name)
    if unit not in _SECONDS:
        raise DataError(
            f"{table.path} gives the time {name} in {unit!r}, which is not one of s, ms, us, min",
            hint="name another --time column, or give --rate",
        )
    time_s = table.check_finite(name) * _SECONDS[unit]
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if back.size:
        row = int(back[0]) + 1
        raise DataError(
            f"the time in {table.path}, column {name}, does not increase at line {table.first_line + row}: "
            f"{time_s[row]:g} s after {time_s[row - 1]:g} s",
            hint="sort the rows, drop repeated ones, or give --rate instead of a time column",
        )
    return time_s
