"""The quiz: balanced, not to be foreseen, and an interval that holds what it promises."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.artefacts import Beats, Quiz
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.steps.conductor import Play, Rest
from pulsetrainer.steps.quiz import GAP_S, QUESTION_S, Blind, from_list, order, score

CHOICES = ("normal", "bifid", "alternans", "stiff")


@given(choices=st.integers(2, 8), seed=st.integers(0, 10**9), more=st.integers(0, 30))
def test_each_pulse_is_asked_as_often_as_the_others(choices, seed, more):
    """Or once more, where it does not come out even."""
    asked = np.bincount(order(choices, choices + more, seed), minlength=choices)
    assert asked.sum() == choices + more
    assert np.ptp(asked) <= 1


def test_an_order_cannot_be_foreseen():
    """Over 2000 seeds every choice stands in every place as often, and follows every other as often."""
    orders = np.array([order(4, 12, seed) for seed in range(2000)])
    for place in range(12):
        counts = np.bincount(orders[:, place], minlength=4)
        assert np.abs(counts - 500).max() < 5 * np.sqrt(2000 * 0.25 * 0.75)
    after = np.zeros((4, 4))
    for row in orders:
        for a, b in itertools.pairwise(row):
            after[a, b] += 1
    # of 11 left each choice has 3, the one just asked 2
    expected = 2000 * 11 * np.where(np.eye(4), 2 / 11, 3 / 11) / 4
    np.testing.assert_allclose(after, expected, rtol=0.08)
    assert len({tuple(row) for row in orders}) > 1990


def _quiz(asked, answered) -> Quiz:
    names = CHOICES
    return Quiz(
        names, tuple(names[k] for k in asked), tuple(names[k] for k in answered), np.full(len(asked), 2.0)
    )


@pytest.mark.parametrize("questions", [20, pytest.param(40, marks=pytest.mark.slow)])
def test_the_interval_holds_the_truth(questions):
    """Of 1000 simulated learners of known skill in 93 to 97 %; skills are drawn, seeds are not looked at."""
    held = 0
    for learner in range(1000):
        rng = np.random.default_rng((20, questions, learner))
        skill = rng.uniform(0.25, 0.98)
        asked = order(4, questions, learner)
        right = rng.random(questions) < skill
        answered = [k if r else (k + int(rng.integers(1, 4))) % 4 for k, r in zip(asked, right, strict=True)]
        result = score(_quiz(asked, answered))
        held += result.interval[0] <= skill <= result.interval[1]
        assert result.right == right.sum()
    assert 930 <= held <= 970


def test_guessing_is_told_from_knowing():
    """Half right of four choices in 20 questions is no guessing; a quarter is."""
    asked = order(4, 20, 0)
    knows = score(_quiz(asked, [k if i % 2 else (k + 1) % 4 for i, k in enumerate(asked)]))
    guesses = score(_quiz(asked, [k if i % 4 == 0 else (k + 1) % 4 for i, k in enumerate(asked)]))
    assert (knows.right, guesses.right) == (10, 5)
    assert knows.p_value < 0.02
    assert guesses.p_value > 0.3
    assert guesses.interval[0] < knows.chance < guesses.interval[1]


def test_the_confusion_counts_every_question_once():
    """Rows are what was asked."""
    quiz = _quiz([0, 1, 2, 3, 0], [0, 0, 2, 3, 1])
    assert quiz.confusion["normal"] == {"normal": 1, "bifid": 1, "alternans": 0, "stiff": 0}
    assert quiz.confusion["bifid"]["normal"] == 1
    assert sum(sum(row.values()) for row in quiz.confusion.values()) == 5


def test_answers_of_a_file_are_checked_beforehand():
    """Too few, or a name that is not asked."""
    with pytest.raises(DataError):
        from_list(["normal"], CHOICES, 2)
    with pytest.raises(DataError):
        from_list(["normal", "bigeminus"], CHOICES, 2)
    assert from_list(["normal", "stiff", "stiff"], CHOICES, 2)(1)[0] == "stiff"


@pytest.mark.parametrize(("choices", "questions"), [(1, 5), (3, 2), (2, 0)])
def test_a_quiz_that_asks_nothing_is_refused(choices, questions):
    """One choice is no choice, and every choice is asked."""
    with pytest.raises(UsageError):
        order(choices, questions, 0)


def _times(asked, bpm, answers):
    """Play a quiz without a device: when each question begins and ends, and each rest."""
    quiz = Blind(CHOICES, asked, answers, Play(0, 1.0, bpm))
    now, number, spans, begun = 0.0, 0, [], None
    while (decision := quiz(number, now)) is not None:
        if isinstance(decision, Rest):
            if begun is not None:
                spans.append((begun, now))
                begun = None
            now += decision.seconds
            continue
        begun = now if begun is None else begun
        now = min(now + 60.0 / (bpm or 40 + 30 * decision.pulse), decision.cut_s)
        number += 1
    return spans, quiz


def test_all_questions_take_the_same_time():
    """Whatever the pulse and its rate: no length gives it away, and no pause between two."""
    spans, quiz = _times([0, 3, 1, 2, 3], None, from_list(["normal"] * 5, CHOICES, 5))
    assert [end - begin for begin, end in spans] == pytest.approx([QUESTION_S] * 5)
    gaps = {round(b[0] - a[1], 6) for a, b in itertools.pairwise(spans)}
    assert len(gaps) == 1
    assert gaps.pop() >= GAP_S
    assert quiz.quiz().asked == ("normal", "stiff", "bifid", "alternans", "stiff")


def test_the_next_question_waits_for_the_answer():
    """And the time to the answer counts from the first beat."""
    waited = itertools.count()

    def slow(_question: int):
        return ("bifid", 17.0) if next(waited) % 9 == 8 else None

    spans, quiz = _times([1, 0], 75.0, slow)
    assert spans[1][0] - spans[0][1] > GAP_S + 8 * 0.25 - 1e-6
    assert quiz.quiz("anna").response_s[0] == pytest.approx(17.0)
    assert quiz.quiz("anna").learner == "anna"


def test_nothing_is_told_before_the_first_answer():
    """An unanswered quiz is no quiz yet."""
    assert Blind(CHOICES, [0, 1], lambda _q: None, Play(0)).quiz() is None


def test_a_question_whose_beats_are_over_waits_for_its_answer():
    """Which is said on the screen: without an answer nothing happens any more."""
    said: list[tuple[str, float]] = []
    blind = Blind(CHOICES, [2, 0], lambda _question: said.pop() if said else None, Play(0))
    end_s = QUESTION_S + GAP_S
    blind(0, 0.0)
    assert not blind.waits
    blind(20, end_s)
    assert blind.waits
    said.append((CHOICES[1], end_s + 30.0))
    blind(20, end_s + 30.0)
    assert not blind.waits
    blind(20, end_s + 30.0 + GAP_S)
    assert not blind.waits


def test_a_beat_is_told_when_its_question_is_answered():
    """Those of an open question stay untold, those of the questions before it are all there."""
    said: list[tuple[str, float]] = []
    blind = Blind(CHOICES, [2, 0], lambda _question: said.pop() if said else None, Play(0))
    start_s = np.arange(0.0, 40.0, 0.8)
    beats = Beats(start_s, *(np.ones(start_s.size) for _ in range(7)))
    assert blind(4, 3.0) == Play(2, 1.0, None, 3.0 + QUESTION_S)
    assert blind.told(beats).start_s.max() < 3.0
    assert blind.share_at(9.0) == 0.0
    said.append((CHOICES[1], 9.0))
    assert blind(20, 3.0 + QUESTION_S + GAP_S) == Rest()
    assert blind.told(beats).start_s.size == start_s.size  # nothing is open
    assert blind.share_at(20.0) == 0.5  # its bar stood still to the end
    second_s = 3.0 + QUESTION_S + 2 * GAP_S
    assert isinstance(blind(24, second_s), Play)
    told = blind.told(beats)
    assert told.start_s.max() < second_s <= start_s[told.start_s.size]
    assert told.gain.size == told.start_s.size
