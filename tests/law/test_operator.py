"""Laws of the Preisach operator, continuous and with relays, against the obvious twin and on their own."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import demagnetising, inputs, pasts, state_after, values, weights, worlds

import oracle
from pulsetrainer.core.memory import negative_saturation, positive_saturation, trace
from pulsetrainer.core.operator import Preisach, base_rows, follow, outputs, rows
from pulsetrainer.core.plane import Plane


def close(actual, expected, slack):
    """Equal up to rounding."""
    assert actual == pytest.approx(expected, rel=0, abs=slack)


def naive(world):
    """Outputs of a world by the oracle of its reading."""
    edges, masses = world.plane.edges, world.operator.weights * oracle.areas(world.plane.edges)
    if world.operator.reading == "relay":
        y = oracle.relay_output(*oracle.relays(edges), masses, world.input, world.past)
    else:
        y = oracle.continuous_output(edges, masses, world.input, world.past)
    return world.operator.offset + world.operator.polarity * y


# --- equality with the oracle ---------------------------------------------------------------------------


@given(worlds())
def test_output_is_that_of_the_naive_twin(world):
    """Everett sums over the memory give what switching every relay, or adding every area, gives."""
    close(world.operator(world.input, world.start), naive(world), world.slack)


@given(worlds(readings=("continuous",), most=4), st.integers(1, 5), st.data())
def test_continuous_reading_is_many_small_relays(world, parts, data):
    """On inputs that are multiples of a fraction of a band, many relays in each cell give the same."""
    plane = world.plane
    cuts = np.interp(np.arange(plane.n_h * parts + 1) / parts, np.arange(plane.n_h + 1), plane.edges)
    on_cuts = st.lists(st.sampled_from(cuts.tolist()), min_size=1, max_size=20)
    past, u = data.draw(on_cuts, label="past"), data.draw(on_cuts, label="input")
    alpha, beta, mass = oracle.subdivided(plane.edges, world.operator.masses, parts)
    y = world.operator.polarity * oracle.relay_output(alpha, beta, mass, u, past)
    close(world.operator(u, state_after(plane, past)), world.operator.offset + y, world.slack)


@given(worlds())
def test_design_rows_are_the_mean_states(world):
    """Rows in node space, carried to the cells, are the states of the relays plus the constant 1."""
    path = follow(world.plane, world.input, world.start, world.operator.reading)
    cells = world.plane.adjoint(rows(world.plane, path).toarray()) - 1.0
    edges = world.plane.edges
    if world.operator.reading == "relay":
        states = oracle.relay_states(*oracle.relays(edges), world.input, world.past)
    else:
        states = oracle.continuous_states(edges, world.input, world.past)
    close(cells, states, 1e-14 * (50 + np.abs(edges).max() / np.diff(edges).min()))


# --- the classical laws -----------------------------------------------------------------------------------


@given(worlds(), st.data())
def test_wiping_out(world, data):
    """What happens between two inputs has no part in the outputs from the second one on."""
    first, second = world.input[0], world.input[-1]
    between = np.clip(data.draw(inputs(world.plane)), min(first, second), max(first, second))
    then = data.draw(inputs(world.plane), label="then")
    detour = world.operator([first, *between, second, *then], world.start)
    straight = world.operator([first, second, *then], world.start)
    close(detour[between.size + 1 :], straight[1:], world.slack)


@given(worlds(), st.data())
def test_congruency_of_minor_loops(world, data):
    """Loops between the same two inputs have the same shape after any two pasts, only shifted."""
    a, b = data.draw(values(world.plane)), data.draw(values(world.plane))
    inside = np.clip(data.draw(inputs(world.plane), label="inside"), min(a, b), max(a, b))
    loop = [b, a, *inside, b]
    y = [
        world.operator([a, *loop], state_after(world.plane, past))[1:]
        for past in (world.past, data.draw(pasts(world.plane), label="other past"))
    ]
    close(y[0] - y[0][0], y[1] - y[1][0], world.slack)
    assert y[0][-1] == pytest.approx(y[0][0], rel=0, abs=world.slack)  # and they close


@given(worlds())
def test_monotonicity(world):
    """An input that only rises gives an output that only rises; with polarity -1, one that only falls."""
    rising = np.sort(world.input)
    for u, direction in ((rising, 1), (rising[::-1], -1)):
        moved = np.diff(world.operator(u, world.start)) * direction * world.operator.polarity
        assert np.all(moved >= -world.slack)


@given(worlds(), st.data())
def test_order_of_pasts_is_kept(world, data):
    """An input that is higher at every time gives an output that is higher at every time."""
    more = data.draw(st.lists(st.floats(0.0, 1.0), min_size=world.input.size, max_size=world.input.size))
    higher = world.input + np.array(more) * (world.plane.high - world.plane.low)
    rise = world.operator(higher, world.start) - world.operator(world.input, world.start)
    assert np.all(rise * world.operator.polarity >= -world.slack)


@given(worlds(), st.data())
def test_rate_independence(world, data):
    """Samples repeated, or added on the way from one to the next, change no output."""
    u, where = world.input, [0]
    dense = [u[0]]
    for before, after in itertools.pairwise(u):
        shares = sorted(data.draw(st.lists(st.floats(0.0, 1.0), max_size=3)))
        way = [before + share * (after - before) for share in shares]
        dense += np.clip(way, min(before, after), max(before, after)).tolist()
        dense.append(after)
        where.append(len(dense) - 1)
    close(world.operator(dense, world.start)[where], world.operator(u, world.start), world.slack)


@given(worlds())
def test_saturation_values(world):
    """At the ends of the range, or beyond, the output is y0 - W and y0 + W whatever went before."""
    operator, plane = world.operator, world.plane
    over = plane.high - plane.low
    ends = np.array([plane.high, plane.low, plane.high + over, plane.low - over])
    y = operator([*world.input, *ends], world.start)[-4:]
    down, up = operator.saturation
    close(y, [up, down, up, down], world.slack)
    assert operator.polarity * (up - down) == pytest.approx(2 * operator.masses.sum(), rel=1e-12)


@given(worlds())
def test_output_stays_between_the_saturations(world):
    """No input gives an output outside [y0 - W, y0 + W]."""
    y, ends = world.operator(world.input, world.start), world.operator.saturation
    assert y.min() >= min(ends) - world.slack
    assert y.max() <= max(ends) + world.slack


@given(worlds(readings=("continuous",)))
def test_continuous_output_is_lipschitz(world):
    """Between two samples the output moves at most as the steepest column or row of the plane allows."""
    plane, masses = world.plane, world.operator.masses
    i, j = plane.cell_indices
    per_band = np.bincount(i, masses, plane.n_h), np.bincount(j, masses, plane.n_h)
    steepest = 2 * np.max(np.maximum(*per_band) / np.diff(plane.edges))
    y = world.operator(world.input, world.start)
    moved = np.abs(np.diff(np.clip(world.input, plane.low, plane.high)))
    assert np.all(np.abs(np.diff(y)) <= steepest * moved + world.slack)


@given(worlds())
def test_reflection_symmetry(world):
    """Turn the plane about its anti-diagonal and the input upside down: the output turns upside down."""
    plane, operator = world.plane, world.operator
    # a relay is up at its upper threshold but not down at its lower one: keep off the thresholds
    distance = np.abs(world.input[:, None] - plane.thresholds).min(axis=1)
    u = np.where(distance > 1e-12 * (plane.high - plane.low), world.input, plane.low)
    past = [v for v in world.past if np.abs(v - plane.thresholds).min() > 1e-12 * (plane.high - plane.low)]
    turned_plane = Plane(-plane.edges[::-1])
    i, j = plane.cell_indices
    square = np.zeros((plane.n_h, plane.n_h))
    square[plane.n_h - 1 - j, plane.n_h - 1 - i] = operator.weights
    turned = Preisach(turned_plane, square[i, j], 0.0, operator.reading)
    turned_past = [-plane.low, *(-v for v in past)]
    upright = Preisach(plane, operator.weights, 0.0, operator.reading)
    y = upright(u, state_after(plane, [plane.low, *past]))
    close(turned(-u, state_after(turned_plane, turned_past)), -y, world.slack)


@given(worlds(), st.floats(-3.0, 3.0), st.sampled_from([1e-6, 0.5, 1e3]))
def test_units_do_not_matter(world, shift, scale):
    """Another zero and another unit of the input change nothing but rounding."""
    plane, operator = world.plane, world.operator
    distance = np.abs(world.input[:, None] - plane.thresholds).min(axis=1)
    u = np.where(distance > 1e-9 * (plane.high - plane.low), world.input, plane.high)
    zero = shift * (plane.high - plane.low)
    moved = Plane((plane.edges + zero) * scale)
    other = Preisach(
        moved, operator.masses / moved.areas, operator.offset, operator.reading, operator.polarity
    )
    close(other((u + zero) * scale), operator(u), 1e-10 * operator.total + world.slack)


@given(worlds(), st.data())
def test_outputs_add_up(world, data):
    """The output is linear in the weights: that of two planes together is the sum of theirs."""
    plane, one = world.plane, world.operator
    more = data.draw(weights(plane)) * (one.weights.max() + 1.0)
    second = Preisach(plane, more, 0.0, one.reading, one.polarity)
    both = Preisach(plane, one.weights + more, one.offset, one.reading, one.polarity)
    y = one(world.input, world.start) + second(world.input, world.start)
    close(both(world.input, world.start), y, world.slack * (1.0 + both.total / max(one.total, 1e-300)))


# --- memory put away and taken up, many weights at once ----------------------------------------------------


@given(worlds(), st.data())
def test_split_and_resume(world, data):
    """A run in pieces, each going on from the state before it, gives the output of one piece."""
    cuts = sorted(data.draw(st.sets(st.integers(1, world.input.size), max_size=4)))
    state, pieces = world.start, []
    for piece in np.split(world.input, cuts):
        if piece.size:
            y, state = world.operator.run(piece, state)
            pieces.append(y)
    whole, final = world.operator.run(world.input, world.start)
    close(np.concatenate(pieces), whole, world.slack)
    assert state == final


@given(worlds())
def test_start_states(world):
    """Starting in a named state is playing the input that leads to it."""
    plane, u = world.plane, world.input
    demagnetised_path = demagnetising(plane)
    for state, path in (
        (negative_saturation(plane.low), [plane.low]),
        (positive_saturation(plane.low, plane.high), [plane.high]),
        (state_after(plane, demagnetised_path), demagnetised_path),
    ):
        played = world.operator([*path, *u])[len(path) :]
        close(world.operator(u, state), played, world.slack)


@given(worlds())
def test_a_state_from_a_wider_plane_is_clipped(world):
    """A memory saved on a wider plane goes on as if its input had been clipped all along."""
    plane = world.plane
    over = plane.high - plane.low
    path = np.array([*world.past, plane.high + over, *world.past])
    wider = negative_saturation(plane.low - over)
    wide = trace(path, wider, wider.extremes[-1], plane.high + over).final
    played = world.operator([*path, *world.input])
    close(world.operator(world.input, wide), played[-world.input.size :], world.slack)


@given(worlds(), st.data())
def test_batch_is_a_loop_of_single_runs(world, data):
    """Many weight vectors and offsets at once give, row by row, what each gives alone."""
    plane, unit = world.plane, world.operator.weights.max()
    mu = np.array([data.draw(weights(plane)) * unit for _ in range(3)])
    offsets = np.array([0.0, 1.0, -2.0]) * world.operator.total
    reading = world.operator.reading
    batch = outputs(plane, mu, offsets, world.input, start=world.start, reading=reading)
    for row, one, offset in zip(batch, mu, offsets, strict=True):
        single = Preisach(plane, one, float(offset), reading)
        close(row, single(world.input, world.start), 1e-10 * (single.total + abs(offset)))


@given(worlds())
def test_base_rows_are_the_rows_of_the_turning_points(world):
    """A turning point's row is that of a sample resting on it."""
    path = follow(world.plane, world.input, world.start, world.operator.reading)
    at_turns = base_rows(world.plane, path) @ world.operator.nodes - world.operator.total
    values_there = path.along_tree(world.operator.step(path.node_value, path.node_value[path.parent]))
    close(at_turns, values_there - world.operator.total, world.slack)
