"""What the page shows, before it is a page: small frozen values, each number with its name.

A number keeps its full precision in ``value`` and its dotted name in ``metric``, for instance
``normal.continuous.scaled.max_abs_error_percent``, so that page and HDF5 can be held against each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from pulsetrainer.artefacts import Model, ModelEvaluation, WaveformEvaluation
from pulsetrainer.report import alternatives, figures, heat_figures
from pulsetrainer.report.names import NAMES, digits
from pulsetrainer.report.panels import largest_residual, scale, titled
from pulsetrainer.report.render import inline_svg
from pulsetrainer.report.style import label


@dataclass(frozen=True, slots=True)
class Number:
    """A number as it is printed, its value to the last digit, its name; or an empty place."""

    text: str
    value: str = ""
    metric: str = ""
    published: bool = False  # somebody else's: not of this evaluation


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure with its caption."""

    svg: Markup
    caption: str


@dataclass(frozen=True, slots=True)
class Part:
    """One part of the page: what it is about, facts, figures."""

    identifier: str
    title: str
    stem: str  # what the names of its figures begin with
    of: Any
    facts: tuple[tuple[str, Number], ...]
    pictures: tuple[Picture, ...]


def number(value: float | None, metric: str = "", form: str = "", *, published: bool = False) -> Number:
    """Return a number for the page, in a form or with its usual digits.

    NaN, the mean of nothing, is said in words; None is an empty place.
    """
    if value is None:
        return Number("")
    shown = format(value, form) if form else digits(value)
    text = shown.replace("-", "−") if math.isfinite(value) else "no value"
    return Number(text, repr(float(value)), metric, published)


def known(value: float | None, metric: str, form: str) -> Number:
    """Return a number for the page; an empty place where it was not measured."""
    return number(value if value is not None and math.isfinite(value) else None, metric, form)


def _count(value: int, metric: str) -> Number:
    return Number(str(value), str(value), metric)


def picture(figure: Figure, identifier: str, title: str, description: str, caption: str = "") -> Picture:
    """Return a figure for the page; the caption is the description where there is no other."""
    svg = inline_svg(figure, identifier=identifier, title=title, description=description)
    return Picture(Markup(svg), caption or description)  # noqa: S704 - our own XML, its texts are escaped


def metric(played: WaveformEvaluation, dotted: str, stem: str, form: str = "") -> Number:
    """Return a figure of a played waveform by its name within it: ``scaled.max_abs_error_percent``."""
    return number(attrgetter(dotted)(played), f"{stem}.{dotted}", form)


def beats(played: Sequence[WaveformEvaluation]) -> list[Picture]:
    """Return for each pulse one beat before and after, by all inversions that played it."""
    found = []
    for k, name in enumerate(dict.fromkeys(one.name for one in played), start=1):
        several = [one for one in played if one.name == name]
        found.append(
            picture(
                figures.methods(several),
                f"beat-{k}",
                f"One beat of {name} before and after",
                alternatives.methods(several),
                f"One beat of {name}, mean of the repeats: merely scaled, and compensated by each inversion; "
                "below, what each leaves.",
            )
        )
    return found


def waveform_part(played: WaveformEvaluation, stem: str, identifier: str) -> Part:
    """Return the part of the page about one played waveform."""
    title = titled(played)
    said = ("mean_error_reduction_percent", "noise_percent")
    full_force = number(played.full_force, f"{stem}.full_force", ".4g")
    pictures = [
        picture(
            figures.tracking(played),
            f"{identifier}-tracking",
            f"Force and error over time: {title}",
            alternatives.tracking(played),
            "Force with and without compensation, mean of the repeats; below, the error of each.",
        ),
        picture(
            figures.loops([played]),
            f"{identifier}-loops",
            f"Force against target: {title}",
            alternatives.loops(played),
            "Force against target over one beat. Hysteresis opens a loop; without it there is a line.",
        ),
    ]
    kelvin = played.temperature_K
    if kelvin is not None and kelvin.size:
        pictures.append(
            picture(
                heat_figures.of_playback(kelvin),
                f"{identifier}-temperature",
                f"Temperature of the coil: {title}",
                f"from {kelvin[0]:+.1f} K before the first repeat to {kelvin[-1]:+.1f} K before the last",
                "How much warmer the coil was than at calibration before each compensated repeat, as its "
                "duty told; the drive made up for the force that this costs.",
            )
        )
    facts = (
        *((str(NAMES[name]), metric(played, name, stem)) for name in said),
        (label("full force", played.output_unit), full_force),
        ("repeats", _count(played.repeats, f"{stem}.repeats")),
    )
    return Part(identifier, title, stem, played, facts, tuple(pictures))


def model_part(model: Model, which: str = "") -> Part:
    """Return the part of the page about the model; ``which`` says of what, where there are several."""
    fit = model.fit
    facts = [
        ("levels", _count(model.levels, "model.levels")),
        ("cells", _count(model.weights.size, "model.cells")),
        ("form", Number(model.form)),
        *([("loop", Number(fit.loop))] if fit and fit.loop else []),
        (label("offset", model.offset_unit), number(model.offset, "model.offset", ".4g")),
    ]
    beyond = "; orange lies beyond the scale." if scale(model)[1] == "max" else "."
    pictures = [
        picture(
            figures.preisach_density(model),
            "model-density",
            "Preisach density",
            alternatives.density(model),
            "The density over the levels at which relays switch up (α) and down (β). "
            f"The diagonal is the reversible part{beyond}",
        )
    ]
    if fit is not None:
        facts += [
            (name, number(getattr(fit, field), f"model.fit.{field}", form))
            for name, field, form in (
                (str(NAMES["coverage_percent"]), "coverage_percent", ".1f"),
                (label("rms error of the fit", model.output_unit), "rms", ".3g"),
                (str(NAMES["fit_rms_percent"]), "rms_percent", ".3g"),
            )
        ]
        pictures.append(
            picture(
                figures.identification(fit, model.input_quantity, model.output_quantity),
                "model-fit",
                "Measured and model",
                alternatives.identification(fit),
                "The run that the model was fitted to, measured and as the model has it, and what it leaves; "
                "the dotted lines are at plus and minus the rms.",
            )
        )
    return Part("model", f"Model{which}", "model", model, tuple(facts), tuple(pictures))


def predictions(models: Sequence[ModelEvaluation]) -> list[Picture]:
    """Return the figures of models on a held-out run."""
    reach = largest_residual(models)
    return [
        picture(
            figures.prediction(model, reach),
            f"prediction-{k}",
            f"Prediction by {model.name}",
            alternatives.prediction(model),
            f"{model.name} on the run; the dotted lines are at plus and minus the rms.",
        )
        for k, model in enumerate(models, start=1)
    ]
