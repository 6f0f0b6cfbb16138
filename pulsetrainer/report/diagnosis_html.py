"""The report of a diagnosis as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pulsetrainer.artefacts import Diagnosis
from pulsetrainer.report import diagnosis_figures as figures
from pulsetrainer.report import diagnosis_text
from pulsetrainer.report.diagnosis_text import explains, in_doubt
from pulsetrainer.report.html import page
from pulsetrainer.report.views import Picture, picture


def render_diagnosis(found: Diagnosis, *, commands: Sequence[str] = (), **header: Any) -> str:
    """Return the report of a diagnosis, with the commands that come next; ``header`` as in ``html.page``."""
    shown = [*found.found, *[one for one in found.causes if not one.found and one.explains_percent > 0]][:12]
    return page(
        "diagnosis.html.j2",
        **header,
        found=found,
        words=diagnosis_text,
        commands=commands,
        headline=headline(found),
        shown=shown,
        course=_course(found),
        profiles=[*_dependences(found), *_profiles(found)],
        ranking=_ranking(found)
        if any(one.found or explains(one, found) > figures.SEEN for one in shown)
        else None,
    )


def headline(found: Diagnosis) -> str:
    """Return the verdict in few words; what each cause found means stands below them."""
    if found.verdict == "none":
        limits = ", but they could not have shown everything: see what they lack" if found.lacks else ""
        return f"These recordings show nothing wrong with the model{limits}."
    if found.verdict == "inconclusive":
        return "Nothing was found, but these recordings could not have shown everything that is common."
    if found.verdict == "unknown":
        return "Something is wrong that no known cause explains."
    cause = next(one for one in found.causes if one.cause == found.verdict)
    also = [one.cause for one in found.found if one.cause != found.verdict]
    words = "In doubt" if in_doubt(found) else "Found"
    tied = f" (could equally be {' or '.join(cause.confounded_with)})" if cause.confounded_with else ""
    rest = "" if found.left.whole else ". Something else is left"
    named = ", ".join(dict.fromkeys([cause.cause + tied, *also]))  # each once
    named = named.replace("unlisted", "a dependence in no list")
    return f"{words}: {named}{rest}."


def _course(found: Diagnosis) -> Picture:
    words = (
        "What was measured, and the model fitted anew to it without any cause; below, the error that is left "
        "without the causes found and with them. Each point is a short average."
    )
    return picture(figures.course(found), "course", "Output and error over time", words)


def _dependences(found: Diagnosis) -> list[Picture]:
    return [
        picture(
            figures.dependence(one, found.output_quantity), f"dependence-{k}", "Learned dependence", one.text
        )
        for k, one in enumerate(found.dependences, start=1)
    ]


def _profiles(found: Diagnosis) -> list[Picture]:
    return [
        picture(
            figures.profile(
                one, found.input_quantity, extended=found.extended_percent < found.static_percent
            ),
            f"profile-{one.name}",
            f"Error against {one.name}",
            f"Where the error is, by {figures.axis_of(one, found.input_quantity)}: rms of each group."
            + (" A speed of 1 goes through the whole range in a second." if one.name == "rate" else ""),
        )
        for one in found.profiles
    ]


def _ranking(found: Diagnosis) -> Picture:
    words = "How much of the error beyond noise each cause explains; found in blue, in doubt in green."
    return picture(figures.ranking(found), "ranking", "Ranking of the causes", words)
