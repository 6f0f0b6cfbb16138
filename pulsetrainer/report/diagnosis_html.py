"""The report of a diagnosis as one self-contained HTML page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from markupsafe import Markup

from pulsetrainer.report import diagnosis_figures as figures
from pulsetrainer.report.html import environment, indented
from pulsetrainer.report.render import inline_svg
from pulsetrainer.report.style import pretty_unit
from pulsetrainer.report.views import Picture

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from pulsetrainer.artefacts.kinds import Cause, Diagnosis


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
    named = [one for one in found.causes if one.found]
    shown = [*named, *[one for one in found.causes if not one.found and one.explains_percent > 0]][:12]
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
            named=[_words(one) for one in named],
            rows=[_row(one) for one in shown],
            pictures=_pictures(found),
        )
    )


def headline(found: Diagnosis) -> str:
    """Return the verdict as one sentence for a technician."""
    if found.verdict == "none":
        return "Nothing is wrong with the model that these runs could show."
    if found.verdict == "unknown":
        return "Something is wrong that no cause of the library explains."
    cause = next(one for one in found.causes if one.cause == found.verdict)
    also = [one.text for one in found.causes if one.found and one.cause != found.verdict]
    words = f"{cause.text[:1].upper()}{cause.text[1:]}"
    tied = f" (not told from {', '.join(cause.confounded_with)})" if cause.confounded_with else ""
    return f"{words}{tied}{'; besides, ' + '; '.join(also) if also else ''}."


def _words(one: Cause) -> dict[str, str]:
    parameters = ", ".join(
        f"{p.name} {p.value:.3g} {pretty_unit(p.unit)}".rstrip()
        + (f" (95 %: {p.lower:.3g} to {p.upper:.3g})" if math.isfinite(p.lower) and p.lower < p.upper else "")
        for p in one.parameters
    )
    return {
        "id": one.cause,
        "text": f"{one.text[:1].upper()}{one.text[1:]}",
        "parameters": parameters,
        "tied": ", ".join(one.confounded_with),
    }


def _row(one: Cause) -> dict[str, str]:
    gain = (
        f"{one.held_out_gain_percent:.1f}" if one.found and math.isfinite(one.held_out_gain_percent) else "·"
    )
    return {
        "id": one.cause,
        "found": "yes" if one.found else "no",
        "p": f"{one.p_value:.3f}",
        "explains": f"{one.explains_percent:.2f}",
        "gain": gain,
    }


def _pictures(found: Diagnosis) -> dict[str, Picture]:
    def picture(name: str, figure: Figure, words: str) -> Picture:
        svg = inline_svg(figure, identifier=name, title=words, description=words)
        return Picture(Markup(svg), words)  # noqa: S704 - our own XML, its texts are escaped

    return {
        "course": picture(
            "course", figures.course(found), "Measured output and static model, the residuals below."
        ),
        "profiles": picture(
            "profiles",
            figures.profiles(found),
            "Where the residual is: against rate, level, direction, time and frequency, before and after.",
        ),
        "ranking": picture("ranking", figures.ranking(found), "Ranking of the causes, found ones in colour."),
    }
