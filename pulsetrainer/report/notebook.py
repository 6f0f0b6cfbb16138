"""What a notebook shows of an artefact: its figure and its text."""

from __future__ import annotations

from html import escape
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pulsetrainer.report import figures, render, text
from pulsetrainer.report.tables import ESCAPE

_WIDTH = 80  # characters of a line: sentences are folded there, a wider table is scrolled
# notebooks and sites break lines at the column's edge; nbconvert's page sets text in a proportional font
_WHOLE = "white-space: pre; overflow-x: auto; font-family: monospace"


def html(artefact: Any) -> str:
    """Return the text of an artefact, and its figure as SVG below it; no file, nothing fetched."""
    words = ESCAPE.sub("", text.of(artefact, _WIDTH))  # a notebook passes for a terminal
    picture = render.encode(figures.draw(artefact), "svg").decode()
    return f'<pre style="{_WHOLE}">{escape(words)}</pre>{picture[picture.index("<svg") :]}'


def plot(artefact: Any) -> Axes:
    """Draw an artefact and return the first axes of its figure."""
    figure: Figure = figures.draw(artefact)
    return figure.axes[0]
