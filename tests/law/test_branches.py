"""Laws of the branches: many loops set aside at once give the pieces that following turn by turn gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.core import branches
from pulsetrainer.core.memory import turning_points

EVEN = st.lists(st.integers(0, 9), min_size=1, max_size=400)


@st.composite
def noisy(draw):
    """Extremes of a slow input with noise, rounded or not, from all relays down."""
    n = draw(st.integers(2, 1500))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    swing = np.sin(np.arange(n) / draw(st.floats(1.0, 60.0))) * np.linspace(1.0, draw(st.floats(0.0, 2.0)), n)
    u = swing + draw(st.sampled_from([0.0, 0.01, 0.3])) * random.standard_normal(n)
    return np.round(u, draw(st.sampled_from([1, 2, 15])))


def _extremes(u) -> np.ndarray:
    path = np.append(np.min(u), u).astype(float)
    return np.append(path[0], path[turning_points(path)])


@pytest.mark.parametrize("few", [2, branches._FEW])
@given(u=st.one_of(EVEN, noisy()))
def test_loops_set_aside_change_nothing(few, u):
    """Anchors and ends of all pieces are those of the stack, with ties and returns to saturation."""
    value = _extremes(u)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(branches, "_FEW", few)
        found = branches.pieces(value)
    naive = branches._one_by_one(value.tolist())
    np.testing.assert_array_equal(found.anchor, naive.anchor)
    np.testing.assert_array_equal(found.last, naive.last)


def test_noise_on_a_sweep_leaves_few_turns_to_be_followed():
    """Of 20 000 turns of noise on slow sweeps, hardly any is followed one by one."""
    n = np.arange(60_000)
    u = np.sin(n / 3000.0) + 0.001 * np.random.default_rng(7).standard_normal(n.size)
    kept, _ = branches._less_small_loops(_extremes(u))
    assert _extremes(u).size > 20_000
    assert kept.size < 2000
