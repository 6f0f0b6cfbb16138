"""Keys of a session: joins the screen (``cli.live``) to what the keys change, or answer in a quiz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pulsetrainer.cli.console import Screen, say
from pulsetrainer.cli.live import LETTERS, Live, why_not
from pulsetrainer.core.heartbeat import Pulse
from pulsetrainer.core.pulses import Shape
from pulsetrainer.errors import UsageError
from pulsetrainer.steps.conductor import Decide
from pulsetrainer.steps.programme import Programme
from pulsetrainer.steps.quiz import Blind
from pulsetrainer.steps.steering import Steering

_SAID_S = 3.0  # so long the screen shows what a key did: until after the beats that were on their way


@dataclass(frozen=True, slots=True)
class Steered:
    """A session with its screen and keys, or without."""

    decide: Decide
    share: Callable[[float], float] = lambda _s: 0.0  # of the work that is done, at a time in s
    live: Live | None = None
    by_key: bool = False  # a person presses them, and what comes next depends on it


class Keys:
    """What a person presses; ``names`` are those of the pulses."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self._answers: list[tuple[str, float]] = []  # not yet taken

    def answer(self, _question: int) -> tuple[str, float] | None:
        """Return the answer to the question that is open, and when it came; None while there is none."""
        return self._answers.pop(0) if self._answers else None

    def steer(
        self, screen: Screen, chosen: Programme | Blind, shapes: Sequence[Shape], *, by_key: bool
    ) -> Steered:
        """Put screen and keys around who decides, where there is a terminal.

        UsageError where a quiz is to be answered by key, and there is none; ``by_key``: that is asked.
        """
        dark = "a result in JSON has no live view" if screen.as_json else why_not()
        if isinstance(chosen, Blind) and by_key and dark:
            first = "leave --json out" if screen.as_json else "run it on a terminal"
            if "small" in dark:
                first = "make the window larger"
            raise UsageError(
                f"a quiz is answered on the keyboard, but {dark}",
                hint=f"{first}, or give the answers in a file: --answers answers.txt",
            )
        if "small" in dark:
            say("note: ", f"{dark}; there are no keys")
        if dark:
            return Steered(chosen, chosen.share_at)
        if isinstance(chosen, Blind):
            return self._asked(chosen, by_key=by_key)
        steering = Steering(chosen, [Pulse(shape).own_bpm for shape in shapes])
        said, until_s = "", 0.0

        def press(key: str, at_s: float) -> None:
            nonlocal said, until_s
            said, until_s = steering.press(key) or self._asked_for(steering, key), at_s + _SAID_S

        def status(at_s: float) -> str:
            return "; ".join(["paused"] * steering.paused + [said] * (said != "" and at_s < until_s))

        live = Live(press, status, self.names, blind=False)
        return Steered(
            steering, lambda time_s: chosen.share_at(steering.without_pauses(time_s)), live, by_key=True
        )

    def _asked_for(self, steering: Steering, key: str) -> str:
        """Return what the keys asked for: the screen shows it before it is pressed."""
        pulse = "" if steering.pulse is None else self.names[steering.pulse]
        rate = "" if steering.rate is None else f"{steering.rate:.0f}/min"
        height = "" if steering.amplitude is None else f"{100 * steering.amplitude:.0f} %"
        return "" if key in " q" else "next: " + "  ".join(filter(None, (pulse, rate, height)))

    def _asked(self, quiz: Blind, *, by_key: bool) -> Steered:
        """Return a quiz on the screen: a letter answers, Q stops."""
        steering = Steering(quiz, [])
        choices = LETTERS[: len(self.names)]
        wrong = ""

        def press(key: str, at_s: float) -> None:
            nonlocal wrong
            wrong = "" if key in choices or key == "Q" else key
            if key in choices:
                self._answers[:] = [(self.names[choices.index(key)], at_s)]
            elif key == "Q":
                steering.press("q")

        def status(_at_s: float) -> str:
            asked = f"question {min(quiz.question + 1, quiz.questions)} of {quiz.questions}"
            waits = ": its beats are over; waiting for your answer" * quiz.waits
            not_so = f"; {wrong!r} does not count: {choices[0]} to {choices[-1]} answer, Q stops"
            return asked + (", answered" if self._answers else waits) + (not_so if wrong else "")

        live = Live(press, status, self.names, blind=True)
        return Steered(steering, quiz.share_at, live, by_key=by_key)
