"""Acceptance: the best candidate that is relevant and predicts.

Whether a candidate is significant was tested before it was refitted (``joint_fit``), which also puts the
candidates in order. The first one is accepted that meets these conditions:

- its refit lowers the sum of squares by a relevant amount; a refit that falls just short is continued until
  it converges;
- it lowers the error on blocks that were left out of the fit by at least a twentieth of what can be lowered
  there; if too few blocks are left to test this, the fit alone decides, and so it does for a line of the
  spectrum that stands ten times above the lines near it;
- the record can distinguish it at all;
- if it has several parameters, they do not all run into their bounds: it would no longer be the cause that it
  is named after.

With a new cause in the model the error of the levels is estimated again: a missing cause makes that estimate
too large, never too small.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.lines import is_a_line
from pulsetrainer.diagnosis.moments import profile
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with the accepted cause in the model; the same model where none is."""
    for begun, score in state.trials:
        trial = begun
        if LIMITS.nearly < _fall(state, begun) < 1.0:  # a refit that has not ended refuses nothing
            trial = settled(state.problem, begun)
        if _fall(state, trial) < 1.0:
            continue
        (new,) = (term for term in trial.terms if term.cause.id == score.cause.id)
        # halves of equal cycles are their two branches, which show nothing of a hum (decision 124)
        told = score.cause.line or new.cause.by_pieces
        gain_of = state.held_out.gain_told if told else state.held_out.gain
        gain = gain_of(state.current, trial, state.floor)
        line = is_a_line(state, new, trial, state.current)
        if np.isfinite(gain) and gain < LIMITS.held_out_least and not line:
            continue
        accepted = settled(state.problem, trial)
        frames = state.problem.frames
        if not all(t.cause.can_be_told(t.values, frames) for t in accepted.terms):
            continue
        at_bounds = [t.at_bounds(frames[0]) for t in accepted.terms]
        if any(len(one) > 1 and all(one) for one in at_bounds):
            continue
        return replace(
            state,
            current=accepted,
            p_values={**state.p_values, score.cause.id: score.p_value},
            floor=state.floor.heard(accepted).at(state.coarse, accepted),
            trials=(),
        )
    return replace(state, trials=())


def _fall(state: State, trial: Fitted) -> float:
    """Fall of the sum of squares by a trial, as a multiple of the relevant fall."""
    return (state.current.squares - trial.squares) / state.floor.relevant


def settled(problem: Problem, trial: Fitted) -> Fitted:
    """Refit until it converges; a cause of the input gets rows of its own, a sudden one its best moment."""
    changes_input = any(term.cause.stage == "input" for term in trial.terms)
    fitted = refit(problem, trial.terms, trial, rebuild=changes_input)
    for _ in range(LIMITS.moments_moved):
        moved = _moved(problem, fitted)
        if moved is fitted:
            break
        fitted = moved
    return fitted


def _moved(problem: Problem, fitted: Fitted) -> Fitted:
    """Return a fit with its sudden causes at moments that leave less; the same fit where there are none."""
    for term in fitted.terms:
        if term.cause.sudden:
            known = profile(fitted, term)
            if known.gain < LIMITS.enough * fitted.squares:
                continue
            others = [one for one in fitted.terms if one is not term]
            moved = refit(problem, (*others, known.terms[known.best]), fitted)
            if fitted.squares - moved.squares > LIMITS.enough * fitted.squares:
                fitted = moved
    return fitted
