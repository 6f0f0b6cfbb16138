"""What can be said about an input before it is read: absent, a folder, empty, not HDF5.

Nothing heavy is loaded here, so that a mistyped name is answered at once.
"""

from __future__ import annotations

import difflib
import glob
import os
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from pathlib import Path

from pulsetrainer.errors import (
    AbsentError,
    DamagedFileError,
    DataError,
    NotAnArtefactError,
    UsageError,
    in_words,
)
from pulsetrainer.files.checksum import is_as_written

HDF5 = b"\x89HDF\r\n\x1a\n"
_END = {0: 40, 1: 44, 2: 28, 3: 28}  # byte at which an HDF5 file says its length, by its version
TABLES = (".csv", ".tsv", ".txt", ".dat")
_TAKE_TABLES = ("import", "capture", "invert")  # commands
JOURNAL = b"pulsetrainer journal 1\n"  # what a recording under way begins with
_FIRST_TEXT = re.compile(rb"GCOL.{28}([a-z]+)", re.DOTALL)  # our first text attribute is the kind


def check_file(path: Path | str) -> None:
    """Raise DataError for an input that is absent, a folder, no ordinary file, or not permitted."""
    _first_bytes(Path(path))


def check_table(path: Path, expected: str, instead: str) -> None:
    """Raise as ``check_file``, and DataError for an artefact where a name or a table is ``expected``."""
    check_file(path)
    if kind := likely_kind(path):
        play = f"to play a drive: `pulsetrainer play {shlex.quote(str(path))} -o played.h5`"
        raise DataError(
            f"{path}: expected {expected} or a CSV table, got a {in_words([kind])}",
            hint=play if kind == "waveform" else instead,
        )


def check_artefact(path: Path | str) -> None:
    """Raise DataError for an input that cannot be an artefact, by its first bytes.

    As ``check_file``; or it is empty, and neither an HDF5 file nor a recording that was cut off.
    """
    start = _first_bytes(Path(path))
    if not start:
        raise DamagedFileError(f"{path} is empty", path=path)
    if start.lstrip().lower().startswith((b"<!doc", b"<html")):
        raise DataError(
            f"{path} is a web page, expected a .h5 file of pulsetrainer",
            hint="open it in a browser, or give the .h5 that it was made from",
        )
    if not start.startswith((HDF5, JOURNAL)):
        raise NotAnArtefactError(f"{path} is not an HDF5 file", path=path)


def is_journal(path: Path | str) -> bool:
    """Whether a file is a recording under way, or one that was cut off; raises as ``check_file``."""
    return _first_bytes(Path(path)) == JOURNAL


def _first_bytes(path: Path) -> bytes:
    """Return as many bytes as tell what a file is."""
    try:
        if path.is_dir():
            raise DataError(f"{path} is a folder, expected a file", hint=_files_in(path))
        if Path(os.path.realpath(path)).is_symlink():  # where all links lead is none, but for a circle
            raise DataError(
                f"{path} is a link that leads back to itself",
                hint="remove the link, and name the file itself",
            )
        if not path.exists() and path.name == "-":
            raise DataError(
                "standard input (-) cannot be read", hint="write it to a file first, and name that"
            )
        if not path.exists() and any(path.parent.glob(path.name)):
            raise DataError(
                f"{path} does not exist: it is a pattern in quotes",
                hint="leave the quotes out, so that the shell fills in the names",
            )
        if not path.exists():
            raise AbsentError(path, hint=_names_in(path.parent, path))
        if not path.is_file():
            raise DataError(f"{path} is not an ordinary file", hint="name a file on disk")
        with path.open("rb") as stream:
            return stream.read(len(JOURNAL))
    except OSError as error:
        raise unreadable(path, error) from error


def unreadable(path: Path | str, error: OSError) -> DataError:
    """Return the error for a file that cannot be read, with the system's reason in it."""
    if isinstance(error, PermissionError):
        return DataError(f"you have no permission to read {path}", hint=permit(path))
    return DataError(
        f"{path} cannot be read: {error.strerror or error}", hint="check the name and its permissions"
    )


