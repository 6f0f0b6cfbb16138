"""Several steps: a change at several moments, sought together.

One step alone explains a record with two of them badly. It, or a slow drift, takes the place of both, and
each correction leaves a model that is wrong in another way. So the moments are chosen one after another, by
what they leave together, from the columns of the screen, of which all is projected off that the weights can
do (orthogonal matching pursuit: Pati, Rezaiifar and Krishnaprasad, Asilomar Conf. on Signals, 1993). The
search ends where one more would take away less than a fifth of what is left above the noise from sample to
sample. Then all of them are refitted together, and those are dropped that are not needed. They are told only
if they leave less than a tenth of what every other candidate does: a few steps imitate much that is slow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Values
from pulsetrainer.diagnosis.causes.step import Step
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fitting import Fitted, added, refit
from pulsetrainer.diagnosis.screening import at_full_rate
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


def fitted_with(state: State, step: Step, others: Sequence[Fitted]) -> Fitted | None:
    """Return the model with a change at several moments; None where other models are nearly as good."""
    current, quick = state.current, state.floor.quick.squares
    moments = _moments(current, step, quick, state.floor.relevant)
    if len(moments) < 2:
        return None
    trial = refit(state.problem, (*current.terms, _together(step, moments)), current)
    least = min(one.squares for one in (current, *others))
    for _ in moments[1:]:
        if trial.squares - quick >= LIMITS.steps_leave * (least - quick):
            break
        fewer = refit(state.problem, _without_the_weakest(trial, step), trial)
        if fewer.squares - trial.squares > max(state.floor.relevant, trial.squares - quick):
            return trial
        trial = fewer
    return None  # one step is tried as such


def _together(step: Step, moments: Sequence[Values]) -> Term:
    """Return one cause with all of these steps."""
    return Term(step.several(len(moments)), tuple(value for one in moments for value in one))


def _without_the_weakest(fitted: Fitted, step: Step) -> tuple[Term, ...]:
    """Return the causes of a fit without the step that changes least beside what the weights can do."""
    (term,) = (one for one in fitted.terms if one.cause.id == step.id)
    others, each = [one for one in fitted.terms if one is not term], step.each(term.values)
    fewer = [in_order((*others, _together(step, [*each[:k], *each[k + 1 :]]))) for k in range(len(each))]
    changes = np.stack([fitted.simulated - fitted.simulator(terms) for terms in fewer], axis=1)
    return fewer[int(np.argmin(np.linalg.norm(fitted.projector(changes), axis=0)))]


def _moments(fitted: Fitted, step: Step, quick: float, relevant: float) -> list[Values]:
    """Offset, gain and time of the changes that together leave least, in order of time."""
    frames, full = fitted.problem.frames, at_full_rate(fitted)
    blocks = step.starts(frames, full)
    columns = _columns(fitted, step, blocks)
    left = fitted.projector(fitted.residual[:, None])[:, 0]
    near = LIMITS.one_moment * (blocks[-1][0][-1] - blocks[0][0][-1]) / len(blocks)
    found: list[Values] = []
    own, squares = np.empty((left.size, 0)), float(left @ left)
    while len(found) < LIMITS.most_steps:
        apart = [k for k, (one, _) in enumerate(blocks) if all(abs(one[-1] - v[-1]) > near for v in found)]
        fits = {k: _fit(np.column_stack((own, columns[:, 2 * k : 2 * k + 2])), left)[1] for k in apart}
        best = min(apart, key=lambda k: fits[k], default=None)
        if best is None or squares - fits[best] < max(relevant, LIMITS.one_step * (squares - quick)):
            break
        known = [_together(step, found)] if found else []
        moved = added(fitted.simulator, in_order((*fitted.terms, *known)), fitted.terms)
        rest = [one - other for one, other in zip(full, moved, strict=True)]
        moments = [*(one[-1] for one in found), step.sharpened(blocks[best][0], frames, rest)[-1]]
        (offset, *_), (_, gain, _) = exact = step.at(moments[-1], frames)
        own = np.column_stack((own, _columns(fitted, step, [exact])))
        strengths, squares = _fit(own, left)
        sizes = (strengths.reshape(-1, 2) * (offset, gain)).tolist()
        found = [(*size, moment) for size, moment in zip(sizes, moments, strict=True)]
    return sorted(found, key=lambda values: values[-1])


def _columns(fitted: Fitted, step: Step, blocks: Sequence[Sequence[Values]]) -> FloatArray:
    """What an offset and a gain at each moment change (count, 2 m), without what the model can do."""
    changes = [fitted.change(Term(step, one)) for block in blocks for one in block]
    return fitted.beyond(np.asarray(changes).T)


def _fit(columns: FloatArray, left: FloatArray) -> tuple[FloatArray, float]:
    """Strengths (k,) of columns (count, k), and what they leave of a residual, sum of squares."""
    strengths = np.asarray(np.linalg.lstsq(columns, left, rcond=None)[0], dtype=np.float64)
    rest = left - columns @ strengths
    return strengths, float(rest @ rest)
