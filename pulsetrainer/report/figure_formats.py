"""The file formats of figures; loads nothing, so that a wrong ending is answered at once."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from pulsetrainer.errors import UsageError

FORMATS: Final = ("png", "svg", "pdf")


def figure_format(path: Path, what: str, *more: str) -> str:
    """Return the format that the name of a figure asks for; ``more`` are those that are no figures.

    UsageError where it is none of them.
    """
    form = path.suffix.lower().lstrip(".")
    if form not in (*FORMATS, *more):
        known = [*FORMATS, *more]
        raise UsageError(
            f"{what} is written as {', '.join(known[:-1])} or {known[-1]}, but {path} "
            + (f"ends in {path.suffix.lower()!r}" if form else "has no such ending"),
            hint=f"name it {path.parent / (path.stem.lstrip('-') or 'figure')}.png",
        )
    return form
