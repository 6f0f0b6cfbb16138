"""The score sheet of a session as one self-contained page: how true the pulses were, what was answered."""

from __future__ import annotations

from typing import Any

from pulsetrainer.artefacts import Quiz, Score, Session
from pulsetrainer.report import session_figures
from pulsetrainer.report.html import page
from pulsetrainer.report.views import Number, number, picture

_FIGURES = (
    ("mean_abs_error_percent", "mean absolute error", "% of full force", ".2f"),
    ("max_abs_error_percent", "largest absolute error", "% of full force", ".2f"),
    ("error_jnd", "mean absolute error", "just noticeable differences", ".3f"),
    ("nrmse", "rms error", "of the range", ".4f"),
    ("beat_timing_max_ms", "farthest that a beat began from its time", "ms", ".2f"),
    ("rate_cv_percent", "variation of the rate", "%", ".3f"),
    ("amplitude_cv_percent", "variation of the height", "%", ".3f"),
    ("augmentation_index_error_percent", "error of the augmentation index", "%", ".2f"),
)


def render_session(session: Session, score: Score | None, **header: Any) -> str:
    """Return the score sheet of a session, with the score of its quiz; ``header`` as in ``html.page``."""
    beats = session.beats.start_s.size
    return page(
        "session.html.j2",
        **header,
        session=session,
        beats=beats,
        rows=[
            (words, unit, number(getattr(session, name), name, form)) for name, words, unit, form in _FIGURES
        ],
        course=picture(
            session_figures.course(session),
            "course",
            "What was pressed",
            f"Target and measured force for {session_figures.SHOWN_S:g} seconds, and the errors of all "
            f"{beats} beats.",
        ),
        quiz=None if session.quiz is None or score is None else _quiz(session.quiz, score),
    )


def _quiz(quiz: Quiz, score: Score) -> dict[str, object]:
    low, high = score.interval
    facts = [
        ("right", Number(f"{score.right} of {score.asked}", str(score.right), "quiz.right")),
        ("share right [%]", number(100.0 * score.share, "quiz.share_percent", ".0f")),
        ("95 % interval [%]", Number(f"{100 * low:.0f} to {100 * high:.0f}")),
        ("by guessing [%]", number(100.0 * score.chance, "quiz.chance_percent", ".0f")),
        ("probability of as many by guessing", number(score.p_value, "quiz.p_value", ".2g")),
        ("median time to the answer [s]", number(score.response_s, "quiz.response_s", ".1f")),
    ]
    words = "What was asked, downwards, and what was answered, across; on the diagonal what is right."
    return {
        "learner": quiz.learner,
        "facts": facts,
        "picture": picture(session_figures.confusion(quiz), "confusion", "Confusion matrix", words),
        "questions": [
            (k, asked, said, number(float(seconds), "", ".1f"))
            for k, (asked, said, seconds) in enumerate(
                zip(quiz.asked, quiz.answered, quiz.response_s, strict=True), start=1
            )
        ],
    }
