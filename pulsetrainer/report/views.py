"""What the page shows, before it is a page: small frozen values, each number with its name.

A number keeps its full precision in ``value`` and its dotted name in ``metric``, for instance
``normal.continuous.scaled.max_abs_error_percent``, so that page and HDF5 can be held against each other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from markupsafe import Markup
from matplotlib.figure import Figure

from pulsetrainer.artefacts import Model, ModelEvaluation, WaveformEvaluation
from pulsetrainer.artefacts.evaluation import METRICS
from pulsetrainer.artefacts.units import shown
from pulsetrainer.report import alternatives, figures, heat_figures
from pulsetrainer.report.diagnosis_text import of_a_curve
from pulsetrainer.report.names import NAMES, OVERVIEW
from pulsetrainer.report.panels import largest_residual, scale
from pulsetrainer.report.render import inline_svg
from pulsetrainer.report.style import label

Published = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Number:
    """A number as it is printed, its value to the last digit, its name; or an empty place."""

    text: str
    value: str = ""
    metric: str = ""
    published: bool = False  # somebody else's: not of this evaluation


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a table: what it is about, in which unit or by which method, and its numbers."""

    name: str
    note: str
    cells: tuple[Number, ...]
    link: str = ""
    published: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure with its caption."""

    svg: Markup
    caption: str


@dataclass(frozen=True, slots=True)
class Section:
    """One part of the page: facts, a table, figures."""

    identifier: str
    title: str
    facts: tuple[tuple[str, Number], ...] = ()
    rows: tuple[Row, ...] = ()
    pictures: tuple[Picture, ...] = ()


@dataclass(frozen=True, slots=True)
class Readout:
    """The one number to see first of a played waveform."""

    title: str
    link: str
    reduction: Number
    scaled: Number
    compensated: Number


def number(value: float, metric: str = "", digits: str = ".2f", *, published: bool = False) -> Number:
    """Return a number for the page; NaN, the mean of nothing, is said in words."""
    text = format(value, digits).replace("-", "−") if math.isfinite(value) else "no value"
    return Number(text, repr(float(value)), metric, published)


def _count(value: int, metric: str = "") -> Number:
    return Number(str(value), str(value), metric)


def picture(figure: Figure, identifier: str, title: str, description: str, caption: str = "") -> Picture:
    """Return a figure for the page; the caption is the description where there is no other."""
    svg = inline_svg(figure, identifier=identifier, title=title, description=description)
    return Picture(Markup(svg), caption or description)  # noqa: S704 - our own XML, its texts are escaped


def _stem(played: WaveformEvaluation) -> str:
    return f"{played.name}.{played.inversion}"


def titled(played: WaveformEvaluation) -> str:
    """Return a pulse and the inversion that made its drive, in words."""
    return f"{played.name}, {played.inversion} inversion"


def _metric(played: WaveformEvaluation, dotted: str) -> Number:
    drive, _, field = dotted.rpartition(".")
    return number(
        float(getattr(getattr(played, drive) if drive else played, field)), f"{_stem(played)}.{dotted}"
    )


def readout(played: WaveformEvaluation, link: str) -> Readout:
    """Return what stands at the top of the page for one played waveform."""
    return Readout(
        titled(played),
        link,
        number(
            played.mean_error_reduction_percent, f"{_stem(played)}.mean_error_reduction_percent", digits=".1f"
        ),
        _metric(played, "scaled.mean_abs_error_percent"),
        _metric(played, "compensated.mean_abs_error_percent"),
    )


def overview(played: Sequence[tuple[WaveformEvaluation, str]], published: Published) -> tuple[Row, ...]:
    """Return one row per waveform and inversion, and below those of a waveform the published device.

    ``played`` holds each evaluation with the identifier of its section.
    """
    rows: list[Row] = []
    for name in dict.fromkeys(one.name for one, _ in played):
        rows += [
            Row(name, f"{one.inversion} inversion", tuple(_metric(one, dotted) for dotted in OVERVIEW), link)
            for one, link in played
            if one.name == name
        ]
        if name in published:
            known = published[name]
            cells = tuple(
                number(known[dotted], f"{name}.{dotted}", ".1f", published=True)
                if dotted in known
                else Number("")
                for dotted in OVERVIEW
            )
            rows.append(Row(name, "published device", cells, published=True))
    return tuple(rows)


def beats(played: Sequence[WaveformEvaluation]) -> tuple[Picture, ...]:
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
    return tuple(found)


def waveform_section(played: WaveformEvaluation, identifier: str) -> Section:
    """Return the part of the page about one played waveform."""
    stem, title = _stem(played), titled(played)
    return Section(
        identifier,
        title,
        facts=(
            (str(NAMES["mean_error_reduction_percent"]), _metric(played, "mean_error_reduction_percent")),
            (str(NAMES["noise_percent"]), _metric(played, "noise_percent")),
            (
                label("full force", played.output_unit),
                number(played.full_force, f"{stem}.full_force", ".4g"),
            ),
            ("repeats", _count(played.repeats, f"{stem}.repeats")),
        ),
        rows=tuple(
            Row(
                *NAMES[field],
                tuple(_metric(played, f"{drive}.{field}") for drive in ("scaled", "compensated")),
            )
            for field in METRICS
        ),
        pictures=(
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
            *_temperature(played, identifier),
        ),
    )


def _temperature(played: WaveformEvaluation, identifier: str) -> list[Picture]:
    """Return the figure of the coil's temperature, where the play told it."""
    kelvin = played.temperature_K
    if kelvin is None or not kelvin.size:
        return []
    return [
        picture(
            heat_figures.of_playback(kelvin),
            f"{identifier}-temperature",
            f"Temperature of the coil: {titled(played)}",
            f"from {kelvin[0]:+.1f} K before the first repeat to {kelvin[-1]:+.1f} K before the last",
            "How much warmer the coil was than at calibration before each compensated repeat, as its duty "
            "told; the drive made up for the force that this costs.",
        )
    ]


