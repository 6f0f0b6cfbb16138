"""Small tables that a user writes by hand: a signal to be played, bounds to be held."""

from __future__ import annotations

import numpy as np
import pytest

from pulsetrainer.core.excitations import MOST_SAMPLES
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files.bounds import read_bounds
from pulsetrainer.files.pulses import read_pulse
from pulsetrainer.files.signal_table import read_signal
from wording import tells


def test_a_signal_is_read_at_even_steps(tmp_path):
    """Whatever time it begins at: straight lines between its points, both ends included."""
    path = tmp_path / "mine.csv"
    path.write_text("t_s,current_A\n10.0,0\n10.5,1\n12.0,0.25\n")
    signal = read_signal(path, 10.0)
    t = 10.0 + np.arange(21) / 10.0
    np.testing.assert_allclose(signal.value, np.interp(t, [10.0, 10.5, 12.0], [0.0, 1.0, 0.25]), atol=1e-12)
    assert (signal.rate_Hz, signal.name) == (10.0, "mine.csv")
    with pytest.raises(DataError) as caught:
        read_signal(path, MOST_SAMPLES)
    assert str(MOST_SAMPLES) in str(caught.value)


@pytest.mark.parametrize("heading", ["time", "t_s"])
def test_a_time_without_a_unit_is_told_to_be_taken_as_seconds(tmp_path, heading):
    """It may be ms: the device would play for a quarter of an hour."""
    path = tmp_path / "mine.csv"
    path.write_text(f"{heading},current_A\n0,0\n500,1.2\n1000,0\n")
    note = read_signal(path, 1000.0).note
    if heading == "t_s":
        assert not note
    else:
        tells(note, "signal without a unit")


def test_a_signal_needs_two_columns(tmp_path):
    """The columns that it should have are in the remedy."""
    path = tmp_path / "one.csv"
    path.write_text("t_s\n0\n1\n")
    with pytest.raises(DataError) as caught:
        read_signal(path, 10.0)
    assert "t_s,current_A" in caught.value.hint


@pytest.mark.parametrize("heading", ["Weg [µm]", "current_mA"])
def test_a_signal_is_a_current_in_amperes(tmp_path, heading):
    """What another quantity or another unit would make of a device that presses a finger is not tried."""
    path = tmp_path / "other.csv"
    path.write_text(f"t_s,{heading}\n0,0\n1,0.9\n")
    with pytest.raises(DataError) as caught:
        read_signal(path, 10.0)
    assert "current_A" in caught.value.hint


def test_a_current_below_zero_is_named_by_its_line(tmp_path):
    """As its writer counts, not by the number of a sample."""
    (tmp_path / "s.csv").write_text("t_s,current_A\n0,0\n1,-1e-9\n2,-0.5\n")
    with pytest.raises(DataError, match=r"s\.csv has a current of -0\.5 A in column current_A, line 4"):
        read_signal(tmp_path / "s.csv", 10.0)


def test_a_pulse_of_two_rows_is_refused_with_its_file(tmp_path):
    """And with the number of rows: it has no shape."""
    path = tmp_path / "tiny.csv"
    path.write_text("t_s,p\n0,0\n1,1\n")
    with pytest.raises(DataError) as caught:
        read_pulse(str(path))
    assert "tiny.csv has 2 rows" in str(caught.value)
    assert caught.value.hint


def test_bounds_are_named_by_their_tables(tmp_path):
    """A pair of numbers a metric; tables in tables are joined by dots."""
    path = tmp_path / "bounds.toml"
    path.write_text("top = [1, 2]\n[normal.relay]\nrms = [0.5, 0.5]\n[normal.exact]\nrms = [-1, 0]\n")
    assert read_bounds(path) == {
        "top": (1.0, 2.0),
        "normal.relay.rms": (0.5, 0.5),
        "normal.exact.rms": (-1.0, 0.0),
    }


@pytest.mark.parametrize("bound", ["[2, 1]", "[1]", "[1, 2, 3]", "1", "[1, true]", "[1, 'a']", "[nan, 1]"])
def test_what_is_no_bound_is_named(tmp_path, bound):
    """Its key and its file; nothing is held against half a bound."""
    path = tmp_path / "bounds.toml"
    path.write_text(f"[normal]\nrms = {bound}\n")
    with pytest.raises(UsageError) as caught:
        read_bounds(path)
    assert "normal.rms" in str(caught.value)
    assert "bounds.toml" in str(caught.value)
    assert caught.value.hint.startswith("write rms =")
    path.write_text(f'"normal.rms" = {bound}\n')  # without a heading the whole name has to stand there
    with pytest.raises(UsageError) as caught:
        read_bounds(path)
    assert caught.value.hint.startswith('write "normal.rms" =')