def permit(path: Path | str) -> str:
    """Return a hint for a file that may not be read; where its folder is locked, for that."""
    folder = Path(path).parent
    locked = path if os.access(folder, os.X_OK) else folder
    return f"ask its owner for a copy, or if that is you: chmod u+rX {shlex.quote(str(locked))}"


def _files_in(folder: Path) -> str:
    """Return a hint with the first few files of a folder that was given in place of a file."""
    files = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    offered = ", ".join(map(str, _offered(files)))
    return (
        f"name a file in it: {offered}"
        if offered
        else f"give the path of a file; {folder} holds none that can be read"
    )


def _offered(files: Iterable[Path]) -> list[Path]:
    """Return the first five files that can be read."""
    return list(islice(filter(is_sound, files), 5))


def _names_in(folder: Path, path: Path) -> str:
    """Return a hint with the names in a folder that come nearest."""
    if not folder.is_dir():
        address = re.match(r"(https?|ftp):/", str(path))
        return (
            "it is an address: download the file, and give its path here"
            if address
            else f"check the path: the folder {folder} does not exist either"
        )
    names = sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith("."))
    near = difflib.get_close_matches(path.name, names, n=10, cutoff=0.5)
    near += [name for name in names if name.startswith(f"{path.name}.partial") and name not in near]
    near = near or [name for name in names if path.suffix and name.endswith(path.suffix)]
    offered = ", ".join(file.name for file in _offered(folder / name for name in near))
    where = "here" if folder == Path() else f"in {folder}"
    return (
        f"files {where}: {offered}"
        if offered
        else f"check the name, or give the full path: no file {where} has a similar name"
    )


def near_names(path: Path, kinds: Sequence[str]) -> list[str]:
    """Return the artefacts of these kinds in the folder of ``path``, those with the nearest names first.

    No kinds: every artefact. The kind is read off the first bytes, without HDF5; those that are damaged, or
    cannot be read, are left out.
    """
    try:
        names = [
            entry.name
            for entry in sorted(path.parent.iterdir())
            if entry.is_file() and (kind := likely_kind(entry)) and (not kinds or kind in kinds)
        ]
    except OSError:
        return []
    near = difflib.get_close_matches(path.name, names, n=5, cutoff=0.5)
    near += [name for name in names if name not in near]
    return [file.name for file in _offered(map(path.with_name, near))]


def is_sound(path: Path) -> bool:
    """Whether a file may be offered to be read: it can be, holds something, and if it is ours, all of it."""
    try:
        with path.open("rb") as stream:
            start = stream.read(64)
        if not start.startswith(HDF5):
            return bool(start) and (path.suffix != ".h5" or start.startswith(JOURNAL))
        end = _END.get(start[8], 0)
        whole = path.stat().st_size >= int.from_bytes(start[end : end + 8], "little")
        return whole and is_as_written(path)
    except (OSError, IndexError):
        return False


def cut_off(path: Path) -> str:
    """Name what a recording left that was cut off before it had this name; empty where there is none."""
    if path.suffix == ".partial" and path.with_suffix("").is_file():
        return f"it was not cut off: {shlex.quote(str(path.with_suffix('')))} is whole"
    left = path.with_name(f"{path.name}.partial")
    return f"it was cut off: {shlex.quote(str(left))} holds what there is" if left.is_file() else ""


def likely_kind(path: Path) -> str:
    """Return the kind of an artefact by its first bytes; empty where they tell of none."""
    try:
        with path.open("rb") as stream:
            start = stream.read(512)
    except OSError:
        return ""
    if start.startswith(JOURNAL):
        return "run"
    found = _FIRST_TEXT.search(start) if start.startswith(HDF5) else None
    return found[1].decode() if found else ""


def in_quotes(words: Sequence[str], command: str) -> str:
    """Say how the file is given whose name has spaces in it and was typed without quotes; else empty."""
    runs = (" ".join(words[i:j]) for i in range(len(words)) for j in range(i + 2, len(words) + 1))
    meant = next((Path(run) for run in runs if Path(run).is_file()), None)
    if meant is None:
        return ""
    first = meant.suffix.lower() in TABLES and command not in _TAKE_TABLES
    return "put a name with spaces in quotes" + (
        f", and {to_import(meant)}" if first else f": {shlex.quote(str(meant))}"
    )


