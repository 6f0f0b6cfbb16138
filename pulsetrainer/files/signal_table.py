"""A signal of one's own: a table of time and current, to be played on the device."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files.input_file import check_table

if TYPE_CHECKING:
    from pulsetrainer.artefacts import FloatArray
    from pulsetrainer.core.excitations import Signal
    from pulsetrainer.files.table import Table

_NOTHING_A = 5e-5  # of rounding: half of what a device tells apart


def signal_file(signal: str, known: Sequence[str]) -> Path | None:
    """Return the file that a signal is read from; None where it is one of the ``known`` excitations.

    UsageError where the signal is neither an excitation nor a file; DataError where it is a CSV file that
    cannot be read.
    """
    if signal in known:
        return None
    path = Path(signal)
    if path.suffix.lower() != ".csv" and not (signal.strip() and path.exists()):
        raise UsageError(
            f"there is no signal {signal!r}; known signals: {', '.join(known)}, or a CSV file",
            hint="pulsetrainer capture identification -o run.h5",
        )
    check_table(path, ", ".join(known), "write the name of a signal in its place, such as identification")
    return path


def read_signal(path: Path, rate_Hz: float) -> Signal:
    """Return a signal out of a table whose first two columns are time and current, at even steps.

    DataError where the table cannot be used.
    """
    # so that a mistyped name is answered at once
    import numpy as np  # noqa: PLC0415

    from pulsetrainer.core import excitations  # noqa: PLC0415
    from pulsetrainer.files.csv_headings import column_words  # noqa: PLC0415
    from pulsetrainer.files.time_column import unit_of_time  # noqa: PLC0415

    table, time, current = first_two(path, "a reference needs a time and a current", names="t_s,current_A")
    unit = table.unit(table.names[1])
    if unit not in ("", "A"):
        raise DataError(
            f"{path}: the column {table.names[1]} is in {unit}, expected the current to be played in A",
            hint="give the current in A in the second column, such as current_A",
        )
    if table.rows < 2:
        raise DataError(
            f"{path} has {table.rows} row, a signal needs two or more", hint="write a row for each time"
        )
    below = np.flatnonzero(current < -_NOTHING_A)
    if below.size:
        at = f"{column_words(table.names[1])}, {table.place(int(below[0]))}"
        raise DataError(
            f"{path} has a current of {current[below[0]]:g} A in {at}; a device plays 0 A and more",
            hint="shift or scale the signal, so that it begins at 0 A",
        )
    seconds = float(time[-1]) - float(time[0])
    lasts = seconds * rate_Hz
    if not lasts <= excitations.MOST_SAMPLES:
        raise DataError(
            f"{path} lasts {seconds:g} s, {lasts:.3g} samples at {rate_Hz:g} Hz; "
            f"{excitations.MOST_SAMPLES} are the most",
            hint="give its time in s, a lower `rate_Hz`, or a shorter signal with `repeats`",
        )
    count = int(np.floor(lasts + 1e-9)) + 1
    value = np.interp(time[0] + np.arange(count) / rate_Hz, time, current)
    note = ""
    if not unit_of_time(table, table.names[0]):
        note = (
            f"the time of {path}, {column_words(table.names[0])}, has no unit: taken as s, so it lasts "
            f"{seconds:g} s (if it is in ms, write the heading as 't_ms')"
        )
    return excitations.Signal(value, rate_Hz, path.name, note)


def first_two(path: Path, what: str, *, names: str) -> tuple[Table, FloatArray, FloatArray]:
    """Return a table, its first column as seconds (n,), and its second one (n,); raises as ``read_table``."""
    from pulsetrainer.files.table import read_table  # noqa: PLC0415
    from pulsetrainer.files.time_column import seconds  # noqa: PLC0415

    if not path.stat().st_size:
        raise DataError(f"{path} is empty", hint=f"write two columns: {names}")
    table = read_table(path, lambda head: range(min(2, len(head.names))), remedy="")
    if len(table.names) < 2:
        raise DataError(f"{path} has {len(table.names)} column; {what}", hint=f"write two columns: {names}")
    return table, seconds(table, table.names[0]), table.check_finite(table.names[1])
