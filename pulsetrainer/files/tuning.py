"""What `tune` found, kept in the file of settings: a table ``[tuned."SERIAL"]`` for each device.

The rest of the file, comments too, stays as its owner wrote it.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pulsetrainer.errors import ExistsError, UsageError
from pulsetrainer.files.atomic_write import check_output, replacing
from pulsetrainer.files.settings import read_toml

TABLE = "tuned"
Found = Mapping[str, float]


def read_tuned(path: Path | str) -> dict[str, dict[str, Any]]:
    """Return what was found for each device, by its serial number.

    UsageError where the file cannot be read, or what is there is no table of numbers.
    """
    tree = read_toml(path)
    table = tree.get(TABLE, {})
    if not isinstance(table, dict):
        raise _not_by_tune(path, TABLE, table, "tables, one a device")
    for serial, entry in table.items():
        if not isinstance(entry, dict):
            raise _not_by_tune(path, f"{TABLE}.{serial}", entry, "a table")
        for name, value in entry.items():
            if type(value) not in (int, float):
                raise _not_by_tune(path, f"{TABLE}.{serial}.{name}", value, "a number")
    return table


def _not_by_tune(path: Path | str, name: str, value: object, expected: str) -> UsageError:
    return UsageError(
        f"{path}: {name} is {value!r}, expected {expected}",
        hint=f"delete the tables [{TABLE}...] in it and measure again: pulsetrainer tune -o {path}",
    )


def check_tuned(path: Path, serial: str, *, overwrite: bool) -> None:
    """Raise UsageError where a file cannot take a device's entry, before the work that would be lost."""
    check_output(path, overwrite=True)
    if path.exists() and serial in read_tuned(path) and not overwrite:
        hint = "give `overwrite` to replace these gains: the rest of the file stays as it is"
        raise ExistsError(path, f"{path} already has the gains of the device {serial}", hint=hint)


def write_tuned(path: Path, serial: str, found: Found, *, overwrite: bool) -> None:
    """Write a device's entry into a file of settings, which is made where there is none.

    UsageError as ``check_tuned``, or where the entry stands there in a form that cannot be replaced;
    DataError where the disk is full or failed.
    """
    check_tuned(path, serial, overwrite=overwrite)
    before = path.read_text(encoding="utf-8") if path.exists() else ""
    header = f"[{TABLE}.{json.dumps(serial)}]"
    kept, inside = [], False
    for line in before.splitlines():
        if line.lstrip().startswith("["):
            inside = line.strip() == header
        if not inside:
            kept.append(line)
    while kept and not kept[-1].strip():
        kept.pop()
    entry = [header, *(f"{name} = {value!r}" for name, value in found.items())]
    text = "\n".join([*kept, *([""] if kept else []), *entry, ""])
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UsageError(
            f"the entry of {serial} cannot be replaced in {path}: {error}",
            hint=f"delete what is there under {TABLE}, then tune again",
        ) from error
    with replacing(path, overwrite=True) as temporary:
        temporary.write_text(text, encoding="utf-8")
