"""The figures: pure functions from an artefact to a matplotlib ``Figure``.

Nothing here shows or writes anything; ``render.encode`` makes a file of a figure and
``render.inline_svg`` a part of a page. ``draw`` chooses by the kind of the artefact.
Figure numbers are those of Carneiro, Abreu and Restivo, Sensors 2018, 18(5), 1631.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec

import numpy as np
from matplotlib.figure import Figure, FigureBase

from pulsetrainer.artefacts import (
    Diagnosis,
    Evaluation,
    FloatArray,
    Model,
    Playback,
    Run,
    Session,
    Waveform,
    WaveformEvaluation,
)
from pulsetrainer.errors import DataError
from pulsetrainer.report import diagnosis_figures, panels, session_figures
from pulsetrainer.report.directions import directions
from pulsetrainer.report.style import (
    COLUMN_IN,
    COMPENSATED,
    FINE,
    GUIDE,
    MEASURED,
    SCALED,
    TARGET,
    label,
    styled,
)

P = ParamSpec("P")
_ROW_IN = 4.4  # height of a figure of one column


def _sheet(width_in: float = COLUMN_IN, height_in: float = _ROW_IN) -> Figure:
    return Figure(figsize=(width_in, height_in), layout="constrained")


def _alone(
    panel: Callable[Concatenate[FigureBase, P], None], height_in: float = _ROW_IN, width_in: float = COLUMN_IN
) -> Callable[P, Figure]:
    """Return what draws a figure of one panel."""

    @styled
    def draw(*shown: P.args, **options: P.kwargs) -> Figure:
        figure = _sheet(width_in, height_in)
        panel(figure, *shown, **options)
        return figure

    return draw


preisach_density = _alone(panels.density)  # fig. 7
identification = _alone(panels.fit, height_in=5.4)  # fig. 8
tracking = _alone(panels.tracking)  # fig. 9
methods = _alone(panels.methods, height_in=5.4)
loops = _alone(panels.loops, width_in=4.2)  # fig. 10: a square with little beside it
prediction = _alone(panels.prediction)


@styled
def run(record: Run) -> Figure:
    """Return a run: input and output over time, output over input."""
    figure = _sheet(2 * COLUMN_IN)
    left, right = figure.subfigures(1, 2, squeeze=False)[0]
    above, below = left.subplots(2, 1, sharex=True)
    x, name = panels.abscissa(record.time_s, record.input.size)
    if record.reference is not None:
        panels.trace(above, x, record.reference, **TARGET, label="reference")
    panels.trace(above, x, record.input, **MEASURED, label="measured")
    measured = np.where(record.counts, record.output, np.nan)  # what was filled in is no data
    panels.trace(below, x, measured, **MEASURED)
    if record.masked is not None and record.masked.any():
        panels.trace(below, x, np.where(record.counts, np.nan, record.output), **GUIDE, label="taken out")
        panels.headroom(below)
    input_label = label(record.input_quantity, record.input_unit)
    output_label = label(record.output_quantity, record.output_unit)
    above.set_ylabel(input_label)
    title = f"{record.signal} signal over time" if record.signal else "record over time"
    title = f"{record.signal} over time" if "." in record.signal else title[:1].upper() + title[1:]  # a file
    above.set_title(title + ("" if record.complete else ", incomplete"))
    if record.reference is not None:
        panels.headroom(above)
    below.set_ylabel(output_label)
    panels.name_abscissa(below, name)
    loop = right.subplots()
    panels.orbit(loop, record.input, measured, **FINE)
    loop.set(xlabel=input_label, ylabel=output_label)
    directions(loop, record.input, record.output)
    title = f"{record.output_quantity} over {record.input_quantity}; arrows: direction"
    loop.set_title(title[:1].upper() + title[1:])
    return figure


@styled
def waveform(drive: Waveform) -> Figure:
    """Return a target and its drives, and of a refined one its passes; what is not scored is shaded."""
    if not drive.passes:
        figure = _sheet(1.5 * COLUMN_IN)
        panels.drives(figure, drive)
        return figure
    figure = _sheet(1.5 * COLUMN_IN, 1.6 * _ROW_IN)
    above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=(1.8, 1.0))[:, 0]
    panels.drives(above, drive)
    panels.passes(below, drive)
    return figure


@styled
def playback(played: Playback) -> Figure:
    """Return every repeat of both drives: force, current, how well it followed, and the coil's heat."""
    asked, kelvin = played.waveform, played.temperature_K
    rows = 3 if kelvin is None or not kelvin.size else 4
    figure = _sheet(1.5 * COLUMN_IN, (1.5 if rows == 3 else 1.9) * _ROW_IN)
    panes = figure.subplots(rows, 1, height_ratios=(1.4, 1.0, 0.8, 0.65)[:rows])
    force, current, error = panes[:3]
    for axes in (force, current):
        axes.sharex(error)
        axes.tick_params(labelbottom=False)
    if kelvin is not None and rows > 3:
        panels.temperature_of_repeats(panes[3], kelvin)
    panels.trace(force, asked.time_s, asked.target, **TARGET, label="target")
    for name, drive, style in (
        ("scaled", played.scaled, SCALED),
        ("compensated", played.compensated, COMPENSATED),
    ):
        panels.repeats(force, played.time_s, drive.output, name, style)
        panels.repeats(current, played.time_s, drive.input, name, style)
        missed = 100.0 * (drive.input - drive.reference) / played.input_range
        panels.repeats(error, played.time_s, missed, "", style)
    force.set_ylabel(label("force", played.scaled.output_unit))
    force.set_title(panels.titled(asked) + ("" if played.complete else ", incomplete"))
    current.set_ylabel(label(panels.quantity_of(played.scaled.input_unit), played.scaled.input_unit))
    error.axhline(0.0, **GUIDE)
    error.set_ylabel("current error\n[% of range]")
    panels.name_abscissa(error)
    for axes in (force, current, error):
        panels.unscored(axes, asked)
    panels.headroom(force)
    return figure


