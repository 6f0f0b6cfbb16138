"""What to measure next: the excitation on which causes that are tied look least alike.

Each of a few short experiments is simulated with the model that was found. Each tied cause would change the
output. Of that change, the weights can do a part, and another tied cause can do a part; the remainder is
what distinguishes the two. The best experiment is the one with the largest remainder for the closest pair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from pulsetrainer.core.excitations import through
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.creep import Creep
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.design import Design
from pulsetrainer.diagnosis.extended import Term, in_order
from pulsetrainer.diagnosis.fast_causes import as_late, fast_s
from pulsetrainer.diagnosis.fitting import Simulator
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY

# Inputs in shares of the range, speeds in ranges a second, times in s
_NESTED = (0.0, 1.0, 0.1, 0.9, 0.2, 0.8, 0.3, 0.7, 0.0)
RATES = (0.5, 4.0, 1.5, 8.0)
LEVELS = (0.0, 0.9, 0.3, 0.7, 0.1, 0.0)
_FAST, HOLD_S = 8.0, 3.0
BIASES, WIDTH = (0.1, 0.3, 0.5, 0.7), 0.15
CYCLE = (0.8, 0.2)
_CYCLES = (0.0, *CYCLE * 20, 0.0)
_CYCLE_RATES = (1.5, 4.0)
HEATING_S = 30.0
TURNS = _NESTED[1:-1]
SAMPLED_S = 1.0 / 160.0  # twenty samples in a range at the highest rate ...
SAMPLED_AT_REST_S = 0.05  # ... and where the rests tell
_RESTS = ("steps and holds", "heating")
PACE = 1.0  # of minor loops, and of those around the heating
_FASTER = (1.0, 4.0)  # a slow record may hide what is faster than its own second


@dataclass(frozen=True)
class Experiment:
    """The best experiment, and how far apart the closest two causes are on it and on the record."""

    name: str  # what it is in words: see ``wording``
    distance: float  # rms, output unit
    distance_here: float
    faster: float  # its rates in those of ``RATES``; its times are as much shorter


def best_experiment(state: State, names: Sequence[str]) -> Experiment:
    """Return the experiment that tells the causes ``names`` apart best."""
    terms = [_term(state, name) for name in names]
    others = tuple(t for t in state.current.terms if t.cause.id not in names)
    here = _smallest_distance(state, state.problem, terms, others)
    plane = state.problem.plane
    found = []
    # lags look least alike in the shortest of records, which would tell nothing else
    apart = sampled_apart(state)
    factors = (*_FASTER, as_fast_as(fastest_of(state, names), apart)) if Creep.id in names else _FASTER
    for (name, shares), faster in product(_experiments().items(), factors):
        u = plane.low + (plane.high - plane.low) * shares
        y = state.current.simulator.static(u)
        record = Record(u, y, dt_s=1.0 / (faster * LIMITS.experiment_Hz))
        problem = state.problem.of([record])
        found.append(Experiment(name, _smallest_distance(state, problem, terms, others), here, faster))
    return max(found, key=lambda one: one.distance)


def fastest_of(state: State, names: Sequence[str]) -> float | None:
    """Return the shortest time of these causes, s of the records, where it is as fast as the samples.

    A filter of no time at all is none.
    """
    frame = state.problem.frames[0]
    terms = [term for term in state.current.terms if term.cause.id in names and _takes_time(term, frame)]
    times = (fast_s(term, frame) for term in terms)
    return min((tau for tau in times if tau is not None), default=None)


def _takes_time(term: Term, frame: Frame) -> bool:
    bounds = term.cause.quantities(frame)
    return any(one.unit == "s" and value >= one.small for value, one in zip(term.values, bounds, strict=True))


def as_fast_as(tau: float | None, apart: float) -> float:
    """Return how many times faster an experiment must be to show a time, s; 1 where there is none.

    The samples of the record are so far ``apart``, s. Its bench is not asked for ones that are much closer.
    """
    if tau is None:
        return 1.0
    at_most = LIMITS.sampled_faster * SAMPLED_S / apart
    return max(1.0, min(HOLD_S / (LIMITS.fast_stop * tau), at_most))


def sampled_apart(state: State) -> float:
    """Return the time between two samples of the first record, s."""
    frame = state.problem.frames[0]
    return frame.dt_s / frame.averaged


def sampled_s(name: str) -> float:
    """Return the longest time between two samples of an experiment, s, at the rates of ``RATES``."""
    return SAMPLED_AT_REST_S if name in _RESTS else SAMPLED_S


def length_s(name: str) -> float:
    """Return how long an experiment takes, s, at the rates of ``RATES``."""
    return _experiments()[name].size / LIMITS.experiment_Hz


def _experiments() -> dict[str, FloatArray]:
    """Inputs (n,) in shares of the range, by name."""

    def path(points: Sequence[float], ranges_per_s: float) -> FloatArray:
        return through(np.asarray(points), ranges_per_s, LIMITS.experiment_Hz)

    def hold(level: float, seconds: float) -> FloatArray:
        return np.full(round(seconds * LIMITS.experiment_Hz), level)

    steps = [
        part for last, level in pairwise(LEVELS) for part in (path((last, level), _FAST), hold(level, HOLD_S))
    ]
    biases = [
        path((*above, bias, bias + WIDTH, bias, bias + WIDTH, bias, 0.0), PACE)
        for bias in BIASES
        for above in ((0.0,), (0.0, 1.0))
    ]
    loop = path((0.0, 1.0, 0.0), PACE)
    rise, fall = path((0.0, 1.0), PACE), path((1.0, 0.0), PACE)
    heating = (loop, rise, hold(1.0, HEATING_S), fall, loop, hold(0.0, HEATING_S), loop)
    return {
        "nested loops": np.concatenate([path(_NESTED, rate) for rate in RATES]),
        "steps and holds": np.concatenate(steps),
        "equal minor loops": np.concatenate(biases),
        "equal cycles": np.concatenate([path(_CYCLES, rate) for rate in _CYCLE_RATES]),
        "heating": np.concatenate(heating),
    }


def _term(state: State, name: str) -> Term:
    """Return the cause as it was fitted, or at those of its start values that are most like the best one."""
    for term in state.current.terms:
        if term.cause.id == name:
            return term
    frame, cause = state.problem.frames[0], library()[name]
    for term in state.current.terms:
        for other in as_late(term, frame):
            if other.cause.id == name:
                return other
    parts = [state.problem.bins.even(state.baseline.residual, k) for k in range(len(state.problem.records))]
    starts = [Term(cause, block[0]) for block in cause.starts(state.problem.frames, parts)]
    simulator = state.baseline.simulator
    changes = np.stack([simulator((one,)) - state.baseline.simulated for one in starts], axis=1)
    free = state.baseline.projector(changes)
    like = np.abs(free.T @ state.baseline.residual) / np.maximum(np.linalg.norm(free, axis=0), TINY)
    return starts[int(np.argmax(like))]


def _smallest_distance(
    state: State, problem: Problem, terms: Sequence[Term], others: tuple[Term, ...]
) -> float:
    simulator = Simulator(problem, state.current.simulator.operator)
    plain = simulator(others)
    changes = np.stack([simulator(in_order((*others, term))) - plain for term in terms], axis=1)
    rows = Design.build(problem.plane, problem.bins, problem.paths(()), problem.smoothing)
    free = rows.projector(state.current.passive)(changes)
    size = np.maximum(np.linalg.norm(free, axis=0), TINY)
    along = free / size  # a change that is nowhere stays zero
    cosine = np.abs(along.T @ along) - np.eye(len(terms))
    sine = np.sqrt(np.maximum(1.0 - np.max(cosine, axis=0) ** 2, 0.0))
    return float(np.min(size * sine) / np.sqrt(problem.bins.count))
