"""Figures of merit: by hand on a few numbers, and by the shapes they measure."""

from __future__ import annotations

import numpy as np
import pytest

from pulsetrainer.core import metrics

T = np.linspace(0.0, 2.0 * np.pi, 2001)[:-1]


def test_tracking_by_hand():
    """Two repeats of three samples, one of them lost, in percent of a full force of 4."""
    found = metrics.tracking([1.0, 2.0, 3.0], [[1.0, 2.4, 3.0], [0.2, np.nan, 3.0]], 4.0)
    assert found.mean_abs_error_percent == pytest.approx(100 * (0.4 + 0.8) / 5 / 4)
    assert found.max_abs_error_percent == pytest.approx(20.0)
    assert found.rms_error_percent == pytest.approx(100 * np.sqrt((0.4**2 + 0.8**2) / 5) / 4)


def test_prediction_by_hand():
    """Errors of -1 and 2 on outputs that span 10."""
    found = metrics.prediction([0.0, 4.0, 10.0, 5.0], [-1.0, 4.0, 12.0, 5.0])
    assert found.rms == pytest.approx(np.sqrt(5 / 4))
    assert found.rms_percent == pytest.approx(10 * np.sqrt(5 / 4))
    assert (found.max_abs, found.max_percent) == (2.0, 20.0)


def test_the_area_of_a_loop():
    """An ellipse either way round, a rectangle, and no area where it goes back on its way."""
    x, y = 3.0 + 2.0 * np.cos(T), 5.0 * np.sin(T) - 7.0
    assert metrics.loop_area(x, y) == pytest.approx(10.0 * np.pi, rel=1e-5)
    assert metrics.loop_area(x[::-1], y[::-1]) == pytest.approx(10.0 * np.pi, rel=1e-5)
    assert metrics.loop_area([1.0, 4.0, 4.0, 1.0], [2.0, 2.0, 4.0, 4.0]) == pytest.approx(6.0)
    assert metrics.loop_area([0.0, 1.0, 2.0, 1.0], [0.0, 3.0, 1.0, 3.0]) == pytest.approx(0.0)


def test_the_spread_of_repeats():
    """Unbiased, over two repeats and over more, samples that were lost left out; none for one repeat."""
    assert metrics.repeat_spread([[1.0, 5.0, np.nan], [3.0, np.nan, np.nan]]) == pytest.approx(np.sqrt(2.0))
    assert metrics.repeat_spread([[1.0, 5.0], [3.0, 5.0]]) == pytest.approx(1.0)
    three = [[1.0, 2.0], [4.0, np.nan], [7.0, 4.0]]
    assert metrics.repeat_spread(three) == pytest.approx(np.sqrt((9.0 + 2.0) / 2))
    assert metrics.repeat_spread([[1.0, 2.0, 3.0]]) == 0.0


def test_squares_beyond_all_numbers_are_infinite():
    """Without a warning."""
    assert metrics.root_mean_square(np.asarray([3.0, 4.0])) == pytest.approx(np.sqrt(12.5))
    assert metrics.root_mean_square(np.asarray([1e200, 0.0])) == np.inf


def test_what_an_output_lacks_is_that_of_nine_samples_in_ten():
    """Of those that are asked for, of all repeats; a lost sample does not count, and none tell nothing."""
    target = np.arange(11.0)
    measured = np.stack((target - np.arange(11.0), target - np.arange(11.0)))
    measured[1] = np.nan
    assert metrics.lacking(target, measured, np.ones(11, bool)) == pytest.approx(9.0)
    assert metrics.lacking(target, measured, target < 1) == 0.0
    assert np.isnan(metrics.lacking(target, measured, np.zeros(11, bool)))
