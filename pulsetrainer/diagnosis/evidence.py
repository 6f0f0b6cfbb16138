"""Evidence as data: what was seen, for which cause, with which figures. ``wording`` puts it into words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from inspect import cleandoc


@dataclass(frozen=True, slots=True)
class Evidence:
    """One thing that was seen.

    ``kind`` names the sentence that says it: one of ``wording.TEXTS``, or one of the cause's own ``texts``.
    """

    kind: str
    cause: str = ""
    figures: Mapping[str, float] = field(default_factory=dict)
    names: tuple[str, ...] = ()  # of causes, or of what the records lack
    record: int | None = None  # number of the record, where there are several


def sentences(table: str) -> dict[str, str]:
    """Return sentences by their kind; each begins with ``kind: ``, and its further lines are set in."""
    found, kind = dict[str, str](), ""
    for line in cleandoc(table).splitlines():
        if line.startswith(" "):
            found[kind] += f" {line.strip()}"
        else:
            kind, said = line.split(": ", 1)
            found[kind] = said
    return found
