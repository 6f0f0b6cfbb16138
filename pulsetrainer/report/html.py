"""The report: one HTML page that needs nothing but itself, for a screen, a phone and paper."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import PurePath
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from pulsetrainer.artefacts import Evaluation
from pulsetrainer.artefacts.evaluation import METRICS, PUBLISHED
from pulsetrainer.artefacts.units import shown
from pulsetrainer.report import views
from pulsetrainer.report.diagnosis_text import of_a_curve
from pulsetrainer.report.names import NAMES, OVERVIEW
from pulsetrainer.report.panels import titled

_UNIT = re.compile(r"(?<=\d) (?=%|[A-Za-z]{1,2}\b)")


def page(
    template: str,
    *,
    title: str,
    created: str,
    provenance_json: str,
    history: Sequence[str] = (),
    **content: Any,
) -> str:
    """Return one self-contained HTML page with its content and what the header of an artefact says of it."""
    return (
        environment()
        .get_template(template)
        .render(
            title=title,
            created=created,
            provenance=indented(provenance_json),
            history=tuple(history),
            **content,
        )
    )


def render_evaluation(
    evaluation: Evaluation, *, published: Mapping[str, Mapping[str, float]] = PUBLISHED, **header: Any
) -> str:
    """Return the report of an evaluation; ``header`` as in ``page``.

    Beside its figures stand those of a ``published`` device by waveform: ``mean_error_reduction_percent``,
    ``scaled.max_abs_error_percent`` and so on.
    """
    played = evaluation.waveforms
    # whose model the evaluation holds: that of the last
    last = f" of {titled(played[-1])}" if len(set(map(titled, played))) > 1 else ""
    if len(evaluation.models) > 1:
        last = f" {PurePath(evaluation.models[-1].name).stem}"
    return page(
        "evaluation.html.j2",
        **header,
        waveforms=[
            views.waveform_part(one, stem, f"waveform-{k}")
            for k, (one, stem) in enumerate(zip(played, evaluation.stems, strict=False), start=1)
        ],
        published=published,
        beats=views.beats(played),
        model=None if evaluation.model is None else views.model_part(evaluation.model, last),
        predicted=evaluation.models,
        model_stems=evaluation.stems[len(played) :],
        predictions=views.predictions(evaluation.models),
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
    made.filters |= {"unbroken": unbroken, "unit": shown}
    made.tests["of_a_curve"] = of_a_curve
    made.globals |= {"NAMES": NAMES, "OVERVIEW": OVERVIEW, "METRICS": METRICS}
    made.globals |= {"number": views.number, "known": views.known, "metric": views.metric}
    return made


def unbroken(text: str) -> str:
    """Return a text in which no line breaks between a number and its unit."""
    return _UNIT.sub("\N{NO-BREAK SPACE}", text)


def indented(text: str) -> str:
    """Return JSON in lines for a reader; what is not JSON is shown as it is."""
    try:
        return json.dumps(json.loads(text), indent=2, ensure_ascii=False)
    except ValueError:
        return text
