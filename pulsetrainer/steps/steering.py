"""Steering: what a person changes while a session goes on; it takes effect at the next beat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from pulsetrainer.core.heartbeat import FASTEST_BPM, SLOWEST_BPM
from pulsetrainer.steps.conductor import Decide, Decision, Play, Rest

RATE_STEP_BPM = 5.0
AMPLITUDE_STEP = 0.1
_LEAST = 0.1  # of the reach
KEYS = {
    "+": "faster",
    "-": "slower",
    ">": "stronger",
    "<": "weaker",
    "p": "next pulse",
    " ": "pause, go on",
    "q": "stop",
}


@dataclass
class Steering:
    """Decides as ``programme`` does, but for what was changed by key.

    Parameters
    ----------
    programme
        Who decides otherwise.
    own_bpm
        The pulses' own rates, from which faster and slower begin.
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
            decided = replace(
                decided,
                pulse=decided.pulse if self.pulse is None else self.pulse,
                amplitude=decided.amplitude if self.amplitude is None else self.amplitude,
                bpm=decided.bpm if self.rate is None else self.rate,
            )
            self._played = decided
        return decided

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
        self._played = replace(
            self._played,
            pulse=self._played.pulse if self.pulse is None else self.pulse,
            amplitude=self._played.amplitude if self.amplitude is None else self.amplitude,
            bpm=self._played.bpm if self.rate is None else self.rate,
        )
