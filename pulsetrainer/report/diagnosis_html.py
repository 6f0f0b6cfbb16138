"""The report of a diagnosis as one self-contained HTML page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from markupsafe import Markup

from pulsetrainer.artefacts.units import shown
from pulsetrainer.report import diagnosis_figures as figures
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
            levels=[(words, number(getattr(found, name), name, ".3f")) for name, words in _levels(found)],
            rows=[_row(one) for one in shown],
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


def _words(one: Cause) -> dict[str, str]:
    parameters = ", ".join(
        f"{p.name} {p.value:.3g} {shown(p.unit)}".rstrip()
        + (f" (95 %: {p.lower:.3g} to {p.upper:.3g})" if math.isfinite(p.lower) and p.lower < p.upper else "")
        for p in one.parameters
    )
    doubt = f" In doubt: {'; '.join(one.doubts)}." if one.doubts else ""
    return {
        "id": one.cause,
        "text": f"{one.text[:1].upper()}{one.text[1:]}{doubt}",
        "parameters": parameters,
        "tied": ", ".join(one.confounded_with),
    }


def _levels(found: Diagnosis) -> list[tuple[str, str]]:
    """Return field and words of every row of the table of before and after."""
    return [
        ("rms_percent", "the model as given, single samples"),
        ("noise_percent", "noise of single samples"),
        ("static_percent", "weights refitted, short averages"),
        *([] if found.quick else [("extended_percent", "extended, short averages")]),
        ("floor_percent", "if nothing were wrong, short averages"),
    ]


def _row(one: Cause) -> dict[str, str | Number]:
    measured = one.found and math.isfinite(one.held_out_gain_percent)
    return {
        "id": one.cause,
        "found": ("in doubt" if one.doubts else "yes") if one.found else "no",
        "p": Number("") if one.p_value is None else number(one.p_value, f"{one.cause}.p_value", ".3f"),
        "explains": number(one.explains_percent, f"{one.cause}.explains_percent"),
        "gain": number(one.held_out_gain_percent, f"{one.cause}.held_out_gain_percent", ".1f")
        if measured
        else Number(""),
    }


def _picture(name: str, figure: Figure, title: str, words: str) -> Picture:
    svg = inline_svg(figure, identifier=name, title=title, description=words)
    return Picture(Markup(svg), words)  # noqa: S704 - our own XML, its texts are escaped


def _course(found: Diagnosis) -> Picture:
    words = "Measured output and static model; below, what the static and the extended model leave."
    return _picture("course", figures.course(found), "Output and residual over time", words)


def _dependences(found: Diagnosis) -> list[Picture]:
    return [
        _picture(f"dependence-{k}", figures.dependence(one), "Learned dependence", one.text)
        for k, one in enumerate(found.dependences, start=1)
    ]


def _profiles(found: Diagnosis) -> list[Picture]:
    return [
        _picture(
            f"profile-{one.name}",
            figures.profile(one, extended=not found.quick),
            f"Residual against {one.name}",
            f"Where the residual is: against {one.name}.",
        )
        for one in found.profiles
    ]


def _ranking(found: Diagnosis) -> Picture:
    words = "Ranking of the causes, found ones in colour."
    return _picture("ranking", figures.ranking(found), "Ranking of the causes", words)
