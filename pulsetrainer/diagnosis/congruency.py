"""Equal minor loops from unequal histories: what no static Preisach weights can explain.

All minor loops between the same two turning points are congruent in a Preisach operator, whatever its
weights and whatever came before (Mayergoyz, Mathematical Models of Hysteresis, 2003, section 1.2). So the
differences between such loops contain nothing of the weights, of the fineness of the levels, or of anything
that depends on the rate alone. But they do show a feedback of the output into the input, since loops with
another history lie at another output. On the whole record the weights would absorb nearly all of it.

For every loop between turns A and B the residual is averaged at places along its two branches. A constant,
a slope in time and the mean over the loops of one kind are subtracted; the remainder is the *contrast* of
the loop. The contrast that the cause would make, simulated with the fitted weights, is fitted to it. If the
cause is not there, the loops of one kind may be exchanged, which gives an exact test (Good, Permutation
Tests, 2000).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import input_noise
from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.finding import Estimate
from pulsetrainer.diagnosis.fitting import Fitted, weights_for
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.screening import p_value
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY


@dataclass(frozen=True)
class Loop:
    """One closed minor loop B -> A -> B."""

    record: int
    kind: int  # loops of one kind have the same turns and took the same time
    begin: int
    turn: int
    end: int


@dataclass(frozen=True)
class Contrast:
    """A cause fitted to the differences between equal loops."""

    value: float  # its strength
    error: float  # standard error
    p_value: float
    at_bound: bool = False  # the strength ran away

    def estimate(self, cause: Cause) -> Estimate:
        """Return the strength with its 95 % interval."""
        quantity = cause.parameters[0]
        half = LIMITS.normal * self.error + LIMITS.contrast_slope * abs(self.value)
        return Estimate(quantity.name, self.value, quantity.unit, self.value - half, self.value + half)


def loops_of(records: Sequence[Record], low: float, high: float) -> list[Loop]:
    """Return the closed minor loops that were traced more than once, in equal time, by their kind."""
    same = LIMITS.loop_same * (high - low)
    kinds: list[tuple[float, float, float]] = []  # bottom, top, and how long they took
    loops = []
    for k, record in enumerate(records):
        for begin, turn, end in _closed(record.input, low, high):
            if not np.all(record.sample_weight[begin : end + 1]):
                continue
            bottom, top = float(record.input[turn]), float(record.input[begin])
            took = (end - begin) * record.step
            equal = (
                kind
                for kind, (a, b, seconds) in enumerate(kinds)
                if max(abs(a - bottom), abs(b - top)) < same
                and abs(seconds - took) < LIMITS.loop_same_time * seconds
            )
            kind = next(equal, len(kinds))
            if kind == len(kinds):
                kinds.append((bottom, top, took))
            loops.append(Loop(k, kind, begin, turn, end))
    number = np.bincount([loop.kind for loop in loops], minlength=1)
    return [loop for loop in loops if number[loop.kind] >= LIMITS.least_loops]


def _closed(u: FloatArray, low: float, high: float) -> Iterator[tuple[int, int, int]]:
    """Places of the turns B, A, B of an input's minor loops that close where they began."""
    same, narrowest = LIMITS.loop_same * (high - low), LIMITS.loop_narrowest * (high - low)
    turns = input_noise.real_turns(u, LIMITS.loop_turn * narrowest).tolist()
    for (earlier, begin), (turn, end) in zip(pairwise(turns), pairwise(turns[2:]), strict=False):
        before, top, bottom, back = u[[earlier, begin, turn, end]]
        closed = abs(back - top) < same and before < bottom + same
        if closed and top - bottom > narrowest and top < high - same and bottom > low + same:
            yield begin, turn, end


def contrasts(loops: Sequence[Loop], signals: Sequence[FloatArray]) -> FloatArray:
    """Contrasts (loops, 2 places) of one signal (n,) per record."""
    rows = np.stack([_along(loop, signals[loop.record]) for loop in loops])
    drift = np.stack((np.ones(rows.shape[1]), np.linspace(-1.0, 1.0, rows.shape[1])), axis=1)
    basis = np.linalg.qr(drift)[0]
    rows -= rows @ basis @ basis.T
    return _less_means(rows, np.asarray([loop.kind for loop in loops]))


def _less_means(rows: FloatArray, kind: IntArray) -> FloatArray:
    number = np.maximum(np.bincount(kind), 1)
    means = np.zeros((number.size, rows.shape[1]))
    np.add.at(means, kind, rows)
    return np.asarray(rows - (means / number[:, None])[kind])


