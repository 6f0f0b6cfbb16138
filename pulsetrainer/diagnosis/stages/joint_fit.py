"""Joint fit: the best candidates are refitted together with the weights.

The weights have swallowed most of any effect, so that its fit to their residual comes out too small. The
best three candidates are therefore fitted jointly: parameters of all causes and all weights at once. A
candidate must be significant, and its linearised score half of what is relevant, since the score shows less
than a refit does. Of a family that is in the model already none is tried: what a cause of its own kind
leaves is its imperfect formula, not a second cause.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.screening import Score
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with joint refits of the best candidates, the best fit first."""
    trials: list[tuple[Fitted, Score]] = []
    for score in state.scores.scores:
        if len(trials) == LIMITS.tried or not promising(state, score):
            break
        if score.cause.family not in state.families:
            terms = (*state.current.terms, Term(score.cause, score.start))
            trials.append((refit(state.problem, terms, state.current, rounds=LIMITS.trial_rounds), score))
    return replace(state, trials=tuple(sorted(trials, key=lambda pair: pair[0].squares)))


def promising(state: State, score: Score) -> bool:
    """Whether a refit, whose gain is larger, may make it relevant."""
    return score.p_value <= LIMITS.p_max and score.gain > LIMITS.linearised * state.floor.relevant
