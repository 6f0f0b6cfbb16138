"""Readings that a logger repeats: found in either column, whatever the device is, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.signal import lfilter

import pulsetrainer as pt
from pulsetrainer.core.held import input_readings, output_readings
from pulsetrainer.core.memory import turning_points
from pulsetrainer.steps.import_ import import_parts

N = 6000
ROWS = np.arange(N)


def _drive(seed: int) -> np.ndarray:
    """To and fro between drawn turns at drawn rates, with rests."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(0.0, 1.0, 60)
    ways = np.abs(np.diff(turns, prepend=0.0)) / np.exp(rng.uniform(-6.5, -4.5, turns.size))
    at = np.cumsum(np.column_stack((ways + 1.0, np.where(rng.random(turns.size) < 0.2, 150.0, 1.0))).ravel())
    return np.interp(ROWS, np.append(0.0, at), np.append(0.0, np.repeat(turns, 2)))


def _plays(u: np.ndarray) -> np.ndarray:
    """Mean of four plays."""
    widths = np.asarray([0.02, 0.05, 0.1, 0.2])
    at, out = np.zeros(4), np.empty(u.size)
    for k, one in enumerate(u.tolist()):
        at = np.clip(at, one - widths, one + widths)
        out[k] = at.mean()
    return out


def _noisy(y: np.ndarray, seed: int) -> np.ndarray:
    return y + 0.002 * np.random.default_rng(seed).standard_normal(y.size)


U = [_drive(seed) for seed in range(4)]
Y = [_noisy(_plays(u), seed) for seed, u in enumerate(U)]


def _read_at(rows: float) -> np.ndarray:
    """The row (n,) whose reading stands in each row, where every ``rows``-th is read."""
    return np.ceil(np.floor(ROWS / rows + 1e-9) * rows - 1e-9).astype(np.int64)


@given(st.sampled_from(range(4)), st.one_of(st.integers(2, 20), st.floats(2.0, 20.0)), st.booleans())
def test_what_is_read_more_seldom_is_found(which, rows, of_input):
    """And in which rows it was read; also where that is no whole number of rows."""
    at, u, y = _read_at(rows), U[which], Y[which]
    assume(_regular(at))
    new = input_readings(u[at], y) if of_input else output_readings(u, y[at])
    assert new is not None
    column = u if of_input else y
    # a reading that is no whole number of rows may be taken for the next one at the end of a rest
    assert np.count_nonzero(column[at][new] != column[new]) <= (15 if rows % 1 else 0)
    assert np.mean(new) == pytest.approx(1.0 / rows, rel=0.02)


def _regular(at: np.ndarray) -> bool:
    """Whether a converter of so many rows is not nearly one that takes turns between two and three."""
    rows = np.diff(np.unique(at))
    return bool(np.mean(np.abs(rows - rows.mean()) < 1.0) > 0.99)


@pytest.mark.parametrize("which", range(4))
def test_sound_columns_are_as_they_are(which):
    """With and without noise, and read in steps of 6 to 12 bits."""
    u, y = U[which], Y[which]
    for one, other in (
        (u, y),
        (u, _plays(u)),
        *((np.round(u * 2**b), np.round(y * 2**b)) for b in (6, 8, 12)),
    ):
        assert input_readings(one, other) is None
        assert output_readings(one, other) is None


@pytest.mark.parametrize("rows", [3, 5, 20, 100])
@pytest.mark.parametrize("lag", [0.0, 0.3, 1.0])
def test_a_device_that_was_driven_in_steps_saw_them(rows, lag):
    """It answers to each step, at once or with a lag: neither its input nor its output was repeated."""
    u = U[0][(ROWS // rows) * rows]
    y = _plays(u)
    if lag:
        left = np.exp(-1.0 / (lag * rows))
        y = lfilter([1.0 - left], [1.0, -left], y)
    assert input_readings(u, _noisy(y, 7)) is None
    assert output_readings(u, _noisy(y, 7)) is None


def test_few_readings_show_nothing():
    """Forty-nine of them, a constant, and columns that are shorter than that."""
    u, y = U[0], Y[0]
    assert input_readings(u[_read_at(130)], y) is None
    assert turning_points(u).size > 20
    for n in (1, 2, 99):
        assert input_readings(np.ones(n), y[:n]) is None
        assert output_readings(u[:n], np.ones(n)) is None
    assert input_readings(np.ones(N), y) is None


def _run(name: str, u: np.ndarray, y: np.ndarray, **more) -> pt.Run:
    return pt.Run(time_s=0.01 * ROWS, input=u, output=y, input_quantity="field", signal=name, **more)


def test_rows_without_a_new_input_are_left_out():
    """All columns of them, and the note counts them; the time stamps keep their places."""
    at = _read_at(4)
    got = import_parts([_run("slow.csv", U[0][at], Y[0], reference=U[0])])
    assert got.notes[0] == (
        "the field in slow.csv is new in one of 4 rows only, as its logger repeats each reading: "
        "the 4500 rows between are left out"
    )
    for values, whole in ((got.run.input, U[0]), (got.run.output, Y[0]), (got.run.reference, U[0])):
        np.testing.assert_array_equal(values, whole[::4])
    np.testing.assert_allclose(got.run.time_s, 0.01 * ROWS[::4])
    assert got.run.masked is None
    assert (got.report.samples, got.report.gaps, got.report.even) == (1500, 0, True)


def test_an_output_that_is_repeated_counts_once():
    """Its input stays: what it did between two readings is in the memory. In one part of two."""
    late = replace(_run("b.csv", U[1], Y[1]), time_s=0.01 * ROWS + 100.0)
    got = import_parts([_run("a.csv", U[0], Y[0][_read_at(10)]), late])
    assert "the force in a.csv is new in one of 10 rows only" in " ".join(got.notes)
    np.testing.assert_array_equal(got.run.input, np.append(U[0], U[1]))
    np.testing.assert_array_equal(np.flatnonzero(~got.run.masked[:N]), ROWS[::10])
    assert not got.run.masked[N:].any()
    even = import_parts([_run("a.csv", U[0], Y[0][_read_at(10)])], resample=10.0).run
    np.testing.assert_allclose(even.output, Y[0][::10], atol=1e-9)
    assert even.masked is None
