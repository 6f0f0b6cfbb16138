"""A force that does not fit the current is found, whatever is played; a healthy one never is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from healthy_plays import SIGNALS, WAVEFORMS, beats, signal, stopped

from pulsetrainer import load
from pulsetrainer.core import excitations
from pulsetrainer.device.limits import Limits
from pulsetrainer.device.opening import open_device
from pulsetrainer.device.plausibility import (
    _CURRENT_A,
    _FALLING_N,
    _RISING_N,
    ForceWatch,
    _swings,
    judge_against,
    judge_force,
    judge_repeat,
)
from pulsetrainer.device.trace import Trace
from pulsetrainer.errors import DeviceError
from pulsetrainer.steps.play import DRIVES, play

TIME_S = np.arange(3000) / 1000
NOISE_N = 0.045  # of the bench as built


def _mixed(rng):
    """Return all six pulses, a sine, a square, a saw and plateaus, each at a range of its own, A."""
    return np.concatenate([signal(name, rng) for name in SIGNALS])


def _in_time(port: str, reference: np.ndarray) -> Trace:
    """Play on a device, three times at most where the computer was too busy to send the reference in time."""
    for _ in range(3):
        with open_device(port) as device:
            trace = device.play(reference, 1000)
        if not trace.underrun:
            break
    return trace


# The thresholds were set on devices 1 to 10 and judged on 11 to 20: these are others.
@pytest.mark.parametrize(
    "seed", [31, 32, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(33, 51))]
)
def test_a_healthy_force_is_never_doubted(seed):
    """Twenty drawn devices, each with noise as built and three times that: no false alarm."""
    reference = _mixed(np.random.default_rng(seed))
    for noise in (0.003, 0.009):
        trace = _in_time(f"bench:?seed={seed}&noise={noise}", reference)
        assert trace.complete, trace.fault


def test_the_branches_are_those_of_a_major_loop():
    """The lowest and highest force of the bench as built from each current on: within a fifth, or 0.9 N."""
    current = excitations.through([0.0, 1.5, 0.0], 1.0, 1000.0)
    with open_device("bench:") as device:
        force = device.play(current, 1000).force_N
    for at, low, high in zip(_CURRENT_A, _RISING_N, _FALLING_N, strict=True):
        assert force[current >= at].min() == pytest.approx(low, rel=0.2, abs=0.9)
        assert force[current <= at].max() == pytest.approx(high, rel=0.2, abs=0.9)


@pytest.mark.slow
def test_a_healthy_play_over_a_bad_wire_is_never_stopped():
    """A sample of ``python tests/link/healthy_plays.py``: each signal four times on forty devices."""
    assert list(stopped(40 * len(SIGNALS), seed=2)) == []


@pytest.mark.parametrize(
    "peak_A", [0.8, *(pytest.param(peak, marks=pytest.mark.slow) for peak in (0.4, 1.25))]
)
@pytest.mark.parametrize("what", ["force-zero", "force-frozen"])
@pytest.mark.parametrize("path", WAVEFORMS, ids=lambda path: path.stem)
def test_a_sensor_that_dies_below_the_strokes_that_the_device_watches(path, what, peak_A):
    """From the start, or in mid-play: never a complete play, and what was recorded is kept."""
    reference = beats(path, peak_A)
    for at_s in (0.0, 0.4 + float(np.random.default_rng(len(path.stem)).uniform(0, 5.0))):
        with open_device(f"bench:?seed=32&break={what}@{at_s:.3f}") as device:
            trace = device.play(reference, 1000)
        assert not trace.complete
        assert "force" in trace.fault
        assert trace.remedy
        assert trace.tick.size > 0  # the firmware itself may be as quick as 70 ms


def test_a_dead_sensor_under_a_force_limit_stops_the_play_early():
    """The limit can not trip without a reading: the output is off within seconds, not after 52 of them."""
    reference = np.tile(beats(WAVEFORMS[-1], 1.5), 9)
    with open_device("bench:?speed=real&break=force-zero@0", limits=Limits(force_N=3.0)) as device:
        trace = device.play(reference, 1000)
    assert not trace.complete
    assert trace.tick[-1] < 40_000


def _healthy():
    rng = np.random.default_rng(1)
    current = 0.6 - 0.6 * np.cos(2 * np.pi * 1.2 * TIME_S)
    return current, 9.0 * current + rng.normal(0, NOISE_N, current.size)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda _i, f, r: r.normal(0, NOISE_N, f.size), "does not follow"),
        (lambda _i, f, r: f.mean() + r.normal(0, 3 * NOISE_N, f.size), "does not follow"),
        (lambda _i, f, r: f.mean() + r.normal(0, 6 * NOISE_N, f.size), "does not follow"),
        (lambda _i, f, _r: -f, "does not follow"),
        (lambda _i, f, _r: np.where(TIME_S < 2.8, f, f[2800]), "frozen"),
        (lambda _i, f, _r: np.full(f.size, 3.0), "frozen"),
        (lambda _i, f, _r: 0.2 * f, "implausible"),
        (lambda _i, f, _r: f + 4.0, "implausible"),
        (lambda _i, f, _r: f - 4.0, "implausible"),
        (lambda i, f, _r: np.where(i > 1.0, 0.1 * f, f), "implausible"),
    ],
)
def test_what_is_wrong_is_said(spoil, says):
    """Dead, drowned, inverted, stuck late, stuck throughout, weak, shifted, cut off at the peaks."""
    current, force = _healthy()
    assert judge_force(TIME_S, current, force) == ""
    assert says in judge_force(TIME_S, current, spoil(current, force, np.random.default_rng(2)))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda f: np.minimum(f, 8.0),  # an amplifier at its end is found by diagnose
        lambda f: np.where(np.arange(f.size) % 70 == 0, 15.0, f),  # single wild samples
        lambda f: np.round(f / 0.5) * 0.5,  # coarse steps
        lambda f: np.roll(f, 30),  # a lag
        lambda f: 1.3 * f,
        lambda f: 0.7 * f,
    ],
)
def test_what_diagnose_is_there_for_is_not_refused(spoil):
    """Saturation, outliers, coarse steps, delay and a gain that is somewhat off can be captured."""
    current, force = _healthy()
    assert judge_force(TIME_S, current, spoil(force)) == ""


def test_a_finger_that_rings_is_a_living_sensor():
    """A force a quarter of a period behind a fast current has no slope over it, and yet it lives."""
    noise = np.random.default_rng(3).normal(0, NOISE_N, TIME_S.size)
    current = 0.5 - 0.15 * np.cos(2 * np.pi * 17 * TIME_S)
    ringing = 3.9 - 1.2 * np.sin(2 * np.pi * 17 * TIME_S) + noise
    assert judge_force(TIME_S, current, ringing) == ""
    assert "does not follow" in judge_force(TIME_S, current, 3.9 + noise)


def test_too_little_is_not_judged():
    """Under half a second, or at a current that does not move, a force of nothing says nothing."""
    current, force = _healthy()
    assert judge_force(TIME_S[:400], current[:400], 0 * force[:400]) == ""
    assert judge_force(TIME_S, np.full(3000, 0.2), np.random.default_rng(3).normal(0, NOISE_N, 3000)) == ""
    assert ForceWatch().finish() == ""


@pytest.mark.parametrize(
    ("rms_A", "moves_s", "slope", "dead"),
    [
        (0.105, 1.0, 0.45, True),  # of the current in the last second ...
        (0.095, 1.0, 0.45, False),
        (0.053, 5.0, 0.45, True),  # ... and over five
        (0.047, 5.0, 0.45, False),
        (0.105, 1.0, 0.55, False),  # N/A: alive
        (0.053, 5.0, 0.55, False),
    ],
)
def test_how_far_the_current_moves_before_a_force_must_follow(rms_A, moves_s, slope, dead):
    """A tenth of an ampere within a second, half of it within five; half a newton per ampere is enough."""
    time_s = np.arange(10_000) / 1000
    moves = np.sin(2 * np.pi * 5 * time_s) * (time_s >= 10.0 - moves_s)
    current = 0.2 + np.sqrt(2.0) * rms_A * moves
    force = 1.0 + slope * current + 1e-4 * (np.arange(10_000) % 2)
    assert ("does not follow" in judge_force(time_s, current, force)) is dead


@pytest.mark.parametrize("piece", [1, 19, 3000])
def test_the_watch_finds_the_same_in_any_pieces(piece):
    """However the samples come, a force that dies after 20 s of play is found soon, and not before."""
    current = np.tile(_healthy()[0], 10)
    force = 9.0 * current + np.random.default_rng(4).normal(0, NOISE_N, current.size)
    time_s = np.arange(current.size) / 1000
    force[20_000:] = 0.0
    watch = ForceWatch()
    for at in range(0, current.size, piece):
        part = slice(at, at + piece)
        watch.add(time_s[part], current[part], force[part])
        assert not (watch.fault and at + piece < 20_000)
        if watch.fault:
            break
    assert watch.fault
    assert at <= 21_000


@pytest.mark.parametrize(
    ("gain", "offset", "plausible"),
    [
        (1.0, 0.0, True),
        (0.7, 0.5, True),
        (1.5, -0.5, True),
        (0.2, 0.0, False),
        (3.0, 0.0, False),
        (1.0, 6.0, False),
    ],
)
def test_a_force_that_a_model_has_foretold(gain, offset, plausible):
    """Within a factor of two and 1.5 N it may be; samples that were lost are left out."""
    expected = 4.0 - 3.0 * np.cos(2 * np.pi * 1.2 * TIME_S)
    force = gain * expected + offset + np.random.default_rng(5).normal(0, NOISE_N, expected.size)
    force[100:300] = np.nan
    assert (judge_against(TIME_S, expected, force) == "") is plausible
    assert judge_against(TIME_S, expected, np.full(expected.size, np.nan)) == ""
    for at, could_be in ((-5.4, True), (-5.6, False), (0.4, True), (0.6, False)):
        assert (judge_against(TIME_S, np.full(3000, -2.0), np.full(3000, at)) == "") is could_be


class DiesAt:
    """A device on the bench whose force sensor goes on as ``spoil`` says from some moment of one play on."""

    def __init__(self, device, number, spoil):
        self.device, self.info, self.left, self.spoil = device, device.info, number, spoil

    def play(self, *args, **kwargs):
        """Play it there."""
        trace = self.device.play(*args, **kwargs)
        self.left -= 1
        return trace if self.left >= 0 else replace(trace, force_N=self.spoil(trace.force_N))


@pytest.mark.parametrize("last", [200, pytest.param(450, marks=pytest.mark.slow)])
@pytest.mark.parametrize("drive", range(len(DRIVES)))
@pytest.mark.parametrize("repeats", [2, 3])
def test_a_sensor_that_dies_at_the_very_end_of_a_play_and_goes_on_with_noise(last, drive, repeats):
    """Whichever drive comes last: the play is a failed one, what went before is kept."""
    rng = np.random.default_rng([last, drive, repeats])
    waveform = load(Path(__file__).parents[1] / "data/files-0.1/drive.h5")

    def dies(force):
        return np.where(np.arange(force.size) < force.size - last, force, rng.normal(0, NOISE_N, force.size))

    number = len(DRIVES) * (repeats - 1) + drive
    with open_device("bench:?seed=33") as device, pytest.raises(DeviceError) as caught:
        play(waveform, DiesAt(device, number, dies), repeats=repeats)
    assert len(caught.value.kept.compensated.output) == repeats - 1
    assert "force" in caught.value.message
    with open_device("bench:?seed=33&noise=0.009") as device:
        assert play(waveform, device, repeats=repeats).complete


@pytest.mark.parametrize(("last", "plausible"), [(0.4, True), (0.6, False), (-0.6, False)])
def test_a_drive_that_is_played_again(last, plausible):
    """It may press half a newton more or less; lost samples are left out."""
    rng = np.random.default_rng(6)
    before, again = (9.0 * _healthy()[0] + rng.normal(0, NOISE_N, TIME_S.size) for _ in range(2))
    again[-100:] += last
    again[400:500] = before[700:900] = np.nan
    assert (judge_repeat(TIME_S, before, again) == "") is plausible
    assert judge_repeat(TIME_S, before, np.full(TIME_S.size, np.nan)) == ""


@pytest.mark.parametrize("off", [0.4, 0.6])
def test_few_samples_a_second_are_judged_one_by_one(off):
    """At 5 Hz there is nothing to average over and nothing that lags; twenty of them make a stretch."""
    time_s, still = 0.2 * np.arange(40), np.full(40, 4.0)
    assert (judge_repeat(time_s, still, still + off * (time_s == time_s[-1])) != "") is (off > 0.5)
    wrong = np.arange(40) < 10 + (off > 0.5)  # half of them, and the first, before which nothing is known
    assert (judge_against(time_s, still, np.where(wrong, 9.6, 4.0)) != "") is (off > 0.5)


@pytest.mark.parametrize(
    ("noise", "rms", "swings"), [(0.1, 0.32, True), (0.1, 0.28, False), (0.01, 0.14, False)]
)
def test_a_force_swings_by_three_times_its_noise(noise, rms, swings):
    """And by 0.15 N at least; the noise is that from sample to sample."""
    slow = np.sin(2 * np.pi * TIME_S / 3.0)
    force = noise * np.random.default_rng(8).standard_normal(3000)
    assert _swings(4.0 + np.sqrt(2.0 * (rms**2 - noise**2)) * slow + force) is swings
    assert _swings(np.array([1.0, 1.31])) is True  # too few for noise
