"""Laws of inversion: the exact inverse undoes the operator, and the operator undoes the inverse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import planes, values, worlds

import oracle
from pulsetrainer.core.inversion import closest_match, invert, slew_limited, smoothed
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane


def targets(world, *, beyond=0.2):
    """Outputs (n,) to be reached: made by the world itself, at its saturations, anywhere, out of reach."""
    low, high = sorted(world.operator.saturation)
    margin = beyond * (high - low)
    one = st.one_of(
        st.sampled_from(world.operator(world.input, world.start).tolist()),
        st.sampled_from([low, high, 0.5 * (low + high)]),
        st.floats(low - margin, high + margin),
    )
    return st.lists(one, min_size=1, max_size=20).map(np.array)


@st.composite
def wanted(draw, *, least=0.0, most=6, beyond=0.2):
    """A world whose weights are not all zero, and a target for it."""
    world = draw(
        worlds(readings=("continuous",), least=least, most=most).filter(lambda w: w.operator.total > 0)
    )
    return world, draw(targets(world, beyond=beyond))


# --- the exact inverse ----------------------------------------------------------------------------------


@given(wanted())
def test_forward_after_inverse(drawn):
    """The inverse's input gives the target, clipped to the reach; from any state, with any cells empty."""
    world, target = drawn
    found = invert(world.operator, target, world.start)
    reached = np.clip(target, *sorted(world.operator.saturation))
    assert world.operator(found.input, world.start) == pytest.approx(reached, rel=0, abs=world.slack)
    assert found.input.min() >= world.plane.low
    assert found.input.max() <= world.plane.high


@given(worlds(readings=("continuous",), least=0.1))
def test_inverse_after_forward(world):
    """Where every cell answers, the inverse gives back the input that made the output."""
    y = world.operator(world.input, world.start)
    u = np.clip(world.input, world.plane.low, world.plane.high)
    # the output moves at least by the mass on the diagonal: what rounding of the output is worth in input
    i, j = world.plane.cell_indices
    slope = 2 * np.min(world.operator.masses[i == j] / np.diff(world.plane.edges))
    found = invert(world.operator, y, world.start)
    assert found.input == pytest.approx(u, rel=0, abs=4 * world.slack / slope)
    assert found.clipped == 0


@given(wanted(most=4))
def test_inverse_is_what_bisection_finds(drawn):
    """Where every cell answers, interpolation and bisection on the areas find the same inputs."""
    world, target = drawn
    plane = world.plane
    mu = np.maximum(world.operator.weights, 0.1 * world.operator.weights.max())
    operator = Preisach(plane, mu, world.operator.offset, "continuous", world.operator.polarity)
    target = target[:8]
    wanted_masses = np.clip(operator.polarity * (target - operator.offset), -operator.total, operator.total)
    expected = oracle.invert(plane.edges, operator.masses, wanted_masses, world.past)
    i, j = plane.cell_indices
    slope = 2 * np.min(operator.masses[i == j] / np.diff(plane.edges))
    slack = 4 * world.slack * (1 + operator.total / world.operator.total) / slope
    assert invert(operator, target, world.start).input == pytest.approx(expected, rel=0, abs=slack)


@given(wanted())
def test_targets_out_of_reach_are_counted(drawn):
    """Clipped targets are those beyond saturation."""
    world, target = drawn
    low, high = sorted(world.operator.saturation)
    beyond = np.maximum(target - high, low - target)
    found = invert(world.operator, target, world.start)
    sure = 1e-8 * world.operator.total
    assert np.sum(beyond > sure) <= found.clipped <= np.sum(beyond > 0)


@given(wanted(), st.integers(1, 19))
def test_split_and_resume(drawn, cut):
    """An inversion in two pieces, the second from the first one's final state, still gives the target."""
    world, target = drawn
    if cut >= target.size:
        cut = 1
    first = invert(world.operator, target[:cut], world.start)
    pieces = [first.input]
    if cut < target.size:
        pieces.append(invert(world.operator, target[cut:], first.final).input)
    reached = np.clip(target, *sorted(world.operator.saturation))
    assert world.operator(np.concatenate(pieces), world.start) == pytest.approx(
        reached, rel=0, abs=world.slack
    )


