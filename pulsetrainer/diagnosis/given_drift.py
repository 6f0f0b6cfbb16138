"""A drift or a step that shows against the model as given, where refitted weights hide it.

Weights that are refitted to a record absorb much of a drift that is over before the input has gone through
its range twice, and of a step where both sides switch other cells, or where weights may be negative. What
they leave shows neither when it began nor how large it was. If the model as given is far off, a drift of the
zero is therefore fitted to what its fixed weights leave, and a step:

    y - M(u) - d(u) = b + drift(t)

where d is what other causes add, if they bring the model as given nearer. The drift counts if four things
hold: with it, and without a shift b, that model is near; more than half of the squared error is gone; it is
nearer than with another gain and zero; and the interval of the drift does not span zero. A step counts in its
place if it leaves less.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.offset_drift import OffsetDrift
from pulsetrainer.diagnosis.causes.step import Step
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.finding import Estimate, Finding, may_be_nothing
from pulsetrainer.diagnosis.fitting import Fitted, weights_for
from pulsetrainer.diagnosis.judged import Judged, added
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT, TINY

_Average = Callable[[Sequence[FloatArray]], FloatArray]


@dataclass(frozen=True)
class Drifted:
    """A drift of the zero, or a step, in what a model leaves."""

    cause: Cause
    values: Values
    errors: Values  # standard errors over blocks of the time


def told(state: State, judged: Judged, otherwise: float) -> tuple[Finding, Fitted] | None:
    """Return the drift that the model as given tells, and a fit of new weights with it; None without.

    ``otherwise`` is what another gain and zero would leave, rms, output unit.
    """
    few = state.problem.bins.count <= LIMITS.jackknife
    if few or not state.question.timed or state.question.quick:
        return None
    slow = {OffsetDrift.id, Step.id}
    found = {one.cause.id for one in state.findings if one.found and not one.in_doubt} - slow
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
    far = judged.left_by(judged.predicted)
    worse = root_mean_square(judged.measured - said) >= otherwise or near**2 > LIMITS.half * far**2
    if worse or not judged.is_near(said):
        return None
    most = float(moved[np.argmax(np.abs(moved))])
    half = LIMITS.student * np.asarray(drift.errors)
    rows = zip(drift.cause.quantities(state.problem.frames[0]), drift.values, half, strict=True)
    finding = Finding(
        library()[drift.cause.id],
        found=True,
        explains_percent=PERCENT * (1.0 - (near / far) ** 2),
        parameters=tuple(state.scale.estimate(Estimate(q.name, v, q.unit, v - h, v + h)) for q, v, h in rows),
        held_out_gain_percent=float("nan"),
        seen=Evidence(
            "against given" if near > 0 else "against given, nothing left",
            drift.cause.id,
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
    unmoved = [(one - state.scale.zero) / span for one in judged.said]
    averaged = problem.bins.average(left) / span

    def with_it(drift: Drifted) -> tuple[Drifted, FloatArray, FloatArray]:
        moved = judged.kept(_moved(drift, unmoved, problem.frames)) * span
        return drift, judged.predicted + judged.kept(known) + moved, moved

    drift, step = (
        with_it(one)
        for one in (
            drift_in(averaged, problem.frames, problem.bins.average),
            step_in(averaged, unmoved, problem),
        )
    )
    return step if judged.left_by(step[1]) < LIMITS.nearer * judged.left_by(drift[1]) else drift


def _moved(drift: Drifted, unmoved: Sequence[FloatArray], frames: Sequence[Frame]) -> list[FloatArray]:
    """What a drift or step adds to each output (n,)."""
    pairs = zip(unmoved, frames, strict=True)
    return [drift.cause.on_output(y, drift.values, frame) - y for y, frame in pairs]


def step_in(left: FloatArray, unmoved: Sequence[FloatArray], problem: Problem) -> Drifted:
    """Return the step that fits best what a model leaves, averaged (count,), with a shift beside it.

    The gain is that of the outputs that were not moved; it changes with the step where that shows.
    """
    count, time, cause = left.size, problem.time_s, Step()
    before = np.arange(1, count)
    fall = np.cumsum(left - left.mean())[:-1] ** 2 * count / (before * (count - before))
    end = int(LIMITS.moments_from * count)
    fall[:end], fall[count - 1 - end :] = 0.0, 0.0
    best = int(np.argmax(fall))
    moment = float(0.5 * (time[best] + time[best + 1]))
    tried = [
        problem.bins.average(_moved(Drifted(cause, values, ()), unmoved, problem.frames))
        for values in ((1.0, 0.0, moment), (0.0, 1.0, moment))
    ]
    known = np.stack((np.ones(count), *tried), axis=1)
    values, errors = _with_errors(known, left)
    if abs(values[2]) <= LIMITS.student * errors[2]:
        fewer, fewer_errors = _with_errors(known[:, :2], left)
        values, errors = np.append(fewer, 0.0), np.append(fewer_errors, errors[2])
    rest = left - known @ values
    parts, own = np.array_split(rest, LIMITS.jackknife), max(float(np.var(rest)), TINY)
    slow = max(1.0, float(np.var([one.mean() for one in parts])) * parts[0].size / own)  # it is not white
    alike = np.flatnonzero(fall >= fall[best] - LIMITS.of_a_moment * slow * own)
    half = 0.5 * float(time[alike[-1] + 1] - time[alike[0]]) / LIMITS.student
    return Drifted(
        cause, (float(values[1]), float(values[2]), moment), (float(errors[1]), float(errors[2]), half)
    )


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
    errors = _with_errors(known, rest)[1]
    cause = plain.relaxing if relaxes else plain
    return Drifted(cause, tuple(map(float, values)), tuple(map(float, errors[1:])))


def _with_errors(known: FloatArray, left: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return coefficients (k,) of columns (count, k), and their errors by leaving out tenths of the time."""
    parts = np.array_split(np.arange(left.size), LIMITS.jackknife)
    moved = [_solved(np.delete(known, one, 0), np.delete(left, one)) for one in parts]
    return _solved(known, left), np.sqrt(LIMITS.jackknife - 1) * np.std(moved, axis=0)


def _solved(known: FloatArray, left: FloatArray) -> FloatArray:
    size = np.maximum(np.linalg.norm(known, axis=0), TINY)  # of a step, a tenth may hold all that comes after
    return np.asarray(np.linalg.lstsq(known / size, left, rcond=None)[0] / size)
