"""The report of a diagnosis as one self-contained HTML page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from pulsetrainer.report import diagnosis_figures as figures
from pulsetrainer.report.diagnosis_text import COLUMNS, ERRORS, answer, parameters, stands
from pulsetrainer.report.html import environment, indented
from pulsetrainer.report.render import inline_svg
from pulsetrainer.report.views import Number, Picture, number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from pulsetrainer.artefacts import Cause, Diagnosis


def render_diagnosis(
    found: Diagnosis, *, title: str, created: str, provenance_json: str, history: Sequence[str] = ()
) -> str:
    """Return the report of a diagnosis.

    Parameters
    ----------
    found
        The diagnosis.
    title, created, provenance_json, history
        From the header of the artefact.

    """
    shown = [*found.found, *[one for one in found.causes if not one.found and one.explains_percent > 0]][:12]
    return (
        environment()
        .get_template("diagnosis.html.j2")
        .render(
            title=title,
            created=created,
            provenance=indented(provenance_json),
            history=tuple(history),
            found=found,
            headline=headline(found),
            named=[_words(one) for one in found.found],
            levels=_levels(found),
            rows=[_row(one, quick=found.quick) for one in shown],
            columns=COLUMNS,
            course=_course(found),
            profiles=[*_dependences(found), *_profiles(found)],
            ranking=_ranking(found),
        )
    )


def headline(found: Diagnosis) -> str:
    """Return the verdict as one sentence for a technician."""
    if found.verdict == "none":
        limits = ", but they could not have shown everything: see what they lack" if found.lacks else ""
        return f"These runs show nothing wrong with the model{limits}."
    if found.verdict == "inconclusive":
        return "Nothing was found, but these runs could not have shown everything that is common."
    if found.verdict == "unknown":
        return "Something is wrong that no known cause explains."
    cause = next(one for one in found.causes if one.cause == found.verdict)
    also = [one.text for one in found.found if one.cause != found.verdict]
    words = f"{cause.text[:1].upper()}{cause.text[1:]}"
    tied = f" (could equally be {' or '.join(cause.confounded_with)})" if cause.confounded_with else ""
    rest = "" if found.left.whole else ". That explains only a part: something else is left"
    return f"{words}{tied}{'; in addition, ' + '; '.join(also) if also else ''}{rest}."


def _words(one: Cause) -> dict[str, Any]:
    doubt = f" In doubt: {'; '.join(one.doubts)}." if one.doubts else ""
    return {
        "id": one.cause,
        "text": f"{one.text[:1].upper()}{one.text[1:]}{doubt}",
        "parameters": parameters(one.parameters),
        "tied": ", ".join(one.confounded_with),
    }


def _levels(found: Diagnosis) -> list[tuple[str, list[Number]]]:
    """Return the table of errors: words, then of single samples and of averages."""
    return [
        (words, [_number(getattr(found, name), name, ".3f") if name else Number("") for name in fields])
        for words, *fields in ERRORS
        if stands(found, fields)
    ]


def _number(value: float, metric: str, digits: str) -> Number:
    return number(value, metric, digits) if math.isfinite(value) else Number("")


def _row(one: Cause, *, quick: bool) -> dict[str, str | Number]:
    gain = one.held_out_gain_percent if one.found else float("nan")
    return {
        "id": one.cause,
        "found": answer(one, quick=quick),
        "explains": number(one.explains_percent, f"{one.cause}.explains_percent", ".1f"),
        "gain": _number(gain, f"{one.cause}.held_out_gain_percent", ".1f"),
    }


def _picture(name: str, figure: Figure, title: str, words: str) -> Picture:
    svg = inline_svg(figure, identifier=name, title=title, description=words)
    return Picture(Markup(svg), words)  # noqa: S704 - our own XML, its texts are escaped


def _course(found: Diagnosis) -> Picture:
    words = (
        "What was measured, and the model fitted anew to it without any cause; below, the error that is left "
        "without the causes found and with them. Each point is a short average."
    )
    return _picture("course", figures.course(found), "Output and error over time", words)


def _dependences(found: Diagnosis) -> list[Picture]:
    return [
        _picture(f"dependence-{k}", figures.dependence(one), "Learned dependence", one.text)
        for k, one in enumerate(found.dependences, start=1)
    ]


def _profiles(found: Diagnosis) -> list[Picture]:
    return [
        _picture(
            f"profile-{one.name}",
            figures.profile(one, extended=found.extended_percent < found.static_percent),
            f"Error against {one.name}",
            f"Where the error is, by {figures.axis_of(one)}: rms of the averages in each group.",
        )
        for one in found.profiles
    ]


def _ranking(found: Diagnosis) -> Picture:
    words = "How much of the error beyond noise each cause explains; those that were found in colour."
    return _picture("ranking", figures.ranking(found), "Ranking of the causes", words)
