"""The report of a diagnosis as one self-contained HTML page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pulsetrainer.artefacts import Cause, Diagnosis
from pulsetrainer.report import diagnosis_figures as figures
from pulsetrainer.report.diagnosis_text import (
    COLUMNS,
    ERRORS,
    answer,
    explains,
    in_doubt,
    parameters,
    stands,
)
from pulsetrainer.report.html import page
from pulsetrainer.report.views import Number, Picture, number, picture


def render_diagnosis(found: Diagnosis, *, commands: Sequence[str] = (), **header: Any) -> str:
    """Return the report of a diagnosis, with the commands that come next; ``header`` as in ``html.page``."""
    shown = [*found.found, *[one for one in found.causes if not one.found and one.explains_percent > 0]][:12]
    return page(
        "diagnosis.html.j2",
        **header,
        found=found,
        commands=commands,
        headline=headline(found),
        named=[_words(one) for one in found.found],
        levels=_levels(found),
        rows=[_row(one, found) for one in shown],
        columns=COLUMNS,
        course=_course(found),
        profiles=[*_dependences(found), *_profiles(found)],
        ranking=_ranking(found) if any(one.found or explains(one, found) > 0 for one in shown) else None,
    )


def headline(found: Diagnosis) -> str:
    """Return the verdict as one sentence for a technician."""
    if found.verdict == "none":
        limits = ", but they could not have shown everything: see what they lack" if found.lacks else ""
        return f"These recordings show nothing wrong with the model{limits}."
    if found.verdict == "inconclusive":
        return "Nothing was found, but these recordings could not have shown everything that is common."
    if found.verdict == "unknown":
        return "Something is wrong that no known cause explains."
    cause = next(one for one in found.causes if one.cause == found.verdict)
    also = [one.text for one in found.found if one.cause != found.verdict]
    words = f"In doubt: {cause.text}" if in_doubt(found) else f"{cause.text[:1].upper()}{cause.text[1:]}"
    tied = f" (could equally be {' or '.join(cause.confounded_with)})" if cause.confounded_with else ""
    rest = "" if found.left.whole else ". That explains only a part: something else is left"
    return f"{words}{tied}{'; in addition, ' + '; '.join(also) if also else ''}{rest}."


def _words(one: Cause) -> dict[str, Any]:
    doubt = f". In doubt: {'; '.join(one.doubts)}" if one.doubts else ""
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


def _row(one: Cause, found: Diagnosis) -> dict[str, str | Number]:
    gain = one.held_out_gain_percent if one.found else float("nan")
    return {
        "id": one.cause,
        "found": answer(one, quick=found.quick),
        "explains": _number(explains(one, found), f"{one.cause}.explains_percent", ".1f"),
        "gain": _number(gain, f"{one.cause}.held_out_gain_percent", ".1f"),
    }


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
