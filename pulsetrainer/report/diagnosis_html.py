"""The report of a diagnosis as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pulsetrainer.artefacts import Diagnosis
from pulsetrainer.report import diagnosis_text
from pulsetrainer.report.diagnosis_figures import ranked
from pulsetrainer.report.diagnosis_text import IN_MODEL, beside, in_doubt, rivals, too_little, unnamed
from pulsetrainer.report.html import page


def render_diagnosis(found: Diagnosis, *, commands: Sequence[str] = (), **header: Any) -> str:
    """Return the report of a diagnosis, with the commands that come next; ``header`` as in ``html.page``."""
    return page(
        "diagnosis.html.j2",
        **header,
        found=found,
        words=diagnosis_text,
        commands=commands,
        headline=headline(found),
        ranked=bool(ranked(found)),
    )


def headline(found: Diagnosis) -> str:
    """Return the verdict in few words; what each cause found means stands below them."""
    if found.verdict in ("none", "inconclusive") and found.found:
        shown = ", ".join(dict.fromkeys(one.cause for one in found.found))
        return f"No verdict: {shown} can be seen, but in doubt or no larger than the noise."
    if seen := unnamed(found):
        small = f"{seen} shows, but it is {too_little(found)}"
        short = bool(found.lacks) or found.verdict == "inconclusive"
        limits = " These recordings could not have shown everything that is common." * short
        return f"Nothing that matters was found: {small}.{limits}"
    if found.verdict == "none":
        limits = ", but they could not have shown everything: see what they lack" if found.lacks else ""
        return f"These recordings show nothing wrong with the model{limits}."
    if found.verdict == "inconclusive":
        return "Nothing was found, but these recordings could not have shown everything that is common."
    if found.verdict == "unknown":
        return "Something is wrong that no known cause explains."
    cause = next(one for one in found.causes if one.cause == found.verdict)
    sure, doubted = beside(found)
    words = "In doubt" if in_doubt(found) else "Found"
    tied = f" ({rivals(cause)})" if cause.confounded_with else ""
    rest = "" if found.left.whole else ". Something else is left"
    named = ", ".join(dict.fromkeys([cause.cause + tied, *sure]))  # each once
    named += f"; in doubt: {', '.join(doubted)}" if doubted else ""
    named = named.replace("unlisted", "a dependence in no list")
    held = f"; {IN_MODEL}" if found.verdict in found.in_model else ""
    return f"{words}: {named}{held}{rest}."
