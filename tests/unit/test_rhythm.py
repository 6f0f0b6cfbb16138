"""The rhythm of a heart and single beats: what each option does, from a seed, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.core.heartbeat import Pulse
from pulsetrainer.core.pulses import train
from pulsetrainer.core.rhythm import BREATH_Hz, Rhythm
from pulsetrainer.errors import ArgumentError
from pulsetrainer.files.pulses import library, read_pulse

RATE_HZ = 1000.0


def _intervals(rhythm: Rhythm, count: int = 4000) -> np.ndarray:
    return np.array([rhythm.timing(k, 0.8 * k).interval for k in range(count)])


def test_an_even_rhythm_is_even():
    """Without options every beat is as the pulse has it."""
    assert all(
        t.interval == t.strength == 1.0
        for t in (Rhythm(seed=s).timing(k, k) for s in (0, 7) for k in range(9))
    )


def test_variability_is_the_standard_deviation_of_the_intervals():
    """To what 4000 draws can tell; independent from beat to beat."""
    intervals = _intervals(Rhythm(variability=0.05, seed=3))
    assert intervals.std() == pytest.approx(0.05, rel=0.06)
    assert intervals.mean() == pytest.approx(1.0, abs=0.004)
    assert abs(np.corrcoef(intervals[1:], intervals[:-1])[0, 1]) < 0.06


def test_respiration_swings_with_the_breath():
    """A sine of the time, in proportion."""
    intervals = _intervals(Rhythm(respiration=0.1))
    expected = 1.0 + 0.1 * np.sin(2 * np.pi * BREATH_Hz * 0.8 * np.arange(4000))
    np.testing.assert_allclose(intervals, expected, atol=1e-9)


def test_premature_beats_are_early_weak_and_followed_by_a_full_pause():
    """As many as asked for; from the beat before to the beat after it are two intervals."""
    rhythm = Rhythm(ectopic=0.1, seed=5)
    timings = [rhythm.timing(k, 0.8 * k) for k in range(4000)]
    early = [k for k, t in enumerate(timings) if t.strength < 1.0]
    assert len(early) == pytest.approx(400, abs=60)
    for k in early:
        assert timings[k - 1].interval == pytest.approx(0.65)
        assert timings[k - 1].interval + timings[k].interval == pytest.approx(2.0)
        assert timings[k - 1].strength == 1.0


def test_every_second_beat_may_be_premature_for_hours():
    """Half of all beats, the most there is: each odd one, however long it has gone on."""
    rhythm = Rhythm(ectopic=0.5, seed=2)
    assert [rhythm.timing(k, 0.0).strength < 1.0 for k in (0, 1, 2, 3, 9000, 9001)] == [False, True] * 3


@given(seed=st.integers(0, 10**6), number=st.integers(0, 10**5))
def test_a_beat_asked_for_twice_is_the_same(seed, number):
    """It depends on seed, number and time alone."""
    rhythm = Rhythm(0.05, 0.05, 0.1, seed)
    assert rhythm.timing(number, 3.0) == rhythm.timing(number, 3.0)


def test_another_seed_is_another_rhythm():
    """And the same one is the same."""
    one, same, other = (_intervals(Rhythm(variability=0.05, seed=s), 50) for s in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 0.01


@pytest.mark.parametrize(
    "options",
    [{"variability": -0.01}, {"variability": 0.3}, {"respiration": 0.5}, {"ectopic": 0.9}, {"seed": -1}],
)
def test_what_no_heart_does_is_refused(options):
    """Each option has its range."""
    with pytest.raises(ArgumentError):
        Rhythm(**options)


@pytest.mark.parametrize("name", sorted(library()))
def test_beats_put_together_are_the_record(name):
    """At their own intervals the beats of a pulse are its record, joint by joint."""
    shape = read_pulse(name)
    pulse = Pulse(shape)
    whole = train(shape, periods=1, rate_Hz=RATE_HZ, low=0.0, high=1.0)
    at = 0.0
    for k in range(pulse.beats):
        interval = pulse.own_interval_s(k)
        samples = np.arange(np.ceil(at * RATE_HZ - 1e-6), np.ceil((at + interval) * RATE_HZ - 1e-6))
        level = pulse.level(k, interval, samples / RATE_HZ - at)
        np.testing.assert_allclose(level, whole[samples.astype(int)], atol=2e-3)
        at += interval
    assert at == pytest.approx(shape.period_s)


@given(name=st.sampled_from(sorted(library())), bpm=st.floats(20.0, 240.0), number=st.integers(0, 40))
def test_a_stretched_beat_runs_from_foot_to_foot(name, bpm, number):
    """At any rate: the ends are those of the record's beat, the height is kept, time never runs back."""
    pulse = Pulse(read_pulse(name))
    interval = pulse.own_interval_s(number) * pulse.own_bpm / bpm
    time_s = np.linspace(0.0, interval, 4001)
    level = pulse.level(number, interval, time_s)
    own = pulse.level(
        number, pulse.own_interval_s(number), np.linspace(0, pulse.own_interval_s(number), 4001)
    )
    np.testing.assert_allclose(level[[0, -1]], own[[0, -1]], atol=1e-6)
    assert level.max() == pytest.approx(own.max(), abs=2e-3)


def test_a_faster_beat_takes_it_from_diastole():
    """At twice the rate the peak comes at the root of the time, not at half of it."""
    pulse = Pulse(read_pulse("normal"))
    peaks = []
    for interval in (0.8, 0.4):
        time_s = np.arange(0, interval, 1e-4)
        peaks.append(time_s[np.argmax(pulse.level(0, interval, time_s))])
    assert peaks[1] / peaks[0] == pytest.approx(np.sqrt(0.5), abs=0.06)
