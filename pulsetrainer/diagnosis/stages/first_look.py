"""First look: the answer of a quick diagnosis.

Causes are only screened, and nothing is refitted. The best cause is found if it is significant and relevant.
Its strength is linearised and therefore too small. Causes with similar signatures (cosine above 0.9) are
named beside it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis.finding import Estimate, Finding
from pulsetrainer.diagnosis.screening import Score
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def stage(state: State) -> State:
    """Return the state with a finding for every cause that was screened."""
    return replace(state, findings=tuple(_finding(state, score) for score in state.scores.scores))


def _finding(state: State, score: Score) -> Finding:
    best = score is state.scores.scores[0]
    pairs = zip(score.cause.quantities(state.problem.frames[0]), score.start, strict=True)
    unsure = float("nan")
    return Finding(
        score.cause,
        found=best and state.significant(score),
        p_value=score.p_value,
        explains_percent=state.explains(score.gain),
        parameters=tuple(
            state.scale.estimate(Estimate(q.name, value, q.unit, unsure, unsure)) for q, value in pairs
        ),
        confounded_with=_alike(state, score) if best else (),
        held_out_gain_percent=unsure,
    )


def _alike(state: State, best: Score) -> tuple[str, ...]:
    """Causes whose columns point the same way as those of the best cause."""
    return tuple(
        score.cause.id
        for score in state.scores.scores
        if score is not best and float(np.linalg.norm(best.basis.T @ score.basis, ord=2)) > LIMITS.alike
    )
