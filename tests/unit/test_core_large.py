"""Large planes: the matrix-free path ends where the dense one does."""

from __future__ import annotations

import numpy as np
import pytest
from core_jobs import curves, plant, random_reversals

import pulsetrainer as pt
from pulsetrainer.core import identification, large, nnls
from pulsetrainer.core.equations import node_sums
from pulsetrainer.core.identification import identify
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.core.smoothing import smoothed
from pulsetrainer.errors import ConvergenceError
from wording import raises

N_H = 24
PLANE = Plane.uniform(-1.0, 1.0, N_H)


def signal(kind, rng, n=4000):
    """Return reversal curves, the same with noise, random reversals, or a signal that leaves gaps."""
    if kind == "curves":
        return curves(n, N_H, 20)
    if kind == "noisy":
        return curves(n, N_H, 20) + rng.normal(0.0, 0.005, n)
    if kind == "gaps":
        return 0.6 * curves(n, N_H, 20)
    return random_reversals(rng, n, n // 10)


@pytest.mark.parametrize("smoothing", [0.0, 0.05])
@pytest.mark.parametrize("kind", ["curves", "noisy", "random", "gaps"])
def test_same_answer_as_the_dense_path(kind, smoothing):
    """Objective, masses, offset and output agree; optimality is as good as stated, after few steps."""
    rng = np.random.default_rng(1)
    u = signal(kind, rng)
    y = plant(120)(u) + rng.normal(0.0, 0.005, u.size)
    sums = node_sums(PLANE, [Record(u, y)], "continuous")
    equations = sums.dense()
    gram, rhs = smoothed(equations, smoothing)
    dense = nnls.solve(gram, rhs)
    found = large.solve(sums, smoothing)

    def objective(x):
        return equations.sum_of_squares(x, equations.offset(x)) + x @ (gram - equations.centred()[0]) @ x

    print(f"seed 1, {kind}, s = {smoothing}: {found.iterations} Newton steps, violation {found.kkt:.1e}")
    assert found.iterations <= 13  # 10 to 12; up to 17 where the corrector aims at another product
    assert objective(found.masses) == pytest.approx(objective(dense.x), rel=1e-6)
    assert found.offset == pytest.approx(equations.offset(found.masses), abs=1e-9)
    ours, theirs = (Preisach(PLANE, x / PLANE.areas, equations.offset(x))(u) for x in (found.masses, dense.x))
    # at the minimum, objectives equal to 1e-6 mean outputs equal to 1e-3 of the noise
    assert np.sqrt(np.mean((ours - theirs) ** 2)) <= 1e-3 * 0.005
    assert nnls.kkt_violation(gram, rhs, found.masses) <= 2 * large.TOLERANCE
    if kind != "gaps":  # there neither the offset nor the weights are unique
        assert found.offset == pytest.approx(equations.offset(dense.x), abs=1e-5)
        assert np.allclose(PLANE.everett_nodes(found.masses), PLANE.everett_nodes(dense.x), atol=1e-5)


def test_the_couplings_that_are_left_out_do_not_change_the_answer(monkeypatch):
    """With S factorised, or with its near part only: the same fit."""
    rng = np.random.default_rng(2)
    u = signal("random", rng)
    sums = node_sums(PLANE, [Record(u, plant(120)(u) + rng.normal(0.0, 0.005, u.size))], "continuous")
    whole = large.solve(sums)
    monkeypatch.setattr(large, "_FACTORISED_ROW", 0)
    near = large.solve(sums)
    assert np.allclose(near.masses, whole.masses, atol=1e-5)


def test_identify_chooses_it_when_dense_matrices_do_not_fit(monkeypatch):
    """The same call, and the same prediction."""
    rng = np.random.default_rng(3)
    u = signal("curves", rng)
    record = Record(u, plant(120)(u) + rng.normal(0.0, 0.005, u.size))
    dense = identify([record], PLANE, smoothing=0.04)
    monkeypatch.setattr(identification, "DENSE_BYTES", 1000)
    free = identify([record], PLANE, smoothing=0.04)
    unseen = random_reversals(rng, 1000, 60)
    assert np.allclose(free.operator(unseen), dense.operator(unseen), atol=1e-5)
    assert free.kkt <= large.TOLERANCE
    falling = identify([Record(u, -record.output)], PLANE, smoothing=0.04)
    assert falling.operator.polarity == -1
    assert np.allclose(falling.operator(unseen), -free.operator(unseen), atol=1e-9)


@pytest.mark.slow
def test_more_levels_than_dense_allows():
    """90 levels, 4095 cells, go the matrix-free way by themselves."""
    rng = np.random.default_rng(4)
    u = curves(8000, 48, 30)
    device = plant(240)
    clean = device(u)
    fit = identify(
        [Record(u, clean + rng.normal(0.0, 0.005, u.size))], Plane.uniform(-1.0, 1.0, 90), smoothing=0.05
    )
    unseen = random_reversals(rng, 2000, 60)
    error = 100 * np.sqrt(np.mean((fit.operator(unseen) - device(unseen)) ** 2)) / np.ptp(clean)
    print(f"seed 4: {fit.iterations} Newton steps, error {error:.3f} %")
    assert error < 0.1


def test_the_diagonal_is_that_of_the_dense_matrix():
    """Cone sums over pairs of nodes by one cumulative sum."""
    rng = np.random.default_rng(5)
    u = signal("random", rng)
    sums = node_sums(PLANE, [Record(u, u)], "continuous")
    gram, _ = sums.dense().centred()
    assert np.allclose(large.centred_diagonal(sums), np.diagonal(gram), atol=1e-9 * sums.weight_sum)


def test_the_stencil_undoes_the_cumulative_sums():
    """D C = 1."""
    masses = np.random.default_rng(6).random(PLANE.n_q)
    assert np.allclose(large.difference(PLANE) @ PLANE.everett_nodes(masses), masses, atol=1e-12)


def test_what_does_not_settle_says_so():
    """Too few steps: the violation reached and the one wanted."""
    u = signal("curves", np.random.default_rng(7))
    sums = node_sums(PLANE, [Record(u, plant(120)(u))], "continuous")
    with raises(ConvergenceError, "did not settle", steps=2):
        large.solve(sums, max_iterations=2)


def test_as_many_steps_as_are_needed_are_enough():
    """The last one that is permitted is taken; with one less it did not settle."""
    u = signal("curves", np.random.default_rng(1))
    sums = node_sums(PLANE, [Record(u, plant(N_H)(u))], "continuous")
    needed = large.solve(sums)
    assert needed.iterations > 2
    again = large.solve(sums, max_iterations=needed.iterations)
    np.testing.assert_array_equal(again.masses, needed.masses)
    with pytest.raises(ConvergenceError):
        large.solve(sums, max_iterations=needed.iterations - 1)


@pytest.mark.parametrize(("unit", "zero"), [(1e5, -3e5), (1e-6, 4e-6)])
def test_units_do_not_matter(unit, zero):
    """Nor where the output's zero is: as many steps to the same fit."""
    u = signal("curves", np.random.default_rng(1))
    y = plant(N_H)(u)
    here, there = (
        large.solve(node_sums(PLANE, [Record(u, output)], "continuous")) for output in (y, unit * y + zero)
    )
    assert there.iterations == here.iterations
    np.testing.assert_allclose(there.masses, unit * here.masses, rtol=1e-5, atol=1e-8 * unit)
    assert there.offset == pytest.approx(zero + unit * here.offset, abs=1e-6 * unit)


def test_progress_rises_to_nearly_all_of_the_usual_steps():
    """A fit of minutes says how far it is, once a Newton step."""
    rng = np.random.default_rng(5)
    plane = Plane.uniform(0.0, 1.0, 30)
    record = Record(rng.random(3000), rng.random(3000))
    told: list[float] = []
    solved = large.solve(node_sums(plane, [record], "continuous"), 0.02, progress=told.append)
    assert len(told) == solved.iterations
    assert told == sorted(told)
    assert told[0] == 0.0
    assert 0.3 < told[-1] <= 1.0


def test_identify_passes_on_how_far_a_large_fit_is():
    """From a tenth, which the cleaning took, to what is left for the words."""
    u = curves(2000, 20, 20)
    told: list[float] = []
    pt.identify(
        pt.Run(time_s=np.arange(u.size) / 100, input=u, output=plant(60)(u)),
        levels=90,
        smoothing=0.03,
        progress=told.append,
    )
    assert told[0] == 0.1
    assert len({share for share in told if 0.1 < share < 0.8}) > 5
    assert told[-1] == 1.0
