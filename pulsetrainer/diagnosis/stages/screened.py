"""Screening: every cause is scored against noise.

Each cause that is not in the model yet is tried at a few values, linearised: how far would the residual
fall? The same is asked of noise that looks like the residual but holds no cause, drawn again and again, and
of each draw the largest score over the whole library counts. The p-value of a cause is the share of draws
that score as much, so that it holds for the search as a whole and not for one cause. A cause goes on with p
of at most 0.01.
"""

from __future__ import annotations

from dataclasses import replace

from pulsetrainer.diagnosis.screening import screen
from pulsetrainer.diagnosis.state import State


def stage(state: State) -> State:
    """Return the state with the scores of all causes that are not in the model."""
    return replace(state, scores=screen(state.problem, state.current, state.question.rng))
