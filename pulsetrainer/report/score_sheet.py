"""The score sheet of a session as one self-contained page: how true the pulses were, what was answered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pulsetrainer.artefacts import Quiz, Score, Session
from pulsetrainer.report import session_figures
from pulsetrainer.report.html import page
from pulsetrainer.report.names import NAMES
from pulsetrainer.report.views import Number, number, picture

_FIGURES = (
    ("mean_abs_error_percent", ""),
    ("max_abs_error_percent", ""),
    ("error_jnd", ".3f"),
    ("nrmse_percent", ""),
    ("beat_timing_max_ms", ""),
    ("rate_cv_percent", ".3f"),
    ("amplitude_cv_percent", ""),
    ("augmentation_index_error_percent", ""),
)
_RHYTHM = (
    ("variability", "intervals vary by {:g} % (standard deviation)"),
    ("respiration", "they swing by {:g} % with the breath"),
    ("ectopic", "{:g} % of the beats come early"),
)


def render_session(
    session: Session, score: Score | None, asked: Mapping[str, Any] | None = None, **header: Any
) -> str:
    """Return the score sheet of a session, with the score of its quiz; ``header`` as in ``html.page``.

    ``asked`` are the options of the session; without them the sheet does not tell the rhythm.
    """
    beats = session.beats.start_s.size
    count = np.bincount(session.beats.pulse, minlength=len(session.pulses))
    value = {name: getattr(session, name, 100.0 * session.nrmse) for name, _ in _FIGURES}
    return page(
        "session.html.j2",
        **header,
        session=session,
        pressed=[f"{name}: {number} beats" for name, number in zip(session.pulses, count, strict=True)],
        rhythm=_rhythm(asked) if asked else None,
        rows=[(*NAMES[name], number(value[name], name, form)) for name, form in _FIGURES],
        course=picture(
            session_figures.course(session),
            "course",
            "What was pressed",
            f"Target and measured force for {session_figures.SHOWN_S:g} seconds, and the errors of all "
            f"{beats} beats.",
        ),
        quiz=session.quiz if score is not None else None,
        scored=None if session.quiz is None or score is None else _scored(session.quiz, score),
    )


def _rhythm(asked: Mapping[str, Any]) -> str:
    """Say which rhythm was asked for."""
    given = {name: asked.get(name) for name, _ in _RHYTHM}  # of a file, so anything
    return (
        "; ".join(w.format(given[n]) for n, w in _RHYTHM if isinstance(given[n], float) and given[n])
        or "even"
    )


def _scored(quiz: Quiz, score: Score) -> dict[str, object]:
    low, high = score.interval
    facts = [
        ("right", Number(f"{score.right} of {score.asked}", str(score.right), "quiz.right")),
        ("share right [%]", number(100.0 * score.share, "quiz.share_percent", ".0f")),
        ("95 % interval [%]", Number(f"{100 * low:.0f} to {100 * high:.0f}")),
        ("by guessing [%]", number(100.0 * score.chance, "quiz.chance_percent", ".0f")),
        ("probability of as many by guessing", number(score.p_value, "quiz.p_value", ".2g")),
    ]
    timed = bool(np.isfinite(quiz.response_s).any())
    if timed:
        facts.append(("median time to the answer [s]", number(score.response_s, "quiz.response_s", ".1f")))
    words = "What was asked, downwards, and what was answered, across; on the diagonal what is right."
    matrix = picture(session_figures.confusion(quiz), "confusion", "Confusion matrix", words)
    return {"facts": facts, "timed": timed, "matrix": matrix}
