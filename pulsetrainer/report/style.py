"""How figures look: one palette, one set of settings, for paper, screen and dark screen alike.

Series are told apart by line as well as by colour, so that a grey print and a colour-blind
reader lose nothing. The hues are of Okabe and Ito's palette (2008). Each colour used here has a name in
``THEME``: an inline SVG gets the name instead of the value, and the page decides by its theme.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, Final, ParamSpec

from matplotlib import rc_context
from matplotlib.figure import Figure

from pulsetrainer.artefacts.units import shown

P = ParamSpec("P")

INK: Final = "#1b1f24"
MUTED: Final = "#6b7480"
GRID: Final = "#d9dde1"
BLUE: Final = "#0072b2"  # what the project adds: compensated drive, model
VERMILION: Final = "#d55e00"  # what it is compared with: scaled drive, error
GREEN: Final = "#00805f"  # a third series

THEME: Final[dict[str, str]] = {
    INK: "currentColor",
    MUTED: "var(--muted, #6b7480)",
    GRID: "var(--grid, #d9dde1)",
    BLUE: "var(--blue, #0072b2)",
    VERMILION: "var(--vermilion, #d55e00)",
    GREEN: "var(--green, #00805f)",
}

# One column of the report: 10 pt text stays readable when a phone shows the figure 360 px wide.
COLUMN_IN: Final = 5.2

# One way of drawing per role: the same thing looks the same in every figure.
MEASURED: Final[dict[str, Any]] = {"color": INK, "linewidth": 1.1}
TARGET: Final[dict[str, Any]] = {"color": INK, "linewidth": 2.2, "alpha": 0.45}
# what a model is laid upon, and the model: broad and narrow, so that both are seen where they agree
GROUND: Final[dict[str, Any]] = {"color": INK, "linewidth": 2.0, "alpha": 0.45}
MODEL: Final[dict[str, Any]] = {"color": BLUE, "linewidth": 0.7}
FINE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.6}
COMPENSATED: Final[dict[str, Any]] = {"color": BLUE, "linewidth": 1.3}
SCALED: Final[dict[str, Any]] = {"color": VERMILION, "linewidth": 1.3, "linestyle": (0, (4, 1.5))}
# several methods in one figure, each by line and colour
METHODS: Final[tuple[dict[str, Any], ...]] = (
    {"color": BLUE, "linewidth": 1.3},
    {"color": GREEN, "linewidth": 1.3, "linestyle": (0, (6, 1.2, 1.2, 1.2))},
    {"color": INK, "linewidth": 1.1, "linestyle": (0, (1.2, 1.0))},
    {"color": MUTED, "linewidth": 1.3, "linestyle": (0, (7, 2))},
)
ERROR: Final[dict[str, Any]] = {"color": VERMILION, "linewidth": 0.9}
GUIDE: Final[dict[str, Any]] = {"color": MUTED, "linewidth": 0.9, "linestyle": (0, (1, 2))}

# Any: newer stubs of matplotlib name every key, older ones take any text
SETTINGS: Final[Any] = {
    "font.family": "sans-serif",
    "font.size": 10.0,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "figure.titlesize": 11.5,
    "figure.titleweight": "bold",
    "text.parse_math": False,  # a file name with two dollars is a file name
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.facecolor": "none",
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.xmargin": 0.01,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 4),  # 0.002, not 2 and far from it 1e-3; but labels of 70000 would touch
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "legend.frameon": False,
    "legend.fontsize": 10.0,
    "legend.handlelength": 2.4,
    "lines.solid_capstyle": "round",
    "figure.constrained_layout.w_pad": 0.07,
    "figure.constrained_layout.h_pad": 0.06,
    "path.simplify": True,
    "hatch.linewidth": 0.6,
    "svg.fonttype": "none",  # text stays text: selectable, searchable, in the reader's colours
    "svg.hashsalt": "pulsetrainer",  # the same figure is the same bytes
}


def styled(drawing: Callable[P, Figure]) -> Callable[P, Figure]:
    """Decorate a function that draws: it draws in the house style and leaves matplotlib's settings alone."""

    @wraps(drawing)
    def in_style(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with rc_context(SETTINGS):
            drawn = drawing(*args, **kwargs)
            drawn.align_ylabels()  # of panels one below the other
            return drawn

    return in_style


def label(quantity: str, unit: str) -> str:
    """Return an axis label: the quantity, and the unit in brackets where there is one."""
    printed = shown(unit)
    return f"{quantity} [{printed}]" if printed else quantity
