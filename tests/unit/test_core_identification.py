"""Identification: the right weights, one optimum by every way, and errors that name the argument."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_jobs import curves, job, plant, random_reversals
from scipy.optimize import nnls as reference

from oracle import cells
from pulsetrainer.core import equations, identification, nnls
from pulsetrainer.core.coverage import Gap, coverage, largest_gap
from pulsetrainer.core.identification import identify, offsets_between, polarity_of
from pulsetrainer.core.operator import follow, rows
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record, counted_output
from pulsetrainer.core.uncertainty import bootstrap
from pulsetrainer.errors import ArgumentError
from wording import raises

PLANE = Plane.uniform(-1.0, 1.0, 12)


def noisy(seed, n=1500, n_h=12):
    """Return a record of a plant with ``n_h`` levels, and the plant."""
    rng = np.random.default_rng(seed)
    device = plant(n_h)
    u = np.concatenate((curves(n - 500, n_h, 10), random_reversals(rng, 500, 40)))
    return Record(u, device(u) + rng.normal(0.0, 0.02, u.size)), device


def design(record, plane):
    """Rows (n, n_q) of a record in mass space, relays -1 or +1."""
    return plane.adjoint(rows(plane, follow(plane, record.input, None, "continuous")).toarray()) - 1.0


def test_clean_data_give_back_the_plant():
    """Without noise the weights are the plant's own."""
    device = plant(12)
    u = curves(4000, 24, 30)
    fit = identify([Record(u, device(u))], PLANE)
    assert np.allclose(fit.operator.weights, device.weights, rtol=1e-6, atol=1e-8 * device.weights.max())
    assert fit.operator.offset == pytest.approx(device.offset, abs=1e-9)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_same_objective_as_dense_nnls(seed):
    """The dense design matrix and scipy.optimize.nnls find the same minimum, to 1e-9."""
    record, _ = noisy(seed)
    matrix = design(record, PLANE)
    centred = matrix - matrix.mean(axis=0)
    y = record.output - record.output.mean()
    _, norm = reference(centred, y)
    fit = identify([record], PLANE)
    residual = record.output - fit.operator(record.input)
    assert residual @ residual == pytest.approx(norm**2, rel=1e-9)
    assert fit.kkt < 1e-10


@pytest.mark.parametrize("smoothing", [0.0, 0.05])
def test_alternating_ends_at_the_joint_optimum(smoothing):
    """The paper's two steps in turn converge to the fit with the offset eliminated."""
    record, _ = noisy(4)
    joint = identify([record], PLANE, smoothing=smoothing)
    alternating = identify([record], PLANE, method="alternating", smoothing=smoothing)
    assert alternating.operator.offset == pytest.approx(joint.operator.offset, abs=1e-8)
    assert np.allclose(alternating.operator.masses, joint.operator.masses, atol=1e-7)


def test_the_weights_of_samples_count_by_their_ratios_alone():
    """In squares of 1e9 the two steps had stopped as soon as they moved by a part of these."""
    record, _ = noisy(4)
    heavy = replace(record, sample_weight=np.full(record.input.size, 1e9))
    plain, other = (identify([one], PLANE, method="alternating") for one in (record, heavy))
    assert other.operator.offset == pytest.approx(plain.operator.offset, abs=1e-8)


def test_sums_of_parts_are_the_sums_of_the_whole():
    """Normal equations are additive over samples, each part simulated from the start of the record."""
    record, _ = noisy(5)
    part = np.random.default_rng(5).integers(0, 3, record.input.size)
    parts = equations.parted_sums(PLANE, [record], "continuous", [part], 3)
    whole = equations.node_sums(PLANE, [record], "continuous").dense()
    summed = sum(parts[1:], start=parts[0]).dense()
    for name in ("gram", "moment", "row_sum", "weight_sum", "output_sum", "output_square"):
        assert np.allclose(getattr(summed, name), getattr(whole, name), rtol=1e-12, atol=1e-9), name
    masked = Record(record.input, record.output, (part == 1).astype(float))
    alone = equations.normal_equations(PLANE, [masked], "continuous")
    assert np.allclose(alone.gram, parts[1].dense().gram, atol=1e-9)
    left, others = whole - alone, (parts[0] + parts[2]).dense()
    for name in ("gram", "moment", "row_sum", "weight_sum", "output_sum", "output_square"):
        assert np.allclose(getattr(left, name), getattr(others, name), atol=1e-9), name


