"""A course in parts is the course: every sample is played once, and the memory comes back as it was."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.core import excitations
from pulsetrainer.core.course import Course
from pulsetrainer.core.excitations import Signal
from pulsetrainer.core.memory import negative_saturation, trace
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.errors import ArgumentError
from wording import raises

RATE_HZ = 100.0
HIGH = 1.5
PLANE = Plane.uniform(0.0, HIGH, 12)
PREISACH = Preisach(PLANE, np.linspace(1.0, 2.0, PLANE.n_q))


@st.composite
def courses(draw: st.DrawFn) -> Course:
    """Draw a signal between random turning points, from zero on or from anywhere, some times over."""
    turns = draw(st.lists(st.floats(0.0, HIGH), min_size=1, max_size=12))
    first = draw(st.just(0.0) | st.floats(0.0, HIGH))
    path = np.append(excitations.through(np.array([first, *turns]), 3.0, RATE_HZ), turns[-1])
    return Course(Signal(path, RATE_HZ, "random"), draw(st.integers(1, 4)))


@given(course=courses(), data=st.data())
def test_values_are_those_of_the_repeated_signal(course, data):
    """Any slice of the course is that slice of the signal laid out in full."""
    whole = np.tile(course.signal.value, course.repeats)
    assert course.size == whole.size
    start = data.draw(st.integers(0, whole.size - 1))
    stop = data.draw(st.integers(start, whole.size))
    np.testing.assert_array_equal(course.values(start, stop), whole[start:stop])


@given(course=courses())
def test_reversals_are_those_of_the_repeated_signal(course):
    """Also where one repeat goes over into the next: none, one or two."""
    whole = Signal(np.tile(course.signal.value, course.repeats), RATE_HZ, "whole")
    assert course.reversals == whole.reversals


@given(course=courses(), data=st.data())
def test_the_memory_is_that_of_all_samples_so_far(course, data):
    """However many repeats came before: the same state as tracing every sample."""
    count = data.draw(st.integers(0, course.size))
    whole = np.tile(course.signal.value, course.repeats)[:count]
    expected = trace(whole, negative_saturation(0.0), 0.0, HIGH).final if count else negative_saturation(0.0)
    assert course.memory(count) == expected


@given(course=courses(), data=st.data())
def test_after_the_lead_in_the_output_goes_on_as_if_nothing_had_happened(course, data):
    """Interrupted anywhere, at rest, then led in: the rest of the course gives the same output."""
    at = data.draw(st.integers(1, course.size - 1))
    whole = np.tile(course.signal.value, course.repeats)
    unbroken = PREISACH(whole)[at:]
    lead = course.lead_in(at, speed=3.0, rest_s=0.1)
    longer = course.lead_in(at, speed=3.0, rest_s=0.3)
    assert longer.size - lead.size == (20 if lead.size else 0)  # samples of 0.2 s
    resumed = PREISACH(np.concatenate((lead, whole[at:])))[lead.size :]
    np.testing.assert_allclose(resumed, unbroken, atol=1e-9 * PREISACH.total)


def test_a_swing_shorter_than_a_sample_is_kept():
    """Two turns less than half a sample apart: both are visited, so that the memory is what it should be."""
    path = excitations.through(np.array([0.0, 0.265625, 0.24921875]), 3.0, 100.0)
    assert path.max() == 0.265625
    assert path[-1] == 0.24921875


@given(course=courses(), longest=st.integers(1, 400))
def test_parts_cover_the_course_once(course, longest):
    """Parts follow one another without gap or overlap, none longer than allowed, each one goes ahead."""
    at, ends = 0, []
    while at < course.size:
        end = course.part_end(at, longest)
        assert at < end <= at + longest
        at = end
        ends.append(end)
    assert ends[-1] == course.size


def test_a_part_ends_at_rest_where_it_can():
    """A signal that comes to zero is cut there, and the next part needs no lead-in."""
    course = Course(Signal(excitations.through(np.array([0, 1.0, 0]), 1.0, RATE_HZ), RATE_HZ, "strokes"), 10)
    end = course.part_end(0, 500)
    assert end % course.signal.value.size in (0, 1)
    assert course.lead_in(end, speed=3.0, rest_s=0.2).size == 0


@pytest.mark.parametrize(("rests_at", "end"), [(9, 10), (8, 20)])
def test_only_a_rest_in_the_second_half_ends_a_part(rests_at, end):
    """Of parts of 20 samples, one that ends with its tenth is long enough, one with its ninth is not."""
    value = np.ones(100)
    value[rests_at] = 0.0
    assert Course(Signal(value, RATE_HZ, "rest")).part_end(0, 20) == end


def test_a_deep_memory_is_gone_through_in_time():
    """Many remembered extremes are led through faster: the lead-in stays below a minute and its rest."""
    swings = 0.5 + 0.5 * np.linspace(1, 0.01, 2000) * np.where(np.arange(2000) % 2 == 0, 1, -1)
    signal = Signal(excitations.through(np.array([0.0, *swings]), 20.0, 1000.0), 1000.0, "decay")
    lead = Course(signal).lead_in(signal.value.size, speed=3.0, rest_s=0.2)
    assert lead.size <= 60.3 * 1000


def test_no_repeats_are_an_error():
    """A course without a signal in it."""
    with raises(ArgumentError, "not such an argument", argument="repeats", got="0"):
        Course(Signal(np.zeros(3), 1.0, "x"), 0)
