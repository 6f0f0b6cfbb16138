"""Pulses: the library that ships with the package, and anybody's table of a time and a value."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import TYPE_CHECKING

from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files.input_file import check_table
from pulsetrainer.resources import waveforms_dir

if TYPE_CHECKING:
    from pulsetrainer.core.pulses import Shape


def library() -> dict[str, Path]:
    """Names and files of the pulse library."""
    return {path.stem: path for path in sorted(waveforms_dir().glob("*.csv"))}


def pulse_file(name: str) -> Path:
    """Return the file of a pulse: of the library, or the one that is named.

    UsageError where it is neither in the library nor a file; DataError where it is a CSV file that cannot be
    read.
    """
    known = library()
    path = known.get(name, Path(name))
    if name not in known and path.suffix.lower() != ".csv" and not (name.strip() and path.exists()):
        near = difflib.get_close_matches(name.lower(), known, n=3, cutoff=0.6)
        hint = f"did you mean {' or '.join(near)}? Or " if near else "name one of them, or "
        hint += "give any CSV file with a time and a value column, such as my-pulse.csv"
        several = re.split(r"[,;|\s]+", name)
        if len(several) > 1 and set(several) <= set(known):
            hint = f"put commas between the names: {','.join(several)}"
            if "," in name:  # a session parts them there
                hint = "one pulse at a time: run it once for each, with an output of its own"
        raise UsageError(f"there is no pulse {name!r}; the library has {', '.join(known)}", hint=hint)
    check_table(path, "the name of a pulse", "write the name of a pulse in its place, such as normal")
    return path


def read_pulse(name: str) -> Shape:
    """Return a pulse of the library, or out of a table whose first two columns are time and value.

    Raises as ``pulse_file``, and DataError where the table cannot be used.
    """
    from pulsetrainer.core.pulses import FEWEST_SAMPLES, Shape  # noqa: PLC0415 - so that a mistyped name is answered at once
    from pulsetrainer.files.signal_table import first_two  # noqa: PLC0415

    path = pulse_file(name)
    columns, time_s, value = first_two(path, "a pulse needs a time and a value", names="t_s,p")
    if columns.rows < FEWEST_SAMPLES:
        raise DataError(
            f"{path} has {columns.rows} row{'s' * (columns.rows != 1)}, expected {FEWEST_SAMPLES} or more: "
            "one period of a pulse",
            hint="give a whole period, with samples close enough to draw it",
        )
    said = {c.partition(":")[0]: c.partition(":")[2].strip() for c in columns.comments}
    try:
        feet_s = tuple(float(foot) for foot in said.get("beats", "0").split())
    except ValueError as error:
        raise DataError(
            f"{path}: the comment `beats:` is {said['beats']!r}, expected the times at which beats begin, s",
            hint="write `# beats: 0 0.8` for two beats, or leave it out for one",
        ) from error
    note = ""
    if len(columns.names) > 2:
        note = (
            f"of the {len(columns.names)} columns of {path} the second is played, {columns.names[1]}; to "
            "play another one, write it into a table of its own, time and value"
        )
    source, unit = said.get("source") or path.name, columns.unit(columns.names[1])
    return Shape(path.stem, time_s, value, source, feet_s, unit, note)
