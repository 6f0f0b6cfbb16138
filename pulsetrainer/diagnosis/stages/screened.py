"""Screening: every cause is scored against noise.

Each cause that is not in the model yet is tried at a few values, linearised: how far would the residual
fall? The same is asked of noise that looks like the residual but holds no cause, drawn again and again, and
of each draw the least likely score over the whole library counts. The p-value of a cause is the share of
draws with one as unlikely, so that it holds for the search as a whole and not for one cause. A cause goes
on with p of at most 0.01.

From the same null follows how small an effect of each cause would have shown: large enough that the test
finds it in nine of ten records, that what the weights leave of it matters, and that neither is undone by what
looks like the cause already.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis.screening import screen
from pulsetrainer.diagnosis.state import State


def stage(state: State) -> State:
    """Return the state with the scores of all causes that are not in the model."""
    scores = screen(state.current, state.question.rng)
    norm = state.floor.span * float(np.sqrt(state.floor.count))
    limits = {
        one.cause.id: one.sight.least(state.floor.relevant, one.gain) / norm
        for one in scores.scores
        if one.sight is not None
    }
    return replace(state, scores=scores, limits={**state.limits, **limits})
