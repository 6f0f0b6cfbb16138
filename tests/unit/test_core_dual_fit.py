"""The dual form fitted in its output: what masses change there, and what it gains."""

from __future__ import annotations

from dataclasses import replace

import form_devices as devices
import numpy as np
import pytest

from pulsetrainer.core import dual_fit
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record

LEVELS = 6


def inner(polarity):
    """P from output to input, of uneven levels and a density without zeros."""
    plane = Plane(np.array([0.0, 0.1, 0.3, 0.45, 0.7, 0.85, 1.0]))
    weights = np.random.default_rng(3).uniform(0.5, 2.0, plane.n_q)
    return Preisach(plane, weights, 0.7, polarity=polarity)


def excited(operator, rng, beyond=0.0):
    """An input with small and large loops, in reach of the operator, or ``beyond`` it."""
    low, high = operator.low, operator.high
    turns = np.concatenate(([0.0, 1.0, 0.0], rng.uniform(-beyond, 1.0 + beyond, 30)))
    u = np.interp(np.linspace(0, turns.size - 1, 400), np.arange(turns.size), turns)
    return low + (high - low) * u


@pytest.mark.parametrize("polarity", [1, -1])
@pytest.mark.parametrize("beyond", [0.0, 0.1])
def test_what_a_mass_changes_in_the_output_is_its_derivative(polarity, beyond):
    """Against differences, for every cell and for the offset; also beyond the ends."""
    operator = inner(polarity)
    u = excited(Dual(operator), np.random.default_rng(5), beyond)
    path, past = dual_fit._path(operator, Record(u, np.zeros(u.size)))
    at = np.arange(u.size)
    rows = dual_fit._moved(operator, path, at + past)
    small = 1e-6
    for k in range(operator.plane.n_q + 1):
        masses = operator.masses.copy()
        masses[k % operator.plane.n_q] += small * (k < operator.plane.n_q)
        down = polarity * operator.offset - operator.total + small * (k == operator.plane.n_q)
        moved = replace(
            operator,
            weights=masses / operator.plane.areas,
            offset=polarity * (down + masses.sum()),
        )
        found = (Dual(moved)(u) - Dual(operator)(u)) / small
        # samples that cross an edge in between, or come to an end, have two slopes
        alike = np.abs(rows[:, k] - found) <= 0.02 * (1.0 + np.abs(found))
        assert np.mean(alike) > 0.97


def test_a_fit_to_the_input_is_mended_where_branches_are_steep():
    """Less than half of the error, on a clean signal never seen; and never more on the record itself."""
    rng = np.random.default_rng(7301)
    device = devices.steep_exchanged_plane(rng)
    u = devices.record(rng, 3000)
    clean = device(u)
    y = clean + rng.normal(0.0, 0.003 * np.ptp(clean), u.size)
    found = {}
    for name in ("to the input", "in the output"):
        with pytest.MonkeyPatch.context() as patch:
            if name == "to the input":
                patch.setattr("pulsetrainer.core.fit.in_output", lambda operator, *_: operator)
            from pulsetrainer.core.fit import fit

            found[name] = fit([(u, y)], 0.0, 1.0, 32, form="dual").operator
    turns = np.concatenate(([0.0, 1.0, 0.0], rng.uniform(0.0, 1.0, 60)))
    unseen = np.interp(np.linspace(0, 62, 3000), np.arange(63), turns)
    before, after = (np.std(found[name](unseen) - device(unseen)) for name in found)
    assert after < 0.5 * before
    before, after = (np.std(found[name](u) - y) for name in found)
    assert after < before
