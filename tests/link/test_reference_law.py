"""Whatever is played, the device's reference is its linear interpolation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pulsetrainer.device.opening import open_device


@pytest.fixture(scope="module")
def ideal():
    """One ideal bench for all examples."""
    with open_device("bench:?ideal") as device:
        yield device


@given(
    steps=st.lists(st.integers(-20, 20), min_size=1, max_size=300),
    first=st.integers(0, 15_000),
    ticks_per_sample=st.sampled_from([1, 2, 5, 10, 50, 125]),
    decimation=st.integers(1, 40),
)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_reference_is_interpolated(ideal, steps, first, ticks_per_sample, decimation):
    """Any reference within the limits: ticks and interpolated values are exact to the wire's unit."""
    units = np.clip(first + np.cumsum(steps), 0, 15_000)
    recording = ideal.play(units / 10_000, 10_000 / ticks_per_sample, decimation=decimation)
    last = (len(units) - 1) * ticks_per_sample
    assert recording.complete
    assert recording.dropped_samples == 0
    np.testing.assert_array_equal(recording.tick, np.arange(0, last + 1, decimation))
    exact = np.interp(recording.tick, ticks_per_sample * np.arange(len(units)), units)
    assert np.abs(recording.reference_A * 10_000 - exact).max() < 1
