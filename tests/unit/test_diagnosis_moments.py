"""When a step was: the best moment is found from far off, and the interval holds a plateau."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit
from pulsetrainer.diagnosis.floor import floor_of
from pulsetrainer.diagnosis.held_out import HeldOut
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.screening import screen
from pulsetrainer.diagnosis.stages.acceptance import settled
from pulsetrainer.diagnosis.stages.parameters import estimates_of

DT, CYCLE_S, REST_S = 0.01, 4.0, 1.6
STEP = library()["step"]


def _record(offset: float, gain: float, moment: float, color: float = 0.0, rms: float = 1e-3) -> Record:
    """Twenty loops of 4 s, each of which begins with a rest at zero, with a step and noise."""
    t = np.arange(0.0, 20 * CYCLE_S, DT)
    u = np.interp(t % CYCLE_S, [0.0, REST_S, 2.8, CYCLE_S], [0.0, 0.0, 1.0, 0.0])
    noise = np.random.default_rng(4).normal(0.0, rms, t.size)
    for k in range(1, t.size):
        noise[k] = color * noise[k - 1] + np.sqrt(1.0 - color**2) * noise[k]
    y = u**2
    return Record(u, np.where(t >= moment, y * (1.0 + gain) + offset, y) + noise, dt_s=DT)


def _told(record: Record, begun: float):
    """The moment of a step with its interval, when the search began at another one."""
    problem = problem_for([record], 0.0, 1.0)
    fitted = settled(problem, refit(problem, [Term(STEP, (0.001, 0.01, begun))], None))
    floor = floor_of([record], [], problem).at(problem.coarser(), fitted)
    noise = screen(fitted, np.random.default_rng(1))
    return estimates_of(fitted, noise, HeldOut(problem), floor)["step"][2]


@pytest.mark.parametrize("begun", [31.0, 42.0, 55.0])
def test_the_best_moment_is_found_from_far_off(begun):
    """The gain changes on a slope, where it shows; the fit has a low in every loop beside it."""
    told = _told(_record(0.0, 0.03, 42.4), begun)
    assert told.lower <= 42.4 <= told.upper
    assert told.value == pytest.approx(42.4, abs=0.1)
    assert told.upper - told.lower < 1.0


def test_a_gain_that_changes_at_rest_may_have_changed_at_any_time_of_it():
    """Near an output of zero it does not show: the interval is the rest, and a little of the slopes."""
    told = _told(_record(0.0, 0.03, 40.6), 40.8)
    assert told.lower <= 40.05
    assert told.upper >= 41.55
    assert 38.5 < told.lower < told.upper < 42.6


def test_slow_noise_widens_the_interval():
    """Neighbours that go together tell less than as many that do not."""
    white, slow = (_told(_record(0.01, 0.0, 41.0, color, 0.005), 41.2) for color in (0.0, 0.95))
    assert slow.lower <= 41.0 <= slow.upper
    assert slow.upper - slow.lower > 1.5 * (white.upper - white.lower)


def test_an_offset_shows_at_rest():
    """There the moment is known to a few samples."""
    told = _told(_record(0.02, 0.0, 40.6), 40.8)
    assert told.lower <= 40.6 <= told.upper
    assert told.upper - told.lower < 0.1


def test_what_the_levels_miss_widens_the_interval():
    """As it widens all others: a fifth of it may be in line."""
    record = _record(0.0, 0.03, 42.4)
    problem = problem_for([record], 0.0, 1.0)
    fitted = settled(problem, refit(problem, [Term(STEP, (0.001, 0.01, 42.4))], None))
    floor, noise = floor_of([record], [], problem), screen(fitted, np.random.default_rng(1))
    fine, coarse = (
        estimates_of(fitted, noise, HeldOut(problem), replace(floor, discretisation=size))["step"][2]
        for size in (0.0, 5e-3)
    )
    assert coarse.upper - coarse.lower > 1.5 * (fine.upper - fine.lower)
