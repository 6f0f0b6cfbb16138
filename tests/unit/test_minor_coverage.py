"""What minor loops tell of the plane, and what only the major loop does."""

from __future__ import annotations

from bisect import bisect

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pulsetrainer.core import excitations, input_noise
from pulsetrainer.core.coverage import coverage, minor_coverage
from pulsetrainer.core.plane import Plane
from pulsetrainer.report.facts import minor_words

PLANE = Plane.uniform(0.0, 1.0, 12)


def _major() -> np.ndarray:
    return np.concatenate((np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)))


def test_one_loop_switches_every_cell_and_tells_none_apart():
    """Which is why a coverage of 100 % alone says too much."""
    assert coverage(PLANE, [_major()]).all()
    assert minor_coverage(PLANE, [_major()]) == 0.0
    assert minor_coverage(PLANE, [_major(), _major()]) == 0.0


def test_reversal_curves_and_the_diagnostic_signal_tell_all_apart():
    """Curves from turns in every band; nested loops at many levels."""
    middles = PLANE.thresholds
    curves = [
        x
        for low in middles
        for x in (np.linspace(0, 1, 30), np.linspace(1, low, 30), np.linspace(low, 1, 30))
    ]
    assert minor_coverage(PLANE, [np.concatenate(curves)]) == 1.0
    assert minor_coverage(PLANE, [excitations.diagnostic(0.0, 1.0, rate_Hz=200.0).value]) == 1.0


def test_what_nothing_has_switched_is_not_said_of_the_major_loop():
    """Of a record that was cut, 7 % of the cells were told apart, and the rest was called switched."""
    assert minor_words(7.0, 100.0).endswith(
        "only the major loop switched the rest: smaller loops within it would tell them apart"
    )
    assert minor_words(7.0, 7.7).endswith(
        "only the major loop, or nothing, switched the rest: smaller loops within it would tell them apart"
    )
    assert minor_words(0.0, 0.0).endswith(
        "nothing switched the rest: smaller loops within the range would tell them apart"
    )
    assert minor_words(99.0, 99.0) == "99 % of the cells"


def test_a_small_loop_tells_its_own_cells_apart():
    """From 0.75 down to 0.3 and back: row and column of its turns, no cell beside them."""
    u = np.concatenate((np.linspace(0, 0.7, 40), np.linspace(0.7, 0.3, 40), np.linspace(0.3, 0.7, 40)))
    i, j = PLANE.cell_indices
    within = np.count_nonzero((i < 11) & (j > 0))
    # up at 0.7 is band 8, down at 0.3 band 3: cells (8, 3..8) and (3..8, 3), one of them in both
    assert minor_coverage(PLANE, [u]) == (6 + 6 - 1) / within


@pytest.mark.parametrize(("edge", "other", "after"), [(3 / 12, 0.7, 0.7), (8 / 12, 0.4, 0.0)])
def test_a_turn_is_known_no_better_than_its_noise(edge, other, after):
    """A turn that noise alone takes into the next band, outwards, marks no cell there: minima and maxima."""
    first = [0.0, other] if other > edge else [0.0, 1.0, other]

    def told(turn: float, noise: float) -> float:
        turns = [*first, turn, after]
        return minor_coverage(
            PLANE, [np.interp(np.arange(0, len(turns) - 0.99, 0.01), np.arange(len(turns)), turns)], noise
        )

    near, beyond = edge + np.sign(other - edge) * 0.001, edge - np.sign(other - edge) * 0.001
    assert told(beyond, 0.002) == told(near, 0.0)
    assert told(beyond, 0.0) != told(near, 0.0)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=12))
def test_the_corners_are_those_of_a_memory_followed_step_by_step(turns):
    """Against the slow obvious way: the last remembered extreme and the input, a step at a time."""
    path = np.interp(np.arange(0, len(turns) - 1 + 1e-9, 1 / 64), np.arange(len(turns)), turns)
    u = np.concatenate((np.linspace(0.0, path[0], 64), path))
    assert minor_coverage(PLANE, [u]) == _slowly(u)


def _slowly(u: np.ndarray) -> float:
    """Share of the cells that the corner passes, by wiping a list of extremes out at every step."""
    edges = PLANE.edges.tolist()

    def band(value: float) -> int:
        return min(max(bisect(edges, value) - 1, 0), 11)

    passed = np.zeros((12, 12), bool)
    maxima, minima, at, rising = [np.inf], [-np.inf], 0.0, True
    for value in u.tolist():
        if value == at:
            continue
        if (value > at) != rising:
            (maxima if rising else minima).append(at)
            rising = value > at
        for level in range(min(band(at), band(value)), max(band(at), band(value)) + 1):
            edge = edges[level] if rising else edges[level + 1]
            here = min(max(edge, min(at, value)), max(at, value))
            while rising and len(maxima) > 1 and here >= maxima[-1]:
                maxima.pop()
                minima.pop()
            while not rising and len(minima) > 1 and here <= minima[-1]:
                minima.pop()
                maxima.pop()
            row, column = (level, band(minima[-1])) if rising else (band(maxima[-1]), level)
            passed[row, column] = True
        at = value
    i, j = PLANE.cell_indices
    return float(np.mean(passed[i, j][(i < 11) & (j > 0)]))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("falling", [False, True])
def test_noise_in_the_turns_costs_no_cell(seed, falling):
    """Reversal curves from every edge of the plane tell all apart, whichever side of it noise puts a turn.

    Nor does it matter that the record begins a little below the plane.
    """
    edges, sigma = PLANE.edges, 1e-4
    turns = [x for edge in (edges[1:-1] if falling else edges[-2:0:-1]) for x in (falling, edge)]
    turns = np.asarray([0.0, *turns, falling, not falling])
    u = np.interp(np.arange(80 * turns.size - 79) / 80, np.arange(turns.size), turns)
    noisy = u + np.random.default_rng(seed).normal(0.0, sigma, u.size)
    cleaned = input_noise.clean(np.concatenate(([-3 * sigma], noisy)))
    assert minor_coverage(PLANE, [cleaned.input], cleaned.dead_band) == 1.0
