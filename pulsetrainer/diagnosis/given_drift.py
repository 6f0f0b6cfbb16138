"""A drift that shows against the model as given, where refitted weights hide it.

Weights that are refitted to a record absorb much of a drift that is over before the input has gone through
its range twice. What they leave shows neither where the drift began nor how fast it went. If the model as
given is far off, a drift of the zero is therefore fitted to what its fixed weights leave:

    y - M(u) - d(u) = b + drift(t)

where d is what other causes add, if they bring the model as given nearer. The drift counts if three things
hold: with it, and without a shift b, that model is near; it is nearer than with another gain and zero; and
the interval of the drift does not span zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Values
from pulsetrainer.diagnosis.causes.condition_change import Change
from pulsetrainer.diagnosis.causes.offset_drift import OffsetDrift
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.finding import Estimate, Finding, may_be_nothing
from pulsetrainer.diagnosis.fitting import Fitted, weights_for
from pulsetrainer.diagnosis.judged import Judged, added
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

_Average = Callable[[Sequence[FloatArray]], FloatArray]


@dataclass(frozen=True)
class Drifted:
    """A drift of the zero in what a model leaves."""

    cause: Cause
    values: Values
    errors: Values  # standard errors over blocks of the time


def told(state: State, judged: Judged, changed: Change) -> tuple[Finding, Fitted] | None:
    """Return the drift that the model as given tells, and a fit of new weights with it; None without.

    ``changed`` is what another gain and zero would leave.
    """
    if not state.question.timed or state.question.quick:
        return None
    found = {one.cause.id for one in state.findings if one.found and not one.in_doubt} - {OffsetDrift.id}
    others = [term for term in state.current.terms if term.cause.id in found]
    drift, said, moved = _with_drift(state, judged, [])
    near = judged.left_by(said)
    if others:
        beside = _with_drift(state, judged, others)
        nearer = judged.left_by(beside[1])
        if nearer < LIMITS.nearer * near:
            (drift, said, moved), near = beside, nearer
        else:
            others = []
    if not judged.is_near(said) or root_mean_square(judged.measured - said) >= changed.left:
        return None
    far = judged.left_by(judged.predicted)
    most = float(moved[np.argmax(np.abs(moved))])
    half = LIMITS.student * np.asarray(drift.errors)
    rows = zip(drift.cause.quantities(state.problem.frames[0]), drift.values, half, strict=True)
    finding = Finding(
        library()[OffsetDrift.id],
        found=True,
        explains_percent=PERCENT * (1.0 - (near / far) ** 2),
        parameters=tuple(state.scale.estimate(Estimate(q.name, v, q.unit, v - h, v + h)) for q, v, h in rows),
        held_out_gain_percent=float("nan"),
        seen=Evidence(
            "against given" if near > 0 else "against given, nothing left",
            OffsetDrift.id,
            {"moved": judged.polarity * most, "left": near},
        ),
    )
    if may_be_nothing(finding.cause.strengths_of(finding.parameters)):
        return None
    terms = in_order((*others, Term(drift.cause, drift.values)))
    return finding, weights_for(state.problem, terms, state.current)


def _with_drift(
    state: State, judged: Judged, others: Sequence[Term]
) -> tuple[Drifted, FloatArray, FloatArray]:
    """Return the drift beside other causes, what the model as given says with all (n,), and how it moves."""
    problem, span = state.problem, state.scale.span
    known = added(state, others)
    left = [residual - one for residual, one in zip(judged.residuals, known, strict=True)]
    drift = drift_in(problem.bins.average(left) / span, problem.frames, problem.bins.average)
    shown = [
        drift.cause.on_output(np.zeros(frame.input.size), drift.values, frame) for frame in problem.frames
    ]
    moved = judged.kept([span * one for one in shown])
    return drift, judged.predicted + judged.kept(known) + moved, moved


def drift_in(left: FloatArray, frames: Sequence[Frame], average: _Average) -> Drifted:
    """Return the drift that fits best what a model leaves, averaged (count,), with a shift beside it."""
    plain = OffsetDrift()
    zeros = [np.zeros(frame.input.size) for frame in frames]

    def columns(slowing: float) -> FloatArray:
        said = [
            average([plain.on_output(z, one, frame) for z, frame in zip(zeros, frames, strict=True)])
            for one in ((1.0, 0.0), (0.0, 1.0, slowing))
        ]
        return np.stack((np.ones(left.size), *said), axis=1)

    def squares(slowing: float) -> float:
        known = columns(slowing)
        return float(np.sum((left - known @ _solved(known, left)) ** 2))

    tried = np.geomspace(*LIMITS.slowings) / frames[0].length_s * np.asarray([[1.0], [-1.0]])
    best = float(min(tried.ravel(), key=squares))
    ends = np.sort(best * np.asarray((0.5, 2.0)))  # beyond its neighbours
    slowing = float(scipy.optimize.minimize_scalar(squares, bounds=ends, method="bounded").x)
    relaxes = squares(slowing) < LIMITS.nearer**2 * squares(0.0)
    known = columns(slowing if relaxes else 0.0)
    solved = _solved(known, left)
    values, rest = solved[1:], left - known @ solved
    if relaxes:
        small = LIMITS.difference * slowing
        known = np.column_stack((known, solved[2] * (columns(slowing + small)[:, 2] - known[:, 2]) / small))
        values = np.append(values, slowing)
    parts = np.array_split(np.arange(left.size), LIMITS.jackknife)
    moved = [_solved(np.delete(known, one, 0), np.delete(rest, one)) for one in parts]
    errors = np.sqrt(LIMITS.jackknife - 1) * np.std(moved, axis=0)
    cause = plain.relaxing if relaxes else plain
    return Drifted(cause, tuple(map(float, values)), tuple(map(float, errors[1:])))


def _solved(known: FloatArray, left: FloatArray) -> FloatArray:
    size = np.linalg.norm(known, axis=0)
    return np.asarray(np.linalg.lstsq(known / size, left, rcond=None)[0] / size)
