"""Draw the figures of the pages: ``python docs/figures.py`` writes docs/figures/*.svg.

A made-up operator, evaluated by the program's own core, and two of the measured records of tests/data: what the pages show
is what the program computes.
"""  # noqa: INP001 - a folder of pages with its script, not a package

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from before_after import DARK, pictures
from demo import KEPT
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.figure import Figure

import pulsetrainer as pt
from pulsetrainer.core.inversion import invert
from pulsetrainer.core.memory import State
from pulsetrainer.core.operator import Preisach, follow
from pulsetrainer.core.plane import Plane
from pulsetrainer.report.figures import model as model_figure
from pulsetrainer.report.render import encode
from pulsetrainer.report.style import (
    BLUE,
    COMPENSATED,
    FINE,
    GRID,
    GUIDE,
    MEASURED,
    MUTED,
    SCALED,
    TARGET,
    VERMILION,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    FloatArray = NDArray[np.float64]

HERE = Path(__file__).parent / "figures"
DATA = Path(__file__).parents[1] / "tests" / "data"
SIZE_IN = (7.6, 3.5)


def operator(n_h: int = 48) -> Preisach:
    """Return an operator with one hump of density and a reversible part, input and output from 0 to 1."""
    plane = Plane.uniform(0.0, 1.0, n_h)
    i, j = plane.cell_indices
    alpha, beta = plane.thresholds[i], plane.thresholds[j]
    hump = np.exp(-(((alpha - 0.6) / 0.14) ** 2) - ((beta - 0.33) / 0.14) ** 2)
    masses = (hump + np.where(i == j, 0.35, 0.02)) * plane.areas
    scale = 0.5 / masses.sum()
    return Preisach(plane, scale * masses / plane.areas, offset=0.5)


def through(points: ArrayLike, count: int = 160) -> FloatArray:
    """Return an input that goes straight through ``points``, ``count`` samples a leg."""
    legs = np.asarray(points, dtype=np.float64)
    pieces = [np.linspace(a, b, count, endpoint=False) for a, b in pairwise(legs)]
    return np.concatenate([*pieces, legs[-1:]])


def _half_plane(axes: Axes) -> None:
    axes.plot([0, 1], [0, 1], color=MUTED, linewidth=0.8)
    axes.plot([0, 0, 1], [0, 1, 1], color=MUTED, linewidth=0.8)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("β, switches down at")
    axes.set_ylabel("α, switches up at")


def _staircase(state: State) -> FloatArray:
    """Return the corners (β, α) between the relays that are up and those that are down."""
    path = state.extremes
    corners: list[tuple[float, float]] = []
    beta = path[0]
    for k in range(1, len(path), 2):
        alpha = path[k]
        corners += [(beta, alpha)]
        beta = path[k + 1] if k + 1 < len(path) else alpha
        corners += [(beta, alpha)]
    if len(path) % 2:
        corners += [(path[-1], path[-1])]
    return np.array(corners)


@styled
def plane() -> Figure:
    """Return an input, and the line that it leaves in the plane."""
    figure = Figure(figsize=SIZE_IN, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    turns = (0.0, 0.9, 0.2, 0.7, 0.4, 0.55)
    u = through(turns)
    left.plot(np.linspace(0, len(turns) - 1, u.size), u, **MEASURED)
    left.plot(np.arange(1, len(turns) - 1), turns[1:-1], "o", color=VERMILION, markersize=5)
    left.set_xlabel("time")
    left.set_ylabel("input u")
    left.set_title("The input, its remembered extremes")
    state = follow(operator().plane, u, None, "continuous").final
    line = _staircase(state)
    _half_plane(right)
    under = np.vstack([[0.0, 0.0], line])
    right.fill(under[:, 0], under[:, 1], color=BLUE, alpha=0.25, linewidth=0)
    right.plot(line[:, 0], line[:, 1], color=VERMILION, linewidth=1.8)
    right.annotate("up", (0.12, 0.35), color=BLUE, weight="bold")
    right.annotate("down", (0.5, 0.93), color=MUTED, weight="bold")
    right.set_title("The relays, and the line between")
    return figure


@styled
def everett() -> Figure:
    """Return the triangle whose mass is the Everett function, and the branch that measures it."""
    figure = Figure(figsize=SIZE_IN, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    model = operator()
    alpha, beta = 0.75, 0.3
    field = np.full((model.plane.n_h, model.plane.n_h), np.nan)
    field[model.plane.cell_indices] = np.minimum(model.weights, np.quantile(model.weights, 0.97))
    edges = model.plane.edges
    shown = np.ma.masked_invalid(field)
    blues = LinearSegmentedColormap.from_list("blues", [to_rgba(BLUE, 0.0), BLUE])  # on any ground
    left.pcolormesh(edges, edges, shown, cmap=blues, rasterized=True)
    left.fill([beta, beta, alpha], [beta, alpha, alpha], facecolor="none", edgecolor=VERMILION, linewidth=2)
    line = {"arrowstyle": "-", "color": VERMILION}
    left.annotate("E(α, β)", (0.58, 0.66), (0.6, 0.4), color=VERMILION, weight="bold", arrowprops=line)
    left.annotate("α", (0.02, alpha), color=VERMILION, va="bottom")
    left.annotate("β", (beta, 0.02), color=VERMILION, ha="left")
    left.plot([0, beta], [alpha, alpha], **GUIDE)
    left.plot([beta, beta], [0, beta], **GUIDE)
    _half_plane(left)
    left.set_title("The mass in a triangle")
    major, branch = through((0, 1, 0)), through((0, alpha, beta))
    right.plot(major, model(major), color=GRID, linewidth=1.4)
    y = model(branch)
    right.plot(branch, y, **MEASURED)
    half = branch.size // 2
    right.annotate(
        "", (beta + 0.0, y[half]), (beta, y[-1]), arrowprops={"arrowstyle": "<->", "color": VERMILION}
    )
    right.plot([beta, alpha], [y[half]] * 2, **GUIDE)
    right.annotate(
        "2 E(α, β)", (beta - 0.02, (y[half] + y[-1]) / 2), ha="right", va="center", color=VERMILION
    )
    right.set_xlabel("input u")
    right.set_ylabel("output y")
    right.set_title("From α down to β the output falls by 2 E")
    return figure


@styled
def wiping_out() -> Figure:
    """Return an input whose large swing wipes out a small one, and the loops it draws."""
    figure = Figure(figsize=SIZE_IN, layout="constrained")
    left, right = figure.subplots(1, 2)
    model = operator()
    turns = (0.0, 0.72, 0.3, 0.58, 0.42, 0.9)
    u = through(turns)
    left.plot(np.linspace(0, len(turns) - 1, u.size), u, **MEASURED)
    left.plot(
        range(1, 5), turns[1:5], "o", color=VERMILION, markersize=6, fillstyle="none", label="wiped out"
    )
    left.plot([5], turns[5:], "o", color=VERMILION, markersize=6, label="kept", clip_on=False)
    left.set_xlabel("time")
    left.set_ylabel("input u")
    left.set_ylim(0, 1.12)
    left.legend(loc="upper left", ncols=2)
    left.set_title("Passing an extreme forgets it")
    y = model(u)
    straight = through((0.0, 0.9))
    right.plot(straight, model(straight), color=BLUE, linewidth=4, alpha=0.35, label="straight to 0.9")
    right.plot(u, y, **FINE, label="with the detour")
    right.set_xlabel("input u")
    right.set_ylabel("output y")
    right.legend(loc="upper left")
    right.set_title("Loops close, as if nothing had been")
    return figure


@styled
def inverse() -> Figure:
    """Return a wanted output, the input that the inverse finds, and what comes out with and without it."""
    figure = Figure(figsize=SIZE_IN, layout="constrained")
    left, right = figure.subplots(1, 2)
    model = operator()
    t = np.linspace(0, 2, 600)
    beat = np.exp(-(((t % 1) - 0.25) ** 2) / 0.012) + 0.45 * np.exp(-(((t % 1) - 0.52) ** 2) / 0.02)
    target = 0.1 + 0.75 * beat / beat.max()
    found = invert(model, target)
    scaled = target
    left.plot(t, target, **TARGET, label="wanted")
    left.plot(t, model(scaled), **SCALED, label="from the scaled input")
    left.plot(t, model(found.input), **COMPENSATED, label="from the inverse")
    left.set_ylim(0, 1.35)
    left.legend(loc="upper left")
    left.set_xlabel("time")
    left.set_ylabel("output y")
    left.set_title("What comes out")
    right.plot(scaled, target, **SCALED, label="scaled")
    right.plot(found.input, target, **COMPENSATED, label="inverse")
    right.set_xlabel("input u")
    right.set_ylabel("wanted output")
    right.legend(loc="upper left")
    right.set_title("The inverse is a loop too")
    return figure


def measured_steel() -> Figure:
    """Return the model of an electrical steel: a steep loop."""
    run = pt.read_table(
        DATA / "bh_steel_m130_27s_3.csv", input="u", output="y", input_unit="A/m", output_unit="T"
    )
    return model_figure(pt.identify(run))


def measured_damper() -> Figure:
    """Return the model of a damper, which is the wrong kind."""
    return model_figure(pt.identify(pt.read_table(DATA / "mrdamper_ensaio1_1.csv", input="u", output="y")))


FIGURES = {"plane": plane, "everett": everett, "wiping-out": wiping_out, "inverse": inverse}
MEASURED_FIGURES = {"measured-steel": measured_steel, "measured-damper": measured_damper}


def themed(svg: str) -> str:
    """Return a figure that is light on a light page and dark on a dark one, without a ground of its own."""
    names = {colour: f"--c{number}" for number, colour in enumerate(DARK)}
    for colour, name in names.items():
        svg = svg.replace(colour, f"var({name}, {colour})")
    dark = "; ".join(f"{names[colour]}: {other}" for colour, other in DARK.items())
    style = f"<style>@media (prefers-color-scheme: dark) {{ svg {{ {dark} }} }}</style>"
    at = svg.index(">", svg.index("<svg")) + 1
    return f"{svg[:at]}\n {style}{svg[at:]}".replace("fill: #ffffff", "fill: none")


def main() -> None:
    """Write every figure."""
    HERE.mkdir(exist_ok=True)
    for name, draw in (FIGURES | MEASURED_FIGURES).items():
        (HERE / f"{name}.svg").write_text(themed(encode(draw(), "svg").decode()), encoding="utf-8")
        print(f"wrote docs/figures/{name}.svg")
    for name, picture in pictures(json.loads(KEPT.read_text(encoding="utf-8"))).items():
        (HERE / name).write_text(picture, encoding="utf-8")
        print(f"wrote docs/figures/{name}")


if __name__ == "__main__":
    main()
