"""Refining on devices that are no Preisach operator, and on what cannot be refined."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import store_examples as examples
from foreign_plants import PLANTS, ForeignDevice

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.errors import DeviceError, PulsetrainerError
from pulsetrainer.steps.invertible import invertible
from pulsetrainer.steps.refine import _repeats, refine

SLEW = 30.0
AWAY = 0.1  # of the reach, from both ends: a current at the end of its range can learn nothing
PLANT = "Coleman-Hodgdon"


@cache
def drive_of(plant: str, pulse: str = "normal") -> pt.Waveform:
    """The drive for a pulse, by a model identified on the device itself."""
    current = excitations.identification(0.0, 1.5, n_h=48, speed=1.5, rate_Hz=1000.0).value
    played = ForeignDevice(plant, seed=9).play(current, 1000.0)
    model = pt.identify(pt.Run(time_s=np.arange(current.size) / 1000.0, input=current, output=played.force_N))
    low, high = invertible(model, 1000.0).reach
    edge = AWAY * (high - low)
    return pt.invert(pulse, model, slew=SLEW, force_min=low + edge, force_max=high - edge)


@cache
def refined_of(plant: str, pulse: str = "normal") -> pt.Waveform:
    """The drive of a pulse, refined on the device."""
    return refine(drive_of(plant, pulse), ForeignDevice(plant, seed=3), slew=SLEW)


@pytest.mark.parametrize("pulse", ["normal", pytest.param("bifid", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "plant", [pytest.param(name, marks=pytest.mark.slow if k else ()) for k, name in enumerate(PLANTS)]
)
def test_what_is_left_on_a_foreign_plant_is_noise(plant, pulse):
    """Within 1.2 times the noise in five passes; no pass worse than the one before by more than noise."""
    refined = refined_of(plant, pulse)
    mean = [one.mean_abs_error_percent for one in refined.passes]
    noise = refined.passes[refined.kept - 1].noise_percent
    print(plant, pulse, mean, noise)
    assert len(mean) <= 5
    # of 0.04 N, whose mean size is sqrt(2 / pi) of that
    assert noise == pytest.approx(100.0 * 0.04 * np.sqrt(2.0 / np.pi) / refined.full_force, rel=0.05)
    assert min(mean) == mean[refined.kept - 1] <= 1.2 * noise
    assert all(after <= before + noise for before, after in pairwise(mean))
    truth = PLANTS[plant](refined.compensated)[refined.scored]
    error = 100.0 * np.abs(truth - refined.target[refined.scored]).mean() / refined.full_force
    assert error < 0.5 * noise  # of the repeats' mean, by the plant itself: it is no luck of the noise
    assert np.abs(np.diff(refined.compensated)).max() <= SLEW / 1000.0 * (1 + 1e-9)


def test_the_best_pass_is_kept():
    """Also where the device changes after it; what is told of the others stays."""
    drive = drive_of(PLANT)
    device = ForeignDevice(PLANT, seed=4)
    device.shift_N = lambda play: 0.6 if play > 6 else 0.0
    refined = refine(drive, device, slew=SLEW)
    mean = [one.mean_abs_error_percent for one in refined.passes]
    assert int(np.argmin(mean)) + 1 == refined.kept < len(mean)


def test_it_ends_when_only_noise_is_left():
    """A device that is its model needs one pass."""
    drive = drive_of(PLANT)
    device = ForeignDevice(PLANT, seed=5)
    device.press = lambda current: np.asarray(drive.model.predict(current, 1e-3))
    refined = refine(drive, device, slew=SLEW)
    assert len(refined.passes) == refined.kept == 1
    assert np.array_equal(refined.compensated, drive.compensated)


def test_more_noise_asks_for_more_repeats():
    """Two where the error is large; up to five where the noise hides it."""
    quiet = refine(drive_of(PLANT), ForeignDevice(PLANT, seed=6, noise_N=0.01), slew=SLEW)
    loud = refine(drive_of(PLANT), ForeignDevice(PLANT, seed=6, noise_N=0.3), slew=SLEW)
    assert {one.repeats for one in quiet.passes} == {2}
    assert loud.passes[0].repeats == 2
    assert max(one.repeats for one in loud.passes) > 2


@pytest.mark.parametrize(
    ("noise", "error", "repeats"),
    [(0.0, 1.0, 2), (1.0, 0.0, 5), (0.43, 1.0, 3), (0.51, 1.0, 5), (0.49, 1.0, 4), (9.0, 1.0, 5)],
)
def test_repeats_leave_a_quarter_of_the_error_as_noise(noise, error, repeats):
    """Their mean has noise over the root of them; two at least, five at most, and where there is no error."""
    for unit in (1e-3, 1.0, 1e3):
        assert _repeats(unit * noise, unit * error) == repeats


@pytest.mark.parametrize("dead", [0.0, 7.0])
def test_a_force_that_says_nothing_is_not_learnt_from(dead):
    """A sensor that is dead or stuck."""
    device = ForeignDevice(PLANT, noise_N=0.0)
    device.press = lambda current: np.full(current.size, dead)
    with pytest.raises(DeviceError):
        refine(drive_of(PLANT), device, slew=SLEW)


@pytest.mark.parametrize(
    ("drive", "passes"),
    [
        (lambda: drive_of(PLANT), 0),
        (lambda: replace(drive_of(PLANT), model=None), 5),
        (lambda: replace(drive_of(PLANT), input_unit="V"), 5),
        (lambda: examples.waveform(400, model=examples.model(reading="relay")), 5),
    ],
    ids=["no pass", "no model", "no current", "relays"],
)
def test_what_cannot_be_refined_is_refused(drive, passes):
    """Before anything is played."""
    device = ForeignDevice(PLANT)
    with pytest.raises(PulsetrainerError) as caught:
        refine(drive(), device, passes=passes)
    assert caught.value.exit_code in (2, 3)
    assert caught.value.hint
    assert device.plays == 0