def test_a_loop_that_is_closed_but_for_rounding_wipes_nothing_out():
    """An input beyond the extreme by one rounding would follow the wide branch: 1.2e-15 off, of 1e-3."""
    plane = Plane(np.asarray([0.0, 0.001, 0.002, 0.003]))
    operator = Preisach(plane, np.asarray([0.0, 0.0, 0.0, 0.0, 1000.0, 0.0]), 0.0, "continuous", polarity=-1)
    target = np.asarray([0.0, 1e-7, 2.2250738585072014e-308])
    assert operator(invert(operator, target).input) == pytest.approx(target, rel=0, abs=1e-18)


@given(wanted())
def test_final_state_gives_the_last_target(drawn):
    """From the final state, resting at its present input, the output stays at the last target."""
    world, target = drawn
    found = invert(world.operator, target, world.start)
    assert found.final.extremes[-1] == found.input[-1]
    there = world.operator([found.final.extremes[-1]], found.final)[0]
    assert there == pytest.approx(np.clip(target[-1], *sorted(world.operator.saturation)), abs=world.slack)


@given(wanted(beyond=0.0))
def test_inverse_turns_where_the_target_turns(drawn):
    """While the target rises the input never falls, and the other way round: no chatter."""
    world, target = drawn
    u = invert(world.operator, target, world.start).input
    moved, asked = np.diff(u), np.diff(target) * world.operator.polarity
    assert np.all(moved[asked > 0] >= 0)
    assert np.all(moved[asked < 0] <= 0)
    assert np.all(moved[asked == 0] == 0)


@given(wanted(), st.data())
def test_a_resting_target_leaves_the_input_at_rest(drawn, data):
    """Samples of the target said twice change nothing: the inverse knows no time."""
    world, target = drawn
    times = np.array(data.draw(st.lists(st.integers(1, 3), min_size=target.size, max_size=target.size)))
    slow = invert(world.operator, np.repeat(target, times), world.start).input
    assert np.array_equal(slow, np.repeat(invert(world.operator, target, world.start).input, times))


@given(wanted())
def test_polarity_turns_the_target_upside_down(drawn):
    """A falling device asked for -y moves like the rising one asked for y."""
    world, target = drawn
    up = replace(world.operator, polarity=1, offset=0.0)
    down = replace(world.operator, polarity=-1, offset=0.0)
    assert np.array_equal(invert(up, target, world.start).input, invert(down, -target, world.start).input)


@given(planes(), st.data())
def test_an_empty_band_is_crossed_at_once(plane, data):
    """Where no cell answers, the input waits before the gap, then stands beyond it: no overshoot."""
    gap = data.draw(st.integers(0, plane.n_h - 1), label="empty band")
    i, j = plane.cell_indices
    mu = np.where((i == gap) | (j == gap), 0.0, 1.0)
    operator = Preisach(plane, mu)
    left, right = plane.edges[gap], plane.edges[gap + 1]
    u = np.linspace(plane.low, plane.high, 7 * plane.n_h + 1)
    y = operator(u)
    found = invert(operator, y)
    assert operator(found.input) == pytest.approx(y, rel=0, abs=1e-13 * operator.total)
    slack = 1e-9 * (plane.high - plane.low)
    inside = (found.input > left + slack) & (found.input < right - slack)
    assert not np.any(inside)
    outside = (u < left - slack) | (u > right + slack)
    assert found.input[outside] == pytest.approx(u[outside], rel=0, abs=slack)


# --- closest match --------------------------------------------------------------------------------------


