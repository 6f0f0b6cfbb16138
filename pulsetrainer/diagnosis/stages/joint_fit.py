"""Joint fit: the best of the significant candidates are refitted together with the weights.

The weights have absorbed most of any effect, so a cause that is fitted to what they leave comes out too
small. The three best candidates are therefore fitted jointly: the parameters of all causes and all weights at
once. If the refit of a candidate lowers nothing (a lag, say, where the output leads), the next one takes its
turn; a drift of the zero and one of the gain, whose formula holds it, have one place. A hum, which nothing
else resembles, is tried in any case. If one of them is a lag, the other lags are tried too, starting from the
same lateness: linearised from far away, lags hardly differ. If a step is significant, several steps are
sought together, and tried where they leave less than a tenth of what all other candidates do (decision 146).

A candidate must be significant, and its linearised score at least half of what is relevant, since the score
shows less than a refit does. A *family* is a group of causes that look alike, such as the lags. No candidate
is tried if its family is in the model already: what a cause leaves that looks like its family is due to its
imperfect formula, not to a second cause. The best fit comes first. But a fit with fewer parameters comes
before it, if noise or what happens between two samples could make the difference. So does a drift of the zero
before one of the gain, whose formula holds it.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis import several_steps
from pulsetrainer.diagnosis.causes import other_kinds, places
from pulsetrainer.diagnosis.causes.base import Cause, Values
from pulsetrainer.diagnosis.causes.step import Step
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.noise import doubt
from pulsetrainer.diagnosis.screening import Score, both_late
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with joint refits of the best candidates, the best fit first."""
    trials: list[tuple[Fitted, Score]] = []
    for score in state.scores.scores:
        lower = [one.cause for trial, one in trials if trial.squares < state.current.squares]
        if not promising(state, score):
            break
        if (places(lower) < LIMITS.tried or score.cause.line) and score.cause.family not in state.families:
            trials.append((_of_best_kind(state, score), score))
    trials += _as_late(state, trials)
    trials += _at_several_moments(state, trials)
    trials.sort(key=lambda pair: pair[0].squares)
    if trials:
        best = trials[0]
        trials.sort(key=lambda pair: not _simpler(state, best, pair))  # stable: else by their squares
    return replace(state, trials=tuple(trials))


def _of_best_kind(state: State, score: Score) -> Fitted:
    """Refit with the kind of a cause that fits best: linearised they can hardly be told apart."""
    best = _with(state, score.cause, score.start)
    values = best.terms[best.names.index(score.cause.id)].values
    others = other_kinds(score.cause, state.problem.frames)
    return min([best, *(_with(state, kind, values) for kind in others)], key=lambda fitted: fitted.squares)


def _as_late(state: State, trials: list[tuple[Fitted, Score]]) -> list[tuple[Fitted, Score]]:
    """Return refits of the lags not tried yet, started from where the best of the tried ones ended."""
    terms = [
        term
        for trial, score in sorted(trials, key=lambda pair: pair[0].squares)
        for term in trial.terms
        if both_late(score, term)
    ]
    known = {score.cause for _, score in trials}
    return [
        (_with(state, score.cause, terms[0].values), score)
        for score in state.scores.scores
        if terms and both_late(score, terms[0]) and score.cause not in known and promising(state, score)
    ]


def _at_several_moments(state: State, trials: list[tuple[Fitted, Score]]) -> list[tuple[Fitted, Score]]:
    """Return a refit with several steps, where a step is promising and all other trials are far worse."""
    for score in state.scores.scores:
        if (
            isinstance(score.cause, Step)
            and promising(state, score)
            and score.cause.family not in state.families
        ):
            several = several_steps.fitted_with(state, score.cause, [trial for trial, _ in trials])
            return [] if several is None else [(several, score)]
    return []


def _with(state: State, cause: Cause, values: Values) -> Fitted:
    terms = (*state.current.terms, Term(cause, values))
    return refit(state.problem, terms, state.current, rounds=LIMITS.trial_rounds)


def _simpler(state: State, first: tuple[Fitted, Score], other: tuple[Fitted, Score]) -> bool:
    """Whether a trial has fewer parameters than the best one, and fits as well, within the doubt.

    A formula that holds another counts as the larger one, whichever kind of the other it is. A force by
    speed looks like an input that is recorded late. Devices have forces; few recorders are late.
    """
    (best, score), (trial, its) = first, other
    known, own = (sum(len(term.values) for term in fitted.terms) for fitted in (best, trial))
    fewer = own < known or score.cause.holds == its.cause.id
    usual = score.cause.comes_before if score.cause.comes_before != its.cause.comes_before else fewer
    return usual and trial.squares - best.squares < doubt(best, trial, state.scores.noise)


def promising(state: State, score: Score) -> bool:
    """Whether a candidate may become relevant by a refit, whose gain is larger than the score."""
    return score.p_value <= LIMITS.p_max and score.gain > LIMITS.linearised * state.floor.relevant
