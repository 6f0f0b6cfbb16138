"""What a flow needs from outside itself: the command line, the clock, and somewhere to report progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime

Progress = Callable[[float], None]  # share of the work done, 0..1


def _silent(_share: float) -> None:
    """Report nothing."""


@dataclass(frozen=True, slots=True)
class Context:
    """Handed to every flow; library code reads no clock and no ``sys.argv``."""

    argv: Sequence[str]
    now: Callable[[], datetime]
    progress: Progress = _silent
    note: Callable[[str], None] = field(default=lambda _text: None)  # one line for the person at the screen
