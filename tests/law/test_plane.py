"""Laws of the plane: masses and Everett nodes are two coordinate systems of one space."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds import planes, values, weights

import oracle
from pulsetrainer.core.large import difference
from pulsetrainer.core.plane import Plane


@st.composite
def masses_on_planes(draw):
    """A plane and masses for its cells."""
    plane = draw(planes())
    return plane, draw(weights(plane)) * plane.areas


@given(masses_on_planes())
def test_everett_nodes_are_sums_over_triangles(drawn):
    """Two cumulative sums give what adding up the cells of every triangle gives."""
    plane, masses = drawn
    expected = oracle.everett(plane.edges, masses)
    assert plane.everett_nodes(masses) == pytest.approx(expected, rel=1e-13, abs=1e-15 * masses.sum())


@given(masses_on_planes())
def test_masses_come_back_from_their_everett_nodes(drawn):
    """The stencil of ``core.large`` undoes everett_nodes, and the other way round."""
    plane, masses = drawn
    nodes = plane.everett_nodes(masses)
    slack = 1e-14 * masses.sum()
    undone = difference(plane) @ nodes
    assert undone == pytest.approx(masses, rel=0, abs=slack)
    assert plane.everett_nodes(undone) == pytest.approx(nodes, rel=0, abs=10 * slack)


@given(masses_on_planes(), st.data())
def test_adjoint_is_the_transpose(drawn, data):
    """The inner product of node values with E m is that of E' (node values) with m."""
    plane, masses = drawn
    node_values = data.draw(weights(plane)) - 0.5
    left = node_values @ plane.everett_nodes(masses)
    right = plane.adjoint(node_values) @ masses
    assert left == pytest.approx(right, rel=0, abs=1e-14 * plane.n_q * masses.sum())


@given(masses_on_planes())
def test_many_at_once_are_the_same_one_by_one(drawn):
    """A stack of mass vectors, or of node vectors, is transformed row by row."""
    plane, masses = drawn
    stack = np.stack([masses, masses[::-1], 0 * masses])
    for transform in (plane.everett_nodes, plane.adjoint):
        assert np.array_equal(transform(stack), np.stack([transform(row) for row in stack]))


@given(planes())
def test_areas_fill_the_half_plane(plane):
    """Cells have the areas of their rectangles and triangles and together half the square."""
    assert plane.areas == pytest.approx(oracle.areas(plane.edges), rel=1e-14)
    assert plane.areas.sum() == pytest.approx(0.5 * (plane.high - plane.low) ** 2, rel=1e-12)


@given(masses_on_planes(), st.data())
def test_signed_everett_is_antisymmetric(drawn, data):
    """G(b, a) = -G(a, b) anywhere in the square, and G(a, a) = 0."""
    plane, masses = drawn
    signed = plane.signed_everett(plane.everett_nodes(masses))
    a, b = np.array(data.draw(st.lists(st.tuples(values(plane), values(plane)), min_size=1, max_size=10))).T

    def everett(to, origin):
        corner, weight = plane.corners(to, origin)
        return (weight * signed[corner]).sum(axis=0)

    slack = 1e-15 * masses.sum() * (10 + np.abs(plane.edges).max() / np.diff(plane.edges).min())
    assert everett(a, b) == pytest.approx(-everett(b, a), rel=0, abs=slack)
    assert everett(a, a) == pytest.approx(0.0, abs=slack)


@given(planes(), st.data())
def test_bands_and_fractions_give_the_value_back(plane, data):
    """Every input is its band's lower level plus its fraction of the band; beyond the edges, the edge."""
    u = np.array(data.draw(st.lists(values(plane), min_size=1, max_size=10)))
    band, fraction = plane.bands(u)
    assert np.all((band >= 0) & (band < plane.n_h))
    assert np.all((fraction >= 0) & (fraction <= 1))
    back = plane.edges[band] + fraction * np.diff(plane.edges)[band]
    size = np.abs(plane.edges).max()
    assert back == pytest.approx(np.clip(u, plane.low, plane.high), rel=0, abs=4e-16 * size)


@given(planes(), st.data())
def test_rounding_to_nodes_is_what_the_relays_see(plane, data):
    """An input and its rounded value switch the same relays: up from a threshold on."""
    u = np.array(data.draw(st.lists(values(plane), min_size=1, max_size=10)))
    rounded = plane.round_to_nodes(u)
    assert np.all(np.isin(rounded, plane.edges))
    seen, switched = u[:, None] >= plane.thresholds, rounded[:, None] >= plane.thresholds
    assert np.array_equal(seen, switched)


def test_numbering_of_the_cells():
    """Cells are numbered k = i (i + 1) / 2 + j, the top of the plane last."""
    plane = Plane.uniform(0.0, 1.0, 5)
    i, j = plane.cell_indices
    assert np.array_equal(i * (i + 1) // 2 + j, np.arange(plane.n_q))
    assert list(zip(i.tolist(), j.tolist(), strict=True)) == oracle.cells(plane.edges)
