"""The fit as a verb asks for it: where the levels lie, which samples count, what is left."""

from __future__ import annotations

import numpy as np
import pytest
from core_jobs import curves, plant

from pulsetrainer.core import output_curve
from pulsetrainer.core.fit import CROWDED_MISFIT, fit
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane

U = curves(1500, 12, 10)
DEVICE = plant(12)
Y = DEVICE(U)


def test_residual_and_misfit_are_of_the_samples_that_count():
    """What is measured less what is fitted; the misfit leaves out what comes before the memory is known."""
    late = U[40:]  # begins on the way: unknown until it first reaches an end
    noise = np.random.default_rng(1).normal(0.0, 0.05, late.size)
    spoilt = Y[40:] + noise
    found = fit([(late, spoilt)], -1.0, 1.0, 12, smoothing=0.0)
    operator, record = found.identified.operator, found.records[0]
    counted = record.sample_weight > 0
    assert 0 < np.count_nonzero(~counted) < 100
    left = spoilt - operator(late, record.start)
    np.testing.assert_array_equal(found.residuals[0], left)
    assert found.misfit == pytest.approx(np.sqrt(np.mean(left[counted] ** 2)) / np.ptp(spoilt[counted]))


@pytest.mark.parametrize("unit", [1.0, 1e-9])
def test_levels_crowd_only_where_that_fits(unit):
    """A steep loop has crowded levels, relays even ones; what no operator follows falls back to even ones.

    In any unit of the input.
    """
    plane = Plane.uniform(-1.0, 1.0, 60)
    i, j = plane.cell_indices
    steep = Preisach(plane, np.exp(-(((i - 32.0) / 1.5) ** 2) - ((j - 28.0) / 1.5) ** 2))(U)

    def fitted(y, **how):
        return fit([(unit * U, y)], -unit, unit, 12, **how)

    assert not fitted(steep).evenly_spaced
    assert fitted(steep, reading="relay", smoothing=0.0).evenly_spaced
    assert fitted(Y).evenly_spaced
    jumps = np.sign(np.sin(40.0 * np.arange(U.size) / U.size)) * (np.abs(U) < 0.05)
    lost = fitted(jumps)
    assert lost.evenly_spaced
    assert lost.misfit > CROWDED_MISFIT
    steep /= np.ptp(steep)
    for share, even in ((0.08, False), (0.12, True)):  # crowded levels leave 1.9 % and 2.5 % of the span
        assert fitted(steep + share * jumps).evenly_spaced is even


def test_records_shifted_against_each_other_have_offsets():
    """They are fitted as if they were not; the offsets are against the mean."""
    found = fit([(U, Y), (U, Y + 0.5)], -1.0, 1.0, 12, smoothing=0.0)
    assert found.offsets == pytest.approx([-0.25, 0.25], abs=1e-3)
    assert found.misfit < 1e-3
    alone = fit([(U, Y)], -1.0, 1.0, 12, smoothing=0.0)
    assert not np.any(alone.offsets)
    assert alone.misfit < 1e-6


def test_a_curve_over_the_state_is_the_one_that_was_there():
    """Bent once; what it leaves is what is left of its own output."""
    plane, rng = Plane.uniform(0.0, 1.0, 6), np.random.default_rng(4)
    masses, rows = plane.areas / plane.areas.sum(), rng.uniform(-1.0, 1.0, (400, plane.n_q))
    y = (1.0 + rows @ masses) ** 2
    found = output_curve._curve_over(masses, rows, y)
    left = y - found(rows)
    assert found.squares == pytest.approx(np.sum(left**2))
    assert np.std(left) < 0.01 * np.ptp(y)
