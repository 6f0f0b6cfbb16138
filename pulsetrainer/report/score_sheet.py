"""The score sheet of a session as one self-contained page: how true the pulses were, what was answered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pulsetrainer.artefacts import Score, Session
from pulsetrainer.artefacts.units import counted
from pulsetrainer.report.html import number, page
from pulsetrainer.report.names import NAMES, told

_FIGURES = (
    ("mean_abs_error_percent", ""),
    ("max_abs_error_percent", ""),
    ("error_jnd", ".3f"),
    ("nrmse", ""),
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
    quiz = session.quiz if score is not None else None
    count = np.bincount(session.beats.pulse, minlength=len(session.pulses)).tolist()
    value = {name: told(name, getattr(session, name)) for name, _ in _FIGURES}
    return page(
        "session.html.j2",
        **header,
        session=session,
        pressed=[f"{name}: {counted(k, 'beat')}" for name, k in zip(session.pulses, count, strict=True)],
        rhythm=_rhythm(asked) if asked else None,
        rows=[(*NAMES[name], number(value[name], name, form)) for name, form in _FIGURES],
        quiz=quiz,
        score=score,
        timed=quiz is not None and bool(np.isfinite(quiz.response_s).any()),
    )


def _rhythm(asked: Mapping[str, Any]) -> str:
    """Say which rhythm was asked for."""
    given = {name: asked.get(name) for name, _ in _RHYTHM}  # of a file, so anything
    return (
        "; ".join(w.format(given[n]) for n, w in _RHYTHM if isinstance(given[n], float) and given[n])
        or "even"
    )
