"""The file formats of figures; loads nothing, so that a wrong ending is answered at once."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Final

from pulsetrainer.errors import EndingError

FORMATS: Final = ("png", "svg", "pdf")


def figure_format(path: Path, what: str, *more: str) -> str:
    """Return the format that the name of a figure asks for; ``more`` are those that are no figures.

    EndingError where it is none of them.
    """
    form = path.suffix.lower().lstrip(".")
    if form not in (*FORMATS, *more):
        with suppress(OSError):  # a folder, or one that is locked, is told when it is looked at
            if path.is_dir():
                return FORMATS[0]
        known = [*FORMATS, *more]
        written_as = f"{what} is written as {', '.join(known[:-1])} or {known[-1]}"
        raise EndingError(path, written_as, ".png", usual="figure")
    return form
