"""Steering: which key changes what while a session goes on; it takes effect at the next beat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from pulsetrainer.core.heartbeat import FASTEST_BPM, SLOWEST_BPM
from pulsetrainer.steps.conductor import Decide, Decision, Play, Rest
from pulsetrainer.steps.quiz import Blind

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

    Faster and slower begin at the rate of the pulse, ``own_bpm``. In a pause the programme stands still.
    """

    programme: Decide
    own_bpm: Sequence[float]
    paused: bool = False
    stopped: bool = False
    rate: float | None = None
    amplitude: float | None = None
    pulse: int | None = None
    _played: Play = field(default_factory=lambda: Play(0))
    _pauses: list[tuple[float, float]] = field(default_factory=list)  # from and to, s; inf: it goes on

    def __call__(self, number: int, time_s: float) -> Decision:
        """Return what is played next."""
        if self.stopped:
            return None
        begun_s = self._pauses[-1][0] if self._pauses and math.isinf(self._pauses[-1][1]) else None
        if self.paused:
            if begun_s is None:
                self._pauses.append((time_s, math.inf))
            return Rest()
        if begun_s is not None:
            self._pauses[-1] = (begun_s, time_s)
        decided = self.programme(number, self.without_pauses(time_s))
        if isinstance(decided, Play):
            decided = self._played = decided.changed(self.pulse, self.amplitude, self.rate)
        return decided

    @property
    def stopped_by_key(self) -> str:
        """Where a key stopped it, and in which question of a quiz; empty: none did, or all was answered."""
        quiz = self.programme
        if not self.stopped:
            return ""
        if not isinstance(quiz, Blind):
            return "stopped by key before its end"
        left = quiz.question < quiz.questions
        return f"stopped by key in question {quiz.question + 1} of {quiz.questions}" * left

    def without_pauses(self, time_s: float) -> float:
        """Return how much of a time, s, was no pause."""
        return time_s - sum(min(max(time_s - begun, 0.0), ended - begun) for begun, ended in self._pauses)

    def press(self, key: str) -> str:
        """Take in a key; return why nothing changes by it, empty where something does."""
        said = ""
        if key in ("+", "=", "-"):
            at = self._played.bpm or self.own_bpm[self._played.pulse]
            step = -RATE_STEP_BPM if key == "-" else RATE_STEP_BPM
            self.rate = _stepped(at, step, SLOWEST_BPM, FASTEST_BPM)
            said = f"already {at:.0f}/min" * (self.rate == at)
        elif key in ("<", ">", ",", "."):
            at = self._played.amplitude
            self.amplitude = _stepped(
                at, AMPLITUDE_STEP if key in (">", ".") else -AMPLITUDE_STEP, _LEAST, 1.0
            )
            said = f"already {100 * at:.0f} %" * (self.amplitude == at)
        elif key == "p":
            self.pulse = (self._played.pulse + 1) % len(self.own_bpm)
            said = "there is no other pulse" * (len(self.own_bpm) == 1)
        elif key == " ":
            self.paused = not self.paused
        elif key == "q":
            self.stopped = True
        else:
            said = f"{key!r} is not one of the keys"
        self._played = self._played.changed(self.pulse, self.amplitude, self.rate)
        return said


def _stepped(at: float, step: float, least: float, most: float) -> float:
    """Return a value a step further, up to an end; one beyond that end stays."""
    further = round(at + step, 6)  # steps of 0.1 do not add up to 1
    return max(at, min(further, most)) if step > 0 else min(at, max(further, least))
