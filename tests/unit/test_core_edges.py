"""Where the edges of a plane lie, and how much the density may differ along its diagonal."""

from __future__ import annotations

import numpy as np
import pytest
from core_jobs import curves, plant

from pulsetrainer.core import edges, stiffness
from pulsetrainer.core.equations import normal_equations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record

STEP = np.tanh(40.0 * (np.linspace(0.0, 1.0, 2001) - 0.5))  # all of it happens in a tenth of the range
THERE_AND_BACK = np.concatenate((np.linspace(0.0, 1.0, 2001), np.linspace(1.0, 0.0, 2001)))


def test_variation_is_counted_where_it_happens():
    """A staircase up and down: each bin holds its step twice; what is masked or jitters is not counted."""
    u = np.concatenate((np.linspace(0.0, 1.0, 101), np.linspace(1.0, 0.0, 101)))
    y = np.interp(u, [0.0, 0.25, 0.5, 0.75, 1.0], [0.0, 1.0, 1.0, 4.0, 3.0])
    assert edges.variation([Record(u, y)], 0.0, 1.0, 4) == pytest.approx([2.0, 0.0, 6.0, 2.0])
    assert edges.variation([Record(u, y)] * 2, 0.0, 1.0, 2) == pytest.approx([4.0, 8.0])
    spoilt, mask = y.copy(), np.ones(u.size)
    spoilt[101:], mask[101:] = np.nan, 0.0
    assert edges.variation([Record(u, spoilt, mask)], 0.0, 1.0, 4) == pytest.approx([1.0, 0.0, 3.0, 1.0])
    wiggling = u + 0.009 * (-1.0) ** np.arange(u.size)  # turns below 2 % of the range end no branch
    assert edges.variation([Record(wiggling, y)], 0.0, 1.0, 1) == pytest.approx([6.0], abs=0.3)


def test_steepness_is_a_share_of_the_range():
    """A straight line takes half of the range for half of its rise, a constant counts as that."""
    u = np.linspace(0.0, 2.0, 500)
    assert edges.steepness([Record(u, 3.0 * u)], 0.0, 2.0) == pytest.approx(0.5)
    assert edges.steepness([Record(u, np.ones(u.size))], 0.0, 2.0) == 0.5
    bent = np.interp(u, [0.0, 1.5, 2.0], [0.0, 1.0, 3.0])  # the last quarter holds two thirds
    assert edges.steepness([Record(u, bent)], 0.0, 2.0) == pytest.approx(0.25 * 0.5 / (2 / 3), abs=1e-3)


def test_edges_crowd_where_the_loop_is_steep():
    """Half of them follow the output, half the input; a gentle loop has even ones."""
    steep = Record(THERE_AND_BACK, np.concatenate((STEP, STEP[::-1])))
    plane = edges.plane_for([steep], 0.0, 1.0, 20)
    assert (plane.low, plane.high, plane.n_h) == (0.0, 1.0, 20)
    share = 0.5 * (0.5 * (1.0 + np.tanh(40.0 * (plane.edges - 0.5))) + plane.edges)
    assert share == pytest.approx(np.linspace(0.0, 1.0, 21), abs=0.01)
    gentle = Record(THERE_AND_BACK, THERE_AND_BACK**2)
    assert np.array_equal(edges.plane_for([gentle], 0.0, 1.0, 20).edges, np.linspace(0.0, 1.0, 21))


@pytest.mark.parametrize("jump", [0.501, 0.999])
def test_edges_crowd_within_the_192nd_of_the_range_that_holds_a_jump(jump):
    """No finer: half of the edges, and one in 192 of the others, lie there at even steps."""
    u = np.concatenate(([0.0, jump - 1e-6, jump + 1e-6, 1.0], [jump + 1e-6, jump - 1e-6, 0.0]))
    edges_there = edges.plane_for([Record(u, np.where(u > jump, 1.0, 0.0))], 0.0, 1.0, 384).edges
    first = np.floor(192 * jump) / 192
    inside = edges_there[(edges_there >= first - 1e-9) & (edges_there <= first + 1 / 192 + 1e-9)]
    assert abs(inside.size - 193) <= 1
    assert np.diff(inside) == pytest.approx(1 / 192 / 193, rel=1e-6)


def test_a_thinned_plane_crowds_alike():
    """Every other edge of an even number; a plane that is small enough stays what it is."""
    plane = Plane(np.cumsum(np.arange(1.0, 14.0)))
    assert edges.thinned(plane, 6).edges == pytest.approx(plane.edges[::2])
    assert edges.thinned(plane, 12) is plane
    assert edges.thinned(plane, 24) is plane


def test_stiffness_of_equal_loops_and_of_others():
    """A density of alpha - beta alone costs nothing; the rest costs what its differences are."""
    plane = Plane.uniform(0.0, 1.0, 5)
    i, j = plane.cell_indices
    weight = np.full(plane.n_q, 3.0)
    penalty = stiffness.stiffness_penalty(plane, weight, 2.0)
    assert penalty @ (1.0 + (i - j) ** 2) == pytest.approx(0.0)
    assert (i @ (penalty @ i)) == pytest.approx(2.0 * 3.0 * 10)  # ten pairs of neighbours, each one apart
    weight[0] = 0.0  # a cell without data: one pair less, and a smaller mean
    masses = i.astype(float)
    assert masses @ (stiffness.stiffness_penalty(plane, weight, 2.0) @ masses) == pytest.approx(
        2.0 * 3.0 * 14 / 15 * 9
    )


def test_the_strengths_lead_from_a_free_density_to_equal_loops():
    """The weakest hardly binds, the strongest is all but equality."""
    u = curves(1500, 12, 10)
    noise = np.random.default_rng(3).normal(0.0, 0.02, u.size)
    plane = Plane.uniform(-1.0, 1.0, 12)
    sums = normal_equations(plane, [Record(u, plant(60)(u) + noise)], "continuous")
    free, weakest, strongest, equal = (
        stiffness._error(sums, sums, t)
        for t in (0.0, *stiffness.STRENGTHS[:: len(stiffness.STRENGTHS) - 1], 1e6)
    )
    print(f"free {free:.5f}, weakest {weakest:.5f}, strongest {strongest:.5f}, equal {equal:.5f}")
    assert weakest - free < 0.1 * (equal - free)
    assert strongest - free > 0.9 * (equal - free)


def test_stiffness_is_chosen_by_what_comes_later():
    """Loops that differ along the diagonal stay free; a force of the velocity asks for the stiffest."""
    u = np.concatenate((curves(1500, 12, 10), curves(1500, 12, 10)))
    plane = Plane.uniform(-1.0, 1.0, 12)
    assert stiffness.choose_stiffness([Record(u, plant(12)(u))], plane, "continuous") == 0.0
    t = np.linspace(0.0, 60.0, 3000)
    swinging = np.sin(t) * np.sin(0.13 * t + 0.2)
    viscous = Record(swinging, np.tanh(3.0 * np.gradient(swinging, t)))
    assert stiffness.choose_stiffness([viscous], plane, "continuous") == stiffness.STRENGTHS[-1]
    alike = Preisach(plane, np.exp(-1.0 * np.subtract(*plane.cell_indices)))
    noise = np.random.default_rng(1).normal(0.0, 0.2, u.size)
    assert stiffness.choose_stiffness([Record(u, alike(u) + noise)], plane, "continuous") >= 10.0
    whole = Record(u, plant(12)(u), (np.arange(u.size) == 0) * 1.0)
    assert stiffness.choose_stiffness([whole], plane, "continuous") == 0.0
