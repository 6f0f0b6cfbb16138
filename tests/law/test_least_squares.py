"""Laws of identification: the sums are those of the dense matrix, the fit is that of dense nnls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import inputs, pasts, planes, scales, weights, worlds

import oracle
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.identification import identify, normal_equations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.record import Record

# fits are slow to check: fewer of them
few = settings(max_examples=settings().max_examples // 2)


@st.composite
def measured(draw, *, noise=0.05):
    """A world that sweeps its range at first, and its output with noise and sample weights."""
    world = draw(worlds(most=5, most_samples=20))
    plane = world.plane
    sweep = np.linspace(plane.low, plane.high, 2 * plane.n_h + 1)
    world = replace(world, input=np.concatenate((sweep, sweep[::-1], world.input)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    # a plane without any mass gives a constant output, which cannot be fitted: noise of its own size then
    size = world.operator.total or 1.0
    output = world.operator(world.input, world.start) + noise * size * rng.normal(size=world.input.size)
    weight = draw(
        st.sampled_from([np.ones(()), rng.random(output.size), (rng.random(output.size) < 0.8) * 1.0])
    )
    return world, Record(world.input, output, weight, world.start)


def states_of(world):
    """The dense design matrix: mean states of all cells at all samples."""
    edges = world.plane.edges
    if world.operator.reading == "relay":
        return oracle.relay_states(*oracle.relays(edges), world.input, world.past)
    return oracle.continuous_states(edges, world.input, world.past)


@given(measured())
def test_sums_are_those_of_the_dense_matrix(drawn):
    """Sparse node sums carried to the cells are S'VS, S'Vy, S'v of the dense states S."""
    world, record = drawn
    equations = normal_equations(world.plane, [record], world.operator.reading)
    states, v, y = states_of(world), record.sample_weight, record.output
    rounding = 1e-13 * (20 + np.abs(world.plane.edges).max() / np.diff(world.plane.edges).min()) * v.sum()
    size = np.abs(y).max()
    assert equations.gram == pytest.approx(states.T @ (states * v[:, None]), rel=0, abs=rounding)
    assert equations.row_sum == pytest.approx(states.T @ v, rel=0, abs=rounding)
    assert equations.moment == pytest.approx(states.T @ (v * y), rel=0, abs=rounding * size)
    assert equations.weight_sum == pytest.approx(v.sum())
    assert equations.output_sum == pytest.approx(v @ y, rel=0, abs=rounding * size)
    assert equations.output_square == pytest.approx(v @ y**2)


@few
@given(measured())
def test_fit_has_the_objective_of_dense_nnls(drawn):
    """No design matrix, one block solve: the sum of squares of the slow way to 1e-9."""
    world, record = drawn
    found = identify([record], world.plane, reading=world.operator.reading, polarity=1)
    states = states_of(world)
    slow = oracle.sum_of_squares(
        states,
        record.output,
        *oracle.dense_fit(states, record.output, record.sample_weight),
        record.sample_weight,
    )
    fast = oracle.sum_of_squares(
        states, record.output, found.operator.masses, found.operator.offset, record.sample_weight
    )
    spread = np.ptp(record.output) ** 2 * record.sample_weight.sum()
    assert fast == pytest.approx(slow, rel=1e-9, abs=1e-13 * spread)


@few
@given(measured())
def test_alternating_ends_where_joint_does(drawn):
    """The paper's two steps in turn and the exact elimination of the offset are one fit."""
    world, record = drawn
    reading = world.operator.reading
    joint, turns = (
        identify([record], world.plane, reading=reading, method=method) for method in ("joint", "alternating")
    )
    states = states_of(world)
    squares = [
        oracle.sum_of_squares(
            states,
            record.output,
            f.operator.polarity * f.operator.masses,
            f.operator.offset,
            record.sample_weight,
        )
        for f in (joint, turns)
    ]
    spread = np.ptp(record.output) ** 2 * record.sample_weight.sum()
    assert squares[0] == pytest.approx(squares[1], rel=1e-8, abs=1e-12 * spread)