def model_section(model: Model, which: str = "") -> Section:
    """Return the part of the page about the model; ``which`` says of what, where there are several."""
    facts = [
        ("levels", _count(model.edges.size - 1, "model.levels")),
        ("cells", _count(model.weights.size, "model.cells")),
        ("form", Number(model.form)),
        *([("loop", Number(model.fit.loop))] if model.fit and model.fit.loop else []),
        (label("offset", model.offset_unit), number(model.offset, "model.offset", ".4g")),
    ]
    pictures = [
        picture(
            figures.preisach_density(model),
            "model-density",
            "Preisach density",
            alternatives.density(model),
            "The density over the levels at which relays switch up (α) and down (β). "
            "The diagonal is the reversible part"
            + ("; orange lies beyond the scale." if scale(model)[1] == "max" else "."),
        )
    ]
    if model.fit is not None:
        facts += [
            (
                str(NAMES["coverage_percent"]),
                number(model.fit.coverage_percent, "model.fit.coverage_percent", ".1f"),
            ),
            (label("rms error of the fit", model.output_unit), number(model.fit.rms, "model.fit.rms", ".3g")),
            (str(NAMES["fit_rms_percent"]), number(model.fit.rms_percent, "model.fit.rms_percent", ".3g")),
        ]
        pictures.append(
            picture(
                figures.identification(model.fit, model.input_quantity, model.output_quantity),
                "model-fit",
                "Measured and model",
                alternatives.identification(model.fit),
                "The run that the model was fitted to, measured and as the model has it, and what it leaves; "
                "the dotted lines are at plus and minus the rms.",
            )
        )
    rows = tuple(
        Row(
            f"{extension.cause}: {parameter.name}" + (f", {parameter.meaning}" if parameter.meaning else ""),
            shown(parameter.unit),
            tuple(
                number(value, f"model.{extension.cause}.{parameter.name}{suffix}", ".4g")
                for value, suffix in (
                    (parameter.value, ""),
                    (parameter.lower, ".lower"),
                    (parameter.upper, ".upper"),
                )
            ),
        )
        for extension in model.extensions
        for parameter in extension.parameters
        if not of_a_curve(parameter)
    )
    return Section("model", f"Model{which}", tuple(facts), rows, tuple(pictures))


def prediction_section(models: Sequence[ModelEvaluation]) -> Section:
    """Return the part of the page about models on a held-out run."""
    rows, pictures = [], []
    reach = largest_residual(models)
    for k, model in enumerate(models, start=1):
        stem = PurePath(model.name).stem
        cells = [
            number(model.rms, f"{stem}.rms", ".4g"),
            number(model.rms_percent, f"{stem}.rms_percent", ".3f"),
            number(model.max_percent, f"{stem}.max_percent"),
        ]
        if len(models) > 1:
            cells.append(number(model.gain_percent, f"{stem}.gain_percent", ".1f"))
        rows.append(Row(model.name, shown(model.output_unit), tuple(cells)))
        pictures.append(
            picture(
                figures.prediction(model, reach),
                f"prediction-{k}",
                f"Prediction by {model.name}",
                alternatives.prediction(model),
                f"{model.name} on the run; the dotted lines are at plus and minus the rms.",
            )
        )
    return Section("prediction", "Prediction of the run", (), tuple(rows), tuple(pictures))
