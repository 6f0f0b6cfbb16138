"""Laws of the non-negative solver: the optimality conditions, and equality with scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import optimize

from pulsetrainer.core import nnls


@st.composite
def problems(draw):
    """Random matrices, tall and wide, with sparse, repeated and empty columns, in any unit; a right side."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    rows, columns = draw(st.integers(1, 40)), draw(st.integers(1, 15))
    matrix = rng.normal(size=(rows, columns)) + draw(st.sampled_from([0.0, 1.0]))
    matrix[rng.random(matrix.shape) < draw(st.sampled_from([0.0, 0.5]))] = 0.0
    if draw(st.booleans()) and columns > 1:
        matrix[:, 0] = matrix[:, -1]  # cells that the data cannot tell apart
    if draw(st.booleans()):
        matrix[:, columns // 2] = 0.0  # a cell that they never touch
    matrix *= draw(st.sampled_from([1e-8, 1.0, 1e5]))
    return matrix, rng.normal(size=rows) * draw(st.sampled_from([1e-6, 1.0, 1e3]))


@given(problems())
def test_same_objective_as_scipy(problem):
    """The residual is that of scipy.optimize.nnls on the matrix itself, but for the ridge r of the pivots.

    Beside positive columns A of least singular value s the ridge moves A x by at most r |x| / s.
    """
    matrix, right = problem
    x = nnls.solve(matrix.T @ matrix, matrix.T @ right).x
    _, norm = optimize.nnls(matrix, right, maxiter=10_000)
    rounding = 1e-12 * (right @ right) + _moved_by_the_ridge(matrix, x) ** 2
    assert np.sum((matrix @ x - right) ** 2) == pytest.approx(norm**2, rel=1e-9, abs=rounding)


def _moved_by_the_ridge(matrix, x):
    size = np.linalg.svd(matrix[:, x > 0], compute_uv=False)
    seen = size[size > 1e-7 * size.max(initial=0.0)]  # less is a column that the data cannot tell from others
    return 1e-13 * np.max(np.sum(matrix**2, axis=0)) * np.linalg.norm(x) / seen[-1] if seen.size else 0.0


@given(problems())
def test_the_active_set_ends_what_exchanges_leave(problem):
    """After a single system scipy goes on, on a root of the normal equations, to the same objective.

    What the data never touch stays at zero.
    """
    matrix, right = problem
    x = nnls.solve(matrix.T @ matrix, matrix.T @ right, max_iterations=1).x
    _, norm = optimize.nnls(matrix, right, maxiter=10_000)
    assert np.all(x >= 0)
    assert np.all(x[~matrix.any(axis=0)] == 0)
    assert np.sum((matrix @ x - right) ** 2) == pytest.approx(norm**2, rel=1e-6, abs=1e-9 * (right @ right))


@given(problems())
def test_same_minimiser_as_scipy_where_there_is_one(problem):
    """A well-conditioned problem has one minimiser, and both find it."""
    matrix, right = problem
    size = np.linalg.svd(matrix, compute_uv=False)
    if matrix.shape[0] < matrix.shape[1] or size[-1] < 1e-3 * size[0]:
        matrix = np.vstack((matrix, size[0] * np.eye(matrix.shape[1])))
        right = np.append(right, np.zeros(matrix.shape[1]))
    expected, _ = optimize.nnls(matrix, right, maxiter=10_000)
    # scipy's own steps left 2e-8 of the largest where a column is empty; on its support there is one answer
    positive = expected > 0
    expected[positive] = np.maximum(np.linalg.lstsq(matrix[:, positive], right, rcond=None)[0], 0.0)
    found = nnls.solve(matrix.T @ matrix, matrix.T @ right).x
    own, other = (np.linalg.norm(matrix @ x - right) for x in (found, expected))
    assume(other <= own * (1.0 + 1e-9))  # scipy 1.17 once ended at twice ours: no judge then
    assert found == pytest.approx(expected, rel=0, abs=1e-8 * np.abs(expected).max() + 1e-300)


@given(problems())
def test_optimality_conditions(problem):
    """X >= 0, no descent at its zeros, a flat gradient where it is positive."""
    matrix, right = problem
    gram, rhs = matrix.T @ matrix, matrix.T @ right
    found = nnls.solve(gram, rhs)
    assert np.all(found.x >= 0)
    assert np.all(found.x[~found.passive] == 0)
    # the largest term that a gradient is a difference of
    size = np.abs(rhs).max() + (np.abs(gram) @ found.x).max() + np.finfo(float).tiny
    gradient = gram @ found.x - rhs
    assert np.all(gradient >= -1e-9 * size)
    assert np.all(np.abs(gradient[found.x > 0]) <= 1e-9 * size)


@given(problems(), st.data())
def test_the_first_guess_does_not_matter(problem, data):
    """A guess of the positive variables changes the way, not the objective reached."""
    matrix, right = problem
    gram, rhs = matrix.T @ matrix, matrix.T @ right
    guess = np.array(data.draw(st.lists(st.booleans(), min_size=rhs.size, max_size=rhs.size)))
    one, two = nnls.solve(gram, rhs).x, nnls.solve(gram, rhs, passive=guess).x
    squares = [np.sum((matrix @ x - right) ** 2) for x in (one, two)]
    assert squares[0] == pytest.approx(squares[1], rel=1e-9, abs=1e-12 * (right @ right))


@given(problems(), st.sampled_from([1e-12, 1e-3, 1e7]))
def test_units_do_not_matter(problem, unit):
    """Another unit of the data scales the minimiser and changes no decision."""
    matrix, right = problem
    gram, rhs = matrix.T @ matrix, matrix.T @ right
    here, there = nnls.solve(gram, rhs), nnls.solve(gram * unit**2, rhs * unit)
    squares = [np.sum((matrix @ x - right) ** 2) for x in (here.x, there.x * unit)]
    assert squares[0] == pytest.approx(squares[1], rel=1e-9, abs=1e-12 * (right @ right))


@given(problems())
def test_kkt_violation_tells_right_from_wrong(problem):
    """It is small at the solution and large at a point that is none."""
    matrix, right = problem
    gram, rhs = matrix.T @ matrix, matrix.T @ right
    found = nnls.solve(gram, rhs).x
    if rhs.max() > 1e-6 * np.abs(rhs).max():  # else the solution may be zero
        assert nnls.kkt_violation(gram, rhs, np.zeros_like(found)) > 0
    at_work = found + 1.0
    expected = np.abs(gram @ at_work - rhs).max() / max(np.abs(rhs).max(), np.finfo(float).tiny)
    assert nnls.kkt_violation(gram, rhs, at_work) == pytest.approx(expected, rel=1e-9)


def _hardly_different(seed, empty=()):
    """Twice cumulated columns, some of them empty, and a right side that they make but for noise."""
    rng = np.random.default_rng(seed)
    rows, columns = int(rng.integers(20, 60)), int(rng.integers(20, 60))
    matrix = np.cumsum(np.cumsum(rng.normal(size=(rows, columns)), axis=1), axis=0)
    matrix *= 10.0 ** rng.uniform(-3, 0, columns)
    matrix[:, list(empty)] = 0.0
    return matrix, matrix @ np.maximum(rng.normal(size=columns), 0.0) + 1e-3 * rng.normal(size=rows)


@pytest.mark.parametrize("seed", [10047, 10069, 10125, 10250, 10417, 10505, 10627])
def test_cells_that_hardly_differ_settle(monkeypatch, seed):
    """Twice cumulated columns, fewer samples than cells: descent that only puts to zero what falls stalls.

    A ridge would settle it at another point: the conditions hold to rounding, after few systems. No step of
    the descent leaves the non-negative, or climbs.
    """
    matrix, right = _hardly_different(seed)
    columns = matrix.shape[1]
    gram, rhs = matrix.T @ matrix, matrix.T @ right
    ways, is_lower = [], nnls.Gram.is_lower
    monkeypatch.setattr(
        nnls.Gram, "is_lower", lambda own, *ends: ways.append(ends[1]) or is_lower(own, *ends)
    )
    found = nnls.solve(gram, rhs, max_iterations=columns)
    way = np.array(ways)
    heights = np.sum((0.5 * way @ gram - rhs) * way, axis=1)
    assert np.all(way >= 0)
    assert np.all(np.diff(heights) <= 1e-12 * np.abs(heights).max())
    assert nnls.kkt_violation(gram, rhs, found.x) < 1e-12
    _, norm = optimize.nnls(matrix, right, maxiter=10_000)
    left = np.sum((matrix @ found.x - right) ** 2)
    assert left <= norm**2 + 1e-12 * (right @ right)


@pytest.mark.parametrize("seed", [10047, 10069, 10125, 10250, 10417, 10505, 10627])
def test_systems_are_counted_and_no_more_are_solved_than_may_be(monkeypatch, seed):
    """By exchanges and by descent together; one system fewer leaves the end to the active set."""
    matrix, right = _hardly_different(seed)
    gram, rhs = matrix.T @ matrix, matrix.T @ right
    solved, minimise = [], nnls.Gram.minimise
    monkeypatch.setattr(
        nnls.Gram, "minimise", lambda own, rhs, free: solved.append(free) or minimise(own, rhs, free)
    )
    found = nnls.solve(gram, rhs)
    assert found.iterations == len(solved)
    for most in (found.iterations, found.iterations - 1):
        solved.clear()
        nnls.solve(gram, rhs, max_iterations=most)
        assert len(solved) == most


@pytest.mark.parametrize("rounding", [1e-15, 1e-12, 1e-9])
def test_cells_that_cannot_be_told_apart_share_their_mass(rounding):
    """Also where the rounding of large sums makes their matrix indefinite."""
    gram = np.array([[4.0, 4.0, 0.0], [4.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    gram[[0, 1], [1, 0]] *= 1.0 + rounding
    assert nnls.solve_signed(gram, np.array([2.0, 2.0, 0.0])) == pytest.approx([0.25, 0.25, 0.0], abs=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_twins_are_not_exchanged_for_one_another_by_rounding(seed):
    """Each column twice: a twin of a positive one descends by rounding alone. A few exchanges end it.

    Six on one kind of processor, five on another, whose sums round otherwise; up to 15 where rounding counts.
    """
    rng = np.random.default_rng(seed)
    matrix = np.tile(rng.random((60, 20)), 2)
    right = matrix @ np.maximum(rng.normal(size=40), 0.0) + 0.01 * rng.normal(size=60)
    found = nnls.solve(matrix.T @ matrix, matrix.T @ right)
    print(f"seed {seed}: {found.iterations} systems")
    assert found.iterations <= 6


@pytest.mark.parametrize(("seed", "systems"), [(10250, 13), (10417, 9), (10505, 9)])
def test_where_nothing_settles_a_ridge_ends_it(monkeypatch, seed, systems):
    """The same kind of columns and an empty one: near the minimum, after fewer systems."""
    matrix, right = _hardly_different(seed, empty=[3])
    gram, rhs = matrix.T @ matrix, matrix.T @ right
    monkeypatch.setattr(optimize, "nnls", _out_of_iterations)
    found = nnls.solve(gram, rhs, max_iterations=systems)
    assert found.iterations <= systems
    assert 1e-12 < nnls.kkt_violation(gram, rhs, found.x) < 1e-9
    assert found.x[3] == 0.0


def _out_of_iterations(*_, **__):
    raise RuntimeError("Maximum number of iterations reached.")