def test_normal_equations_equal_the_design_matrix():
    """The Gram matrix by cumulative sums is that of the dense rows."""
    record, _ = noisy(6)
    matrix = design(record, PLANE)
    sums = equations.normal_equations(PLANE, [record], "continuous")
    assert np.allclose(sums.gram, matrix.T @ matrix, atol=1e-8)
    assert np.allclose(sums.moment, matrix.T @ record.output, atol=1e-8)
    masses = np.abs(np.random.default_rng(6).normal(size=PLANE.n_q))
    residual = record.output - 0.2 - matrix @ masses
    assert sums.sum_of_squares(masses, 0.2) == pytest.approx(residual @ residual, rel=1e-10)
    small = equations.normal_equations(PLANE, [Record(record.input, 1e-3 * record.output)], "continuous")
    expected = 1e-3 * np.sqrt(np.mean(residual**2))
    assert small.rms(1e-3 * masses, 2e-4) == pytest.approx(expected, rel=1e-9)


def test_masked_samples_do_not_count():
    """A masked sample may be anything, NaN too, and weights count like repeats."""
    record, _ = noisy(7)
    spoilt = record.output.copy()
    mask = np.ones(spoilt.size)
    spoilt[100:150], mask[100:150] = np.nan, 0.0
    left_out = identify([Record(record.input, spoilt, mask)], PLANE)
    assert np.all(np.isfinite(left_out.operator.weights))
    counted = counted_output([Record(record.input, spoilt, mask)])
    np.testing.assert_array_equal(counted, record.output[mask > 0])
    twice = identify([record, record], PLANE)
    double = identify([Record(record.input, record.output, np.full(mask.size, 2.0))], PLANE)
    assert np.allclose(twice.operator.masses, double.operator.masses, atol=1e-9)


@pytest.mark.parametrize("far", [1e4, 1e8])
def test_an_output_far_from_zero_is_fitted_as_well(far):
    """Smoothing is chosen alike, and the fit is the same, also between records and for a falling loop."""
    near = job(4, n=1200, levels=60, count=12)
    plane = Plane.uniform(-1.0, 1.0, 10)
    slack = 1e-7 + 1e-14 * far
    here = identify([Record(near.input, near.output)], plane, smoothing="auto")
    for sign in (1, -1):
        there = identify([Record(near.input, sign * near.output + far)], plane, smoothing="auto")
        assert there.smoothing == pytest.approx(here.smoothing, rel=1e-4)
        assert there.operator.weights == pytest.approx(here.operator.weights, abs=100 * slack)
        assert there.operator.offset == pytest.approx(sign * here.operator.offset + far, abs=slack)
    records = [Record(near.input, near.output + far + shift) for shift in (0.0, 0.5)]
    assert offsets_between(records, plane) == pytest.approx([-0.25, 0.25], abs=1e-3)
    ensemble = bootstrap(records[:1], here, rng=np.random.default_rng(1), draws=3)
    assert ensemble.offsets == pytest.approx(far + here.operator.offset, abs=0.05)


def test_records_share_an_offset_unless_they_differ():
    """Against their mean, weighted by their samples; zeros where one offset serves all, and for one."""
    record, _ = noisy(10)
    assert offsets_between([record], PLANE).tolist() == [0.0]
    assert offsets_between([record, record], PLANE).tolist() == [0.0, 0.0]
    rng = np.random.default_rng(4)  # noise alone shifts nothing
    again = [Record(record.input, record.output + rng.normal(0.0, 0.1, record.output.size)) for _ in range(2)]
    assert offsets_between(again, PLANE).tolist() == [0.0, 0.0]
    half = Record(record.input, record.output - 0.9, (np.arange(record.input.size) % 2) * 1.0)
    for sign in (1, -1):
        turned = [Record(r.input, sign * r.output, r.sample_weight) for r in (record, half)]
        assert offsets_between(turned, PLANE) == pytest.approx([sign * 0.3, -sign * 0.6], abs=0.01)


