"""How a verdict is reached: the stages, one after another.

Each stage is a file of its own in ``stages``: it takes what is known before it and returns what is known
after it. What each number decides is written beside it in ``thresholds``, or in the file of its cause.
"""

from __future__ import annotations

from collections.abc import Callable

from pulsetrainer.diagnosis.stages import (
    account,
    advice,
    baseline,
    begin,
    elimination,
    equal_loops,
    exchange,
    extension,
    first_look,
    first_stroke,
    given_model,
    jumps,
    parameters,
    raw_data,
    repetition,
    restart,
    rivals,
    screened,
    search,
    settling,
    unlisted,
    verdict,
)
from pulsetrainer.diagnosis.state import Question, State

FULL: tuple[tuple[Callable[[State], State], float], ...] = (  # with the share of the work that is then done
    (search.stage, 0.55),  # screening, joint fit and acceptance, until nothing is accepted
    (restart.stage, 0.6),
    (exchange.stage, 0.62),
    (elimination.stage, 0.65),
    (first_stroke.stage, 0.66),
    (settling.stage, 0.66),
    (unlisted.stage, 0.66),
    (jumps.stage, 0.66),
    (equal_loops.stage, 0.7),
    (parameters.stage, 0.75),
    (rivals.stage, 0.94),
    (repetition.stage, 0.94),
    (begin.stage, 0.95),
    (verdict.stage, 0.95),
    (account.stage, 0.95),
    (given_model.stage, 0.97),
    (extension.stage, 0.99),
    (advice.stage, 1.0),
)
QUICK: tuple[tuple[Callable[[State], State], float], ...] = (
    (screened.stage, 0.7),
    (first_look.stage, 0.8),
    (verdict.stage, 0.8),
    (account.stage, 0.8),
    (given_model.stage, 0.9),
    (advice.stage, 1.0),
)
VOID: tuple[tuple[Callable[[State], State], float], ...] = (  # what else the records show is not sought
    (verdict.stage, 0.8),
    (account.stage, 0.9),
    (advice.stage, 1.0),
)


def diagnose(question: Question) -> State:
    """Diagnose records of one device: gates and baseline, then every stage.

    DataError where the data do not suffice for any statement.
    """
    state = baseline.stage(raw_data.stage(question))
    stages = QUICK if question.quick else FULL
    for stage, done in VOID if state.void else stages:
        state = stage(state)
        question.progress(done)
    return state
