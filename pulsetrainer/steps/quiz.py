"""The quiz: pulses asked blind in a balanced random order, and what the answers say about a learner."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pulsetrainer.artefacts.session import Beats, Quiz, Score
from pulsetrainer.errors import DataError
from pulsetrainer.steps.arguments import check_quiz
from pulsetrainer.steps.conductor import Decision, Play, Rest

QUESTION_S = 12.0  # every question lasts as long, whatever the pulse
GAP_S = 2.0  # rest between an answer and the next question, and at least between two questions
_LEVEL = 0.95
_ROUNDING_S = 1e-6  # of sums of times

Answer = Callable[[int], tuple[str, float] | None]
"""Asked for the answer to a question, from 0: name and time of the session in s, None while there is none."""


def order(choices: int, questions: int, seed: int) -> list[int]:
    """Return which of the choices is asked in each question: each as often as the others, or once more.

    Which ones are asked once more, and the order, are drawn from the seed.

    UsageError where there are fewer than two choices, or fewer questions than choices.
    """
    check_quiz(choices, questions)
    rng = np.random.default_rng((seed, questions, choices))
    often, more = divmod(questions, choices)
    asked = np.repeat(np.arange(choices), often)
    extra = rng.permutation(choices)[:more]
    return [int(k) for k in rng.permutation(np.concatenate((asked, extra)))]


def from_list(answers: Sequence[str], choices: Sequence[str], questions: int) -> Answer:
    """Return answers that were written down beforehand, one for each question.

    DataError where there are too few, or one names no pulse that can be asked.
    """
    for line, said in enumerate(answers, start=1):
        if said not in choices:
            raise DataError(
                f"answer {line} is {said!r}, which is not asked; asked are {', '.join(choices)}",
                hint="write one of these names on each line",
            )
    if len(answers) < questions:
        raise DataError(
            f"expected {questions} answers, one a question, got {len(answers)}",
            hint="write one pulse name on each line, as many as questions",
        )
    return lambda question: (answers[question], np.nan)


class Blind:
    """The decisions of a quiz; nothing of what is asked shows before all is answered."""

    def __init__(self, choices: Sequence[str], asked: Sequence[int], answer: Answer, play: Play) -> None:
        self._choices, self._asked, self._answer, self._play = tuple(choices), tuple(asked), answer, play
        self._answers: list[tuple[str, float]] = []
        self._begun: list[float] = []
        self._first: int  # number of the first beat of the question, once it has begun
        self.questions = len(self._asked)
        self.waits = False  # the beats of a question are over, and its answer is still to come

    @property
    def question(self) -> int:
        """Number of the question, from 0; as many as there are when all are answered."""
        return len(self._answers)

    def share_at(self, _time_s: float) -> float:
        """How much of it is over: an answer may take any time."""
        return self.question / self.questions

    def __call__(self, number: int, time_s: float) -> Decision:
        """Return what is played next."""
        at = self.question
        if len(self._begun) == at:  # not yet begun
            if at == self.questions:
                return None
            self._begun.append(time_s)
            self._first = number
        elif number == self._first:  # its first beat has not been given out: it begins now
            self._begun[at] = time_s
        cut_s = self._begun[at] + QUESTION_S
        if time_s < cut_s - _ROUNDING_S:
            self.waits = False
            return Play(self._asked[at], self._play.amplitude, self._play.bpm, cut_s)
        said = self._answer(at) if time_s >= cut_s + GAP_S - _ROUNDING_S else None
        if said is not None:
            self._answers.append(said)
        self.waits = said is None
        return Rest()

    def told(self, beats: Beats) -> Beats:
        """Return the beats of the questions that are answered: one of the others would tell what is asked."""
        is_open = len(self._answers) < len(self._begun)
        return Beats.of(beats.columns[:, : self._first], beats.output_unit) if is_open else beats

    def quiz(self, learner: str = "") -> Quiz | None:
        """Return what was asked and answered so far; None where that is nothing."""
        answered = self._answers
        if not answered:
            return None
        return Quiz(
            choices=self._choices,
            asked=tuple(self._choices[k] for k in self._asked[: len(answered)]),
            answered=tuple(said for said, _ in answered),
            response_s=np.asarray(
                [at - begun for (_, at), begun in zip(answered, self._begun, strict=False)], dtype=np.float64
            ),
            learner=learner,
        )


def score(quiz: Quiz) -> Score:
    """Return the share right with its 95 % interval, against chance.

    The interval is Wilson's (Journal of the American Statistical Association 1927, 22, 209-212), the
    test is binomial, one-sided.
    """
    from scipy.stats import binomtest

    asked, right, chance = len(quiz.asked), quiz.right, 1.0 / len(quiz.choices)
    tested = binomtest(right, asked, chance, alternative="greater")
    interval = binomtest(right, asked).proportion_ci(_LEVEL, method="wilson")
    known = quiz.response_s[np.isfinite(quiz.response_s)]
    return Score(
        asked=asked,
        right=right,
        share=right / asked,
        interval=(float(interval.low), float(interval.high)),
        chance=chance,
        p_value=float(tested.pvalue),
        response_s=float(np.median(known)) if known.size else float("nan"),
    )
