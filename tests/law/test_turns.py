"""Turns of the input that fall between two samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.core.turns import at_their_tips, reached
from pulsetrainer.errors import ArgumentError


def _naive(u: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Turn by turn: the two lines as polynomials, and where they meet."""
    found = u.copy()
    for a in range(2, u.size - 3):
        left, right = (
            np.polyfit(t[a - 1 : a + 1], u[a - 1 : a + 1], 1),
            np.polyfit(t[a + 1 : a + 3], u[a + 1 : a + 3], 1),
        )
        further_left = (u[a - 1] - u[a - 2]) / (t[a - 1] - t[a - 2])
        further_right = (u[a + 3] - u[a + 2]) / (t[a + 3] - t[a + 2])
        if left[0] * right[0] >= 0 or u[a] == u[a + 1]:
            continue
        if abs(left[0] - further_left) >= 0.2 * abs(left[0]) or abs(right[0] - further_right) >= 0.2 * abs(
            right[0]
        ):
            continue
        at = (right[1] - left[1]) / (left[0] - right[0])
        if t[a] <= at <= t[a + 1]:
            top = max if left[0] > 0 else min
            extreme = a + [u[a], u[a + 1]].index(top(u[a], u[a + 1]))
            found[extreme] = top(found[extreme], np.polyval(left, at))
    return found


vertices = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=8)


@given(vertices, st.floats(0.05, 0.4), st.integers(0, 2**32 - 1))
def test_a_triangle_wave_reaches_its_tips(levels, rate, seed):
    """Whatever moments it is sampled at, even or uneven, where each stroke has seven samples or more."""
    levels = np.asarray(levels)
    length = np.maximum(np.abs(np.diff(levels)) / rate, 8.0)
    corners = np.append(0.0, np.cumsum(length))
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, corners[-1]) + rng.uniform(0.0, 0.5) + rng.uniform(0.0, 0.3, int(np.ceil(corners[-1])))
    t = t[t < corners[-1]]
    u = np.interp(t, corners, levels)
    found = reached(u, t)
    np.testing.assert_allclose(found, _naive(u, t), atol=1e-9)
    slope = np.diff(levels) / length
    for k in range(1, levels.size - 1):
        if slope[k - 1] * slope[k] < 0 and min(abs(slope[k - 1]), abs(slope[k])) > 1e-6:
            beside = np.searchsorted(t, corners[k]) + np.arange(-1, 1)
            top = np.max if slope[k] < 0 else np.min
            if np.all(np.abs(u[beside] - levels[k]) > 0):
                np.testing.assert_allclose(top(found[beside]), levels[k], atol=1e-9)


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=60), st.floats(0.01, 100.0), st.booleans())
def test_it_knows_no_unit_and_only_raises_extremes(values, scale, mirrored):
    """Nothing but extremes moves, outwards, by less than a step; a u + b gives a times as much, plus b."""
    u = np.round(np.asarray(values), 3)
    found = reached(u)
    moved = np.flatnonzero(found != u)
    for k in moved:
        assert (found[k] - u[k]) * (u[k] - u[k - 1]) >= 0
        assert (found[k] - u[k]) * (u[k] - u[k + 1]) >= 0
        assert abs(found[k] - u[k]) <= max(abs(u[k] - u[k - 1]), abs(u[k] - u[k + 1]))
    a = -scale if mirrored else scale
    np.testing.assert_allclose(reached(a * u), a * found, atol=1e-9 * scale)
    np.testing.assert_allclose(reached(u[::-1])[::-1], found, atol=1e-9)


@pytest.mark.parametrize("per_turn", [5, 9, 40])
def test_rounded_turns_stay_as_they_are(per_turn):
    """A sine, and a triangle behind a slow lag; a rest at the tip."""
    u = np.sin(np.arange(400) * np.pi / per_turn + 0.3)
    np.testing.assert_array_equal(reached(u), u)
    rest = np.interp(np.arange(60), [0, 20, 30, 59], [0.0, 1.0, 1.0, 0.0])
    np.testing.assert_array_equal(reached(rest), rest)


def test_what_is_no_input_is_refused():
    """As everywhere in the core."""
    with pytest.raises(ArgumentError):
        reached([1.0, np.nan])
    np.testing.assert_array_equal(reached([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0])


def _followed(tips: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Minor loops of a triangle wave, seven samples a stroke; three plays that see all of it, or samples."""
    rng = np.random.default_rng(11)
    corners = np.cumsum(np.append(0.0, rng.uniform(6.2, 7.8, 120)))
    levels = np.where(
        np.arange(corners.size) % 2, rng.uniform(0.5, 1.0, corners.size), rng.uniform(0.0, 0.4, 121)
    )
    t = np.arange(0.0, corners[-1])
    fine = np.arange(0.0, corners[-1], 1.0 / 64.0) if tips else t
    seen = np.interp(fine, corners, levels)
    at, widths = np.zeros(3), np.asarray([0.05, 0.12, 0.2])
    y = np.empty_like(seen)
    for k, one in enumerate(seen):
        at = np.clip(at, one - widths, one + widths)
        y[k] = at.sum()
    return np.interp(t, corners, levels), y[:: 64 if tips else 1], t


@pytest.mark.parametrize("tips", [True, False])
def test_the_output_tells_whether_the_device_saw_the_tips(tips):
    """What is driven sample by sample keeps its input; without time, and where nothing moves, all do."""
    u, y, t = _followed(tips)
    kept = np.ones(u.size, dtype=bool)
    (found,) = at_their_tips([(u, y)], [t], [kept])
    np.testing.assert_array_equal(found, reached(u, t) if tips else u)
    assert np.count_nonzero(reached(u, t) != u) > 60
    (untimed,) = at_their_tips([(u, y)], [None], [kept])
    np.testing.assert_array_equal(untimed, u)


@pytest.mark.parametrize("stepped", [True, False])
def test_the_ends_of_a_record_tell_an_input_that_is_made_of_steps(stepped):
    """A ramp that is cut short at its target, at a sample; or the same targets between samples."""
    targets = [0.0, 1.0, 0.0, 1.0, 0.45, 1.0, 0.0, 0.62, 0.0]
    corners = np.append(0.0, np.cumsum(np.abs(np.diff(targets)) / 0.07))
    if stepped:
        u = [0.0]
        for target in targets[1:]:
            way = target - u[-1]
            ramp = np.append(np.arange(1, np.floor(abs(way) / 0.07) + 1), abs(way) / 0.07)
            u += (u[-1] + np.sign(way) * 0.07 * ramp).tolist()
    else:
        u = np.interp(np.arange(0.3, corners[-1]), corners, targets)
    u = np.asarray(u)
    t = np.arange(float(u.size))
    (found,) = at_their_tips([(u, np.zeros(u.size))], [t], [np.zeros(u.size, dtype=bool)])
    np.testing.assert_array_equal(found, u if stepped else reached(u))
    assert np.any(reached(u) != u)
