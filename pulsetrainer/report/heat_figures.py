"""The figure of the coil's temperature: as the duty tells it."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.report import panels
from pulsetrainer.report.style import COLUMN_IN, COMPENSATED, GUIDE, styled


def temperature(axes: Axes, time_s: FloatArray, told_K: FloatArray) -> None:
    """Draw how much warmer the copper was than at calibration, arrays (w,) in s and K."""
    panels.trace(axes, time_s, told_K, **COMPENSATED, label="told by the duty")
    _finish(axes, 0.4)  # a low panel, of which a legend is a large part
    axes.set_xlabel("time [s]")


def temperature_of_repeats(axes: Axes, told_K: FloatArray) -> None:
    """Draw how much warmer the copper was before each repeat (r,), K."""
    axes.plot(range(1, told_K.size + 1), told_K, marker="o", **COMPENSATED, label="told by the duty")
    _finish(axes, 0.16)
    axes.set_xlabel("repeat")
    axes.margins(x=0.04)  # a point is whole at either end
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))


@styled
def of_playback(told_K: FloatArray) -> Figure:
    """Return the coil's temperature before each repeat (r,), K."""
    figure = Figure(figsize=(0.6 * COLUMN_IN, 2.4), layout="constrained")  # few points: a small figure
    axes = figure.add_subplot()
    temperature_of_repeats(axes, told_K)
    axes.set_title("Coil temperature")
    return figure


def _finish(axes: Axes, share: float) -> None:
    axes.axhline(0.0, **GUIDE)
    axes.set_ylabel("coil, against\ncalibration [K]")
    panels.headroom(axes, share)
