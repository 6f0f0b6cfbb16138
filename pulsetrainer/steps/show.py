"""Names that moved: to ``report.facts`` and ``artefacts.units``."""

from __future__ import annotations

from pulsetrainer.report.facts import run_facts

__all__ = ["run_facts", "shown"]


def shown(unit: str) -> str:
    """Return a unit as a person reads it: nothing for a pure number."""
    return "" if unit == "1" else unit
