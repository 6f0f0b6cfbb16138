"""Noise in the input: measured from the record itself, and its false reversals taken out."""

from __future__ import annotations

import numpy as np
import pytest
from core_jobs import job

from pulsetrainer.core import input_noise
from pulsetrainer.core.identification import identify
from pulsetrainer.core.memory import turning_points
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.errors import ArgumentError
from wording import raises

PLANE = Plane.uniform(-1.0, 1.0, 48)


def slow(kind, n=8000):
    """Return a slow input in -1..1 without noise."""
    t = np.linspace(0.0, 1.0, n)
    if kind == "sine":
        return np.sin(2 * np.pi * 15 * t) * (1.0 - 0.9 * t)
    if kind == "triangle":
        return np.abs((t * 30) % 2 - 1) * 2 - 1
    return np.repeat(np.random.default_rng(3).uniform(-1, 1, n // 400), 400)  # rests and jumps


@pytest.mark.parametrize("kind", ["sine", "triangle", "rests"])
@pytest.mark.parametrize("sigma", [1e-4, 1e-3, 1e-2])
def test_the_noise_is_estimated(kind, sigma):
    """Within a tenth, on curves, on ramps with sharp turns, and on rests with jumps."""
    u = slow(kind) + np.random.default_rng(1).normal(0.0, sigma, 8000)
    assert input_noise.estimate(u) == pytest.approx(sigma, rel=0.1)


@pytest.mark.parametrize(
    "level", [0.001, *(pytest.param(level, marks=pytest.mark.slow) for level in (0.0025, 0.005)), 0.01]
)
def test_false_reversals_go_and_prediction_gains(level):
    """The job of the benchmarks with noise in the input too: nearly the true turns, a smaller error."""
    world = job(1)
    rng = np.random.default_rng(3)
    measured = world.input + rng.normal(0.0, 2 * level, world.input.size)
    cleaned = input_noise.clean(measured)
    raw, clean, best = (
        identify([Record(u, world.output)], PLANE, smoothing=0.05).operator
        for u in (measured, cleaned.input, world.input)
    )
    errors = [world.percent(operator(world.unseen_input)) for operator in (raw, clean, best)]
    turns = [turning_points(u).size for u in (measured, cleaned.input, world.input)]
    print(f"seed 3, noise {100 * level} %: error {errors} % of span, turns {turns}")
    assert cleaned.sigma == pytest.approx(2 * level, rel=0.05)
    assert turns[1] <= turns[2] + 2
    assert errors[1] <= 1.1 * errors[0]  # never worse ...
    if level >= 0.005:
        assert errors[1] < 0.5 * errors[0]  # ... and much better where noise exceeds a step
        assert cleaned.removed > 1000
    before, after = (np.sqrt(np.mean((u - world.input) ** 2)) for u in (measured, cleaned.input))
    assert after <= 0.5 * before or cleaned.removed == 0


@pytest.mark.parametrize("kind", ["sine", "triangle", "rests"])
def test_a_clean_input_is_left_alone(kind):
    """The very same samples come back."""
    u = slow(kind)
    cleaned = input_noise.clean(u)
    assert cleaned.input is u
    assert (cleaned.removed, cleaned.kept) == (0, turning_points(u).size - 1)
    assert cleaned.dead_band < 1e-4  # and no more was looked for
    assert input_noise.estimate(u[:16]) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize(
    "u",
    [
        np.random.default_rng(4).uniform(
            -1, 1, 500
        ),  # every sample a reversal: motion, as far as anyone can tell
        np.sin(np.arange(200.0)),  # six samples a period
        np.linspace(0.0, 1.0, 15),  # one sample too few
    ],
)
def test_coarse_records_cannot_tell_noise_from_motion(u):
    """No estimate, and nothing is removed."""
    cleaned = input_noise.clean(u)
    assert np.isnan(cleaned.sigma)
    assert cleaned.input is u
    assert cleaned.removed == 0


def test_no_lag_and_no_lost_amplitude():
    """Zero phase: turns stay where they were, within the noise."""
    rng = np.random.default_rng(5)
    true = slow("triangle")
    cleaned = input_noise.clean(true + rng.normal(0.0, 0.01, true.size)).input
    error = cleaned - true
    rising = np.gradient(true) > 0
    assert abs(error[rising].mean() - error[~rising].mean()) < 0.002
    tops = turning_points(true)[:-1]
    assert np.abs(error[tops]).max() < 0.03


def test_a_record_backwards_is_cleaned_the_same():
    """The filter of a piece of any length is of zero phase."""
    rng = np.random.default_rng(8)
    for n in range(2, 40):
        u = np.linspace(0.0, 0.05, n) + rng.normal(0.0, 0.01, n)
        there, back = (input_noise.monotone_between(x, np.zeros(0, int), 0.01) for x in (u, u[::-1]))
        np.testing.assert_allclose(back[::-1], there, rtol=0, atol=1e-15)


def test_real_turns_alternate_and_exceed_the_band():
    """Every kept swing exceeds the dead-band, from first extreme to first extreme, and holds no other."""
    u = np.round(np.cumsum(np.random.default_rng(6).normal(size=5000)), 1)
    turns = input_noise.real_turns(u, 5.0)
    swings = np.diff(u[turns])
    assert np.all(np.abs(swings) > 5.0)
    assert np.all(swings[1:] * swings[:-1] < 0)
    for begin, end, swing in zip(turns, turns[1:], swings, strict=False):
        way = np.sign(swing) * u[begin : end + 1]
        assert (way.argmin(), way.argmax()) == (0, end - begin)
        assert np.max(np.maximum.accumulate(way) - way) <= 5.0


def test_bad_input_is_named():
    """NaN is refused by name."""
    with raises(ArgumentError, "not such an argument", argument="input", got="nan"):
        input_noise.clean([0.0, np.nan])
