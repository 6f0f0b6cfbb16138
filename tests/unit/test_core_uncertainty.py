"""Uncertainty: intervals that hold the truth about as often as they say."""

from __future__ import annotations

import form_devices as devices
import numpy as np
import pytest
from core_jobs import curves, plant, random_reversals
from scipy.signal import lfilter

from pulsetrainer.core import identification, uncertainty
from pulsetrainer.core.equations import parted_sums
from pulsetrainer.core.identification import identify
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.errors import ArgumentError
from wording import raises

N_H = 10
PLANE = Plane.uniform(-1.0, 1.0, N_H)
DEVICE = plant(N_H)
INPUT = curves(2000, N_H, 20)
CLEAN = DEVICE(INPUT)
SIGMA = 0.01 * float(np.ptp(CLEAN))


def noise(rng, memory):
    """Return noise of size SIGMA whose autocorrelation falls by ``memory`` a sample."""
    white = rng.normal(0.0, SIGMA, INPUT.size + 200)
    return lfilter([np.sqrt(1 - memory**2)], [1.0, -memory], white)[200:]


@pytest.mark.parametrize("memory", [pytest.param(0.0, marks=pytest.mark.slow), 0.8])
def test_intervals_hold_the_truth(memory):
    """Nominal 90 % intervals of output, offset and weights, in white and in coloured noise."""
    unseen = random_reversals(np.random.default_rng(1), 300, 20)
    truth = DEVICE(unseen)
    held = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        record = Record(INPUT, CLEAN + noise(rng, memory))
        fit = identify([record], PLANE)
        ensemble = uncertainty.bootstrap([record], fit, rng=rng, draws=40)
        band = ensemble.output_band(unseen)
        weights = ensemble.weight_interval()
        offset = uncertainty.interval(ensemble.offsets)
        slack = 1e-9 * DEVICE.weights.max()
        held.append(
            (
                np.mean((truth >= band.lower) & (truth <= band.upper)),
                np.mean(
                    (DEVICE.weights >= weights.lower - slack) & (DEVICE.weights <= weights.upper + slack)
                ),
                float(offset.lower <= DEVICE.offset <= offset.upper),
            )
        )
    output, weight, offset = np.mean(held, axis=0)
    print(f"seeds 0..9, memory {memory}: output {output:.3f}, weights {weight:.3f}, offset {offset:.2f}")
    assert 0.78 <= output <= 0.97
    assert 0.75 <= weight <= 0.99
    assert offset >= 0.6