@few
@given(measured(noise=0.0))
def test_noise_free_output_is_explained(drawn):
    """Without noise the fitted operator gives the measured output back, whatever weights it chose."""
    world, record = drawn
    record = Record(record.input, record.output, start=record.start)
    if np.ptp(record.output) <= 1e-9 * np.abs(record.output).max():
        return
    found = identify([record], world.plane, reading=world.operator.reading)
    back = found.operator(record.input, record.start)
    assert found.operator.polarity == world.operator.polarity
    assert back == pytest.approx(record.output, rel=0, abs=1e-6 * np.ptp(record.output) + world.slack)


@few
@given(measured(), st.integers(2, 12))
def test_two_records_are_one_cut_in_two(drawn, cut):
    """A record, and its two parts with the second starting from the first one's state, are one fit."""
    world, record = drawn
    cut = min(cut, record.input.size - 2)  # a record has two samples or more
    v, reading = record.sample_weight, world.operator.reading
    _, middle = world.operator.run(record.input[:cut], world.start)
    parts = [
        Record(record.input[:cut], record.output[:cut], v[:cut], world.start),
        Record(record.input[cut:], record.output[cut:], v[cut:], middle),
    ]
    whole, two = (normal_equations(world.plane, r, reading) for r in ([record], parts))
    slack = 1e-11 * v.sum() * (1 + np.abs(world.plane.edges).max() / np.diff(world.plane.edges).min())
    assert two.gram == pytest.approx(whole.gram, rel=0, abs=slack)
    assert two.moment == pytest.approx(whole.moment, rel=0, abs=slack * np.abs(record.output).max())


@few
@given(measured())
def test_masked_samples_do_not_count(drawn):
    """Samples of weight 0 may be anything, NaN too, but the memory passes through them."""
    world, record = drawn
    masked = record.sample_weight == 0
    nonsense = np.where(masked, np.nan, record.output)
    weight = record.sample_weight
    one = identify([Record(record.input, record.output, weight, record.start)], world.plane)
    spoilt = Record(record.input, nonsense, weight, record.start)
    assert np.array_equal(spoilt.counts, ~masked)
    two = identify([spoilt], world.plane)
    assert np.array_equal(one.operator.weights, two.operator.weights)
    assert one.operator.offset == two.operator.offset


@few
@given(measured(), scales, st.sampled_from([-3.0, 0.0, 5.0]))
def test_unit_and_zero_of_the_output_do_not_matter(drawn, unit, shift):
    """Another unit and another zero of the sensor scale the weights and move the offset, no more."""
    world, record = drawn
    size = np.ptp(record.output)
    other = Record(record.input, (record.output + shift * size) * unit, record.sample_weight, record.start)
    reading = world.operator.reading
    here, there = (identify([r], world.plane, reading=reading) for r in (record, other))
    y, z = (f.operator(record.input, record.start) for f in (here, there))
    fitted = record.sample_weight > 0
    assert here.operator.polarity == there.operator.polarity
    assert (z / unit - shift * size)[fitted] == pytest.approx(y[fitted], rel=0, abs=1e-6 * size)


@given(planes(), st.data())
def test_coverage_is_that_of_the_naive_twin(plane, data):
    """A cell is covered when its relay went up and, later, down."""
    runs = [np.array([*data.draw(pasts(plane)), *data.draw(inputs(plane))]) for _ in range(2)]
    expected = oracle.coverage(plane.edges, runs[0]) | oracle.coverage(plane.edges, runs[1])
    assert np.array_equal(coverage(plane, runs), expected)


@given(planes(), st.data())
def test_uncovered_cells_do_not_change_the_output(plane, data):
    """Mass added where the input never switched a relay both ways is a constant once all is swept up."""
    u = np.array([plane.high, *data.draw(inputs(plane))])
    covered = coverage(plane, [u])
    mu = data.draw(weights(plane))
    extra = np.where(covered, 0.0, 1.0)
    one, two = Preisach(plane, mu, 0.0, "relay"), Preisach(plane, mu + extra, 0.0, "relay")
    difference = two(u) - one(u)
    assert np.ptp(difference) <= 1e-12 * two.total
