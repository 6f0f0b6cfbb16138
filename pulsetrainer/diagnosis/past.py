"""What the causes of a chain remember from one piece of a signal to the next."""

from __future__ import annotations

from dataclasses import dataclass, field

from pulsetrainer.core.plane import FloatArray


@dataclass
class Past:
    """States by name: of the piece before, and as they are after this one.

    A chain that feeds its output back passes a piece several times: each time from ``before``, and the last
    time counts.
    """

    before: dict[str, FloatArray] = field(default_factory=dict)
    after: dict[str, FloatArray] = field(default_factory=dict)

    def next(self) -> Past:
        """Return what the piece that follows begins with."""
        return Past(before={**self.before, **self.after})
