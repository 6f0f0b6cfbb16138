"""An input that its recorder clips: the device saw all of it, the record shows a part."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import form_devices
import numpy as np
import pytest
from scipy import signal

import pulsetrainer as pt
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import wording
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.raw import Raw

SAMPLES = 120  # a loop
LOOPS = 10
TIME = np.arange(SAMPLES * LOOPS) / SAMPLES  # loops
SHAPES = {"sine": 0.5 - 0.5 * np.cos(2 * np.pi * TIME), "triangle": 1.0 - np.abs((2 * TIME) % 2 - 1.0)}
DEVICES = {
    "lagging": form_devices.play_sum,
    "falling": form_devices.falling,
    "clockwise": form_devices.stop_sum,
    "plane": form_devices.lagging_plane,
}


def _device(name: str, seed: int = 1):
    return DEVICES[name](np.random.default_rng(seed))


@cache
def _seen(name: str, shape: str, low: float = 0.0, high: float = 1.0):
    """What the device does when its own input is clipped there."""
    return _device(name)(np.clip(SHAPES[shape], low, high))


def _noisy(y, percent: float, seed: int = 5):
    noise = np.random.default_rng(seed).standard_normal(y.size)
    return y + 0.01 * percent * np.ptp(y) * noise


def _gate(u, y):
    record = Record(u, y, np.ones(u.size), dt_s=0.01)
    return library()["clipped-input"].gate(Raw(record, float(u.min()), float(u.max())))


def _lagged(x, tau: float):
    a = np.exp(-1.0 / tau)
    return signal.lfilter([1.0 - a], [1.0, -a], x, zi=[a * x[0]])[0]


def _rung(x, period: float, damping: float = 0.1):
    w = 2.0 * np.pi / period
    b, a, _ = signal.cont2discrete(([w**2], [1.0, 2.0 * damping * w, w**2]), 1.0, method="foh")
    return signal.lfilter(b.ravel(), a, x, zi=signal.lfilter_zi(b.ravel(), a) * x[0])[0]


@pytest.mark.parametrize("noise", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", DEVICES)
def test_an_input_that_its_recorder_clips_is_named(name, shape, noise):
    """At the top, at the bottom and at both ends, whatever way the loops run."""
    u = SHAPES[shape]
    y = _noisy(_seen(name, shape), noise)
    for low, high in ((-9.0, 0.75), (0.25, 9.0), (0.25, 0.75)):
        firing = _gate(np.clip(u, low, high), y)
        assert firing is not None
        assert firing.value in (low, high)
        assert firing.figures["count"] >= LOOPS - 2


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", DEVICES)
def test_noise_behind_the_clipping_leaves_it_to_be_seen(name, shape):
    """Then no two samples are equal, but they stay at one level within their noise."""
    u = SHAPES[shape]
    clipped = np.minimum(u, 0.75) + 0.002 * np.random.default_rng(2).standard_normal(u.size)
    firing = _gate(clipped, _seen(name, shape))
    assert firing is not None
    assert firing.value == pytest.approx(0.75, abs=0.004)


@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("name", DEVICES)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(
    "after",
    [
        lambda y: y,
        lambda y: y + 0.1 * _lagged(y, 15.0),
        lambda y: y - 0.1 * _lagged(y, 15.0),
        lambda y: _lagged(y, 6.0),
        lambda y: _lagged(y - 0.1 * _lagged(y, 40.0), 3.0),
        lambda y: _rung(y, 9.0),
        lambda y: _rung(y, 25.0),
        lambda y: y + 0.02 * np.ptp(y) * np.sin(0.9 * np.arange(y.size)),
        lambda y: y + 0.02 * np.ptp(y) * np.sin(0.11 * np.arange(y.size)),
        lambda y: y + 0.1 * np.ptp(y) * np.arange(y.size) / y.size,
    ],
    ids=[
        "",
        "creep",
        "relaxing",
        "lag",
        "lag, relaxing",
        "rings",
        "rings slowly",
        "hum",
        "slow hum",
        "drift",
    ],
)
def test_a_command_that_is_clipped_in_front_of_the_device_is_sound(after, shape, name, noise):
    """There the output rests with its input, creeps one way, rings, or hums as elsewhere."""
    u = np.clip(SHAPES[shape], 0.2, 0.75)
    assert _gate(u, _noisy(after(_seen(name, shape, 0.2, 0.75)), noise)) is None


@pytest.mark.parametrize("name", DEVICES)
@pytest.mark.parametrize("shape", SHAPES)
def test_the_turn_of_a_sound_input_is_no_rest(shape, name):
    """A coarse converter repeats its highest value; noise hides the turn; averages have steps between."""
    u, y = SHAPES[shape], _seen(name, shape)
    for bits in (4, 6, 10):
        coarse = np.round(u * 2**bits) / 2**bits
        assert _gate(coarse, y) is None
        assert _gate(coarse.reshape(-1, 4).mean(axis=1), y.reshape(-1, 4).mean(axis=1)) is None
    assert _gate(u + 0.01 * np.random.default_rng(3).standard_normal(u.size), y) is None


def test_it_knows_no_unit():
    """The same in other units, and turned over; the place is told in them."""
    u = SHAPES["sine"]
    clipped, y = np.minimum(u, 0.8), _noisy(_seen("lagging", "sine"), 0.3)
    for gain, shift in ((40.0, 7.0), (1e-3, 0.0), (-3.0, 1.0)):
        firing = _gate(gain * clipped + shift, -2.0 * y + 5.0)
        assert firing is not None
        assert firing.value == pytest.approx(gain * 0.8 + shift)


@pytest.mark.parametrize("places", [2, 3])
def test_two_places_may_be_chance(places):
    """The record's own ends do not count."""
    u = np.minimum(SHAPES["sine"][: (places + 1) * SAMPLES], 1.0)
    firing = _gate(np.minimum(u, 0.8), _device("lagging")(u))
    assert (firing is not None) is (places > 1)
    few = np.where(TIME[: u.size] < places, u, 0.3 * u)
    firing = _gate(np.minimum(few, 0.8), _device("lagging")(few))
    assert (firing is not None) is (places > 2)


def _run(u, y):
    return pt.Run(time_s=0.01 * np.arange(u.size), input=u, output=y)


@pytest.mark.parametrize("quick", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_nothing_else_is_sought_in_such_a_record(quick):
    """A rate of 1 and a clipped peak had been `rate-widening` and `viscous`, which were not there."""
    swing = np.repeat([1.0, 0.7, 1.0, 0.9, 0.5], 2 * SAMPLES)
    u = swing * SHAPES["triangle"]
    y = _noisy(_device("lagging")(u), 0.2)
    run = replace(_run(np.minimum(u, 0.8), y), reference=u)  # which the driver follows all the while
    model = pt.identify(run)
    found = pt.diagnose(run, model, quick=quick)
    assert found.verdict == "clipped-input"
    assert [one.cause for one in found.found] == ["clipped-input"]
    assert found.extended is None
    assert found.correctable == ()
    assert "clips the current at 0.8 A" in found.next_experiment
    sound = pt.diagnose(_run(u, y), pt.identify(_run(u, y)), quick=True)
    assert sound.verdict != "clipped-input"


def test_what_it_says_has_its_figures():
    """One end or both."""
    u = SHAPES["sine"]
    y = _device("lagging")(u)
    one, both = (_gate(np.clip(u, low, 0.8), y) for low in (-1.0, 0.3))
    assert one is not None
    assert both is not None
    assert "rests at 0.8 in " in wording.text(one.evidence)
    assert "rests at 0.8 or 0.3 in " in wording.text(both.evidence)
