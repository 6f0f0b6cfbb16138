"""The parts of figures, each on the axes it is given: half-plane of weights, loops, traces, residuals."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import PurePath
from typing import Any, Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import FigureBase
from matplotlib.patches import Polygon
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullFormatter

from pulsetrainer.artefacts import Fit, FloatArray, Model, ModelEvaluation, Waveform, WaveformEvaluation
from pulsetrainer.artefacts.units import counted, shown, unit_of_axis
from pulsetrainer.core.metrics import beats
from pulsetrainer.report.fewer_points import extremes, path
from pulsetrainer.report.names import NAMES, digits
from pulsetrainer.report.style import (
    COMPENSATED,
    ERROR,
    GRID,
    GROUND,
    GUIDE,
    INK,
    METHODS,
    MODEL,
    MUTED,
    SCALED,
    TARGET,
    VERMILION,
    label,
)

# A density is mostly small, with a ridge: the square root shows both. Lone spikes far beyond the
# rest (the least squares make some) do not set the scale.
_DENSITY_GAMMA = 0.5
_DENSITY_QUANTILE = 0.99
_DENSITY_REACH = 2.0
# letters of a title in a line, above a whole column and above a square; matplotlib's own wrapping reads
# what stands between two dollars as a formula, whatever the settings say
_TITLE, _SQUARE_TITLE = 48, 30
_CLOCK = 10.0  # lengths of the record that its first time is late: a date, or minutes since midnight
SAMPLE_NUMBER = "sample number"
_QUANTITIES = {
    "N": "force", "A": "current", "T": "flux density", "V": "voltage", "Pa": "pressure", "N*m": "torque",
}  # fmt: skip


def abscissa(time_s: FloatArray | None, n: int) -> tuple[FloatArray, str]:
    """Return the horizontal axis of a record, and what it is: time in s, or else the sample number.

    Time stamps with a date, or a time of day, are counted from the first one.
    """
    if time_s is None:
        return np.arange(n, dtype=np.float64), SAMPLE_NUMBER
    if abs(time_s[0]) > _CLOCK * (time_s[-1] - time_s[0]):
        return time_s - time_s[0], "time since the first sample"
    return time_s, "time"


class _TicksIn(MaxNLocator):
    """Round numbers of a unit so many seconds long."""

    def __init__(self, seconds: float) -> None:
        super().__init__("auto", steps=[1, 2, 2.5, 5, 10])
        self.seconds = seconds

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the ticks, in seconds."""
        ticks = super().tick_values(vmin / self.seconds, vmax / self.seconds)
        return [self.seconds * tick for tick in ticks]


def name_abscissa(axes: Axes, name: str = "time", behind: str = "") -> None:
    """Label the horizontal axis: a time, drawn in s, is read in s, min, h or d by the length of the axis.

    The curves must be there already; ``behind`` stands behind the unit.
    """
    low, high = axes.get_xlim()
    unit, one = ("1", 1.0) if name == SAMPLE_NUMBER else unit_of_axis(high - low)
    axes.set_xlabel(label(name, unit) + behind)
    if one > 1.0:
        axes.xaxis.set_major_locator(_TicksIn(one))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / one:g}"))


def trace(axes: Axes, x: FloatArray, y: FloatArray, **style: Any) -> None:
    """Draw ``y`` over ``x``, thinned to its envelope."""
    kept = extremes(y)
    axes.plot(x[kept], y[kept], **style)


def orbit(axes: Axes, x: FloatArray, y: FloatArray, **style: Any) -> None:
    """Draw ``y`` against ``x`` in the order of time, thinned to its shape."""
    kept = path(x, y)
    axes.plot(x[kept], y[kept], **style)


