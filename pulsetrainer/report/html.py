"""The report: one HTML page that needs nothing but itself, for a screen, a phone and paper."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import PurePath
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from pulsetrainer.artefacts import Evaluation
from pulsetrainer.artefacts.evaluation import PUBLISHED
from pulsetrainer.report import views

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
    evaluation: Evaluation, *, published: views.Published = PUBLISHED, **header: Any
) -> str:
    """Return the report of an evaluation; ``header`` as in ``page``.

    Beside its figures stand those of a ``published`` device by waveform: ``mean_error_reduction_percent``,
    ``scaled.max_abs_error_percent`` and so on.
    """
    played = [(one, f"waveform-{k}") for k, one in enumerate(evaluation.waveforms, start=1)]
    several = len({(one.name, one.inversion) for one in evaluation.waveforms}) > 1
    # whose model the evaluation holds: that of the last
    last = f" of {views.titled(evaluation.waveforms[-1])}" if several else ""
    if len(evaluation.models) > 1:
        last = f" {PurePath(evaluation.models[-1].name).stem}"
    return page(
        "evaluation.html.j2",
        **header,
        readouts=[views.readout(one, identifier) for one, identifier in played],
        overview=views.overview(played, published),
        compared=any(one.name in published for one, _ in played),
        warning=evaluation.model.fit.warning if evaluation.model and evaluation.model.fit else "",
        beats=views.beats(evaluation.waveforms),
        model=None if evaluation.model is None else views.model_section(evaluation.model, last),
        waveforms=[views.waveform_section(one, identifier) for one, identifier in played],
        prediction=views.prediction_section(evaluation.models) if evaluation.models else None,
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
    made.filters["unbroken"] = unbroken
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