def test_polarity_by_trial():
    """Where the correlation is weak both signs are fitted; else it decides."""
    device = plant(12)
    u = np.concatenate((curves(300, 4, 4), np.tile([0.3, -0.3], 40)))
    loop = device(u) - 0.9 * np.polyval(np.polyfit(u, device(u), 1), u)  # the trend nearly gone
    record = Record(u, loop)
    assert abs(identification.correlation_of([record])) < identification.CLEAR
    for sign in (1, -1):
        assert polarity_of([Record(u, sign * loop)], PLANE) == sign
    assert polarity_of([Record(u, -u)], PLANE) == -1
    assert identification.correlation_of([Record(u, 1e-200 * u)]) == pytest.approx(1.0)
    spoilt, mask = u.copy(), np.ones(u.size)
    spoilt[::2], mask[::2] = -5.0 * u[::2], 0.0
    assert identification.correlation_of([Record(u, spoilt, mask)]) == pytest.approx(1.0)
    assert identification.correlation_of([Record(u, np.ones(u.size))]) == 0.0


def test_falling_loops_are_detected():
    """A falling loop is the mirror image of a rising one."""
    record, _ = noisy(8)
    rising = identify([record], PLANE)
    falling = identify([Record(record.input, -record.output)], PLANE)
    assert (rising.operator.polarity, falling.operator.polarity) == (1, -1)
    assert np.allclose(falling.operator(record.input), -rising.operator(record.input), atol=1e-9)


def test_fewer_samples_than_cells_are_fitted():
    """Non-negativity keeps the problem well posed; the count of samples tells."""
    device = plant(12)
    u = random_reversals(np.random.default_rng(9), 60, 12)
    fit = identify([Record(u, device(u))], PLANE)
    assert fit.samples == 60 < PLANE.n_q
    assert np.sqrt(np.mean((fit.operator(u) - device(u)) ** 2)) < 1e-6


RAMP = np.linspace(-1.0, 1.0, 40)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: identify([], PLANE), ["records", "0 records"]),
        (lambda: identify([Record(RAMP, RAMP, np.zeros(40))], PLANE), ["counts"]),
        (lambda: identify([Record(RAMP, np.ones(40))], PLANE), ["output", "does not vary", "1"]),
        (lambda: identify([Record(np.ones(40), RAMP)], PLANE), ["input", "does not vary"]),
        (
            lambda: identify([Record(RAMP, RAMP > 0.9, 1.0 * (RAMP < 0.9))], PLANE),
            ["output", "does not vary"],
        ),
        (lambda: identify([Record(RAMP[:5], RAMP[:5])], PLANE), ["12 levels", "got 5"]),
        (lambda: identify([Record(RAMP, RAMP)], PLANE, method="guess"), ["method", "'guess'"]),
        (lambda: identify([Record(RAMP, RAMP)], PLANE, smoothing="much"), ["smoothing", "'much'"]),
        (lambda: identify([Record(RAMP, RAMP)], PLANE, smoothing=-0.1), ["smoothing", "-0.1"]),
        (lambda: identify([Record(RAMP, RAMP)], PLANE, smoothing=1.01), ["smoothing", "1.01"]),
        (lambda: identify([Record(RAMP, RAMP)], PLANE, smoothing=float("nan")), ["smoothing", "nan"]),
        (lambda: Record(RAMP[:0], RAMP[:0]), ["input", "(0,)"]),
        (lambda: Record(RAMP[:1], RAMP[:1]), ["input", "(1,)", "at least 2"]),
        (lambda: Record(RAMP, RAMP[:-1]), ["(40,)", "(39,)"]),
        (lambda: Record(RAMP, RAMP, -np.ones(40)), ["weight", "-1"]),
        (lambda: Record(RAMP, np.where(RAMP > 0.9, np.nan, RAMP)), ["output", "nan"]),
        (lambda: Record(np.where(RAMP > 0.9, np.inf, RAMP), RAMP), ["input", "inf"]),
    ],
)
def test_bad_input_is_named(act, words):
    """Every refusal says which argument, its shape or value, and is a ValueError."""
    with pytest.raises(ArgumentError) as caught:
        act()
    assert isinstance(caught.value, ValueError)
    for word in words:
        assert word in str(caught.value)
    assert caught.value.hint