def room(axes: Axes, share: float = 0.16) -> None:
    """Make room above the curves."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + share * (high - low))


def headroom(axes: Axes, share: float = 0.16, markerscale: float = 1.0) -> None:
    """Make room above the curves and put the legend there, in one row: it never covers a curve.

    ``markerscale`` makes the points of the legend larger than those of the data, which they looked like.
    """
    room(axes, share)
    axes.legend(
        loc="upper left",
        ncols=4,
        columnspacing=1.0,
        handlelength=1.8,
        borderaxespad=0.2,
        markerscale=markerscale,
    )


def quantity_of(unit: str, otherwise: str = "output") -> str:
    """Return what is measured in a unit, where an artefact tells no more."""
    return _QUANTITIES.get(unit, otherwise)


def density(panel: FigureBase, model: Model) -> None:
    """Draw the weights of a model over the half-plane alpha >= beta, cells that were not covered hatched."""
    edges = model.edges
    rows, columns = np.tril_indices(model.levels)  # the order of the cells: k = i (i + 1) / 2 + j
    field = np.full((model.levels, model.levels), np.nan)
    field[rows, columns] = np.where(model.covered, model.weights, np.nan)

    axes = panel.add_subplot()
    axes.set_aspect("equal")
    axes.grid(visible=False)
    top, ends = scale(model)
    signed = model.form == "signed"
    mesh = axes.pcolormesh(
        edges,
        edges,
        np.ma.masked_invalid(field),
        norm=Normalize(-top, top) if signed else PowerNorm(_DENSITY_GAMMA, vmin=0.0, vmax=top),
        cmap=colormaps["PuOr"] if signed else colormaps["viridis"].with_extremes(over=VERMILION),
        rasterized=True,  # as vectors a thousand seams would shine through
    )
    corner = [(edges[0], edges[0]), (edges[0], edges[-1]), (edges[-1], edges[-1])]
    half_plane = Polygon(corner, closed=True, facecolor="none", edgecolor=MUTED, linewidth=0.8)
    axes.add_patch(half_plane)
    mesh.set_clip_path(half_plane)  # diagonal cells are triangles
    missing = np.flatnonzero(~model.covered)
    if missing.size:
        cells = [_cell(edges, int(rows[k]), int(columns[k])) for k in missing]
        axes.add_collection(
            PolyCollection(cells, facecolors=GRID, edgecolors=MUTED, hatch="/////", linewidths=0.0)
        )
    axes.set_xlabel(label("β, switches down at: " + model.edges_quantity, model.edges_unit))
    axes.set_ylabel(label("α, switches up at: " + model.edges_quantity, model.edges_unit))
    axes.set_title("Preisach density" + ("" if model.form == "direct" else f", {model.form} form"))
    axes.text(
        0.97, 0.06, _facts(model, ends), transform=axes.transAxes, ha="right", va="bottom", linespacing=1.5
    )
    bar = panel.colorbar(mesh, ax=axes, label=label("density μ", model.weights_unit), extend=ends, shrink=0.9)
    bar.outline.set_visible(False)


def scale(model: Model) -> tuple[float, Literal["max", "both", "neither"]]:
    """Return the density at the upper end of the colour scale, and at which ends there is more.

    Cells on the diagonal hold the reversible part: however large, it must not darken the rest.
    """
    rows, columns = np.tril_indices(model.levels)
    top = 1.0
    for chosen in (model.covered & (rows != columns), model.covered):
        sizes = np.abs(model.weights[chosen & (model.weights != 0)])
        if sizes.size:
            top = float(min(sizes.max(), _DENSITY_REACH * np.quantile(sizes, _DENSITY_QUANTILE)))
            break
    signed = model.form == "signed"
    seen = model.weights[model.covered]
    if not np.any((np.abs(seen) if signed else seen) > top):
        return top, "neither"
    return top, "both" if signed else "max"


def _cell(edges: FloatArray, i: int, j: int) -> list[tuple[float, float]]:
    """Return the corners (beta, alpha) of cell (i, j); a triangle on the diagonal."""
    left, right, low, high = edges[j], edges[j + 1], edges[i], edges[i + 1]
    corners = [(left, low), (left, high), (right, high), (right, low)]
    return corners[:3] if i == j else corners


def _facts(model: Model, ends: str) -> str:
    """Return what stands in the empty half of the plane."""
    covered = int(np.count_nonzero(model.covered))
    lines = [
        f"{model.levels} levels, {model.weights.size} cells",
        f"{covered} switched" + (",\nhatched: not switched" if covered < model.weights.size else ""),
        f"offset {model.offset:.4g} {shown(model.offset_unit)}".rstrip().replace("-", "−"),
    ]
    if model.polarity < 0:
        lines.append("output falls as input rises")
    if ends == "max":
        lines.append("orange: beyond the scale")
    if model.extensions:
        lines.append("with " + ",\n".join(extension.cause for extension in model.extensions))
    return "\n".join(lines)


def fit(
    panel: FigureBase, record: Fit, input_quantity: str = "input", output_quantity: str = "output"
) -> None:
    """Draw output over input, measured and modelled, and the residual over time below."""
    loop, below = panel.subplots(2, 1, height_ratios=(2.4, 1.0))
    orbit(loop, record.input, record.output, **GROUND, label="measured")
    orbit(loop, record.input, record.predicted, **MODEL, label="model")
    if record.wild_input is not None and record.wild_output is not None:
        wild = {"linestyle": "none", "marker": "x", "markersize": 4.0, "color": VERMILION}
        loop.plot(record.wild_input, record.wild_output, **wild, label="left out")
    loop.set_xlabel(label(input_quantity, record.input_unit))
    loop.set(ylabel=label(output_quantity, record.output_unit), title="Measured and model")
    headroom(loop, 0.1)
    residual(below, record)


def residual(axes: Axes, of: Fit | ModelEvaluation) -> None:
    """Draw what a model leaves over time, between lines at plus and minus its rms."""
    x, name = abscissa(of.time_s, of.output.size)
    trace(axes, x, of.output - of.predicted, **ERROR)
    axes.axhline(0.0, **GUIDE)
    for y in (-of.rms, of.rms):
        axes.axhline(y, **{**GUIDE, "color": INK, "zorder": 3})
    axes.set_ylabel(label("residual", of.output_unit))
    name_abscissa(axes, name)
    axes.set_title(f"Residual: rms {of.rms_percent:.3g} % of span (dotted: ± rms)")


def prediction(
    panel: FigureBase, model: ModelEvaluation, reach: float | None = None, quantity: str = ""
) -> None:
    """Draw a measured record of a quantity with a model's prediction of it, and the residual below.

    With ``reach`` the residual is drawn from -reach to reach, so that several models compare by eye.
    """
    above, below = panel.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
    x, _ = abscissa(model.time_s, model.output.size)
    trace(above, x, model.output, **GROUND, label="measured")
    trace(above, x, model.predicted, **MODEL, label="predicted")
    above.set_ylabel(label(quantity or quantity_of(model.output_unit), model.output_unit))
    above.set_title(
        textwrap.fill(f"Prediction by {PurePath(model.name).stem}", _TITLE, break_on_hyphens=False)
    )
    headroom(above)
    residual(below, model)
    if reach is not None and np.isfinite(reach) and reach > 0:
        below.set_ylim(-1.05 * reach, 1.05 * reach)


def largest_residual(models: Sequence[ModelEvaluation]) -> float:
    """Return the largest residual of all models, NaN where there is none."""
    return max(
        (float(np.nanmax(np.abs(m.output - m.predicted), initial=0.0)) for m in models), default=float("nan")
    )


def tracking(panel: FigureBase, played: WaveformEvaluation) -> None:
    """Draw target and output of both drives, superimposed, and their errors below."""
    above, below = panel.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
    trace(above, played.time_s, played.target, **TARGET, label="target")
    trace(above, played.time_s, played.scaled.output, **SCALED, label="scaled")
    trace(above, played.time_s, played.compensated.output, **COMPENSATED, label="compensated")
    above.set(ylabel=label("force", played.output_unit), title=titled(played))
    headroom(above)
    below.axhline(0.0, **GUIDE)
    for drive, style in ((played.scaled, SCALED), (played.compensated, COMPENSATED)):
        trace(below, played.time_s, 100.0 * (drive.output - played.target) / played.full_force, **style)
    below.set_ylabel("error\n[% of full force]")
    name_abscissa(below)


def inversions(played: Sequence[WaveformEvaluation]) -> list[str]:
    """Return the inversions in their order: each keeps its line in the figures of all pulses."""
    return list(dict.fromkeys(one.inversion for one in played))


def _line_of(inversion: str, among: Sequence[str]) -> dict[str, Any]:
    return METHODS[among.index(inversion) % len(METHODS)]


def methods(panel: FigureBase, played: Sequence[WaveformEvaluation], among: Sequence[str] = ()) -> None:
    """Draw one beat by every method that played a pulse: before and after above, what is left below.

    ``among``: the inversions of all pulses, where there are others.
    """
    above, below = panel.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
    first = played[0]
    beat = slice(0, first.target.size // beats(first.target))
    time = first.time_s[beat] - first.time_s[0]
    trace(above, time, first.target[beat], **TARGET, label="target")
    trace(above, time, first.scaled.output[beat], **SCALED, label="scaled")
    below.axhline(0.0, **GUIDE)
    for one in played:
        style = _line_of(one.inversion, among or inversions(played))
        size = min(time.size, one.target.size)
        x, measured, target = time[:size], one.compensated.output[:size], one.target[:size]
        shown = f"{one.inversion}: mean {digits(one.compensated.mean_abs_error_percent)} %"
        trace(above, x, measured, **style, label=shown)
        trace(below, x, 100.0 * (measured - target) / one.full_force, **style)
    above.set(ylabel=label("force", first.output_unit), title=f"{first.name}, one beat")
    below.set_ylabel("error\n[% of full force]")
    name_abscissa(below)
    panel.legend(loc="outside lower center", ncols=2, columnspacing=0.8, handlelength=1.5, handletextpad=0.5)


def titled(one: Waveform | WaveformEvaluation) -> str:
    """Return a pulse and the inversion that made its drive, in words."""
    return f"{one.name}, {one.inversion} inversion"


def loops(panel: FigureBase, played: Sequence[WaveformEvaluation], among: Sequence[str] = ()) -> None:
    """Draw force against target over one beat: hysteresis opens a loop, the perfect drive is a line.

    The scaled drive, and the compensated one by each method that played the pulse, ``among`` those of all.
    """
    axes = panel.add_subplot()
    first = played[0]
    ends = [float(np.nanmin(first.target)), float(np.nanmax(first.target))]
    axes.plot(ends, ends, **TARGET, label="target")
    several = len(played) > 1
    drawn = [("scaled", first, first.scaled, SCALED)]
    for one in played:
        style = _line_of(one.inversion, among or inversions(played)) if several else COMPENSATED
        drawn.append((one.inversion if several else "compensated", one, one.compensated, style))
    for name, one, drive, style in drawn:
        beat = slice(0, one.target.size // beats(one.target))
        shown = f"{name}: {digits(drive.hysteresis_percent)}"
        orbit(axes, one.target[beat], drive.output[beat], **style, label=shown)
    axes.set_aspect("equal", anchor="W")  # begins where the text below it begins
    axes.set(xlabel=label("target", first.output_unit), ylabel=label("force", first.output_unit))
    title = f"{first.name}, {'force against target' if several else first.inversion}"
    axes.set_title(textwrap.fill(title, _SQUARE_TITLE, break_on_hyphens=False))
    step = float(np.diff(MaxNLocator(7, steps=(1, 2, 5, 10)).tick_values(*ends))[0])
    for axis in (axes.xaxis, axes.yaxis):  # equal scales have equal ticks
        axis.set_major_locator(MultipleLocator(step))
    # outside, since inside a loop would run through
    panel.legend(loc="outside lower left", title=str(NAMES["hysteresis_percent"]), alignment="left")


def drives(panel: FigureBase, waveform: Waveform) -> None:
    """Draw what a waveform asks for and the two currents that shall press it."""
    above, below = panel.subplots(2, 1, sharex=True)
    trace(above, waveform.time_s, waveform.target, **TARGET, label="target")
    measured = "pressed in the kept pass, mean" if waveform.passes else "predicted by the model"
    trace(above, waveform.time_s, waveform.predicted, **MODEL, label=measured)
    model = waveform.model
    pressed, driven = (model.output_quantity, model.input_quantity) if model else ("", "")
    above.set_ylabel(label(pressed or quantity_of(waveform.output_unit), waveform.output_unit))
    above.set_title(f"{titled(waveform)}: what is asked for, and the drive")
    trace(below, waveform.time_s, waveform.scaled, **SCALED, label="scaled")
    trace(below, waveform.time_s, waveform.compensated, **COMPENSATED, label="compensated")
    below.set_ylabel(label(f"drive: {driven or quantity_of(waveform.input_unit)}", waveform.input_unit))
    name_abscissa(below)
    unscored(above, waveform)
    unscored(below, waveform, name="")
    if not waveform.scored[0]:
        room(below)
        over = below.get_xaxis_transform()
        begin = float(waveform.time_s[0])
        below.text(begin, 0.98, " lead-in: sets the memory", transform=over, ha="left", va="top")
    panel.legend(loc="outside lower center", ncols=5, columnspacing=1.2)


def passes(panel: FigureBase, waveform: Waveform) -> None:
    """Draw how the error of a refined drive fell from pass to pass, down to the noise."""
    axes = panel.subplots()
    numbers = np.arange(1, len(waveform.passes) + 1)
    for name, style in (("max", SCALED), ("mean", COMPENSATED)):
        values = [getattr(one, f"{name}_abs_error_percent") for one in waveform.passes]
        axes.semilogy(numbers, values, marker="o", **style, label=f"{name} error")
    noise = [one.noise_percent for one in waveform.passes]
    axes.semilogy(numbers, noise, **TARGET, label="noise alone, mean")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.axvline(waveform.kept, **GUIDE)
    axes.set_xticks(numbers)
    axes.set(xlabel=f"pass; pass {waveform.kept} is kept", ylabel="error\n[% of full force]")
    panel.legend(loc="outside lower center", ncols=3)


def unscored(axes: Axes, waveform: Waveform, name: str = "not scored") -> None:
    """Shade the lead-in and whatever else does not count in the evaluation."""
    edges = np.flatnonzero(np.diff(np.concatenate(([True], waveform.scored, [True])).astype(np.int8)))
    last = waveform.time_s.size - 1
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        axes.axvspan(
            waveform.time_s[min(start, last)],
            waveform.time_s[min(stop, last)],
            color=MUTED,
            alpha=0.2,
            lw=0,
            label=name or None if start == 0 else None,
        )


def temperature(axes: Axes, time_s: FloatArray, told_K: FloatArray) -> None:
    """Draw how much warmer the copper was than at calibration, as the duty tells, arrays (w,) in s and K."""
    trace(axes, time_s, told_K, **COMPENSATED, label="told by the duty")
    _finish_temperature(axes, 0.4)  # a low panel, of which a legend is a large part


def temperature_of_repeats(axes: Axes, told_K: FloatArray) -> None:
    """Draw how much warmer the copper was before each repeat (r,), K."""
    axes.plot(range(1, told_K.size + 1), told_K, marker="o", **COMPENSATED, label="told by the duty")
    _finish_temperature(axes, 0.16)
    axes.set_xlabel("repeat")
    axes.margins(x=0.04)  # a point is whole at either end
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _finish_temperature(axes: Axes, share: float) -> None:
    axes.axhline(0.0, **GUIDE)
    axes.set_ylabel("coil, against\ncalibration [K]")
    headroom(axes, share)


def repeats(axes: Axes, time_s: FloatArray, rows: FloatArray, name: str, style: dict[str, Any]) -> None:
    """Draw every repeat of one measurement, thin, in one colour; only the first is named, if there is one."""
    thin = style | {"linewidth": 0.8, "alpha": 0.6, "linestyle": "-"}
    for k, row in enumerate(rows):
        named = f"{name}, {counted(len(rows), 'repeat')}" if name and k == 0 else None
        trace(axes, time_s, row, **thin, label=named)
