"""Excitations: the paths they promise, sample by sample."""

from __future__ import annotations

import numpy as np
import pytest

from pulsetrainer.core import excitations
from pulsetrainer.core.memory import turning_points
from pulsetrainer.errors import ArgumentError
from wording import raises


def test_a_path_goes_through_its_points():
    """At constant speed, with every point on the nearest sample."""
    path = excitations.through([0.0, 1.0, 0.4, 2.0], 10.0, 100.0)
    assert path[[0, 10, 16, 32]] == pytest.approx([0.0, 1.0, 0.4, 2.0], abs=0)
    assert path.size == 33
    assert np.abs(np.diff(path)) == pytest.approx(0.1)
    between = excitations.through([0.0, 1.0, 0.0], 3.0, 7.0)  # the turn lies at sample 2.33
    assert between == pytest.approx([0.0, 3 / 7, 1.0, 1 - 2 / 7, 2 - 12 / 7, 0.0], abs=1e-12)


def test_a_first_stroke_shorter_than_a_sample_is_kept():
    """Its turn comes one sample after the beginning."""
    path = excitations.through([0.0, 0.001, -1.0], 10.0, 100.0)
    assert path[:2] == pytest.approx([0.0, 0.001], abs=0)


@pytest.mark.parametrize("n_h", [2, 5, 12])
def test_identification_visits_every_edge(n_h):
    """Down from the top to each edge in turn, the finest loop first: 2 n_h reversals with the last."""
    signal = excitations.identification(-1.0, 2.0, n_h=n_h, speed=1.5, rate_Hz=200.0)
    edges = np.linspace(-1.0, 2.0, n_h + 1)
    expected = [2.0]
    for k in range(n_h - 1, -1, -1):
        expected += [edges[k], 2.0] if k else [edges[k]]
    assert signal.value[turning_points(signal.value)] == pytest.approx(expected)
    assert signal.reversals == 2 * n_h - 1
    assert (signal.value[0], signal.value[-1]) == (-1.0, -1.0)
    length = np.abs(np.diff([-1.0, *expected])).sum()
    assert signal.value.size / signal.rate_Hz == pytest.approx(length / 1.5, abs=0.01)
    assert signal.time_s[[0, 1, -1]] == pytest.approx([0.0, 0.005, (signal.value.size - 1) / signal.rate_Hz])


def test_a_signal_must_not_jump_over_its_range():
    """One step as wide as the range is just possible."""
    assert excitations.identification(0.0, 1.0, n_h=2, speed=10.0, rate_Hz=10.0).value.max() == 1.0
    with raises(ArgumentError, "too few samples", got="its whole range of 1"):
        excitations.identification(0.0, 1.0, n_h=2, speed=10.1, rate_Hz=10.0)
    with raises(ArgumentError, "too few samples", got="its whole range of 1"):
        excitations.diagnostic(1.0, 2.0, rate_Hz=0.99 * max(excitations._RATES))
    for rate in (0.0, -0.5):
        with raises(ArgumentError, "not such an argument", argument="rate", got=f"{rate:g}"):
            excitations.identification(0.0, 1.0, n_h=2, speed=1.0, rate_Hz=rate)


def test_conditioning_is_one_loop_and_a_rest():
    """Up, down, and still."""
    value = excitations.conditioning(0.5, 1.5, speed=2.0, rate_Hz=10.0, rest_s=0.4)
    assert value == pytest.approx([*np.arange(0.5, 1.5, 0.2), *np.arange(1.5, 0.4, -0.2), 0.5, 0.5, 0.5, 0.5])


def test_size_is_checked_before_anything_is_made():
    """The limit itself passes, one more does not."""
    excitations.check_size(4, 25.0, 100)
    for times, samples in ((4, 25.1), (101, 0.0), (10**400, 0.0), (2, np.inf), (2, np.nan)):
        with pytest.raises(ArgumentError):
            excitations.check_size(times, samples, 100)


def holds(value):
    """Levels and lengths of the rests of a signal (n,) that last longer than 0.5 s at 1 kHz."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(value)) + 1, [value.size]))
    length = np.diff(starts)
    at = starts[:-1][length > 500]
    return list(
        zip(value[at].round(6).tolist(), (np.round(length[length > 500] / 100) / 10).tolist(), strict=True)
    )


def test_the_diagnostic_signal_is_what_it_says():
    """Ten blocks over the whole range, each with its hold; four rates 14 to 1; loops at four biases."""
    value = excitations.diagnostic(0.0, 1.0, rate_Hz=1000.0).value
    assert (value[0], value[-1], value.min(), value.max()) == (0.0, 0.0, 0.0, 1.0)
    levels = (0.8, 0.3, 0.6, 0.45, 0.9, 0.2, 0.7, 1.0, 0.0, 0.5)
    seconds = (1.2, 1.2, 2.4, 1.2, 1.2, 2.4, 1.2, 6.0, 6.0, 0.8)
    assert holds(value) == list(zip(levels, seconds, strict=True))
    moves = np.abs(np.diff(value)) * 1000.0
    steady = moves[1:][np.isclose(moves[1:], moves[:-1], rtol=1e-6) & (moves[1:] > 0)]
    rates, counts = np.unique(steady.round(3), return_counts=True)
    assert rates.tolist() == [0.7, 2.0, 4.0, 5.0, 10.0]
    turns = value[turning_points(value)]
    for low in (0.1, 0.22, 0.34, 0.46):  # two blocks, from two histories, four cycles each
        pairs = np.isclose(turns[:-1], low) & np.isclose(turns[1:], low + 0.2)
        assert pairs.sum() >= 16
    # what every constant of the signal moves: its length, its turns, the way it goes, where it dwells
    assert value.size == 94_298
    assert turns.size == 472
    assert np.abs(np.diff(value)).sum() == pytest.approx(227.1)
    assert counts.tolist() == [15_422, 29_594, 7_184, 11_124, 7_225]
    assert value.mean() == pytest.approx(0.492146817536, rel=1e-10)
    assert np.arange(value.size) @ value / value.size**2 == pytest.approx(0.240048098934, rel=1e-10)


def test_the_diagnostic_signal_fits_any_range():
    """The same shape between any two ends."""
    one = excitations.diagnostic(0.0, 1.0, rate_Hz=50.0).value
    assert excitations.diagnostic(-3.0, 5.0, rate_Hz=50.0).value == pytest.approx(8.0 * one - 3.0)
