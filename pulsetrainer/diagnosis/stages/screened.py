"""Screening: every cause is scored against noise, and the smallest effect that would have shown is noted.

Each cause that is not in the model yet is tried at a few values of its parameters, linearised. Its score is
the fall of the sum of squares of the residual. The same is done with noise that looks like the residual but
holds no cause, drawn again and again; of each draw only the least likely score in the whole library counts.
The p-value of a cause is the share of draws with a score that is at least as unlikely as its own. It
therefore holds for the search as a whole, and not for one cause alone. Causes with p of at most 0.01 go on to
the joint fit.

The same draws show how small an effect of each cause would have been seen. Such an effect is large enough
that the test finds it in nine of ten records, and that what the weights leave of it is relevant even if that
is little more than half of what they leave of the effects that are tried. Both hold even if what already
looks like the cause in this record works against it. For a cause that has entered the model since, the
present noise is used. For a cause that the weights can absorb almost entirely no such figure is given: what
they leave of it depends only on how fine the levels are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.screening import screen
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with the scores of all causes that are not in the model."""
    scores = screen(state.current, state.question.rng)
    norm = state.floor.span * float(np.sqrt(state.floor.count))
    gains = {one.cause.id: one.gain for one in scores.scores}
    seen = {one.cause.id: one.sight for one in scores.scores if one.sight is not None}
    falls = [seen[name].noise / state.sights[name].noise for name in seen if name in state.sights]
    quieter = float(np.median(falls or 1.0))
    # of one in the model, what it and later ones explain has left the noise since
    known = {name: replace(one, noise=one.noise * quieter) for name, one in state.sights.items()}
    sights = {**known, **seen}
    detectable, expected = (
        {
            name: one.least(state.floor.relevant, gains.get(name, 0.0), unsure) / norm
            for name, one in sights.items()
            if not library()[name].by_contrast
        }
        for unsure in (LIMITS.share_unsure, 1.0)
    )
    return replace(state, scores=scores, sights=sights, detectable=detectable, expected=expected)