@styled
def temperature(told_K: FloatArray) -> Figure:
    """Return the coil's temperature before each repeat (r,), K."""
    figure = _sheet(0.6 * COLUMN_IN, 2.4)  # few points: a small figure
    axes = figure.add_subplot()
    panels.temperature_of_repeats(axes, told_K)
    axes.set_title("Coil temperature")
    return figure


@styled
def model(identified: Model) -> Figure:
    """Return the density, and beside it the fit where the model carries one."""
    if identified.fit is None:
        return preisach_density(identified)
    figure = _sheet(2 * COLUMN_IN, 5.0)
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.1, 1.0))[0]
    panels.density(left, identified)
    panels.fit(right, identified.fit, identified.input_quantity, identified.output_quantity)
    return figure


@styled
def evaluation(errors: Evaluation) -> Figure:
    """Return force and loops of every pulse, methods overlaid, then the prediction of every model.

    DataError where the evaluation holds neither.
    """
    errors = errors.told_apart()
    pairs, among = -(-len(errors.models) // 2), panels.inversions(errors.waveforms)
    pulses: dict[str, list[WaveformEvaluation]] = {}
    for one in errors.waveforms:
        pulses.setdefault(one.name, []).append(one)
    quantity = errors.model.output_quantity if errors.model else ""
    rows = len(pulses) + pairs
    if rows == 0:
        raise DataError(
            "this evaluation holds neither played waveforms nor models, so there is nothing to draw",
            hint="evaluate again, with pulsetrainer evaluate",
        )
    if not pulses and len(errors.models) == 1:
        return prediction(errors.models[0], quantity=quantity)
    tall = 1.25 if any(len(played) > 1 for played in pulses.values()) else 1.0  # legends of several lines
    figure = _sheet(2 * COLUMN_IN, tall * _ROW_IN * rows)
    widths = (1.0, 1.0) if pairs else (1.2, 1.0)  # a loop is a square
    cells = figure.subfigures(rows, 2, squeeze=False, width_ratios=widths)
    for row, played in zip(cells, pulses.values(), strict=False):
        if len(played) > 1:
            panels.methods(row[0], played, among)
        else:
            panels.tracking(row[0], played[0])
        panels.loops(row[1], played, among)
    reach = panels.largest_residual(errors.models)
    for cell, predicted in zip(cells[len(pulses) :].flat, errors.models, strict=False):
        panels.prediction(cell, predicted, reach, quantity)
    return figure


def draw(artefact: Run | Model | Waveform | Playback | Evaluation | Diagnosis | Session) -> Figure:
    """Return the figure of an artefact, chosen by its kind; DataError where there is none for this kind."""
    drawing: dict[type, Callable[[Any], Figure]] = {
        Run: run,
        Model: model,
        Waveform: waveform,
        Playback: playback,
        Evaluation: evaluation,
        Diagnosis: diagnosis_figures.course,
        Session: session_figures.course,
    }
    if type(artefact) in drawing:
        return drawing[type(artefact)](artefact)
    raise DataError(
        f"there is no figure for a {getattr(artefact, 'kind', type(artefact).__name__)}: "
        "expected a run, model, waveform, playback, evaluation, diagnosis or session",
        hint="pulsetrainer show FILE.h5 tells what a file holds",
    )
