"""What can be wrong with a simulated device, by its port's text: parts that break, a bad wire."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass

from pulsetrainer.errors import UsageError
from pulsetrainer.link.noise import MAX_RATE

# In the order of the enum in firmware/plant/breaks.h; a test compares them with what the firmware lists.
BREAKS = (
    "current-rail", "current-zero", "current-frozen", "force-high", "force-rail",
    "force-zero", "force-frozen", "tick-overrun", "reset", "hang",
)  # fmt: skip
LONGEST_S = 1e5


@dataclass(frozen=True, slots=True)
class Wire:
    """Damage on the way between host and device: events per byte, drawn from a seed."""

    rate: float = 0.0
    seed: int = 1


GOOD_WIRE = Wire()


def wire_rate(kind: str, text: str) -> float:
    """Return the rate in ``wire=text`` of a ``kind:`` port; raises UsageError if it is none."""
    try:
        rate = float(text)
    except ValueError:
        rate = -1.0
    if not 0 <= rate <= MAX_RATE:
        raise UsageError(
            f"{kind} parameter wire={text} is not a rate of damaged bytes between 0 and {MAX_RATE}",
            hint=f'one byte in ten thousand: "{kind}:?wire=0.0001&wire-seed=3"',
        )
    return rate


def wire_seed(kind: str, text: str) -> int:
    """Return the seed in ``wire-seed=text`` of a ``kind:`` port; raises UsageError if it is none."""
    if not re.fullmatch(r"\d{1,9}", text):
        raise UsageError(
            f"{kind} parameter wire-seed={text} is not a whole number from 0 on",
            hint=f'"{kind}:?wire=0.0001&wire-seed=3"',
        )
    return int(text)


def parse_break(text: str) -> tuple[int, float]:
    """Return what breaks, as its place in ``BREAKS``, and at which second of the play.

    Raises
    ------
    UsageError
        if nothing of that name can break, or the time makes no sense.
    """
    what, at, seconds = text.partition("@")
    if what in BREAKS and re.fullmatch(r"\d+(\.\d*)?" if at else "", seconds):
        second = float(seconds or 0)
        if second < LONGEST_S:
            return BREAKS.index(what), second
    near = difflib.get_close_matches(what, BREAKS, n=1)
    raise UsageError(
        f"a simulated device cannot break {text!r}" + (f"; did you mean {near[0]}?" if near else ""),
        hint=f"break=WHAT@SECONDS with WHAT one of {', '.join(BREAKS)}",
    )
