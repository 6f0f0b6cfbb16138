"""Laws of the memory: what it keeps, what it forgets, and that it can be put away and taken up again."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from worlds import inputs, pasts, planes, state_after, values

import oracle
from pulsetrainer.core.memory import (
    State,
    demagnetised,
    negative_saturation,
    positive_saturation,
    trace,
    turning_points,
)


@st.composite
def histories(draw):
    """A plane, a past and an input."""
    plane = draw(planes())
    return plane, draw(pasts(plane)), draw(inputs(plane))


def follow(plane, past, values):
    """Trace an input after a past."""
    return trace(values, state_after(plane, past) or negative_saturation(plane.low), plane.low, plane.high)


@given(histories())
def test_memory_is_what_the_whole_history_remembers(history):
    """The stack ends as the extremes found by searching the whole history, to the last digit."""
    plane, past, u = history
    whole = np.clip([*past, *u], plane.low, plane.high).tolist()
    assert list(follow(plane, past, u).final.extremes) == oracle.remembered(whole, plane.low)


@given(histories())
def test_every_sample_moves_away_from_its_anchor(history):
    """At each sample the tree of turning points, read from the anchor to the root, is the memory then."""
    plane, past, u = history
    path = follow(plane, past, u)
    whole = np.clip([*past, *u], plane.low, plane.high).tolist()
    for n in range(u.size):
        chain, node = [path.value[n]], int(path.anchor[n])
        while True:
            chain.append(path.node_value[node])
            if node == 0:
                break
            node = int(path.parent[node])
        remembered = [v for k, v in enumerate(chain) if k == len(chain) - 1 or v != chain[k + 1]][::-1]
        assert remembered == oracle.remembered(whole[: len(past) + n + 1], plane.low)


@given(histories())
def test_parents_come_before_children(history):
    """Node 0 is its own parent; every other node is numbered after its parent and differs from it."""
    plane, past, u = history
    path = follow(plane, past, u)
    assert path.parent[0] == 0
    assert path.node_value[0] == plane.low
    assert np.all(path.parent[1:] < np.arange(1, path.parent.size))
    assert np.all(path.node_value[1:] != path.node_value[path.parent[1:]])
    assert np.array_equal(path.value, np.clip(u, plane.low, plane.high))


@given(histories(), st.data())
def test_wiping_out(history, data):
    """Whatever happens between two inputs is forgotten altogether once the second is reached."""
    plane, past, u = history
    first, second = u[0], u[-1]
    between = np.clip(data.draw(inputs(plane)), min(first, second), max(first, second))
    detour = follow(plane, past, np.array([first, *between, second])).final
    assert detour == follow(plane, past, np.array([first, second])).final


@given(histories(), st.integers(0, 25))
def test_split_and_resume(history, cut):
    """A memory put away in the middle of a run and taken up again ends as in one piece."""
    plane, past, u = history
    cut = min(cut, u.size - 1)
    whole = follow(plane, past, u)
    if cut:
        middle = follow(plane, past, u[:cut]).final
        assert trace(u[cut:], middle, plane.low, plane.high).final == whole.final
        assert trace(u[cut:], State(middle.extremes), plane.low, plane.high).final == whole.final


@given(histories())
def test_a_state_is_reached_by_playing_its_extremes(history):
    """The extremes of a state, played as an input from negative saturation, leave that state behind."""
    plane, past, u = history
    state = follow(plane, past, u).final
    assert follow(plane, [], np.array(state.extremes)).final == state


@given(planes(), st.data())
def test_edges_of_the_range_leave_saturation(plane, data):
    """At either end of the range, or beyond, nothing of the past is left."""
    past = data.draw(pasts(plane))
    over = 0.5 * (plane.high - plane.low)
    low, high = negative_saturation(plane.low), positive_saturation(plane.low, plane.high)
    assert follow(plane, past, np.array([plane.high + over])).final == high
    assert follow(plane, past, np.array([plane.low - over])).final == low


@given(planes())
def test_demagnetised_state_swings_ever_less(plane):
    """Its extremes are the swings, all of them: none passes an earlier one."""
    state = demagnetised(plane.low, plane.high)
    assert len(state.extremes) == 201
    assert follow(plane, [], np.array(state.extremes)).final == state


@given(planes(), st.data())
def test_turning_points_are_the_local_extremes(plane, data):
    """A turn is where the next different sample goes back; the last value that moved counts as one."""
    path = data.draw(st.lists(values(plane), min_size=1, max_size=20))
    moved = [0, *[k for k in range(1, len(path)) if path[k] != path[k - 1]]]
    turns = [
        here
        for before, here, after in zip(moved, moved[1:], moved[2:], strict=False)
        if (path[after] > path[here]) != (path[here] > path[before])
    ]
    assert turning_points(np.array(path)).tolist() == turns + moved[-1:] * (len(moved) > 1)
