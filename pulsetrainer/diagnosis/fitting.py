"""The joint refit: weights and the parameters of all causes at once.

For given parameters of the causes the static weights solve a non-negative problem. Its right side is the
output less what the causes of the output add. The parameters follow by Gauss-Newton on columns from which
everything that the weights can do has been projected away (variable projection: Golub and Pereyra, SIAM J.
Numer. Anal. 10, 1973; Kaufman, BIT 15, 1975). To fit a cause to the residual of a fitted model instead would
make it too small: the weights have already absorbed most of it.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.design import Design, Projector
from pulsetrainer.diagnosis.extended import Term, hysteresis, in_order, shown_output
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.thresholds import LIMITS


@dataclass(frozen=True, eq=False)
class Fitted:
    """A jointly fitted model; one fit is the same as itself only."""

    terms: tuple[Term, ...]
    simulator: Simulator
    design: Design
    passive: BoolArray
    simulated: FloatArray  # (count,) as the causes and the operator give it
    residual: FloatArray  # (count,) measured less simulated, without offset and start
    squares: float
    _without: dict[str, Fitted] = field(default_factory=dict, init=False, repr=False)
    _changes: dict[Term, FloatArray] = field(default_factory=dict, init=False, repr=False)

    @property
    def problem(self) -> Problem:
        """What it was fitted to."""
        return self.simulator.problem

    @property
    def rms(self) -> float:
        """Rms of the residual."""
        return root_mean_square(self.residual)

    @property
    def names(self) -> tuple[str, ...]:
        """Ids of the causes in it."""
        return tuple(term.cause.id for term in self.terms)

    @cached_property
    def projector(self) -> Projector:
        """What its weights can fit."""
        return self.design.projector(self.passive)

    @cached_property
    def _beside(self) -> FloatArray:
        """Orthonormal columns (count, k) of what the parameters of its causes change, weights taken off."""
        own = self.projector(self.slopes)
        return scipy.linalg.orth(own) if own.shape[1] else own

    def beyond(self, columns: FloatArray) -> FloatArray:
        """Columns (count, k) less what its weights and the parameters of its causes can do."""
        free = self.projector(columns)
        free -= self._beside @ (self._beside.T @ free)
        return free

    def without(self, term: Term) -> Fitted:
        """Return the same with one of its causes taken out; made once for all who ask."""
        if term.cause.id not in self._without:
            others = [other for other in self.terms if other.cause is not term.cause]
            self._without[term.cause.id] = refit(self.problem, others, self, rounds=LIMITS.without_rounds)
        return self._without[term.cause.id]

    def change(self, term: Term) -> FloatArray:
        """Change of the averaged output (count,) when one more cause is put in; made once for all who ask."""
        if term not in self._changes:
            self._changes[term] = self.simulator(in_order((*self.terms, term))) - self.simulated
        return self._changes[term]

    @cached_property
    def slopes(self) -> FloatArray:
        """Derivatives (count, p) of the averaged output with respect to all parameters, weights held."""
        columns = [(self.simulator(moved) - self.simulated) / step for moved, step in self.moves]
        return np.stack(columns, axis=1) if columns else np.empty((self.simulated.size, 0))

    @property
    def moves(self) -> list[tuple[list[Term], float]]:
        """The terms with each parameter moved by a small step, and that step."""
        found = []
        frame = self.problem.frames[0]
        for k, term in enumerate(self.terms):
            for j, quantity in enumerate(term.cause.quantities(frame)):
                value = term.values[j]
                step = max(quantity.small, LIMITS.difference * abs(value))
                up = step if value + step <= quantity.high else -step
                moved = Term(term.cause, (*term.values[:j], value + up, *term.values[j + 1 :]))
                found.append(([*self.terms[:k], moved, *self.terms[k + 1 :]], up))
        return found


class Simulator:
    """Averaged outputs of one operator under many chains; what they begin with alike is run once."""

    def __init__(self, problem: Problem, operator: Preisach) -> None:
        self.problem, self.operator = problem, operator
        rest = float(self.static(np.asarray([problem.plane.low]))[0])
        self.frames = [frame.about(rest) for frame in problem.frames]
        self._static: dict[tuple[Term, ...], list[FloatArray]] = {}
        self._shown: OrderedDict[tuple[Term, ...], list[FloatArray]] = OrderedDict()

    def static(self, u: FloatArray) -> FloatArray:
        """Output (n,) of the hysteresis for what it sees (n,), from negative saturation."""
        y, base = self.operator(u), self.problem.base
        return y if base is None else y + base(u)

    def inner(self, terms: Sequence[Term]) -> list[FloatArray]:
        """Outputs of the hysteresis of every record at the full rate."""
        before = tuple(t for t in terms if t.cause.stage == "input")
        if before not in self._static:
            if any(t.cause.feeds_back for t in before):
                self._static[before] = [
                    hysteresis(before, self.static, frame, alone)
                    for frame, alone in zip(self.problem.frames, self.inner(()), strict=True)
                ]
            else:
                self._static[before] = [one.output(self.operator) for one in self.problem.paths(before)]
        return self._static[before]

    def full(self, terms: Sequence[Term]) -> list[FloatArray]:
        """Outputs of every record at the full rate."""
        if not any(term.cause.stage == "output" for term in terms):
            return self.inner(terms)
        whole = tuple(terms)
        if whole not in self._shown:
            begun = self.full(whole[:-1])
            self._shown[whole] = [
                shown_output(whole[-1:], y, frame) for y, frame in zip(begun, self.frames, strict=True)
            ]
            if len(self._shown) > LIMITS.shown_kept:
                self._shown.popitem(last=False)
        self._shown.move_to_end(whole)
        return self._shown[whole]

    def __call__(self, terms: Sequence[Term]) -> FloatArray:
        """Averaged output (count,) of the chain."""
        return self.problem.bins.average(self.full(terms))


def added(simulator: Simulator, terms: Sequence[Term], others: Sequence[Term] = ()) -> list[FloatArray]:
    """Return what causes add to the output of each record (n,) beside ``others``, in units of the problem."""
    pairs = zip(simulator.full(terms), simulator.full(others), strict=True)
    return [whole - rest for whole, rest in pairs]


def weights_for(
    problem: Problem, terms: Sequence[Term], near: Fitted | None, *, rebuild: bool = False
) -> Fitted:
    """Best weights for given causes.

    The rows are those of ``near``; what the causes make of them is subtracted from the output, with the
    weights of the pass before: m <- fit(y - (M(m) - D m)). The passes contract by the relative size
    of the causes, some per cent, and end when they change little against the residual. If they do not
    contract, the best of them is taken, or of those that begin with nothing: the rows of a filter begin at
    rest where a masked lead ends, and cells that are seen only there may have any weight. ``rebuild`` makes
    new rows for the input that the hysteresis now sees, so that nothing of an input cause is left to be
    subtracted.
    """
    design = _rows(problem, terms) if near is None or rebuild else near.design
    passive = None if near is None else near.passive
    simulator = None if near is None else near.simulator
    added = np.zeros(problem.bins.count)
    if simulator is not None:
        added = simulator(terms) - design.shown(simulator.operator)
    elif problem.base is not None:
        # before anything is fitted: what the weights correct, alone
        added = Simulator(problem, _operator(problem, np.zeros(problem.plane.n_q), 0.0))(terms)
    made: list[Fitted] = []
    moved = inf
    for _ in range(LIMITS.passes):
        wanted = problem.measured - added
        found = design.fit(wanted, passive, signed=problem.signed)
        passive = found.passive
        offset = design.offset(wanted, found.x)
        simulator = Simulator(problem, _operator(problem, found.x, offset))
        simulated = simulator(terms)
        residual = problem.bins.settled(problem.measured - simulated)
        squares = float(residual @ residual)
        made.append(Fitted(tuple(terms), simulator, design, found.passive, simulated, residual, squares))
        before, added = added, simulated - design.shown(simulator.operator)
        moves, moved = moved, float(np.linalg.norm(problem.bins.settled(added - before)))
        if moved < LIMITS.passes_settled * np.linalg.norm(residual):
            break
        if moved >= moves:
            made += [] if near is None else [weights_for(problem, terms, None)]
            return min(made, key=lambda fitted: fitted.squares)
    return made[-1]


def _operator(problem: Problem, masses: FloatArray, offset: float) -> Preisach:
    """Return the operator with masses (n_q,) on the plane of the problem."""
    plane = problem.plane
    return Preisach(plane, masses / plane.areas, offset, signed=problem.signed)


def _rows(problem: Problem, terms: Sequence[Term]) -> Design:
    """Rows behind the input causes, through the output causes that filter them."""
    before = tuple(t for t in terms if t.cause.stage == "input")
    through = [t for t in terms if t.cause.in_rows]

    def one(columns: FloatArray, k: int, dt_s: float) -> FloatArray:
        return shown_output(through, columns, replace(problem.frames[k], dt_s=dt_s))

    bins, steps = problem.bins, [record.step for record in problem.records]
    shown = bins.short(one, steps) if through else None
    if through and shown is None:
        shown = partial(bins.filtered, through=one, dt_s=steps)
    return Design.build(problem.plane, bins, problem.paths(before), problem.smoothing, shown)


def refit(
    problem: Problem,
    terms: Sequence[Term],
    near: Fitted | None,
    rounds: int = LIMITS.refit_rounds,
    *,
    rebuild: bool = False,
    goal: float = inf,
) -> Fitted:
    """Joint refit from the parameter values in ``terms``; given up where it comes nowhere near ``goal``.

    The goal is a sum of squares: the steps fall off fast, so what many of the last one would not reach is
    not reached.
    """
    known = near.names if near is not None else ()
    new = {t.cause for t in terms if t.cause.id not in known}
    # a lag before the hysteresis moves every switch: too much to be subtracted
    rebuild = rebuild or any(cause.in_rows or cause.stage == "input" for cause in new)
    fitted = weights_for(problem, in_order(terms), near, rebuild=rebuild)
    damping = 0.0
    for _ in range(rounds):
        columns = fitted.slopes
        if columns.shape[1] == 0:
            return fitted
        free = fitted.projector(columns)
        size = np.sqrt(np.sum(free**2, axis=0))
        size[size == 0] = 1.0
        scaled = free / size
        normal = scaled.T @ scaled
        better = None
        for _ in range(LIMITS.step_tries):
            ridge = np.eye(normal.shape[0]) * (damping + LIMITS.ridge_steps)
            step = np.linalg.solve(normal + ridge, scaled.T @ fitted.residual) / size
            trial = weights_for(problem, _moved(fitted.terms, step, problem.frames[0]), fitted)
            if trial.squares < fitted.squares:
                better = trial
                damping *= LIMITS.damping_falls
                break
            damping = max(LIMITS.damping_rises * damping, LIMITS.damping_least)
        if better is None:
            return fitted
        fall = fitted.squares - better.squares
        fitted = better
        if fall < LIMITS.enough * fitted.squares or LIMITS.hopeless * fall < fitted.squares - goal:
            break
    return fitted


def _moved(terms: Sequence[Term], step: FloatArray, frame: Frame) -> tuple[Term, ...]:
    """Terms after a step, kept within their bounds and within a factor of three of where they were."""
    moved, changes = [], iter(step.tolist())
    for term in terms:
        values = []
        for quantity, value in zip(term.cause.quantities(frame), term.values, strict=True):
            new = value + next(changes)
            if quantity.low >= 0 and value > 0:
                new = min(max(new, value / LIMITS.step_factor), value * LIMITS.step_factor)
            values.append(min(max(new, quantity.low), quantity.high))
        moved.append(replace(term, values=tuple(values)))
    return tuple(moved)