def test_block_pivoting_matches_the_reference_on_random_problems():
    """Where variables hardly matter and where they are many times redundant."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        matrix = rng.normal(size=(60, 40)) @ np.diag(10.0 ** rng.uniform(-3, 0, 40))
        y = rng.normal(size=60)
        expected, norm = reference(matrix, y)
        found = nnls.solve(matrix.T @ matrix, matrix.T @ y)
        assert np.sum((matrix @ found.x - y) ** 2) == pytest.approx(norm**2, rel=1e-9), seed
        assert np.allclose(found.x, expected, rtol=1e-5, atol=1e-6 * expected.max()), seed


def test_dense_matrices_are_refused_beyond_the_stated_memory():
    """83 levels fit into a gigabyte, 84 do not and go another way; weights of either sign have none."""
    assert identification.fits_dense(Plane.uniform(0.0, 1.0, 83))
    large = Plane.uniform(0.0, 1.0, 84)
    assert not identification.fits_dense(large)
    records = [Record(np.linspace(0, 1, 200), np.linspace(0, 1, 200))]
    with raises(ArgumentError, "method too large", method="alternating"):
        identify(records, large, method="alternating")
    with raises(ArgumentError, "too many levels of either sign", most=83, levels=84):
        identify(records, large, signed=True)


# --- coverage in words ----------------------------------------------------------------------------------


def brute_gap(plane, covered):
    """Area of the largest uncovered rectangle cut by the diagonal, by trying all of them."""
    n, index = plane.n_h, {cell: k for k, cell in enumerate(cells(plane.edges))}
    best = 0.0
    for a in range(n):
        for b in range(a, n):
            for c in range(n):
                for d in range(c, n):
                    inside = [
                        index[i, j] for i in range(a, b + 1) for j in range(c, d + 1) if (i, j) in index
                    ]
                    if inside and not covered[inside].any():
                        best = max(best, plane.areas[inside].sum())
    return best / plane.areas.sum()


@pytest.mark.parametrize("seed", range(6))
def test_the_named_gap_is_the_largest(seed):
    """The fast search agrees with trying every rectangle."""
    plane = Plane.uniform(0.0, 1.5, 6)
    covered = np.random.default_rng(seed).random(plane.n_q) < 0.6
    gap = largest_gap(plane, covered)
    assert gap is not None
    assert gap.share == pytest.approx(brute_gap(plane, covered))


def test_the_gap_is_named_in_the_input_unit():
    """A signal that never rises above 1.2 A nor falls below 0.3 A again."""
    plane = Plane.uniform(0.0, 1.5, 30)
    u = np.concatenate(([0.0], np.tile([1.2, 0.3], 5)))
    gap = largest_gap(plane, coverage(plane, [u]))
    assert gap is not None
    words = gap.words(plane, "A")
    print(words)
    assert words.startswith("never switched: relays with beta below 0.3 A")
    assert "% of the plane" in words
    assert "more is elsewhere" in words
    assert gap.uncovered == pytest.approx(1.0 - (0.9 / 1.5) ** 2, abs=0.02)
    assert "beta below 0.3 (" in gap.words(plane, "")


def test_full_coverage_has_no_gap():
    """Down from the top to every level and back switches every relay."""
    plane = Plane.uniform(-1.0, 1.0, 12)
    assert largest_gap(plane, coverage(plane, [curves(2000, 12)])) is None
    almost = Gap(-1.0, 1.0, -1.0, 0.9, 0.997, 0.997)
    assert almost.words(plane, "T") == "never switched: relays with beta below 0.9 T (99.7 % of the plane)"
    nothing = largest_gap(plane, np.zeros(plane.n_q, dtype=bool))
    assert nothing is not None
    assert nothing.words(plane, "T") == "never switched: all relays (100 % of the plane)"
    assert nothing == Gap(-1.0, 1.0, -1.0, 1.0, 1.0, 1.0)
    with raises(ArgumentError, "not such an argument", argument="covered", got="(3,)"):
        largest_gap(plane, np.zeros(3, dtype=bool))
