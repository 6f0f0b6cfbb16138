"""What to measure next: the excitation on which causes that are tied look least alike.

Each of a few short experiments is played to the model that was found. What every tied cause would change in
its output, less what the weights can do, and less what the other one could do in its place, is what is left
to tell the two by. The best experiment is the one on which the closest two leave most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.core.signals import through
from pulsetrainer.diagnosis.answer import Answer
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.design import Design
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fitting import Simulator
from pulsetrainer.diagnosis.problem import Problem, problem_for

_RATE_HZ = 200.0


@dataclass(frozen=True)
class Experiment:
    """The best experiment, and how far apart the closest two causes are on it and on the record."""

    words: str
    distance: float  # rms, output unit
    distance_here: float


def best_experiment(answer: Answer, names: Sequence[str]) -> Experiment:
    """Return the experiment that tells the causes ``names`` apart best."""
    terms = [_term(answer, name) for name in names]
    others = tuple(t for t in answer.final.terms if t.cause.id not in names)
    here = _smallest_distance(answer, answer.problem, terms, others)
    plane = answer.problem.plane
    found = []
    for words, shares in _experiments().items():
        u = plane.low + (plane.high - plane.low) * shares
        y = answer.final.simulator.operator(u)
        record = Record(u, y, dt_s=1.0 / _RATE_HZ)
        problem = problem_for([record], plane.low, plane.high, plane.n_h)
        found.append(Experiment(words, _smallest_distance(answer, problem, terms, others), here))
    return max(found, key=lambda one: one.distance)


def _experiments() -> dict[str, FloatArray]:
    """Inputs (n,) in shares of the range, by what they are in words."""

    def path(points: Sequence[float], ranges_per_s: float) -> FloatArray:
        return through(np.asarray(points), ranges_per_s, _RATE_HZ)

    def hold(level: float, seconds: float) -> FloatArray:
        return np.full(round(seconds * _RATE_HZ), level)

    loops = (0.0, 1.0, 0.1, 0.9, 0.2, 0.8, 0.3, 0.7, 0.0)
    steps = [
        part
        for last, level in zip((0.0, 0.9, 0.3, 0.7, 0.1), (0.9, 0.3, 0.7, 0.1, 0.0), strict=True)
        for part in (path((last, level), 8.0), hold(level, 3.0))
    ]
    biases = [
        part
        for bias in (0.1, 0.3, 0.5, 0.7)
        for part in (
            path((0.0, bias, bias + 0.15, bias, bias + 0.15, bias, 0.0), 1.0),
            path((0.0, 1.0, bias, bias + 0.15, bias, bias + 0.15, bias, 0.0), 1.0),
        )
    ]
    cycles = (0.0, *(0.8, 0.2) * 20, 0.0)
    loop = path((0.0, 1.0, 0.0), 1.0)
    return {
        "nested loops at 0.5, 1.5, 4 and 8 ranges a second": np.concatenate(
            [path(loops, rate) for rate in (0.5, 4.0, 1.5, 8.0)]
        ),
        "fast steps to five levels with holds of three seconds": np.concatenate(steps),
        "equal minor loops at four levels, each reached from below and from above": np.concatenate(biases),
        "twenty equal cycles slowly and twenty fast": np.concatenate([path(cycles, 1.5), path(cycles, 6.0)]),
        "half a minute at the top between equal major loops, and the same at rest": np.concatenate(
            [loop, path((0.0, 1.0), 1.0), hold(1.0, 30.0), path((1.0, 0.0), 1.0), loop, hold(0.0, 30.0), loop]
        ),
    }


def _term(answer: Answer, name: str) -> Term:
    """Return the cause as it was fitted, or at those of its start values that are most like the best one."""
    for term in answer.final.terms:
        if term.cause.id == name:
            return term
    cause = library()[name]
    parts = [
        answer.problem.bins.even(answer.baseline.residual, k) for k in range(len(answer.problem.records))
    ]
    starts = [Term(cause, block[0]) for block in cause.starts(answer.problem.frames, parts)]
    simulator = answer.baseline.simulator
    changes = np.stack([simulator((one,)) - answer.baseline.simulated for one in starts], axis=1)
    free = answer.baseline.projector(changes)
    like = np.abs(free.T @ answer.baseline.residual) / np.maximum(np.linalg.norm(free, axis=0), 1e-300)
    return starts[int(np.argmax(like))]


def _smallest_distance(
    answer: Answer, problem: Problem, terms: Sequence[Term], others: tuple[Term, ...]
) -> float:
    simulator = Simulator(problem, answer.final.simulator.operator)
    plain = simulator(others)
    changes = np.stack([simulator(in_order((*others, term))) - plain for term in terms], axis=1)
    rows = Design.build(problem.plane, problem.bins, problem.paths(()), problem.smoothing)
    free = rows.projector(answer.final.passive)(changes)
    size = np.maximum(np.linalg.norm(free, axis=0), 1e-300)
    cosine = np.abs(free.T @ free) / np.outer(size, size) - np.eye(len(terms))
    sine = np.sqrt(np.maximum(1.0 - np.max(cosine, axis=0) ** 2, 0.0))
    return float(np.min(size * sine) / np.sqrt(problem.bins.count))
