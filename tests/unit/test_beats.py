"""Beats of a recorded pulse: as many as a person counts, cut at the feet, repeatable without a jump."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracle
from pulsetrainer.core.beats import find_beats
from pulsetrainer.core.pulses import Shape
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.steps.arguments import check_beat
from wording import raises

DATA = Path(__file__).resolve().parents[1] / "data"


def _recorded(name: str) -> Shape:
    t, p = np.loadtxt(DATA / f"{name}.csv", delimiter=",", skiprows=1).T
    return Shape(name, t, p)


# counted and measured by eye on the plotted records
@pytest.mark.parametrize(
    ("name", "count", "length"),
    [("fingerbp_AAC249_0", 6, 1.01), ("fingerbp_AAC3_3", 6, 0.648), ("fingerbp_AAC409_0", 6, 0.82)],
)
def test_recorded_pulses(name, count, length):
    """Dicrotic waves are no beats; every beat begins and ends at a foot, close to zero in these records."""
    record = _recorded(name)
    beats = find_beats(record)
    assert beats.count == count
    assert np.mean(beats.periods_s) == pytest.approx(length, abs=0.01)
    height = np.ptp(record.value)
    for k in range(count):
        one = beats.single(k + 1)
        assert one.time_s[0] == 0
        assert abs(one.value[0] - one.value[-1]) < 0.01 * height
        assert one.value.min() >= one.value[0] - 0.01 * height
        assert np.ptp(one.value) > 0.85 * height
    noisy = replace(
        record, value=record.value + np.random.default_rng(1).normal(0.0, 0.005 * height, record.value.size)
    )
    half = round(0.01 / np.median(np.diff(record.time_s)))  # of local parabolas over 20 ms
    for foot in find_beats(noisy).feet:
        near = range(max(foot - 60, half), min(foot + 60, record.value.size - half))
        ends = [oracle.parabola(noisy.value[k - half : k + half + 1]) for k in near]
        assert not half <= foot < record.value.size - half or near[int(np.argmin(ends))] == foot
    mean = beats.mean()
    assert mean.period_s == pytest.approx(np.median(beats.periods_s), abs=2e-3)
    assert 0.85 * height < np.ptp(mean.value) <= height


@pytest.mark.parametrize(("n", "first"), [(5, 1), (6, 0)])
def test_a_record_as_long_as_the_smoothing_is_read_as_it_is(n, first):
    """A spike, samples 5 ms apart: its foot is beside it; parabolas over 20 ms move it where more is read."""
    value = (np.arange(n) == 2).astype(float)
    assert find_beats(Shape("spike", 0.005 * np.arange(n), value)).feet[0] == first


@given(
    beats=st.integers(2, 9),
    rate=st.integers(60, 500),
    gain=st.floats(1e-6, 1e6),
    lift=st.floats(-5.0, 5.0),
    cut=st.floats(0.0, 0.6),
)
def test_beats_of_a_train_are_found_whatever_unit_rate_and_cut(beats, rate, gain, lift, cut):
    """Equal pulses with a dicrotic wave, begun somewhere in a beat: each whole one comes out alike."""
    t = np.arange(0.0, beats * 0.8 + 1e-9, 1.0 / rate)
    phase = (t / 0.8 + cut) % 1.0
    pulse = np.exp(-(((phase - 0.2) / 0.08) ** 2)) + 0.35 * np.exp(-(((phase - 0.5) / 0.08) ** 2))
    pulse += 0.2 * (1.0 - phase)  # diastole falls until the next foot
    found = find_beats(Shape("train", t, gain * (pulse + lift)))
    assert beats - 1 <= found.count <= beats
    np.testing.assert_allclose(found.periods_s, 0.8, atol=0.06)
    again = find_beats(Shape("train", t, pulse))
    assert np.abs(found.feet - again.feet).max() <= 1
    mean, one = found.mean(), found.single(1)
    apart = np.interp(one.time_s, mean.time_s, mean.value)[: -rate // 20] - one.value[: -rate // 20]
    assert np.abs(apart).max() < 0.2 * np.ptp(gain * pulse)


@pytest.mark.parametrize(("apart_s", "beats"), [(0.2, 3), (0.4, 6)])
def test_two_peaks_within_a_quarter_of_a_second_are_one_beat(apart_s, beats):
    """However deep the dip between them; further apart they are two."""
    t = np.arange(0.0, 3.2, 0.005)
    phase = t % 0.8
    value = np.exp(-(((phase - 0.2) / 0.05) ** 2)) + 0.99 * np.exp(-(((phase - 0.2 - apart_s) / 0.05) ** 2))
    found = find_beats(Shape("bifid", t, value)).count
    assert beats <= found <= beats + 2


def test_a_record_from_peak_to_peak_has_its_outer_feet():
    """Begun and ended at a peak, on a falling baseline: neither peak is lost, nor the high foot beside it."""
    t = np.arange(0.0, 3.2001, 0.005)
    pulse = np.exp(-(((t / 0.8 + 0.5) % 1.0 - 0.5) ** 2) / 0.02)
    found = find_beats(Shape("falling", t, pulse - 0.25 * t))
    assert t[found.feet] == pytest.approx(t[found.feet[0]] + 0.8 * np.arange(4.0), abs=0.01)
    assert 0.4 < t[found.feet[0]] < 0.6


@pytest.mark.parametrize("beats", [1, 2, 4, 5])
@pytest.mark.parametrize("drift", [-0.03, 0.0, 0.03])
def test_a_record_from_foot_to_foot_has_all_its_beats(beats, drift):
    """Its outer feet are as near to the middle one as a tenth of the height, not to the lowest of all."""
    t = np.arange(0.0, beats * 0.8 + 1e-9, 0.005)
    pulse = np.sin(np.pi * t / 0.8) ** 2
    found = find_beats(Shape("drifting", t, pulse + drift * t / 0.8))
    assert t[found.feet] == pytest.approx(0.8 * np.arange(beats + 1), abs=0.02)


def test_a_drifting_record_repeats_without_a_jump():
    """What one foot lies above the other is taken out as a straight line."""
    record = _recorded("fingerbp_AAC3_3")
    tilted = Shape("tilted", record.time_s, record.value + 1.5 * record.time_s)
    for k in (2, 3):
        one, flat = find_beats(tilted).single(k), find_beats(record).single(k)
        assert abs(one.value[-1] - one.value[0]) < 0.02 * np.ptp(one.value)
        size = min(one.value.size, flat.value.size) - 20
        apart = (one.value - one.value[0])[:size] - (flat.value - flat.value[0])[:size]
        assert np.abs(apart).max() < 0.1 * np.ptp(flat.value)


@pytest.mark.parametrize("number", [0, 7, -1])
def test_a_beat_that_is_not_there(number):
    """The message says how many there are."""
    with raises(DataError, "no beat of that number", count=6):
        find_beats(_recorded("fingerbp_AAC3_3")).single(number)


@pytest.mark.parametrize("number", [0, "0", -1, "-1", "1.0", "first", ""])
def test_what_can_be_no_beat_is_refused_before_any_file_is_read(number):
    """The first one is 1; the mean, or none, may be asked for."""
    for good in (1, "12", "mean", None):
        check_beat(good)
    with pytest.raises(UsageError):
        check_beat(number)


def test_no_beat_at_all():
    """Half a beat is none."""
    t = np.linspace(0.0, 0.3, 100)
    with raises(DataError, "no whole beat"):
        find_beats(Shape("flank", t, np.sin(5.0 * t)))
