"""Smoothing: it helps where data are noisy, knows no units, and is chosen from held-out blocks."""

from __future__ import annotations

import numpy as np
import pytest
from core_jobs import curves, job, plant
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.core import smoothing
from pulsetrainer.core.identification import identify
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record

ALL = slice(None)


@pytest.mark.slow
def test_chosen_smoothing_beats_the_peers_on_their_job():
    """20 000 samples, 0.5 % noise, 48 levels: under 0.074 % of the span on a signal never seen."""
    world = job(1)
    plane = Plane.uniform(-1.0, 1.0, 48)
    record = [Record(world.input, world.output)]
    plain = world.percent(identify(record, plane).operator(world.unseen_input))
    fit = identify(record, plane, smoothing="auto")
    chosen = world.percent(fit.operator(world.unseen_input))
    heavy = world.percent(identify(record, plane, smoothing=0.15).operator(world.unseen_input))
    print(f"seed 1: none {plain:.4f} %, chosen s = {fit.smoothing:.4f} {chosen:.4f} %, heavy {heavy:.4f} %")
    assert chosen < 0.074
    assert chosen < 0.7 * plain
    assert heavy > 4 * chosen
    nearest = min(fit.tried, key=lambda one: abs(np.log(max(one[0], 1e-3) / fit.smoothing)))
    assert nearest[1] <= 1.01 * min(error for _, error in fit.tried)


@pytest.mark.parametrize(("gain", "shift", "volt"), [(1e-6, 0.0, 1.0), (40.0, 1e3, 1e5)])
def test_smoothing_has_no_units(gain, shift, volt):
    """Input and output in other units, and the same fit."""
    world = job(2, n=3000, levels=240)
    plane = Plane.uniform(-1.0, 1.0, 20)
    here = identify([Record(world.input, world.output)], plane, smoothing=0.06)
    there = Plane.uniform(-gain + shift, gain + shift, 20)
    scaled = identify([Record(gain * world.input + shift, volt * world.output)], there, smoothing=0.06)
    assert np.allclose(scaled.operator.masses, volt * here.operator.masses, atol=1e-6 * volt)


def test_smoothing_does_not_depend_on_samples_or_levels():
    """The same record twice gives the same fit; twice the levels the same surface, coarsely looked at."""
    world = job(3, n=4000, levels=240)
    record = Record(world.input, world.output)
    plane = Plane.uniform(-1.0, 1.0, 16)
    once, twice = (identify([record] * k, plane, smoothing=0.08).operator for k in (1, 2))
    assert np.allclose(once.masses, twice.masses, atol=1e-9)
    fine = Plane.uniform(-1.0, 1.0, 32)
    coarse_error, fine_error = (
        world.percent(identify([record], p, smoothing=0.08).operator(world.unseen_input))
        for p in (plane, fine)
    )
    outputs = [identify([record], p, smoothing=0.08).operator(world.unseen_input) for p in (plane, fine)]
    apart = float(np.sqrt(np.mean((outputs[0] - outputs[1]) ** 2))) / world.span
    print(f"16 levels {coarse_error:.3f} %, 32 levels {fine_error:.3f} %, apart {100 * apart:.3f} %")
    assert apart < 0.002


def test_bending_is_zero_for_a_straight_density():
    """A density linear in the numbers of the levels, and along the diagonal, costs nothing on any levels."""
    plane = Plane(np.cumsum(np.random.default_rng(4).uniform(0.5, 2.0, 11)))
    i, j = plane.cell_indices
    masses = np.where(i == j, 2.0 + i, 30.0 + 3.0 * i - 2.0 * j)
    rows = smoothing.bending(plane, np.ones(plane.n_q, dtype=bool))
    size = abs(rows) @ masses
    assert np.all(np.abs(rows @ masses) <= 1e-12 * size.max())
    # the reversible part and the relays beside it are different things: no row holds both
    assert not np.any((abs(rows) @ (i == j)) * (abs(rows) @ (i != j)))


@pytest.mark.parametrize("n_h", [12, 24])
def test_bending_of_a_parabola(n_h):
    """The integrals themselves: (d2 mu)^2 is 4 x^2-coefficient^2 wherever three cells lie in a row."""
    plane = Plane.uniform(0.0, 7.0, n_h)  # the ends do not matter: x goes from 0 to 1
    i, j = plane.cell_indices
    x, cell = (np.arange(n_h) + 0.5) / n_h, 1.0 / n_h**2
    rows = smoothing.bending(plane, np.ones(plane.n_q, dtype=bool))
    along_alpha, along_beta, diagonal = (
        float(np.sum((rows @ masses) ** 2))
        for masses in (
            np.where(i == j, 0.0, x[i] ** 2 * cell),
            np.where(i == j, 0.0, 3.0 * x[j] ** 2 * cell),
            np.where(i == j, x[i] ** 2 / n_h, 0.0),
        )
    )
    triples = (n_h - 2) * (n_h - 3) / 2  # off the diagonal, along one axis
    assert along_alpha == pytest.approx(4.0 * triples * cell)
    assert along_beta == pytest.approx(36.0 * triples * cell)
    assert diagonal == pytest.approx(10.0 * 4.0 * (n_h - 2) / n_h)
    diagonal_of_gram = np.random.default_rng(n_h).uniform(1.0, 2.0, plane.n_q)
    masses = np.where(i == j, 0.0, x[i] ** 2 * cell)
    cost = masses @ (smoothing.penalty(plane, diagonal_of_gram, 0.5) @ masses)
    assert cost == pytest.approx(0.5**8 * diagonal_of_gram.mean() * along_alpha)


