"""Steering: which key changes what while a session goes on; it takes effect at the next beat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from pulsetrainer.core.heartbeat import FASTEST_BPM, SLOWEST_BPM
from pulsetrainer.steps.conductor import Decide, Decision, Play, Rest

RATE_STEP_BPM = 5.0
AMPLITUDE_STEP = 0.1
_LEAST = 0.1  # of the reach
KEYS = {
    "+": "faster", "-": "slower", ">": "stronger", "<": "weaker",
    "p": "next pulse", " ": "pause, go on", "q": "stop",
}  # fmt: skip


def keys_in(width: int) -> str:
    """Return what the keys do, on one line of a width: the words where there is room, and always the stop."""
    named = [f"{'space' if key == ' ' else key} {what}" for key, what in KEYS.items()]
    short = ["+ - rate", "< > height", "p pulse", "space pause", "q stop"]
    return next(
        (line for line in ("  ".join(named), "  ".join(short)) if len(line) <= width), " ".join(short)
    )


@dataclass
class Steering:
    """Decides as ``programme`` does, but for what was changed by key.

    Faster and slower begin at the rate of the pulse, ``own_bpm``.
    """

    programme: Decide
    own_bpm: Sequence[float]
    paused: bool = False
    stopped: bool = False
    rate: float | None = None
    amplitude: float | None = None
    pulse: int | None = None
    _played: Play = field(default_factory=lambda: Play(0))

    def __call__(self, number: int, time_s: float) -> Decision:
        """Return what is played next."""
        if self.stopped:
            return None
        if self.paused:
            return Rest()
        decided = self.programme(number, time_s)
        if isinstance(decided, Play):
            decided = self._played = self._changed(decided)
        return decided

    def _changed(self, play: Play) -> Play:
        return replace(
            play,
            pulse=play.pulse if self.pulse is None else self.pulse,
            amplitude=play.amplitude if self.amplitude is None else self.amplitude,
            bpm=play.bpm if self.rate is None else self.rate,
        )

    def press(self, key: str) -> None:
        """Take in a key; one that means nothing changes nothing."""
        if key in ("+", "=", "-"):
            rate = self._played.bpm or self.own_bpm[self._played.pulse]
            rate += -RATE_STEP_BPM if key == "-" else RATE_STEP_BPM
            self.rate = min(max(rate, SLOWEST_BPM), FASTEST_BPM)
        elif key in ("<", ">", ",", "."):
            step = AMPLITUDE_STEP if key in (">", ".") else -AMPLITUDE_STEP
            self.amplitude = min(max(self._played.amplitude + step, _LEAST), 1.0)
        elif key == "p":
            self.pulse = (self._played.pulse + 1) % len(self.own_bpm)
        elif key == " ":
            self.paused = not self.paused
        elif key == "q":
            self.stopped = True
        self._played = self._changed(self._played)