@st.composite
def whole_numbered(draw):
    """Planes and weights whose sums are exact, so that both sides of a comparison round alike."""
    n_h = draw(st.integers(2, 7))
    steps = draw(st.lists(st.sampled_from([1.0, 2.0, 4.0]), min_size=n_h, max_size=n_h))
    plane = Plane(np.concatenate(([0.0], np.cumsum(steps))) + draw(st.integers(-8, 8)))
    mu = np.array(
        draw(st.lists(st.integers(0, 5), min_size=plane.n_q, max_size=plane.n_q).filter(any)), dtype=float
    )
    operator = Preisach(plane, mu, draw(st.sampled_from([0.0, 2.0])), "relay", draw(st.sampled_from([1, -1])))
    reach = int(operator.total) + 3
    target = draw(st.lists(st.integers(-2 * reach, 2 * reach), min_size=1, max_size=25))
    return operator, np.array(target) / 2.0


@given(whole_numbered())
def test_closest_match_is_that_of_the_naive_twin(drawn):
    """Stepping an Everett memory chooses the levels that stepping the relays chooses."""
    operator, target = drawn
    plane = operator.plane
    goals = np.clip(operator.polarity * (target - operator.offset), -operator.total, operator.total)
    level, reached = oracle.closest_match(plane.edges, operator.masses, goals)
    found = closest_match(operator, target)
    assert np.array_equal(found.input, plane.edges[level])
    played = operator(found.input)
    assert played == pytest.approx(operator.offset + operator.polarity * reached, rel=0, abs=1e-9)
    there = operator(found.input[-1:], found.final)[0]  # the memory it ends with
    assert there == pytest.approx(played[-1], rel=0, abs=1e-9)


@given(worlds(least=0.01))
def test_closest_match_is_near_on_a_slow_target(world):
    """A target that a level can give is matched by a level that is not farther than one step of it."""
    operator = replace(world.operator, reading="relay")
    y = operator(world.input, world.start)
    rising = np.sort(y)[:: operator.polarity]
    found = closest_match(operator, rising)
    error = np.abs(operator(found.input) - rising)
    i, j = world.plane.cell_indices
    bands = np.bincount(i, operator.masses), np.bincount(j, operator.masses)
    assert np.all(error <= 2 * np.maximum(*bands).max() + world.slack)


# --- making it playable -----------------------------------------------------------------------------------


@given(planes(), st.data())
def test_smoothing_spline_keeps_its_bounds(plane, data):
    """It stays in the range, and differs from the staircase by no more than its levels are rounded by."""
    level = data.draw(st.lists(st.integers(0, plane.n_h), min_size=5, max_size=40))
    step = (plane.high - plane.low) / plane.n_h
    staircase = plane.low + step * np.array(level)
    rate = data.draw(st.sampled_from([1.0, 1000.0]))
    smooth = smoothed(staircase, np.arange(len(level)) / rate, step, plane.low, plane.high)
    assert smooth.min() >= plane.low
    assert smooth.max() <= plane.high
    assert np.mean((smooth - staircase) ** 2) <= step**2 / 12 * 1.001


@given(planes(), st.data(), st.sampled_from([0.0, 0.3, 1.0, 10.0]))
def test_slew_limit_is_kept_and_nothing_is_nearer(plane, data, share):
    """The path moves at most by the slope, and is as near as any such path can be."""
    u = np.array(data.draw(st.lists(values(plane), min_size=1, max_size=30)))
    slope = max(share, 1e-3) * (plane.high - plane.low) / plane.n_h
    limited = slew_limited(u, 1000.0, slope * 1000.0)
    slack = 1e-12 * (np.abs(plane.edges).max() + plane.high - plane.low + slope * u.size)
    assert np.all(np.abs(np.diff(limited)) <= slope + slack)
    below, above = oracle.slope_envelope(u, slope), -oracle.slope_envelope(-u, slope)
    assert limited == pytest.approx(0.5 * (below + above), rel=0, abs=slack)
    # no path of that slope can serve two samples that are farther apart than it can go
    where = np.arange(u.size)
    apart = np.abs(u[:, None] - u) - slope * np.abs(where[:, None] - where)
    assert np.abs(limited - u).max() <= max(0.5 * apart.max(), 0.0) + slack
