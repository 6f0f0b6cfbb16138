"""A lag of few time steps, computed as a recorder or a simulation computes it from sample to sample."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from form_devices import play

import pulsetrainer as pt

STEP_S = 37.0


def _input(rng: np.random.Generator) -> np.ndarray:
    """Strokes that decay, then turns at random, at 150 and at 40 samples a stroke."""
    turns = [0.0, *(side * 0.93**k for k in range(12) for side in (1, -1)), *rng.uniform(-1, 1, 16)]
    strokes = [
        np.linspace(a, b, max(4, int(abs(b - a) / 2 * samples)), endpoint=False)
        for samples in (150, 40)
        for a, b in pairwise(turns)
    ]
    return np.concatenate(strokes)


def _behind(x: np.ndarray, steps: float, between: float) -> np.ndarray:
    """A lag of ``steps`` time steps: the later sample, the earlier one, or a fine line between both."""
    keeps, fine = np.exp(-1.0 / steps), 200
    y = [x[0]]
    for before, after in pairwise(x):
        last = y[-1]
        if between:
            y.append(keeps * last + (1.0 - keeps) * (after if between > 0 else before))
            continue
        for k in range(fine):
            last += (before + (k + 0.5) / fine * (after - before) - last) / (steps * fine + 0.5)
        y.append(last)
    return np.asarray(y)


def _device(u: np.ndarray, rng: np.random.Generator, steps: float, between: float, *, after: bool) -> pt.Run:
    """Sixty plays of random weights, the lag before or after them, noise of 0.2 %."""
    radii, weights = np.linspace(0.0, 0.9, 60), rng.gamma(1.0, 1.0, 60)
    seen = u if after else _behind(u, steps, between)
    y = play(seen, radii) @ weights
    y = _behind(y, steps, between) if after else y
    y = (y - y.min()) / np.ptp(y) + rng.normal(0.0, 0.002, u.size)
    return pt.Run(time_s=STEP_S * np.arange(u.size), input=u, output=y)


@pytest.mark.slow
@pytest.mark.parametrize("between", [1, -1, 0])
@pytest.mark.parametrize("after", [True, False])
def test_the_lag_alone_is_found_and_its_interval_holds_it(after, between):
    """A force by speed, or a resonance, stood beside it, and its interval lay half a time step away."""
    seed = 148_000 + 10 * after + between
    rng = np.random.default_rng(seed)
    steps = rng.uniform(3.0, 9.0)
    run = _device(_input(rng), rng, steps, between, after=after)
    told = pt.diagnose(run, pt.identify(run))
    found, *others = told.found
    assert [one.cause for one in others if between or not one.doubts] == [], seed
    assert (found.cause, told.verdict) == (("output-lag" if after else "field-lag"),) * 2, seed
    tau, *more = found.parameters
    assert tau.lower <= steps * STEP_S <= tau.upper, (seed, steps)
    assert tau.upper - tau.lower < 0.1 * tau.value
    assert [one.lower <= between <= one.upper for one in more] == [True] * abs(between)
    assert told.extended_percent < 1.15 * told.noise_percent


@pytest.mark.slow
@pytest.mark.parametrize("filtered", [0.0, 2.5])
def test_a_force_by_speed_around_each_sample_is_found_alone(filtered):
    """By central differences half of the force of a turn comes a sample early; the other half was left."""
    seed = 148_900 + round(filtered)
    rng = np.random.default_rng(seed)
    u = _input(rng)
    speed = _behind(np.gradient(u), filtered, 0) if filtered else np.gradient(u)
    y = play(u, np.linspace(0.0, 0.9, 60)) @ rng.gamma(1.0, 1.0, 60)
    y = (y - y.min()) / np.ptp(y) + rng.uniform(1.0, 2.0) * speed + rng.normal(0.0, 0.002, u.size)
    run = pt.Run(time_s=STEP_S * np.arange(u.size), input=u, output=y)
    told = pt.diagnose(run, pt.identify(run))
    found, *others = told.found
    assert (found.cause, others, told.verdict) == ("viscous", [], "viscous"), seed
    between = [one.value for one in found.parameters if one.name == "between"]
    assert between == ([] if filtered else [pytest.approx(0.5, abs=0.2)])  # behind a filter it is no matter
    assert told.left.whole, told.left


@pytest.mark.slow
@pytest.mark.parametrize("between", [1, 0])
def test_the_interval_of_a_slow_recorder_holds_digital_filters_too(between):
    """One that goes from sample to sample is told half a time step shorter, and was outside in 2 of 2."""
    seed = 148_700 + between
    rng = np.random.default_rng(seed)
    u, steps = _input(rng), rng.uniform(4.0, 8.0)
    y = play(u, np.linspace(0.0, 0.9, 60)) @ rng.gamma(1.0, 1.0, 60)
    y = (y - y.min()) / np.ptp(y) + rng.normal(0.0, 0.002, u.size)
    run = pt.Run(time_s=STEP_S * np.arange(u.size), input=_behind(u, steps, between), output=y)
    told = pt.diagnose(run, pt.identify(run))
    assert told.verdict == "input-lag", seed
    (tau,) = told.found[0].parameters
    assert tau.lower <= steps * STEP_S <= tau.upper, (seed, steps)
    assert tau.upper - tau.lower < 2.5 * STEP_S
