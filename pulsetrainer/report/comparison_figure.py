"""The figure of a comparison: a panel per metric, a line per pulse and inversion, a place per evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pulsetrainer.artefacts.evaluation import HEADLINES
from pulsetrainer.report.names import split
from pulsetrainer.report.style import BLUE, COLUMN_IN, GREEN, INK, VERMILION, styled

_PANEL_IN = 2.3
_SHOWN = tuple(one for one in HEADLINES if one not in ("right_from_percent", "right_to_percent"))
# one more than there are colours: twenty lines before two look alike
_LINES = (("-", "o"), ("--", "s"), (":", "^"), ("-.", "D"), ((0, (8, 2)), "v"))


@styled
def draw(labels: Sequence[str], values: Mapping[str, Sequence[float | None]]) -> Figure:
    """Return one panel for each of the headline metrics that are there, evaluations from left to right."""
    panels: dict[str, dict[str, Sequence[float | None]]] = {}
    for name, row in values.items():
        for metric in _SHOWN:
            if name.endswith(f".{metric}"):
                panels.setdefault(metric, {})[name.removesuffix(f".{metric}")] = row
    figure = Figure(figsize=(COLUMN_IN, 0.6 + _PANEL_IN * len(panels)), layout="constrained")
    axes_of = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    place = np.arange(len(labels))
    learners = any(name.startswith(("session.", "quiz.")) for name in values)
    for axes, (metric, rows) in zip(axes_of, panels.items(), strict=True):
        colours, lines = cycle((BLUE, VERMILION, GREEN, INK)), cycle(_LINES)
        for stem, row in rows.items():
            line, marker = next(lines)
            known = np.asarray([np.nan if v is None else v for v in row], dtype=np.float64)
            look = {"color": next(colours), "linestyle": line, "marker": marker, "markersize": 4}
            if learners:  # between two learners there is nothing: points, no line
                look |= {"linestyle": "none", "clip_on": False}  # the axis would halve a point at 0 %
                ends = [f"{stem}.{metric.replace('_percent', f'_{end}_percent')}" for end in ("from", "to")]
                if all(end in values for end in ends):
                    interval = np.asarray([values[end] for end in ends], dtype=np.float64)
                    axes.vlines(place, *interval, color=look["color"], linewidth=1.2)
            axes.plot(place, known, **look, label=stem)
        title = str(split(metric)[1])
        axes.set_title(f"{title}, 95 % interval" if metric == "right_percent" else title)
        upper = values.get("quiz.right_to_percent", ()) if metric == "right_percent" else ()
        within = [*rows.values(), upper]
        sizes = [v for row in within for v in row if v is not None and np.isfinite(v)]
        low, top = min(sizes, default=0.0), max(sizes, default=0.0)
        axes.set_ylim(min(1.1 * low, 0.0), 1.1 * top if top > 0 else 0.1 * abs(low) or 1.0)
        axes.yaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 2.5, 5, 10)))
        axes.margins(x=0.08)
    if not learners:
        axes_of[0].legend(loc="best")
    upright = max(map(len, labels), default=0) * len(labels) <= 60
    axes_of[-1].set_xticks(place, labels, rotation=0 if upright else 30, ha="center" if upright else "right")
    return figure
