"""The loop of force over current, drawn in the terminal while a device plays; elsewhere nothing is drawn."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.cli.console import drawing
from pulsetrainer.report.characters import Dots
from pulsetrainer.steps.progress import Progress

if TYPE_CHECKING:
    from rich.console import RenderableType

    from pulsetrainer.artefacts import FloatArray

FULL_SCALE_N = 15.0  # of the force sensor: the axis where no force is foretold
SMALLEST = (40, 12)  # columns and lines
_HIGHEST = 16  # lines of the loop
_DRAWN_EACH_S = 0.3  # of the wall clock: a drawing takes 3 ms, so a hundredth of the time


class LoopView:
    """Takes samples, and shows the loop that they make with one line of figures below it.

    Its axes go from 0 to ``current_A`` and ``force_N``; what is beyond them is drawn on the edge.
    """

    def __init__(self, current_A: float, force_N: float = FULL_SCALE_N) -> None:
        columns, lines = shutil.get_terminal_size()
        self.fits = columns >= SMALLEST[0] and lines >= SMALLEST[1]
        self._size = max(min(columns - 2, 72), 1), max(min(lines - 6, _HIGHEST), 1)
        self._ends = max(current_A, 1e-9), max(force_N, 1e-9)
        self._dots = Dots(*self._size)
        # since the last drawing: all at a time cost less
        self._taken: list[tuple[FloatArray, FloatArray]] = []
        self._share, self._label = 0.0, ""
        self._drawn_s = -np.inf
        self._show: Callable[[RenderableType], None] = lambda _drawn: None
        self.figures = ""

    def take(self, current_A: FloatArray, force_N: FloatArray) -> None:
        """Take in samples (n,); those that were lost are NaN."""
        self._taken.append((current_A, force_N))
        self._draw()

    @contextmanager
    def on_screen(self, label: str) -> Iterator[Progress]:
        """Draw on the terminal, and give a callable that takes the share of the work done."""
        self._label = label
        with drawing() as self._show:
            yield self._progress

    def _progress(self, share: float) -> None:
        self._share = share
        self._draw()

    def _draw(self) -> None:
        now = time.monotonic()
        if now - self._drawn_s >= _DRAWN_EACH_S:
            self._drawn_s = now
            self._show(self.text())

    def text(self) -> RenderableType:
        """Return the loop with its axes, and the figures."""
        from rich.text import Text

        if self._taken:
            current_A, force_N = map(np.concatenate, zip(*self._taken, strict=True))
            there = np.isfinite(current_A) & np.isfinite(force_N)
            self._dots.add(current_A[there] / self._ends[0], force_N[there] / self._ends[1])
            self._taken.clear()
        loop = [f"│{line}" for line in self._dots.lines()]
        axis = f"└{'─' * self._size[0]}"
        ends = f"across: 0 to {self._ends[0]:.3g} A, up: 0 to {self._ends[1]:.3g} N"
        said = f"{self._label}: {100.0 * self._share:.0f} %; {ends}"
        return Text("\n".join([*loop, axis, said, self.figures]))  # words that do not fit go on below