def test_intervals_of_a_smoothed_fit_hold_the_truth():
    """A fit smoothed by held-out blocks is biased, and refits smoothed as much are biased with it."""
    plane, held = Plane.uniform(0.0, 1.0, 20), []
    i, j = plane.cell_indices
    for seed in (5101, 5102):
        rng = np.random.default_rng(seed)
        device = devices.bump_plane(rng, 200)
        true = np.zeros((20, 20))
        np.add.at(true, tuple(band // 10 for band in device.plane.cell_indices), device.masses)
        u = curves(2000, 20, 20, low=0.0, high=1.0)
        clean = device(u)
        record = Record(u, clean + rng.normal(0.0, 0.005 * np.ptp(clean), u.size))
        fit = identify([record], plane, smoothing="auto")
        ends = uncertainty.bootstrap([record], fit, rng=rng, draws=30).weight_interval()
        within = (ends.lower * plane.areas <= true[i, j]) & (true[i, j] <= ends.upper * plane.areas)
        held.append(float(np.mean(within[i != j])))
    print(f"seeds 5101, 5102: weights {held}")
    assert np.mean(held) >= 0.55


def test_the_same_rng_gives_the_same_ensemble():
    """Nothing but the generator decides; a falling loop has the mirrored band."""
    record = Record(INPUT, CLEAN + noise(np.random.default_rng(2), 0.0))
    fit = identify([record], PLANE, smoothing=0.05)
    one, two = (
        uncertainty.bootstrap([record], fit, rng=np.random.default_rng(3), draws=10) for _ in range(2)
    )
    assert np.array_equal(one.weights, two.weights)
    assert np.all(one.weights >= 0)
    mirrored = Record(INPUT, -record.output)
    turned = uncertainty.bootstrap(
        [mirrored], identify([mirrored], PLANE, smoothing=0.05), rng=np.random.default_rng(3), draws=10
    )
    band, other = one.output_band(INPUT[:100]), turned.output_band(INPUT[:100])
    assert np.allclose(other.upper, -band.lower, atol=1e-9)
    assert np.allclose(turned.offsets, -one.offsets, atol=1e-9)


def test_a_resample_is_a_refit_of_the_drawn_blocks():
    """The weighted sum of block sums equals the sums with the drawn counts as weights."""
    record = Record(INPUT, CLEAN)
    part = np.arange(INPUT.size) // 100
    stack = uncertainty._Stack(parted_sums(PLANE, [record], "continuous", [part], 20))
    drawn = np.random.default_rng(4).multinomial(20, np.full(20, 1 / 20)).astype(float)
    direct = identification.normal_equations(PLANE, [Record(INPUT, CLEAN, drawn[part])], "continuous")
    mixed = stack.weighted(drawn).dense()
    for name in ("gram", "moment", "row_sum", "weight_sum", "output_sum", "output_square"):
        assert np.allclose(getattr(mixed, name), getattr(direct, name), atol=1e-8), name


def test_blocks_grow_with_the_memory_of_the_residual():
    """White residuals take short blocks, slow ones long blocks, none at all the shortest."""
    rng = np.random.default_rng(5)
    white, slow = (uncertainty.block_length([noise(rng, memory)]) for memory in (0.0, 0.95))
    assert white <= 25
    assert slow >= 3 * white
    assert uncertainty.block_length([np.zeros(4000)]) == 10
    assert uncertainty.block_length([rng.normal(size=40_001)]) == 101  # so that there are at most 400


def test_blocks_are_as_long_as_asked():
    """Counted over the samples that count, on through all records; the last of a record may be shorter."""
    mask = np.ones(INPUT.size)
    mask[3:10] = 0.0
    parts, count = uncertainty._blocks(
        [Record(INPUT[:25], CLEAN[:25], mask[:25]), Record(INPUT[:6], CLEAN[:6])], 4
    )
    assert parts[0].tolist() == [0, 0, 0, *[-1] * 7, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4]
    assert parts[1].tolist() == [5, 5, 5, 5, 6, 6]
    assert count == 7


def test_masked_samples_are_in_no_block():
    """A record whose first half has no weight is resampled from its second half."""
    weight = np.where(np.arange(INPUT.size) < 1000, 0.0, 1.0)
    output = np.where(weight > 0, CLEAN + noise(np.random.default_rng(6), 0.0), np.nan)
    record = Record(INPUT, output, weight)
    ensemble = uncertainty.bootstrap(
        [record], identify([record], PLANE), rng=np.random.default_rng(6), draws=4
    )
    assert np.all(np.isfinite(ensemble.weights))


def test_a_stiff_density_stays_stiff():
    """A force that follows the velocity gets a density alike along the diagonal; so do all of its refits."""
    rng = np.random.default_rng(8)
    time = np.arange(4000) / 4000
    path = np.sin(40 * time) * (0.6 + 0.4 * np.sin(7 * time))
    force = path + np.tanh(3.0 * np.gradient(path, time) / 40) + 0.05 * rng.normal(size=path.size)
    record = Record(path, force)
    fit = identify([record], PLANE, smoothing="auto", polarity=1)
    ensemble = uncertainty.bootstrap([record], fit, rng=rng, draws=20)
    i, j = PLANE.cell_indices

    def change_along_the_diagonal(weights):
        density = np.zeros((N_H, N_H))
        density[i, j] = weights
        return np.abs(density[1:, 1:] - density[:-1, :-1]).max() / weights.max()

    own = change_along_the_diagonal(fit.operator.weights)
    refits = [change_along_the_diagonal(weights) for weights in ensemble.weights]
    print(f"stiffness {fit.stiffness:g}: {own:.3f} in the fit, {max(refits):.3f} in the refits at most")
    assert fit.stiffness > 0
    assert max(refits) < 0.1  # of its largest value; refits without the penalty come to 1


def test_bad_requests_are_named(monkeypatch):
    """Draws, and planes that do not fit."""
    record = Record(INPUT, CLEAN)
    fit = identify([record], PLANE)
    rng = np.random.default_rng(7)
    with raises(ArgumentError, "not such an argument", argument="draws", got="1"):
        uncertainty.bootstrap([record], fit, rng=rng, draws=1)
    monkeypatch.setattr(identification, "DENSE_BYTES", 1000)
    with raises(ArgumentError, "plane too large"):
        uncertainty.bootstrap([record], fit, rng=rng, draws=9)