def test_cells_without_data_stay_empty():
    """No mass is invented where the signal never was."""
    device = plant(16)
    u = 0.4 * curves(2000, 16)
    fit = identify([Record(u, device(u))], Plane.uniform(-1.0, 1.0, 16), smoothing=0.1)
    i, _ = fit.operator.plane.cell_indices
    assert not np.any(fit.operator.weights[i >= 12])


def test_smoothing_off_is_no_smoothing():
    """0 leaves the normal equations alone."""
    world = job(5, n=1000, levels=120)
    plane = Plane.uniform(-1.0, 1.0, 10)
    record = [Record(world.input, world.output)]
    assert np.array_equal(
        identify(record, plane).operator.weights, identify(record, plane, smoothing=0).operator.weights
    )


def test_a_clean_record_is_left_sharp():
    """Without noise and with a jagged density, the choice does no harm."""
    rng = np.random.default_rng(6)
    plane = Plane.uniform(-1.0, 1.0, 16)
    masses = rng.exponential(size=plane.n_q)
    device = Preisach(plane, masses / masses.sum() / plane.areas)
    u = curves(6000, 32, 30)
    fit = identify([Record(u, device(u))], plane, smoothing="auto")
    print(f"seed 6: s = {fit.smoothing:g}")
    assert np.sqrt(np.mean((fit.operator(u) - device(u)) ** 2)) < 1e-3 * np.ptp(device(u))


def test_a_flat_error_has_its_smoothing_in_the_middle():
    """Errors that differ by no more than chance count alike; a clear minimum is taken, as is no error."""
    grid = [0.0125, 0.025, 0.05, 0.1]
    flat = [(s, 1.0) for s in grid]
    assert smoothing._mean_length(flat, 1000.0) == pytest.approx(0.025 * np.sqrt(2.0))
    clear = [(s, 1.2 if s != 0.05 else 1.0) for s in grid]
    assert smoothing._mean_length(clear, 1000.0) == pytest.approx(0.05)
    assert smoothing._mean_length(clear, 1.0) != pytest.approx(0.05, rel=0.1)
    assert smoothing._mean_length([(0.0, 0.0), (0.1, 1.0)], 10.0) == 0.0
    assert smoothing._mean_length([(0.0, 1.0), (0.1, 1.0)], 10.0) == pytest.approx(np.sqrt(0.00625 * 0.1))


@pytest.mark.parametrize("steps", [0.65, 0.9, 1.2])
def test_the_least_between_two_lengths_is_found(steps):
    """Of errors whose square falls with the logarithm of s and rises as s^8, tried at steps of 2^(1/2)."""
    least = 0.05 * np.sqrt(2.0) ** (steps - 1.0)
    bias = 1e-4 / (np.log(16.0) * 16.0**steps)  # so that the slope is zero there
    tried = [(0.05 * np.sqrt(2.0) ** (k - 1), np.sqrt(1.0 - 1e-4 * k + bias * 16.0**k)) for k in range(3)]
    assert smoothing._mean_length(tried, 1e7) == pytest.approx(min(least, 0.05), rel=1e-6)


class Error:
    """Stands for the error on held-out blocks: 1 up to ``best``, then growing with s."""

    def __init__(self, best, *, signed):
        self.best, self.signed, self.errors = best, signed, {}

    def __call__(self, s):
        """Error at s."""
        return self.errors.setdefault(s, max(1.0, s / self.best))


@pytest.mark.parametrize("signed", [False, True])
def test_the_grid_goes_from_a_small_cell_to_a_fifth_of_the_range(signed):
    """In steps of the root of 2 up to 0.2 or 1.5 times the least error; none at all below, for one sign."""
    fine = 0.2 / 2.0 ** (np.arange(9, -1, -1) / 2.0)
    expected = fine[1:] if signed else [0.0, *fine]
    assert [s for s, _ in smoothing._tried(Error(1.0, signed=signed))] == pytest.approx(expected)
    least = smoothing._tried(Error(0.05, signed=signed))
    assert least[-1] == (pytest.approx(0.1), pytest.approx(2.0))  # the first that is hopeless


