"""The score sheet in words: what is said of a session and of its figures."""

from __future__ import annotations

import html
import re
from dataclasses import replace

import numpy as np
import pytest
import store_examples

from program import pulsetrainer
from pulsetrainer.files import store
from pulsetrainer.report.score_sheet import render_session
from pulsetrainer.steps.compare import differing_quizzes


@pytest.mark.parametrize("tracked", [False, True])
def test_the_caption_names_what_the_figure_shows(tracked):
    """The temperature of the coil is there only where heat was tracked."""
    session = store_examples.session()
    if tracked:
        session = replace(session, temperature_s=np.arange(3.0), temperature_K=np.ones(3))
    header = {"created": "2026-01-02T03:04:05Z", "history": [], "provenance_json": "{}"}
    page = render_session(session, None, title="Session", **header)
    assert ("the coil's temperature in every second" in page) is tracked


def test_a_figure_has_one_unit_wherever_it_is_read(tmp_path):
    """The rms error of a session, a share in files and JSON, is told in percent on screens and pages."""
    session = replace(store_examples.session(), nrmse=0.0123)
    for name in ("a.h5", "b.h5"):
        store.write(tmp_path / name, session, store_examples.header())
    header = {"created": "2026-01-02T03:04:05Z", "history": [], "provenance_json": "{}"}
    sheet = html.unescape(re.sub(r"<[^>]+>", "", render_session(session, None, title="Session", **header)))
    said = [
        sheet,
        str(session),
        pulsetrainer(tmp_path, "show", "a.h5").out,
        pulsetrainer(tmp_path, "evaluate", "a.h5").out,
        pulsetrainer(tmp_path, "compare", "a.h5", "b.h5", "--all").out,
    ]
    for text in said:
        assert re.search(r"rms error[ ,\[]+% of the target's range\W+1\.23\b", text.replace("\xa0", " ")), (
            text
        )
    assert pulsetrainer(tmp_path, "show", "a.h5", "--json").json["facts"]["nrmse"] == 0.0123


def test_quizzes_that_are_not_alike_are_told_apart():
    """Their number of questions and what guessing gives; of the same quiz nothing is said."""
    session = store_examples.session()
    quiz = session.quiz
    asked, answered = quiz.asked * 3, quiz.answered * 3
    longer = replace(session, quiz=replace(quiz, asked=asked, answered=answered, response_s=np.ones(6)))
    assert differing_quizzes([session, session], ["a.h5", "b.h5"]) == []
    (said,) = differing_quizzes([session, longer], ["a.h5", "b.h5"])
    assert "a.h5 has 2 questions on 2 pulses (50 % by guessing)" in said
    assert "b.h5 has 6 questions" in said
