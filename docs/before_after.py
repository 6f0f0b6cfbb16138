"""The picture of the README: the force of one beat before and after compensation, and the loop that closes.

Drawn from the beat that ``docs/demo.py`` keeps of the demo, once for a light page and once for a dark one.
"""  # noqa: INP001 - a folder of pages with its scripts, not a package

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from pulsetrainer.report.render import encode
from pulsetrainer.report.style import (
    BLUE,
    COMPENSATED,
    GRID,
    INK,
    MUTED,
    SCALED,
    TARGET,
    VERMILION,
    label,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN = (8.4, 3.7)
# the dark theme of the report's page
DARK = {INK: "#e4e6e8", MUTED: "#9aa4ae", GRID: "#343a40", BLUE: "#56b4e9", VERMILION: "#f08a3c"}


def pictures(kept: dict[str, Any]) -> dict[str, str]:
    """Return the two pictures, SVG by file name, of what is kept of the demo."""
    beat = kept["beat"]  # times in s, forces in N
    errors = kept["played"]["normal.extended"]  # those of the table, noise and all repeats included
    light = encode(before_after(beat, errors), "svg").decode()
    light = light.replace("fill: #ffffff", "fill: none")  # the page's own ground
    words = f"<desc>{json.dumps(beat, sort_keys=True)}</desc>"  # the numbers that are drawn
    at = light.index(">", light.index("<svg")) + 1
    light = f"{light[:at]}\n {words}{light[at:]}"
    dark = light
    for colour, other in DARK.items():
        dark = dark.replace(colour, other)
    return {"before-after-light.svg": light, "before-after-dark.svg": dark}


@styled
def before_after(beat: dict[str, Any], errors: dict[str, float]) -> Figure:
    """Return the beat over time, and pressed over asked force."""
    time, asked = np.array(beat["time_s"]), np.array(beat["target"])
    forces = {"only scaled": ("scaled", SCALED), "compensated": ("compensated", COMPENSATED)}
    figure = Figure(figsize=SIZE_IN, layout="constrained")
    over_time, loop = figure.subplots(1, 2, width_ratios=(1.55, 1.0))
    over_time.plot(time, asked, **TARGET, label="asked")
    loop.plot([0, asked.max()], [0, asked.max()], **TARGET)
    for words, (name, style) in forces.items():
        pressed = np.array(beat[name])
        error = errors[f"{name}.mean_abs_error_percent"]
        over_time.plot(time, pressed, **style, label=f"{words}: mean error {error:.2g} %")
        loop.plot(np.append(asked, asked[0]), np.append(pressed, pressed[0]), **style)
    _name(over_time, label("time", "s"), label("force", "N"), "One beat on the finger")
    _name(loop, label("force asked", "N"), label("force pressed", "N"), "The loop closes")
    loop.set_aspect("equal")
    for axis in (loop.xaxis, loop.yaxis):  # equal scales have equal ticks
        axis.set_major_locator(MultipleLocator(2.0))
    figure.legend(*over_time.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _name(axes: Axes, x: str, y: str, title: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title)
