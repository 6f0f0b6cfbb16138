"""Learning an inverse pass by pass: what each asks for, and the low-pass between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from pulsetrainer.core.learning import BAND_HZ, STEP, LowPass, passes

TARGET = 1.0 + np.sin(np.arange(200) / 20.0)


@dataclass(frozen=True)
class Asked:
    """The identity as an inverse."""

    input: np.ndarray


@pytest.mark.parametrize("gain", [0.5, 1.3])
def test_each_pass_asks_for_what_the_one_before_it_missed(gain):
    """Of a device that only scales: the error shrinks by 1 - STEP gain from pass to pass."""
    unfiltered = LowPass(None, 1e-3)
    made = list(islice(passes(TARGET, Asked, lambda x: gain * x, smooth=unfiltered), 4))
    assert [one.number for one in made] == [0, 1, 2, 3]
    for one in made:
        missed = (1.0 - gain) * (1.0 - STEP * gain) ** one.number * TARGET
        np.testing.assert_allclose(TARGET - one.output, missed, atol=1e-12)
        assert one.rms == pytest.approx(np.sqrt(np.mean(missed**2)))


def test_a_band_as_wide_as_the_samples_allow_filters_nothing():
    """From 0.4 of the rate on; just below it there is a filter, which leaves what is slow."""
    wide, narrow = LowPass(BAND_HZ, 0.401 / BAND_HZ), LowPass(BAND_HZ, 0.399 / BAND_HZ)
    assert wide(TARGET) is TARGET
    assert (wide.period, narrow.period) == (1, 3)
    assert np.abs(narrow(TARGET) - TARGET).max() < 1e-2
    fast = np.where(np.arange(200) % 2, 1.0, -1.0)
    assert np.abs(narrow(fast)[20:-20]).max() < 0.2
    slow = LowPass(BAND_HZ, 0.01 / BAND_HZ)  # padded by 300 samples, or as many as there are
    np.testing.assert_allclose(slow(np.ones(9)), np.ones(9), atol=1e-9)
    long = np.cumsum(np.random.default_rng(1).normal(size=2000))
    np.testing.assert_array_equal(slow(long), filtfilt(*butter(2, 0.02), long, padlen=300))
