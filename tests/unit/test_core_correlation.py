"""How long a residual remembers itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from pulsetrainer.core.metrics import correlation_time


@pytest.mark.parametrize(("memory", "expected"), [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)])
def test_time_of_a_first_order_process(memory, expected):
    """Noise that forgets by a factor a sample has tau = (1 + a) / (1 - a)."""
    white = np.random.default_rng(3).normal(size=40_000)
    noise = lfilter([1.0], [1.0, -memory], white)
    assert correlation_time([noise]) == pytest.approx(expected, rel=0.15)
    assert correlation_time([5.0 + 1e-6 * noise]) == pytest.approx(correlation_time([noise]), rel=1e-3)


def test_parts_are_about_their_own_means():
    """Two parts that lie apart are as white as each alone; nothing at all remembers nothing."""
    rng = np.random.default_rng(4)
    parts = [rng.normal(size=3000), 100.0 + rng.normal(size=2000)]
    assert correlation_time(parts) == pytest.approx(1.0, abs=0.2)
    assert correlation_time([np.zeros(100), np.zeros(0)]) == 1.0