def _along(loop: Loop, signal: FloatArray) -> FloatArray:
    """Averages (2 places,) of a signal along the way down and the way up."""
    parts = [
        np.array_split(signal[begin:end], LIMITS.loop_places)
        for begin, end in ((loop.begin, loop.turn), (loop.turn, loop.end))
    ]
    return np.asarray([float(piece.mean()) for branch in parts for piece in branch])


def fitted_contrast(
    problem: Problem, fitted: Fitted, cause: Cause, rng: np.random.Generator
) -> Contrast | None:
    """Fit the strength of ``cause`` to the contrasts; None where the records hold no equal loops.

    ``fitted`` is a joint fit without the cause; its other causes stay in.
    """
    low, high = problem.plane.low, problem.plane.high
    loops = [
        loop
        for loop in loops_of(problem.records, low, high)
        if min(loop.turn - loop.begin, loop.end - loop.turn) >= LIMITS.loop_places
    ]
    if not loops:
        return None
    kind = np.asarray([loop.kind for loop in loops])
    free = max(kind.size - np.unique(kind).size, 1)
    measured = contrasts(loops, [r.output for r in problem.records])
    others = _movable(loops, fitted)
    quantity = cause.parameters[0]
    step = LIMITS.contrast_first * cause.starts(problem.frames, [])[0][0][0]
    value, p, error, current = 0.0, 1.0, float("inf"), fitted
    for number in range(LIMITS.contrast_rounds):
        if number:
            step = max(LIMITS.contrast_step * abs(value), quantity.small)
            terms = in_order((*fitted.terms, Term(cause, (value,))))
            current = weights_for(problem, terms, current, rebuild=True)
        base = current.simulator.full(in_order(current.terms))
        moved = current.simulator.full(in_order((*fitted.terms, Term(cause, (value + step,)))))
        slope = contrasts(loops, [(b - a) / step for a, b in zip(base, moved, strict=True)])
        left = measured - contrasts(loops, base)
        if others.size:  # the other causes are known within some error only
            slope, left = (x - (others @ (others.T @ x.ravel())).reshape(x.shape) for x in (slope, left))
        squares = float(np.sum(slope**2))
        if squares <= 0.0:
            return None
        change = float(np.sum(slope * left)) / squares
        if number == 0:
            p = permuted(slope, left, kind, rng)
        each = np.sum((left - change * slope) * slope, axis=1)
        error = float(np.sqrt(np.sum(each**2) * kind.size / free)) / squares
        value = min(max(value + change, quantity.low), quantity.high)
        if p > LIMITS.contrast_hopeless or abs(change) < LIMITS.contrast_settled * error:
            break
    return Contrast(value, error, p, at_bound=value in (quantity.low, quantity.high))


def _movable(loops: Sequence[Loop], fitted: Fitted) -> FloatArray:
    """Orthonormal contrasts (loops times places, k) of the parameters of the causes in the model."""
    base = fitted.simulator.full(fitted.terms)
    columns = []
    for moved, step in fitted.moves:
        after = fitted.simulator.full(moved)
        columns.append(contrasts(loops, [(b - a) / step for a, b in zip(base, after, strict=True)]).ravel())
    if not columns:
        return np.empty((0, 0))
    matrix = np.stack(columns, axis=1)
    return np.asarray(scipy.linalg.orth(matrix / np.maximum(np.linalg.norm(matrix, axis=0), TINY)))


def permuted(slope: FloatArray, left: FloatArray, kind: IntArray, rng: np.random.Generator) -> float:
    """Probability that exchanged loops follow the cause as well.

    How well is told in standard errors over the loops, which need not be equally noisy (Chung and Romano,
    Annals of Statistics 41, 2013: a permutation test keeps its level if its statistic is studentised).
    """
    overlap = slope @ left.T  # (loops, loops)
    same = [np.flatnonzero(kind == k) for k in np.unique(kind)]
    place = np.concatenate(same)
    drawn = np.empty(LIMITS.permutations)
    for k in range(drawn.size):
        drawn[k] = _studentised(overlap[place, np.concatenate([rng.permutation(one) for one in same])])
    return p_value(_studentised(np.diag(overlap)), drawn)


def _studentised(each: FloatArray) -> float:
    """Size of the sum of what the loops say (n,), in standard errors of it."""
    return abs(float(np.sum(each))) / max(float(np.linalg.norm(each)), TINY)
