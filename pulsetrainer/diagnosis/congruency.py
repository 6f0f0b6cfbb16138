"""Equal minor loops from unequal histories: what no static Preisach weights can explain.

All minor loops between the same two turning points are congruent in a Preisach operator, whatever its
weights and whatever came before (Mayergoyz, Mathematical Models of Hysteresis, 2003, section 1.2). So the
differences between such loops hold nothing of the weights, of how finely they are drawn, or of anything
that depends on the rate alone; a feedback of the output into the input is seen in them, since loops of
another history lie at another output. On the whole record the weights would swallow nearly all of it.

Of every loop between turns A and B the residual is averaged in places along its two branches; what is left
after a constant, a slope in time and the mean over the loops of one kind are taken off is its contrast.
The cause's own contrast, simulated with the fitted weights, is fitted to it. Under the null the loops of
one kind may be exchanged, which gives an exact test (Good, Permutation Tests, 2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

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
    reach = high - low
    found: list[tuple[int, int, int, int, float, float]] = []
    for k, record in enumerate(records):
        u = record.input
        at = input_noise.real_turns(u, LIMITS.loop_turn * LIMITS.loop_narrowest * reach)
        values = u[at]
        for j in range(1, at.size - 2):
            before, top, bottom, back = (values[j + k] for k in (-1, 0, 1, 2))
            wide = top - bottom
            closed = abs(back - top) < LIMITS.loop_same * reach and before < bottom + LIMITS.loop_same * reach
            inside = top < high - LIMITS.loop_same * reach and bottom > low + LIMITS.loop_same * reach
            if wide > LIMITS.loop_narrowest * reach and closed and inside:
                whole = slice(int(at[j]), int(at[j + 2]) + 1)
                if np.all(record.sample_weight[whole]):
                    found.append((k, int(at[j]), int(at[j + 1]), int(at[j + 2]), float(bottom), float(top)))
    kinds: list[tuple[float, float, float]] = []
    loops = []
    for k, begin, turn, end, bottom, top in found:
        took = (end - begin) * records[k].step
        equal = [
            kind
            for kind, (a, b, seconds) in enumerate(kinds)
            if max(abs(a - bottom), abs(b - top)) < LIMITS.loop_same * reach
            and abs(seconds - took) < LIMITS.loop_same_time * seconds
        ]
        if not equal:
            equal = [len(kinds)]
            kinds.append((bottom, top, took))
        loops.append(Loop(k, equal[0], begin, turn, end))
    number = np.bincount([loop.kind for loop in loops], minlength=1)
    return [loop for loop in loops if number[loop.kind] >= LIMITS.least_loops]


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
    measured = contrasts(loops, [r.output for r in problem.records])
    quantity = cause.parameters[0]
    first = cause.starts(problem.frames, [])[0][0][0]
    others = _movable(loops, fitted)
    value, p, error = 0.0, 1.0, float("inf")
    current = fitted
    for number in range(LIMITS.contrast_rounds):
        terms = fitted.terms if number == 0 else (*fitted.terms, Term(cause, (value,)))
        if number:
            current = weights_for(problem, in_order(terms), current, rebuild=True)
        base = current.simulator.full(in_order(terms))
        step = (
            LIMITS.contrast_first * first
            if number == 0
            else max(LIMITS.contrast_step * abs(value), quantity.small)
        )
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
        free = max(kind.size - np.unique(kind).size, 1)
        error = float(np.sqrt(np.sum(each**2) * kind.size / free)) / squares
        value = min(max(value + change, quantity.low), quantity.high)
        if p > LIMITS.contrast_hopeless or abs(change) < LIMITS.contrast_settled * error:
            break
    at_bound = value in (quantity.low, quantity.high)
    return Contrast(value, error, p, at_bound)


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
    return np.asarray(linalg.orth(matrix / np.maximum(np.linalg.norm(matrix, axis=0), TINY)))


def permuted(slope: FloatArray, left: FloatArray, kind: IntArray, rng: np.random.Generator) -> float:
    """Probability that exchanged loops follow the cause as well."""
    overlap = slope @ left.T  # (loops, loops)
    same = [np.flatnonzero(kind == k) for k in np.unique(kind)]
    drawn = np.empty(LIMITS.permutations)
    for k in range(drawn.size):
        drawn[k] = sum(float(overlap[members, rng.permutation(members)].sum()) for members in same)
    return p_value(abs(float(np.trace(overlap))), np.abs(drawn))
