"""`--live`: the loop grows on a terminal, and nothing of it is seen anywhere else."""

from __future__ import annotations

import fcntl
import io
import os
import re
import struct
import subprocess
import termios
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from program import PROGRAM, pulsetrainer
from pulsetrainer import load
from pulsetrainer.cli.loop_view import LoopView
from pulsetrainer.report.characters import Dots

pty = pytest.importorskip("pty")
DRIVE = Path(__file__).parents[1] / "data/files-0.1/drive.h5"
LINES = {
    "capture": ("capture", "identification", "--levels", "6", "--speed", "6", "-o", "out.h5"),
    "play": ("play", str(DRIVE), "--repeats", "1", "-o", "out.h5"),
}
BRAILLE = re.compile("[\u2801-\u28ff]")


def on_terminal(folder: Path, *words: str, size=(30, 90), encoding="utf-8") -> str:
    """Return everything that a command writes on a terminal of this size."""
    main, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
    kept = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES")}
    running = subprocess.Popen(
        [*PROGRAM, *words],
        cwd=folder,
        env={**kept, "TERM": "xterm", "PYTHONIOENCODING": encoding},
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
    )
    os.close(terminal)
    seen = b""
    while True:
        try:
            piece = os.read(main, 65536)
        except OSError:
            break
        if not piece:
            break
        seen += piece
    os.close(main)
    assert running.wait(60) == 0, seen[-2000:]
    return seen.decode(errors="replace")


@pytest.mark.parametrize("command", LINES)
def test_the_loop_is_drawn_on_a_terminal(tmp_path, command):
    """Dots of the loop, and in a play the errors as far as they are known; then the result as always."""
    seen = on_terminal(tmp_path, *LINES[command], "--live")
    assert BRAILLE.search(seen)
    assert ("compensated: mean" in seen) == (command == "play")
    assert "out.h5" in seen
    assert load(tmp_path / "out.h5").complete


@pytest.mark.parametrize("command", LINES)
def test_in_a_pipe_it_is_quiet(tmp_path, command):
    """Word for word what comes without it."""
    plain = pulsetrainer(tmp_path, *LINES[command])
    live = pulsetrainer(tmp_path, *LINES[command], "--live", "--overwrite")
    assert (live.code, live.out, live.err) == (0, plain.out, plain.err)


@pytest.mark.parametrize("more", [{"size": (8, 30)}, {"encoding": "ascii"}], ids=["tiny", "ascii"])
def test_a_terminal_that_cannot_show_it_is_told(tmp_path, more):
    """A note, and the work is done."""
    seen = on_terminal(tmp_path, *LINES["play"], "--live", **more)
    assert not BRAILLE.search(seen)
    assert "no live view" in " ".join(seen.split())
    assert (tmp_path / "out.h5").exists()


@pytest.mark.parametrize(
    ("columns", "lines", "width", "height", "fits"),
    [
        (50, 14, 49, 11, True),
        (40, 12, 39, 9, True),
        (39, 12, 38, 9, False),
        (40, 11, 39, 8, False),
        (300, 100, 73, 19, True),
    ],
)
def test_a_loop_is_as_large_as_the_terminal_allows(monkeypatch, columns, lines, width, height, fits):
    """A column is left, and lines for words that fold: nothing scrolls; on a large one it stays a picture."""
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("LINES", str(lines))
    view = LoopView(1.0)
    view.figures = "mean 1 %"
    drawn = view.text().plain.splitlines()
    assert (max(len(line) for line in drawn if line[0] in "│└"), len(drawn)) == (width, height)
    assert view.fits is fits


@pytest.mark.parametrize("columns", [40, 60, 80])
def test_no_word_is_cut_off(monkeypatch, columns):
    """A long line of figures goes on below, within the lines of the terminal."""
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("LINES", "14")
    view = LoopView(1.5)
    view.figures = "repeat 5, compensated: mean 0.28 %, max 1.3 %; scaled: mean 13.14 %, max 31.7 %"
    console = Console(file=io.StringIO(), width=columns)
    console.print(view.text())
    drawn = console.file.getvalue()
    assert view.figures in " ".join(line.strip() for line in drawn.splitlines())
    assert len(drawn.splitlines()) <= 14


def test_every_sample_is_a_dot_where_it_belongs():
    """The corners, what lies beyond them, and what was lost."""
    view = LoopView(2.0, 10.0)
    nan = np.nan
    view.take(np.array([0.0, 2.0, 9.0, nan, 1.0]), np.array([0.0, 10.0, 99.0, 3.0, nan]))
    loop = [line[1:] for line in view.text().plain.splitlines() if line.startswith("│")]
    assert "across: 0 to 2 A, up: 0 to 10 N" in view.text().plain
    dots = {(row, column) for row, line in enumerate(loop) for column, c in enumerate(line) if c != "\u2800"}
    assert dots == {(len(loop) - 1, 0), (0, len(loop[0]) - 1)}


@pytest.mark.parametrize(
    ("across", "up", "shown"),
    [(0.0, 1.0, "⠁⠀⠀⠀"), (1.0, 0.0, "⠀⠀⠀⢀"), (0.5, 0.6, "⠠⠀⠀⠀"), (7.0, 7.0, "⠀⠈⠀⠀")],
)
def test_a_point_is_a_dot(across, up, shown):
    """The one that it falls on, of four by eight; beyond the edge it is at the edge; what was set stays."""
    dots = Dots(2, 2)
    for _ in range(2):
        dots.add(np.array([across]), np.array([up]))
        assert "".join(dots.lines()) == shown
    even = np.linspace(0.0, 1.0, 50)
    dots.add(np.tile(even, 50), np.repeat(even, 50))
    assert dots.lines() == ["⣿⣿", "⣿⣿"]
