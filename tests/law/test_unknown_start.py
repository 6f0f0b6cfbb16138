"""A record whose past nobody knows: from where on its output is known, and up to what."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import pasts, planes, state_after, weights

from pulsetrainer.core.initial_state import first_extreme, known_from, reaches_an_end, start_of
from pulsetrainer.core.operator import Preisach

STEPS = 20  # inputs lie on so many steps of the range: one that is near an end is at it


@given(planes(), st.data())
def test_after_both_extremes_the_past_is_one_constant(plane, data):
    """Whatever was played before, predictions differ by a constant; by nothing where an end was reached."""
    operator = Preisach(plane, data.draw(weights(plane), label="weights"), 0.0, "continuous")
    number = data.draw(st.lists(st.integers(0, STEPS), min_size=2, max_size=30), label="record")
    u = plane.low + (plane.high - plane.low) * np.array(number) / STEPS
    start = state_after(plane, data.draw(pasts(plane), label="past"))
    difference = operator(u, start) - operator(u, start_of(u, plane.low, plane.high))
    slack = 1e-9 * (abs(operator.total) + 1e-300)
    known = known_from(u, plane.low, plane.high)
    if {0, STEPS} & set(number):
        assert number[known] in (0, STEPS)
        assert difference[known:] == pytest.approx(0.0, abs=slack)
    else:
        assert known == first_extreme(u)[0]
        both = max(number.index(min(number)), number.index(max(number)))
        assert difference[both:] == pytest.approx(difference[both], abs=slack)


@pytest.mark.parametrize(("apart", "reached"), [(0.009, True), (0.011, False)])
def test_an_end_is_reached_within_a_hundredth_of_the_range(apart, reached):
    """Of the range of the plane, 2 to 12, or of the record's own; at either end, at the first such sample."""
    for end, inner in ((2.0 + 10.0 * apart, 1.0), (12.0 - 10.0 * apart, -1.0)):
        u = np.array([7.0, 7.0 + 2.0 * inner, end, 7.0, end])
        assert reaches_an_end(u, 2.0, 12.0) == reached
        if reached:
            assert known_from(u, 2.0, 12.0) == 2
    for sign in (1, -1):
        own = sign * np.array([0.0, 10.0 * (1.0 - 2.0 * apart), 10.0, -10.0])
        assert first_extreme(own) == (1 if reached else 2, sign > 0)
