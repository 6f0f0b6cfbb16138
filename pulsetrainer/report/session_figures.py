"""The figures of a session: what was pressed, how true each beat was, and what was answered."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from pulsetrainer.artefacts import Quiz, Session
from pulsetrainer.errors import DataError
from pulsetrainer.report import panels
from pulsetrainer.report.style import BLUE, COLUMN_IN, COMPENSATED, TARGET, VERMILION, label, styled

SHOWN_S = 6.0
_UPRIGHT = 30  # letters of all names that stand side by side


@styled
def course(session: Session) -> Figure:
    """Return the middle of a session, target and force, the errors of all its beats, and the coil's heat.

    DataError where the session was cut off before its first sample.
    """
    if not session.time_s.size:
        raise DataError(
            "nothing was pressed yet, so there is nothing to draw", hint="begin the session again"
        )
    warm_s, warm_K = session.temperature_s, session.temperature_K
    lowest = None
    if warm_s is None or warm_K is None:
        figure = Figure(figsize=(COLUMN_IN, 4.0), layout="constrained")
        above, below = figure.subplots(2, 1, height_ratios=(1.5, 1.0))
    else:
        figure = Figure(figsize=(COLUMN_IN, 5.6), layout="constrained")
        above, below, lowest = figure.subplots(3, 1, height_ratios=(1.5, 1.0, 0.8))
        panels.temperature(lowest, warm_s, warm_K)
        lowest.sharex(below)  # both go over the whole session
        below.tick_params(labelbottom=False)
    middle = session.time_s[session.time_s.size // 2]
    near = np.abs(session.time_s - middle) <= 0.5 * SHOWN_S
    panels.trace(above, session.time_s[near], session.target[near], **TARGET, label="target")
    panels.trace(above, session.time_s[near], session.output[near], **COMPENSATED, label="measured")
    above.set_ylabel(label("force", session.output_unit))
    panels.name_abscissa(above)
    stopped = ", stopped early" if session.ended_early else ""
    above.set_title(f"Session: {SHOWN_S:g} seconds from its middle{stopped}")
    panels.headroom(above)
    beats = session.beats
    percent = 100.0 / session.full_force
    below.plot(
        beats.start_s, percent * beats.max_error, ".", markersize=3, color=VERMILION, label="max error"
    )
    below.plot(beats.start_s, percent * beats.mean_error, ".", markersize=3, color=BLUE, label="mean error")
    below.set_ylabel("error\n[% of full force]")
    if lowest is None:
        panels.name_abscissa(below, "start of the beat")
    else:
        panels.name_abscissa(lowest)
    below.set_ylim(bottom=0.0)
    panels.headroom(below, 0.3, markerscale=3.0)
    return figure


@styled
def confusion(quiz: Quiz) -> Figure:
    """Return the confusion matrix: what was asked downwards, what was answered across."""
    size = len(quiz.choices)
    width = 0.75 * COLUMN_IN  # beside a table on paper, where its letters must still be read
    figure = Figure(figsize=(width, min(1.8 + 0.3 * size, width)), layout="constrained")
    axes = figure.subplots()
    count = np.asarray([list(row.values()) for row in quiz.confusion.values()])
    share = count / np.maximum(count.sum(axis=1, keepdims=True), 1)
    for (row, column), value in np.ndenumerate(count):
        if value:
            colour, strength = BLUE if row == column else VERMILION, 0.15 + 0.45 * share[row, column]
            corner = column - 0.5, row - 0.5
            axes.add_patch(Rectangle(corner, 1.0, 1.0, facecolor=colour, alpha=strength, linewidth=0))
            axes.text(column, row, str(value), ha="center", va="center")
    axes.set_xticks(range(size), quiz.choices, rotation=0 if sum(map(len, quiz.choices)) < _UPRIGHT else 90)
    axes.set_yticks(range(size), quiz.choices)
    axes.set_xlim(-0.5, size - 0.5)
    axes.set_ylim(size - 0.5, -0.5)
    axes.set(aspect="equal", title="Confusion matrix", xlabel="answered", ylabel="asked")
    axes.grid(visible=False)
    return figure
