"""A record whose past nobody knows: from where on its output is known, and up to what."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import pasts, planes, state_after, weights

from pulsetrainer.core.initial_state import first_extreme, known_from, start_of
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
