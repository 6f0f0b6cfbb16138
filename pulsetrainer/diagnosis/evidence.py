"""Evidence as data: what was seen, for which cause, with which figures. ``wording`` puts it into words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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
