"""How a number is written with its unit."""

from __future__ import annotations


def with_unit(number: str, unit: str) -> str:
    """Return ``1.5 A``; a pure number, whose unit is 1, stays alone."""
    return number if unit in ("", "1") else f"{number} {unit}"
