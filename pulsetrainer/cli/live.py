"""The terminal of a session: draws it and reads the keys; in a pipe it does neither."""

from __future__ import annotations

import contextlib
import os
import select
import string
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.cli.console import drawing, shows_unicode
from pulsetrainer.report.characters import BARS, PLAIN_BARS, plotted
from pulsetrainer.steps.steering import keys_in

if TYPE_CHECKING:
    from rich.console import RenderableType

    from pulsetrainer.steps.performance import Now
    from pulsetrainer.steps.progress import Progress

SMALLEST = (50, 10)  # columns and lines
_ROWS = 5  # of the trace
_SHOWN_S = 3.0
_DRAWN_EACH_S = 0.08
Press = Callable[[str, float], None]
Status = Callable[[float], str]
LETTERS = string.ascii_lowercase  # the keys that answer, in the order of the choices


class Live:
    """Shows a session and takes keys, called with each piece of telemetry.

    ``press`` gets every key, with the time of the session in s; ``status`` says a line at such a time.
    ``blind``, in a quiz: the choices are shown, and nothing of the pulse.
    """

    def __init__(self, press: Press, status: Status, names: Sequence[str], *, blind: bool) -> None:
        self._press, self._status, self._names, self._blind = press, status, tuple(names), blind
        self._traces: deque[np.ndarray] = deque()
        self._show: Callable[[RenderableType], None] = lambda _text: None
        self._drawn_s, self._share = -1.0, 0.0

    def __call__(self, now: Now) -> None:
        """Take the keys that were pressed, and draw."""
        while select.select([sys.stdin], [], [], 0.0)[0]:
            key = os.read(sys.stdin.fileno(), 1).decode("ascii", "replace")
            if not key:
                break
            self._press(key, now.time_s)
        self._traces.append(now.force)
        while sum(force.size for force in self._traces) > _SHOWN_S * 1000:
            self._traces.popleft()
        if now.time_s - self._drawn_s >= _DRAWN_EACH_S:
            self._drawn_s = now.time_s
            self._show(self._text(now))

    def _text(self, now: Now) -> RenderableType:
        from rich.text import Text

        if self._blind:
            choices = "  ".join(f"{letter} {name}" for letter, name in zip(LETTERS, self._names))  # noqa: B905
            return Text(f"{self._status(now.time_s)}\n{choices}  Q stop")
        width = max(os.get_terminal_size(sys.stderr.fileno()).columns - 2, 20)
        force = np.concatenate(self._traces)
        lines = plotted(force, width, _ROWS, BARS if shows_unicode() else PLAIN_BARS)
        beat = now.beat
        said = (
            f"{100 * self._share:3.0f} %  {now.time_s:7.1f} s  {force[-1]:5.2f} N  {now.current[-1]:5.3f} A"
        )
        if beat is None:
            said += "  first stroke: no finger yet" if now.leading else "  at rest"
        else:
            rate, height = 60.0 / beat.interval_s, 100 * beat.play.amplitude
            said += f"  {self._names[beat.play.pulse]}  {rate:.0f}/min  {height:.0f} %"
        lines += [said, self._status(now.time_s), keys_in(width)]
        return Text("\n".join(lines), no_wrap=True, overflow="crop")

    def _progress(self, share: float) -> None:
        self._share = share

    @contextlib.contextmanager
    def on_screen(self, _label: str) -> Iterator[Progress]:
        """Take the terminal: keys come at once and unseen, and are given back in the end.

        Gives a callable that takes the share of the work done: a bar beside this would draw into it.
        """
        import termios
        import tty

        before = termios.tcgetattr(sys.stdin)
        try:
            tty.setcbreak(sys.stdin)
            with drawing() as self._show:
                yield self._progress
        finally:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def why_not() -> str:
    """Return why there is no screen; empty if there can be one."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return "there is no terminal"
    try:
        import termios  # noqa: F401
    except ImportError:
        return "this system has no terminal of the kind that is needed"
    columns, rows = os.get_terminal_size(sys.stderr.fileno())
    if columns < SMALLEST[0] or rows < SMALLEST[1]:
        least = " x ".join(map(str, SMALLEST))
        return f"the terminal of {columns} x {rows} is too small for the live view: it needs {least}"
    return ""
