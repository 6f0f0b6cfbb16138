"""What a notebook shows of an artefact: its figure and its text."""

from __future__ import annotations

from html import escape
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pulsetrainer.report import figures, render, text
from pulsetrainer.report.tables import ESCAPE


def html(artefact: Any) -> str:
    """Return the text of an artefact, and its figure as SVG below it; no file, nothing fetched."""
    words = ESCAPE.sub("", text.of(artefact))  # a notebook passes for a terminal
    picture = render.encode(figures.draw(artefact), "svg").decode()
    return f"<pre>{escape(words)}</pre>{picture[picture.index('<svg') :]}"


def plot(artefact: Any) -> Axes:
    """Draw an artefact and return the first axes of its figure."""
    figure: Figure = figures.draw(artefact)
    return figure.axes[0]
