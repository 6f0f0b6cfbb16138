"""The report: one HTML page that needs nothing but itself, for a screen, a phone and paper.

What the pages say, and which figures they show, is in the templates. A number keeps its full precision in
``value`` and its dotted name in ``metric``, for instance ``normal.continuous.scaled.max_abs_error_percent``,
so that page and HDF5 can be held against each other.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import attrgetter
from pathlib import PurePath
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from pulsetrainer.artefacts import Evaluation, FloatArray, Model, ModelEvaluation, WaveformEvaluation
from pulsetrainer.artefacts.evaluation import METRICS, PUBLISHED
from pulsetrainer.artefacts.units import shown
from pulsetrainer.report import diagnosis_figures, figures, panels, session_figures
from pulsetrainer.report.diagnosis_text import of_a_curve
from pulsetrainer.report.facts import loop_drawn
from pulsetrainer.report.names import NAMES, OVERVIEW, beyond_rounding, digits
from pulsetrainer.report.render import inline_svg
from pulsetrainer.report.results import worse
from pulsetrainer.report.style import label

_UNIT = re.compile(r"(?<=\d) (?=%|[A-Za-z]{1,2}\b)")
_OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


@dataclass(frozen=True, slots=True)
class Number:
    """A number as it is printed, its value to the last digit, its name; or an empty place."""

    text: str
    value: str = ""
    metric: str = ""
    published: bool = False  # somebody else's: not of this evaluation


def number(value: float | None, metric: str = "", form: str = "", *, published: bool = False) -> Number:
    """Return a number for the page, in a form or with its usual digits.

    NaN, the mean of nothing, is said in words; None is an empty place.
    """
    if value is None:
        return Number("")
    # "#" keeps zeros at the end: 13.50 beside 13.51
    printed = (
        format(value, f"#{form}" if form.endswith("g") else form).removesuffix(".") if form else digits(value)
    )
    text = printed.replace("-", "−") if math.isfinite(value) else "no value"
    return Number(text, repr(float(value)), metric, published)


def known(value: float | None, metric: str, form: str) -> Number:
    """Return a number for the page; an empty place where it was not measured."""
    return number(value if value is not None and math.isfinite(value) else None, metric, form)


def offset(predicted: ModelEvaluation, metric: str) -> Number:
    """Return the offset of a run against a model for the page, an empty place in files that have none.

    Its metric is no model's ``offset``: a file may be called model.h5.
    """
    found = known(predicted.offset, metric, ".3g")
    return found if beyond_rounding(predicted.offset, predicted.rms) else replace(found, text="0")


def count(value: int, metric: str) -> Number:
    """Return a whole number for the page."""
    return Number(str(value), str(value), metric)


def metric(played: WaveformEvaluation, dotted: str, stem: str, form: str = "") -> Number:
    """Return a figure of a played waveform by its name within it: ``scaled.max_abs_error_percent``."""
    return number(attrgetter(dotted)(played), f"{stem}.{dotted}", form)


def picture(figure: Figure, identifier: str, title: str, words: Markup) -> Markup:
    """Return a figure for the page, ``words`` its text alternative."""
    description = words.unescape()
    svg = inline_svg(figure, identifier=identifier, title=title, description=description)
    return Markup(svg)  # noqa: S704 - our own XML, its texts are escaped


def reach(values: FloatArray, unit: str) -> str:
    """Return from where to where values (n,) go, in words."""
    there = values[np.isfinite(values)]
    if there.size == 0:
        return "without a single value"
    return f"from {there.min():.3g} to {there.max():.3g} {shown(unit)}".rstrip()


def densest(model: Model) -> tuple[float, float, float] | None:
    """Return the largest density off the diagonal, and where relays switch up and down; None: nothing."""
    i, j = np.tril_indices(model.levels)
    off_diagonal = np.where((i != j) & model.covered, model.weights, 0.0)
    k = int(np.argmax(off_diagonal))
    if off_diagonal[k] <= 0:
        return None
    up, down = (float(model.edges[at : at + 2].mean()) for at in (i[k], j[k]))
    return float(off_diagonal[k]), up, down


def page(template: str, *, provenance_json: str, history: Sequence[str] = (), **content: Any) -> str:
    """Return one self-contained HTML page with its content and what the header of an artefact says of it.

    Of the header ``title`` and ``created`` are wanted too.
    """
    provenance, version = _made_by(provenance_json)
    rendered = environment().get_template(template).render
    return rendered(provenance=provenance, version=version, history=history, **content)


def render_evaluation(
    evaluation: Evaluation, *, published: Mapping[str, Mapping[str, float]] = PUBLISHED, **header: Any
) -> str:
    """Return the report of an evaluation; ``header`` as in ``page``.

    Beside its figures stand those of a ``published`` device by waveform: ``mean_error_reduction_percent``,
    ``scaled.max_abs_error_percent`` and so on.
    """
    evaluation = evaluation.told_apart()
    played = evaluation.waveforms
    # whose model the evaluation holds: that of the last
    last = f" of {panels.titled(played[-1])}" if len(set(map(panels.titled, played))) > 1 else ""
    if len(evaluation.models) > 1:
        last = f" {PurePath(evaluation.models[-1].name).stem}"
    pulses = [one.name for one in played]
    return page(
        "evaluation.html.j2",
        **header,
        waveforms=sorted(
            (
                (f"waveform-{k}", one, stem)
                for k, (one, stem) in enumerate(zip(played, evaluation.stems, strict=False), start=1)
            ),
            key=lambda part: pulses.index(part[1].name),  # those of a pulse together, as in the table
        ),
        inversions=panels.inversions(played),
        published=published,
        model=evaluation.model,
        model_title=f"Model{last}",
        predicted=evaluation.models,
        model_stems=evaluation.stems[len(played) :],
        worse=worse(evaluation),
        warnings=evaluation.warnings,
    )


@lru_cache(maxsize=1)
def environment() -> Environment:
    """Return the template environment of the reports."""
    made = Environment(
        loader=PackageLoader("pulsetrainer.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {"unbroken": unbroken, "unit": shown, "digits": format, "rounded": digits}
    made.tests["of_a_curve"] = of_a_curve
    made.globals |= {"NAMES": NAMES, "OVERVIEW": OVERVIEW, "METRICS": METRICS, "Number": Number}
    for tool in (number, known, offset, count, metric, picture, reach, densest, label, loop_drawn):
        made.globals[tool.__name__] = tool
    for drawing in (figures, diagnosis_figures, session_figures, panels):
        made.globals[drawing.__name__.rpartition(".")[2]] = drawing
    return made


def unbroken(text: str) -> Markup:
    """Return a text in which no line breaks within an option or between a number and its unit.

    Markup stays markup. The dashes stay as they are typed, so that an option can be copied.
    """
    joined = _UNIT.sub("\N{NO-BREAK SPACE}", str(escape(text)))
    return Markup(_OPTION.sub(r'<span class="option">\g<0></span>', joined))  # noqa: S704 escaped above


def _made_by(text: str) -> tuple[str, str]:
    """Return JSON in lines for a reader, and the version of the program in it; what is not JSON as it is."""
    try:
        read = json.loads(text)
    except ValueError:
        return text, ""
    version = read.get("version", "") if isinstance(read, dict) else ""
    return json.dumps(read, indent=2, ensure_ascii=False), version