def to_import(table: Path) -> str:
    """Say what is done with a table where an artefact is expected."""
    line = f"pulsetrainer import {shlex.quote(str(table))} --input COLUMN --output COLUMN -o run.h5"
    return f"import the table first: {line}"


def apart(path: Path, option: str, *, several: bool) -> str:
    """Say how files are given that were written as one, with commas between them; empty where none were.

    Each behind an ``option`` of its own, if there is one; ``several``: more than one is taken.
    """
    files = list(dict.fromkeys(map(Path, str(path).split(","))))
    if "," not in str(path) or not all(file.is_file() for file in files):
        return ""
    how = "name them one by one" if len(files) > 1 else "name each file once"
    each = " ".join(f"{option} {shlex.quote(str(file))}".strip() for file in files)
    return f"{how}: {each}" if several else "name one file"


def columns_of(table: Path) -> tuple[str, ...]:
    """Return the columns of a table that is to be imported; DataError where there is none to be read."""
    check_file(table)
    from pulsetrainer.files.array_files import reader_of  # noqa: PLC0415 - slow to import
    from pulsetrainer.files.csv_dialect import detect  # noqa: PLC0415

    reads = reader_of(table)
    return tuple(reads(table).values) if reads else detect(table).names


def name_columns(table: Path, options: Mapping[int, str], missing: str) -> tuple[str, str]:
    """Return what to say where options that name columns are ``missing``, and what to type.

    ``options``: 0 is that of the input, 1 that of the output. That a table cannot be read weighs more.
    """
    try:
        columns = columns_of(table)
        one = "name one for each" if len(options) > 1 else "name its column"
        said, like = f"{missing}; {table} has {', '.join(columns)}", f"{one}, "
    except DataError as error:
        columns = ("1", "2", "3")
        said, like = f"{error.message}; and {missing}", f"{error.hint}; and name the columns, "
    usual = columns[1:3] if len(columns) > 2 else columns
    named = " ".join(f"{options[k]} {shlex.quote(one)}" for k, one in enumerate(usual) if k in options)
    return said, f"{like}such as {named}" if named else "give a table with a column for each quantity"


def check_resumable(path: Path) -> None:
    """Raise UsageError where of a recording into ``path`` nothing is there, nor beside it, to be resumed."""
    if (kind := likely_kind(path)) not in ("run", ""):
        raise UsageError(
            f"there is nothing to resume: {path} is a {kind}, not an interrupted recording",
            hint="name the recording that broke off, or leave --resume out and name another output",
        )
    if not path.exists() and not any(path.parent.glob(f"{glob.escape(path.name)}.partial*")):
        raise UsageError(
            f"there is nothing to resume: neither {path} nor {path.name}.partial exists",
            hint="leave --resume out to record from the beginning",
        )


_NAME = "{name}"  # in an output: one for each file


def outputs_of(files: list[Path], out: Path) -> dict[Path, tuple[Path, ...]]:
    """Return the files that are read into each output: all into one, or each into its own.

    UsageError where two files would be written to one output, or braces hold another word.
    """
    unknown = next((word for word in re.findall(r"{\w*}", str(out)) if word != _NAME), "")
    if unknown:
        raise UsageError(
            f"the output {out} has {unknown} in its name, expected {_NAME} or no braces",
            hint=f"write {str(out).replace(unknown, _NAME)} for one run for each file",
        )
    if _NAME not in str(out):
        return {out: tuple(files)}
    groups: dict[Path, tuple[Path, ...]] = {}
    for path in files:
        target = Path(str(out).replace(_NAME, path.stem))
        if target in groups:
            raise UsageError(
                f"{groups[target][0]} and {path} would both be written to {target}",
                hint="import them one by one, under other names",
            )
        groups[target] = (path,)
    return groups
