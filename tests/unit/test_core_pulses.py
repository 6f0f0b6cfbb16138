"""A pulse train: one beat after the other, between two levels, at any rate."""

from __future__ import annotations

import numpy as np
import pytest

from pulsetrainer.core.pulses import Shape, train

BEAT = Shape("beat", 5.0 + 0.1 * np.arange(8), np.array([2.0, 3.0, 6.0, 4.0, 3.5, 3.0, 2.5, 2.2]))


def test_a_train_goes_through_every_sample_of_every_beat():
    """0.8 s a beat, from the lowest to the highest value, the first beat at time 0; the rate may be finer."""
    value = train(BEAT, periods=3, rate_Hz=50.0, low=-1.0, high=3.0)
    assert value.size == 120
    np.testing.assert_allclose(value[::5], np.tile(-1.0 + (BEAT.value - 2.0), 3), atol=1e-9)
    assert value.min() == -1.0
    assert value.max() == 3.0


def test_between_samples_a_train_neither_overshoots_nor_jumps_at_the_seam():
    """From the last sample of a beat it goes straight down to the first of the next."""
    value = train(BEAT, periods=2, rate_Hz=1000.0, low=0.0, high=1.0)
    assert np.all(np.diff(value[200:801]) <= 0)
    assert value[750] == pytest.approx(0.025, abs=0.02)
    assert np.abs(np.diff(value)).max() < 0.02
