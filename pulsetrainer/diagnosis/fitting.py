"""The joint refit: weights and the parameters of all causes at once.

For given parameters the static weights solve a non-negative problem whose right side is the output less
what the output causes add; the parameters follow by Gauss-Newton on columns from which everything that
the weights can do has been projected away (variable projection: Golub and Pereyra, SIAM J. Numer. Anal.
10, 1973; Kaufman, BIT 15, 1975). Fitting a cause to the residual of a fitted model instead shrinks it: the
weights have already swallowed most of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.diagnosis.causes.base import Frame
from pulsetrainer.diagnosis.design import Bins, Design, Measured, Projector
from pulsetrainer.diagnosis.extended import Term, chain, in_order, seen_input, shown_output

_ROUNDS = 6
_PASSES = 2
_ENOUGH = 2e-3  # relative fall of the sum of squares below which the refit ends


@dataclass(frozen=True)
class Problem:
    """The data, the plane on which the weights live, and how they are averaged."""

    records: tuple[Measured, ...]
    frames: tuple[Frame, ...]
    plane: Plane
    bins: Bins
    measured: FloatArray  # (count,) averaged output
    smoothing: float


@dataclass(frozen=True)
class Fitted:
    """A jointly fitted model."""

    terms: tuple[Term, ...]
    built: tuple[Term, ...]  # the input causes in the rows of the design
    simulator: Simulator
    added: FloatArray  # (count,) what the output causes add to the hysteresis
    design: Design
    passive: NDArray[np.bool_]
    predicted: FloatArray  # (count,)
    residual: FloatArray  # (count,) measured less predicted
    squares: float

    @property
    def names(self) -> tuple[str, ...]:
        """Ids of the causes in it."""
        return tuple(term.cause.id for term in self.terms)

    def projector(self) -> Projector:
        """What its weights can fit."""
        return self.design.projector(self.passive)


class Simulator:
    """Averaged outputs of one operator under many chains; the static part is run once per seen input."""

    def __init__(self, problem: Problem, operator: Preisach) -> None:
        self.problem, self.operator = problem, operator
        self._static: dict[tuple[Term, ...], list[FloatArray]] = {}

    def inner(self, terms: Sequence[Term]) -> list[FloatArray]:
        """Outputs of the hysteresis of every record at the full rate."""
        before = tuple(t for t in terms if t.cause.stage == "input")
        if before not in self._static:
            self._static[before] = [
                chain(before, self.operator, frame, record.output)
                for record, frame in zip(self.problem.records, self.problem.frames, strict=True)
            ]
        return self._static[before]

    def full(self, terms: Sequence[Term]) -> list[FloatArray]:
        """Outputs of every record at the full rate."""
        return [
            shown_output(terms, y, frame)
            for y, frame in zip(self.inner(terms), self.problem.frames, strict=True)
        ]

    def __call__(self, terms: Sequence[Term]) -> FloatArray:
        """Averaged output (count,) of the chain."""
        return self.problem.bins.average(self.full(terms))


def weights_for(
    problem: Problem, terms: Sequence[Term], near: Fitted | None, *, rebuild: bool = False
) -> Fitted:
    """Best weights for given causes.

    The rows are those of ``near``; what the causes make of them is subtracted from the output, with the
    weights of the pass before: m <- fit(y - (M(m) - D m)). The passes contract by the relative size
    of the causes, some per cent. ``rebuild`` makes new rows for the input that the hysteresis now sees, so
    that nothing of an input cause is left to be subtracted.
    """
    if near is None or rebuild:
        built = tuple(t for t in terms if t.cause.stage == "input")
        inputs = [
            seen_input(built, record.output, frame)
            for record, frame in zip(problem.records, problem.frames, strict=True)
        ]
        design = Design.build(problem.plane, problem.bins, inputs, problem.smoothing)
    else:
        design, built = near.design, near.built
    passive = None if near is None else near.passive
    simulator = None if near is None else near.simulator
    added = np.zeros(problem.bins.count)
    exact = tuple(terms) == built
    for _ in range(1 if exact else 3 * _PASSES if near is None else _PASSES):
        if simulator is not None and not exact:
            added = simulator(terms) - simulator(built)
        wanted = problem.measured - added
        found = design.fit(wanted, passive)
        passive = found.passive
        offset = design.offset(wanted, found.x)
        simulator = Simulator(problem, Preisach(problem.plane, found.x / problem.plane.areas, offset))
    assert simulator is not None
    assert passive is not None
    predicted = simulator(terms)
    residual = problem.measured - predicted
    squares = float(residual @ residual)
    return Fitted(tuple(terms), built, simulator, added, design, passive, predicted, residual, squares)


def slopes(problem: Problem, fitted: Fitted) -> FloatArray:
    """Derivatives (count, p) of the averaged output with respect to all parameters, weights held."""
    columns = []
    for k, term in enumerate(fitted.terms):
        for j, quantity in enumerate(term.cause.parameters):
            step = _difference(term, j)
            up = step if term.values[j] + step <= quantity.high else -step
            moved = list(fitted.terms)
            values = list(term.values)
            values[j] += up
            moved[k] = Term(term.cause, tuple(values))
            columns.append((fitted.simulator(moved) - fitted.predicted) / up)
    return np.stack(columns, axis=1) if columns else np.empty((problem.bins.count, 0))


def _difference(term: Term, j: int) -> float:
    quantity = term.cause.parameters[j]
    return max(quantity.small, 0.02 * abs(term.values[j]))


def refit(
    problem: Problem,
    terms: Sequence[Term],
    near: Fitted | None,
    rounds: int = _ROUNDS,
    *,
    rebuild: bool = False,
) -> Fitted:
    """Joint refit from the parameter values in ``terms``."""
    fitted = weights_for(problem, in_order(terms), near, rebuild=rebuild)
    damping = 0.0
    for _ in range(rounds):
        columns = slopes(problem, fitted)
        if columns.shape[1] == 0:
            return fitted
        free = fitted.projector()(columns)
        size = np.sqrt(np.sum(free**2, axis=0))
        size[size == 0] = 1.0
        scaled = free / size
        normal = scaled.T @ scaled
        better = None
        for _ in range(4):
            ridge = np.eye(normal.shape[0]) * (damping + 1e-9)
            step = np.linalg.solve(normal + ridge, scaled.T @ fitted.residual) / size
            trial = weights_for(problem, _moved(fitted.terms, step), fitted)
            if trial.squares < fitted.squares:
                better = trial
                damping *= 0.3
                break
            damping = max(10.0 * damping, 0.1)
        if better is None:
            return fitted
        done = fitted.squares - better.squares < _ENOUGH * better.squares
        fitted = better
        if done:
            break
    return fitted


def _moved(terms: Sequence[Term], step: FloatArray) -> tuple[Term, ...]:
    """Terms after a step, kept within their bounds and within a factor of three of where they were."""
    moved, at = [], 0
    for term in terms:
        values = []
        for quantity, value in zip(term.cause.parameters, term.values, strict=True):
            new = value + float(step[at])
            at += 1
            if quantity.low >= 0 and value > 0:
                new = min(max(new, value / 3.0), value * 3.0)
            values.append(min(max(new, quantity.low), quantity.high))
        moved.append(replace(term, values=tuple(values)))
    return tuple(moved)
