"""How a verb says how far it is: a callable that takes the share of the work done, 0..1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]


def silent(_share: float) -> None:
    """Tell nobody."""
