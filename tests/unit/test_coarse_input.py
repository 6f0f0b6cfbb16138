"""An input that is read in coarse steps: what it did between them, and that no cause is made of the steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from form_devices import play

import pulsetrainer as pt
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.coarse_input import as_it_moved, hidden_square

STEP = 1 / 55


def _device(u: np.ndarray) -> np.ndarray:
    """Output (n,) of plays of several widths, a Preisach device."""
    return 0.3 * u + play(u, np.array([0.02, 0.1, 0.2])) @ [0.3, 0.4, 0.3]


def _swings() -> np.ndarray:
    """Half a minute of sines, 0 to 1 (6000,), whose height falls and rises."""
    time = np.arange(6000) / 200.0
    return 0.5 - (0.3 + 0.2 * np.cos(0.31 * time)) * np.cos(0.8 * np.pi * time)


def _read(u: np.ndarray, step: float = STEP) -> np.ndarray:
    return step * np.round(u / step)


def test_an_input_is_followed_between_the_steps_of_its_reading():
    """The rms error falls to little more than half of that of the reading: turns are as they are read."""
    u = _swings()
    moved = as_it_moved(Record(_read(u), _device(u), dt_s=0.005))
    assert np.std(moved.input - u) < 0.6 * np.std(_read(u) - u)
    assert np.abs(moved.input - u).max() < STEP


def test_a_ramp_is_followed_exactly_but_for_its_ends():
    """Straight through the middles of the steps."""
    u = np.concatenate((np.linspace(0.0, 1.0, 5501), np.linspace(1.0, 0.0, 5501)))
    moved = as_it_moved(Record(_read(u), _device(u), dt_s=0.01))
    for inside in (slice(100, 5400), slice(5600, 10_900)):
        np.testing.assert_allclose(moved.input[inside], u[inside], atol=0.01 * STEP)


@pytest.mark.parametrize("seen", ["a staircase", "a fine reading", "noise"])
def test_an_input_that_moved_as_it_is_read_stays(seen):
    """A device that was driven by steps has seen them; where no reading stays there is nothing between."""
    u = _swings()
    read = _read(u, 1e-4 if seen == "a fine reading" else STEP)
    output = _device(read if seen == "a staircase" else u)
    if seen == "noise":
        read = u + 1e-3 * np.random.default_rng(0).standard_normal(u.size)
    record = Record(read, output, dt_s=0.005)
    assert as_it_moved(record) is record
    assert hidden_square(record) == 0.0


def test_what_is_not_known_is_told_in_the_unit_of_the_output():
    """Half of a step of an output that follows the input at a slope of 3, and in any unit."""
    u = np.tile(np.concatenate((np.arange(0, 1, 0.002), np.arange(1, 0, -0.002))), 4)
    record = Record(_read(u), 3.0 * u, dt_s=0.01)
    assert hidden_square(record) == pytest.approx((0.5 * STEP * 3.0) ** 2 / 12, rel=0.1)
    scaled = replace(record, output=1e3 * record.output, input=1e-6 * record.input)
    assert hidden_square(scaled) == pytest.approx(1e6 * hidden_square(record))


def test_no_cause_is_made_of_the_steps():
    """A lag of the input smooths a staircase: it was called by the name of an effect."""
    u = _swings()
    noise = 2.4e-4 * np.random.default_rng(1).standard_normal(u.size)
    time = np.arange(u.size) / 200.0
    run = pt.Run(time_s=time, input=_read(u), output=_device(u) + noise, input_unit="A", output_unit="mm")
    found = pt.diagnose(run, pt.identify(run))
    assert not any(one.found for one in found.causes)
