"""Hypothesis strategies: planes, weights, inputs and pasts, at every scale of units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from pulsetrainer.core.memory import State, negative_saturation, trace
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane

scales = st.sampled_from([1e-9, 1e-3, 1.0, 1e4])
"""Units must not matter: the same experiment in nanoamperes and in kiloamperes."""


@st.composite
def planes(draw, most=6, scale=None):
    """Planes of 2 to ``most`` levels, even or not, anywhere and in any unit."""
    unit = draw(scales) if scale is None else scale
    n_h = draw(st.integers(2, most))
    low = draw(st.floats(-5.0, 5.0)) * unit
    if draw(st.booleans()):
        return Plane.uniform(low, low + n_h * unit, n_h)
    steps = draw(st.lists(st.floats(0.05, 2.0), min_size=n_h, max_size=n_h))
    return Plane(low + unit * np.concatenate(([0.0], np.cumsum(steps))))


def weights(plane, least=0.0):
    """Weights (n_q,): with ``least`` 0 many of them zero, as an identified plane has them."""
    positive = st.floats(max(least, 1e-3), 1.0)
    one = positive if least > 0 else st.one_of(st.just(0.0), positive)
    return st.lists(one, min_size=plane.n_q, max_size=plane.n_q).map(np.array)


def values(plane, *, inside=False):
    """Single inputs: anywhere, on levels, on thresholds, at the edges and, unless ``inside``, beyond them."""
    margin = 0.0 if inside else 0.2 * (plane.high - plane.low)
    return st.one_of(
        st.floats(plane.low - margin, plane.high + margin),
        st.sampled_from(plane.edges.tolist()),
        st.sampled_from(plane.thresholds.tolist()),
    )


def inputs(plane, *, least=1, most=25, inside=False):
    """Inputs (n,) that repeat themselves and return to where they have been."""
    one = values(plane, inside=inside)
    pool = st.lists(one, min_size=1, max_size=6)
    return st.one_of(
        st.lists(one, min_size=least, max_size=most),
        pool.flatmap(lambda few: st.lists(st.sampled_from(few), min_size=least, max_size=most)),
    ).map(np.array)


@st.composite
def pasts(draw, plane):
    """Inputs played before the first sample: none, up to saturation, demagnetising swings, anything."""
    return draw(
        st.one_of(
            st.just([]),
            st.just([plane.high]),
            st.just([plane.high, plane.low]),
            st.just(demagnetising(plane)),
            inputs(plane, most=8).map(list),
        )
    )


def demagnetising(plane):
    """Six swings around the middle, each smaller than the one before."""
    middle, half = 0.5 * (plane.low + plane.high), 0.5 * (plane.high - plane.low)
    return [middle + half * (1 - k / 6) * (-1) ** k for k in range(6)]


def state_after(plane, past) -> State | None:
    """The memory that a past leaves behind; None after no past, as a caller would write it."""
    if len(past) == 0:
        return None
    return trace(np.array(past), negative_saturation(plane.low), plane.low, plane.high).final


@dataclass(frozen=True)
class World:
    """An operator, an input and the past before it."""

    operator: Preisach
    input: np.ndarray
    past: list[float]

    @property
    def plane(self) -> Plane:
        """The plane of the operator."""
        return self.operator.plane

    @property
    def start(self) -> State | None:
        """The memory after the past."""
        return state_after(self.plane, self.past)

    @property
    def slack(self) -> float:
        """Rounding that an output may show: sums of tens of terms, inputs tens of steps away from zero."""
        size = np.abs(self.plane.edges).max() / np.diff(self.plane.edges).min()
        return 1e-15 * (20.0 + size) * (self.operator.total + abs(self.operator.offset)) * 20.0


@st.composite
def worlds(draw, *, readings=("continuous", "relay"), least=0.0, most=6, most_samples=25, inside=False):
    """Operators with an input and a past; ``least`` > 0 makes every cell answer."""
    plane = draw(planes(most))
    mu = draw(weights(plane, least)) * draw(scales) / plane.areas.max()
    offset = draw(st.sampled_from([0.0, 0.3, -2.0])) * float((mu * plane.areas).sum())
    operator = Preisach(plane, mu, offset, draw(st.sampled_from(readings)), draw(st.sampled_from([1, -1])))
    return World(operator, draw(inputs(plane, most=most_samples, inside=inside)), draw(pasts(plane)))
