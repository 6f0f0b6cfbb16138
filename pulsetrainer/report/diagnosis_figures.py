"""The figures of a diagnosis: measured against model, where the residual is, and the ranking of causes."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, StrMethodFormatter

from pulsetrainer.artefacts import Cause, Dependence, Diagnosis, FloatArray, Profile
from pulsetrainer.core.plane import BoolArray
from pulsetrainer.report import panels
from pulsetrainer.report.diagnosis_text import answer, beside, explains, in_doubt
from pulsetrainer.report.style import (
    BLUE,
    COLUMN_IN,
    ERROR,
    GREEN,
    GROUND,
    GUIDE,
    MODEL,
    MUTED,
    VERMILION,
    label,
    styled,
)

_MOST_BARS = 10
SEEN = 0.05  # % that a cause explains: less reads 0.0
_WHOLE = 100.0 + 1e-9  # %
_SHADES = {"yes": BLUE, "in doubt": GREEN, "no": MUTED}
_MANY = 1.5  # decades: over fewer, an even scale shows more
_REST = 1e-9  # of the highest speed: less is the rounding of a rest
_LABEL = 40  # letters that fit below such a figure
_SMALL_IN = 0.68 * COLUMN_IN  # three of them stand side by side


@styled
def course(found: Diagnosis) -> Figure:
    """Return the measured output with the static model, and the residuals before and after extension."""
    figure = Figure(figsize=(COLUMN_IN, 4.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.3, 1.0))
    _drawn(above, found, found.output, **GROUND, label="measured")
    _drawn(above, found, found.before, **MODEL, label="model, fitted anew")
    above.set_ylabel(label(found.output_quantity or panels.quantity_of(found.output_unit), found.output_unit))
    sure, doubted = beside(found)
    named = found.verdict in [one.cause for one in found.found]
    verdict = ", ".join([found.verdict, *sure]) if named else found.verdict
    how = " (quick screen)" if found.quick else " (in doubt)" if in_doubt(found) else ""
    more = f"; in doubt: {', '.join(doubted)}" if named and doubted else ""
    above.set_title(f"Verdict: {verdict}{how}{more}", wrap=True)
    panels.headroom(above)
    _drawn(below, found, found.output - found.before, **ERROR, label="without causes")
    if found.extended_percent < found.static_percent:
        _drawn(below, found, found.output - found.after, **MODEL, label="with them")
    below.axhline(0.0, **GUIDE)
    below.set_ylabel(label("measured − model", found.output_unit))
    several = "" if len(found.records) == 1 else ", recordings one after another"
    panels.name_abscissa(below, panels.SAMPLE_NUMBER if _timeless(found) else "time", several)
    panels.headroom(below)
    return figure


def _drawn(axes: Axes, found: Diagnosis, values: FloatArray, **style: Any) -> None:
    """Draw values (n,) over the time: no line goes from one recording to the next."""
    begins = np.searchsorted(found.time_s, [one.begin_s for one in found.records[1:]])
    times = np.insert(found.time_s, begins, found.time_s[np.minimum(begins, values.size - 1)])
    panels.trace(axes, times, np.insert(values, begins, np.nan), **style)


def _timeless(found: Diagnosis) -> bool:
    """Tell whether the recordings have no time: what stands for it counts their samples."""
    return bool(found.records) and all(np.isnan(one.step_s) for one in found.records)


def profiles(found: Diagnosis) -> list[Profile]:
    """Return the profiles of two groups or more; of records without time none that needs it."""
    kept = [one for one in found.profiles if one.name == "level" or not _timeless(found)]
    return [one for one in kept if np.count_nonzero(np.isfinite(one.before)) > 1]


@styled
def profile(one: Profile, input_quantity: str, *, extended: bool) -> Figure:
    """Return the rms error against one quantity, before the extension and, where there is one, after."""
    figure = Figure(figsize=(_SMALL_IN, 2.6), layout="constrained")
    axes = figure.add_subplot()
    known = np.isfinite(one.before)
    # between two directions there is nothing: no line joins them
    joined, size = ("", 6) if one.name == "direction" else ("-", 3)
    for values, marker, color, name in (
        (one.before, "o", VERMILION, "without causes"),
        (one.after, "s", BLUE, "with them"),
    )[: 1 + extended]:
        axes.plot(one.at[known], values[known], marker + joined, color=color, markersize=size, label=name)
    if one.name == "frequency" or (one.name == "rate" and _decades(one.at) > _MANY):
        moving = float(np.abs(one.at[_moves(one.at)]).min(initial=np.inf))
        axes.set_xscale("log") if one.name == "frequency" else axes.set_xscale("symlog", linthresh=moving)
        if one.name == "rate":  # where the axis is linear, a tick would touch that of zero
            ends = axes.get_xlim()
            axes.set_xticks([x for x in axes.get_xticks() if x == 0 or abs(x) >= moving])
            axes.set_xlim(ends)
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))  # powers of ten would need mathtext
        axes.xaxis.set_minor_formatter(NullFormatter())
    if one.name == "direction":
        axes.set_xticks([-1, 0, 1], ["falling", "rest", "rising"])
        axes.margins(x=0.08)
    axes.set(xlabel=_folded(axis_of(one, input_quantity)), ylabel=label("rms error left", one.output_unit))
    axes.set_ylim(bottom=0.0)
    panels.headroom(axes)
    if one.name == "time":
        panels.name_abscissa(axes)
    return figure


def _decades(at: FloatArray) -> float:
    """Return over how many decades values other than zero are spread."""
    sizes = np.abs(at[_moves(at)])
    return float(np.log10(sizes.max() / sizes.min())) if sizes.size else 0.0


def _moves(at: FloatArray) -> BoolArray:
    """Tell which speeds (n,) are more than rounding of a rest."""
    return np.abs(at) > _REST * np.nanmax(np.abs(at), initial=0.0)


def _folded(text: str) -> str:
    """Return a label in lines that fit below a small figure, its unit on the last one."""
    if len(text) <= _LABEL:
        return text
    name, bracket, unit = text.partition(" [")
    return "\n".join([*textwrap.wrap(name, _LABEL), bracket.strip() + unit])


def axis_of(one: Profile, input_quantity: str = "") -> str:
    """Return what a profile is drawn over: the quantity, and its unit."""
    name = input_quantity or panels.quantity_of(one.unit if one.name == "level" else "", "input")
    known = {
        "rate": label(f"speed of the {name}", "of its range, per s"),
        "direction": f"direction of the {name}",
        "level": label(name, one.unit),
        "frequency": label("frequency of the error", one.unit),
        "time": "time",  # its unit is that of the axis
    }
    return known.get(one.name, label(one.name, one.unit))


@styled
def dependence(one: Dependence, output_quantity: str = "") -> Figure:
    """Return what a learned dependence adds to the output, with its 95 % band."""
    figure = Figure(figsize=(_SMALL_IN, 2.6), layout="constrained")
    axes = figure.add_subplot()
    low, high = one.value - one.half, one.value + one.half
    axes.fill_between(one.at, low, high, color=BLUE, alpha=0.2, linewidth=0, label="95 %")
    axes.plot(one.at, one.value, color=BLUE, label="learned")
    axes.axhline(0.0, **GUIDE)
    axes.set_xlabel(label(one.state, one.unit), wrap=True)
    panels.headroom(axes)
    of = "gain" if one.output_unit == "%" else output_quantity or panels.quantity_of(one.output_unit)
    axes.set_ylabel(label(f"change of the {of}", one.output_unit))
    return figure


def ranked(found: Diagnosis) -> list[Cause]:
    """Return the causes that have a share to draw: each that was found, and others that explain something."""
    shares = [(explains(one, found), one) for one in found.causes]
    return [one for share, one in shares if share >= (0.0 if one.found else SEEN)][:_MOST_BARS]


@styled
def ranking(found: Diagnosis) -> Figure:
    """Return how much of the error beyond noise each cause explains, whether it was found, and why not."""
    shown = ranked(found)[::-1]
    figure = Figure(figsize=(COLUMN_IN, 1.0 + 0.34 * max(len(shown), 1)), layout="constrained")
    axes = figure.add_subplot()
    share = [max(one.explains_percent, 1e-3) for one in shown]
    answers = [answer(one, found) for one in shown]
    shades = [_SHADES[said.partition(":")[0]] for said in answers]
    bars = axes.barh([one.cause for one in shown], share, color=shades, height=0.62)
    axes.bar_label(bars, answers, padding=4, fontsize=8.5)
    axes.set_xlim(0.0, 1.7 * max([*share, 1.0]))  # room for the words beside the bars
    ticks = axes.get_xticks()
    ends = max((tick for tick in ticks if tick <= _WHOLE), default=0.0)  # but no share over 100 %
    axes.set_xticks([tick for tick in ticks if tick <= ends])
    axes.spines["bottom"].set_bounds(0.0, ends)
    axes.set_title("Causes, and whether each was found")
    axes.set_xlabel("explains [% of the squared error beyond noise]", loc="left")
    axes.grid(visible=False, axis="y")
    return figure