@pytest.mark.parametrize("away", [1e4, 1e6])
def test_zero_of_the_sensors_does_not_move_the_choice(away):
    """Output and input that are many spans away from zero: the same smoothing, the same error unseen."""
    world = job(7, n=2000, levels=120)
    plane, far = (Plane.uniform(low, low + 2.0, 16) for low in (-1.0, 2.0 * away - 1.0))
    moved = Record(world.input + 2.0 * away, world.output + away * world.span)
    here, there = (
        identify([record], levels, smoothing="auto")
        for record, levels in ((Record(world.input, world.output), plane), (moved, far))
    )
    assert there.smoothing == pytest.approx(here.smoothing, rel=1e-3)
    expected = here.operator(world.unseen_input) + away * world.span
    found = there.operator(world.unseen_input + 2.0 * away)
    assert np.abs(found - expected).max() <= 1e-6 * world.span


def test_blocks_are_cut_where_the_memory_is_wiped_out():
    """Cuts go to the nearest visit of an end of the range, and stay put where there is none near."""
    u = np.abs((np.arange(1000) % 100) - 50) / 50.0  # 1 at multiples of 100, 0 in between
    block = smoothing.blocks(u, 0.0, 1.0, 7)
    cuts = np.flatnonzero(np.diff(block)) + 1
    assert cuts.size == 6
    assert np.all((u[cuts] <= 0.01) | (u[cuts] >= 0.99))
    inner = smoothing.blocks(0.2 + 0.5 * u, 0.0, 1.0, 7)
    assert np.ptp(np.bincount(inner)) <= 1
    assert np.array_equal(smoothing.blocks(u[:3], 0.0, 1.0, 7), [0, 0, 0])


@pytest.mark.parametrize(("memory", "count"), [(1.0, 200), (4.0, 125), (50.0, 40)])
def test_a_block_lasts_twice_the_memory(monkeypatch, memory, count):
    """No fewer than 40 and no more than 200 of them."""
    counts, cut = [], smoothing.blocks
    monkeypatch.setattr(smoothing, "blocks", lambda *where: counts.append(where[-1]) or cut(*where))
    monkeypatch.setattr(smoothing, "_memory_of_residual", lambda *_, **__: memory)
    u = np.abs((np.arange(1000) % 100) - 50) / 50.0
    smoothing.choose([Record(u, u)], Plane.uniform(0.0, 1.0, 6), "continuous")
    assert counts == [count]


def test_folds_meet_every_place_of_a_curve():
    """Each fold once in five blocks; of curves as long as five blocks no fold has one place alone."""
    fold = smoothing.dealt(np.arange(200)).reshape(-1, 5)
    assert np.array_equal(np.sort(fold, axis=1), np.tile(np.arange(5), (40, 1)))
    for place in fold.T:
        assert np.bincount(place).max() <= 20
    assert smoothing.dealt(np.array([0, 0, 1, 7, 7])).max() < 5


@pytest.mark.parametrize("seed", range(3))
def test_a_difference_that_is_chance_does_not_choose(seed):
    """Of errors that are alike but for noise from block to block the longest length, else the best."""
    rng = np.random.default_rng(seed)
    common = rng.uniform(0.5, 2.0, 100)
    squares = {
        0.01: common + 0.2,
        0.02: common,
        0.04: common + 0.1 * rng.choice([-1.0, 1.0], 100) + 0.001,
        0.08: common + 0.1,
    }
    tried = [(s, float(np.sqrt(block.sum()))) for s, block in squares.items()]
    length = smoothing._longest_alike(tried, squares.__getitem__)
    best = min(tried, key=lambda one: one[1])[0]
    assert 0.02 <= best <= 0.04
    assert best <= length < 0.08
    noise = squares[0.04] - squares[0.02]
    if noise.sum() <= np.sqrt(noise.size) * noise.std(ddof=1):
        assert length >= 0.04


@given(st.integers(0, 2**32 - 1), st.integers(12, 200), st.integers(2, 8))
def test_cuts_are_the_nearest_ends_one_by_one(seed, n, count):
    """As a person would place them: cut by cut, looking at every sample that is at an end."""
    rng = np.random.default_rng(seed)
    u = np.where(rng.random(n) < 0.1, rng.choice([0.0, 0.005, 0.995, 1.0], n), rng.uniform(0.1, 0.9, n))
    ends = [k for k in range(n) if u[k] <= 0.01 or u[k] >= 0.99]
    kept = max(1, min(count, n // 2))
    cuts = []
    for number in range(1, kept):
        even = number * n // kept
        nearest = min(ends, key=lambda k: (abs(k - even), -k), default=even)
        cuts.append(nearest if abs(nearest - even) <= n / (2 * kept) else even)
    expected = [sum(k >= cut for cut in cuts) for k in range(n)]
    assert smoothing.blocks(u, 0.0, 1.0, count).tolist() == expected
