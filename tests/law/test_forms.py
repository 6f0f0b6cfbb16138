"""Laws of the dual and the signed form."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from worlds import planes, weights, worlds

from pulsetrainer.core.dual import Dual
from pulsetrainer.core.inversion import invert
from pulsetrainer.core.memory import negative_saturation, trace
from pulsetrainer.core.monotone import _turning_back, invertible_range
from pulsetrainer.core.operator import Preisach
from pulsetrainer.errors import ArgumentError

CONTINUOUS = worlds(readings=("continuous",), least=0.1)


def within(operator, draw):
    """Inputs of the dual of an operator, within its range."""
    low, high = sorted(operator.saturation)
    shares = draw(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
    return low + (high - low) * np.array(shares)


@given(CONTINUOUS, st.data())
def test_inverse_after_forward_is_the_identity(world, data):
    """What the dual is asked for, it gives: u -> y -> u."""
    dual = Dual(world.operator)
    u = within(world.operator, data.draw)
    lead = np.array([dual.low, dual.high, dual.low])
    led, y = np.split(dual(np.concatenate((lead, u))), [lead.size])
    low, high = dual.saturation
    reach = world.plane.high - world.plane.low
    np.testing.assert_allclose(led, [low, high, low], atol=1e-6 * reach)
    found = dual.inverse(y, lead)
    np.testing.assert_allclose(found.input, u, atol=100 * world.slack)
    assert found.clipped == 0


@given(CONTINUOUS, st.data())
def test_the_dual_is_the_exact_inverse(world, data):
    """From its lower end a rising dual is ``invert`` of what is within."""
    operator = Preisach(world.plane, world.operator.weights, world.operator.offset)
    u = within(operator, data.draw)
    np.testing.assert_array_equal(Dual(operator)(u), invert(operator, u).input)


@given(CONTINUOUS, st.data())
def test_a_dual_goes_on_where_it_was(world, data):
    """Remembered inputs as the start, and the inputs before them played, give the same."""
    dual = Dual(world.operator)
    before, after = within(world.operator, data.draw), within(world.operator, data.draw)
    past = np.concatenate(([dual.low], before))
    state = trace(past, negative_saturation(dual.low), dual.low, dual.high).final
    whole = dual(np.concatenate((past, after)))[past.size :]
    reach = world.plane.high - world.plane.low
    np.testing.assert_allclose(dual(after, state), whole, atol=1e-6 * reach)


@given(CONTINUOUS)
def test_a_dual_leads(world):
    """Its output on the way up is nowhere below that on the way down, turned upright."""
    dual = Dual(world.operator)
    u = np.linspace(dual.low, dual.high, 40)
    y = dual.polarity * dual(np.concatenate((u, u[::-1])))
    assert np.all(y[:40] - y[40:][::-1] >= -1e-6 * (world.plane.high - world.plane.low))


@st.composite
def signed(draw):
    """Operators with weights of either sign."""
    plane = draw(planes(6))
    mu = draw(weights(plane)) - draw(st.floats(0.0, 0.6)) * draw(weights(plane))
    return Preisach(plane, mu / plane.areas.max(), draw(st.floats(-1.0, 1.0)), signed=True)


def turns_back(operator, a, b):
    """How far any branch within edges a .. b turns back, branch by branch."""
    edges, worst = operator.plane.edges, 0.0
    inside = [operator.low, edges[b], edges[a]]
    for k in range(a, b + 1):
        after_fall, after_rise = [*inside, edges[b], edges[k]], [*inside, edges[k]]
        for past, way in ((after_fall, edges[k : b + 1]), (after_rise, edges[a : k + 1][::-1])):
            y = operator(np.concatenate((past, way)))[len(past) :]
            y = y if way[-1] > way[0] else -y
            worst = max(worst, float(np.max(np.maximum.accumulate(y) - y)))
    return worst


@given(signed())
def test_turning_back_is_that_of_every_branch(operator):
    """The table of all ranges against all branches of each, one after another."""
    grid = operator.plane.everett_grid(operator.plane.everett_nodes(operator.masses))
    table = _turning_back(2.0 * grid)
    size = np.abs(operator.masses).sum() + abs(operator.offset)
    for a in range(operator.plane.n_h):
        for b in range(a + 1, operator.plane.n_h + 1):
            np.testing.assert_allclose(table[a, b], turns_back(operator, a, b), atol=1e-9 * size)


@given(signed(), st.data())
def test_a_signed_operator_is_inverted_where_it_is_monotone(operator, data):
    """Within the range that is named, the output of the whole operator is the target."""
    try:
        found = invertible_range(operator, 0.0)
    except ArgumentError:
        assume(False)  # there is no such range
    low, high = sorted(found.operator.saturation)
    target = low + (high - low) * data.draw(inputs_of_share())
    u = invert(found.operator, target, monotone=True).input
    assert np.all((u >= found.operator.low) & (u <= found.operator.high))
    lead = np.array(found.lead)
    y = operator(np.concatenate((lead, u)))[lead.size :]
    size = np.abs(operator.masses).sum() + abs(operator.offset)
    np.testing.assert_allclose(y, target, atol=1e-6 * size)


def inputs_of_share():
    """Rows of shares of a range."""
    return st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20).map(np.array)
