"""The name of a file that is written: it must not promise another format than the file has."""

from __future__ import annotations

import itertools
from pathlib import Path

from pulsetrainer.errors import EndingError

FORMATS = {
    *(".h5", ".csv", ".tsv", ".txt", ".dat", ".xls", ".xlsx", ".json", ".toml", ".yaml", ".yml"),
    *(".npz", ".mat", ".wav", ".png", ".svg", ".pdf", ".html", ".htm"),
}


def is_no_file(path: Path) -> bool:
    """Whether an output is a folder, a device, or may not be looked at: told when it is to be written."""
    try:
        return path.is_dir() or path.is_char_device()
    except OSError:
        return True


def free(path: Path, but: str = "") -> Path:
    """Return a path, or, where it is taken or called ``but``, a name like it that is neither."""
    others = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in itertools.count(2))
    names = itertools.chain((path,), others)
    return next(one for one in names if one.name != but and not one.exists())


def check_artefact_name(path: Path, what: str, *, then: str = "") -> None:
    """Raise EndingError where the ``path`` of an artefact ends like another format, or is an ending alone.

    ``-`` is no name either: an artefact is not written to standard output.
    """
    if is_no_file(path):
        return
    if path.name.lower() in FORMATS | {"-"} or path.suffix.lower() in FORMATS - {".h5"}:
        raise EndingError(path, what, ".h5", then=then)
