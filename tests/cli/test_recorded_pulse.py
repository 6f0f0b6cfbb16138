"""A recorded finger pressure pulse, from its file to the finger: one beat, and the mean of all."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from program import pulsetrainer
from pulsetrainer.core.beats import find_beats
from pulsetrainer.core.pulses import Shape
from wording import refusal, tells

RECORD = Path(__file__).resolve().parents[1] / "data" / "fingerbp_AAC3_3.csv"


@pytest.mark.slow
@pytest.mark.parametrize("beat", ["2", "mean"])
def test_a_recorded_beat_is_played_like_one_of_the_library(as_built, tmp_path, beat):
    """Invert, play, evaluate on the as-built bench: the compensated error is a small part of the scaled."""
    model = as_built / "model-continuous.h5"
    steps = (
        ["invert", RECORD, "--beat", beat, "--model", model, "-o", "drive.h5"],
        ["play", "drive.h5", "--port", "bench:", "--repeats", "2", "-o", "played.h5"],
        ["evaluate", "played.h5", "--json"],
    )
    for words in steps:
        done = pulsetrainer(tmp_path, *words)
        assert done.code == 0, done
        if words[0] == "invert":
            tells(done.err, "beats found")
            tells(done.err, "stretched")
    pulse = done.json["waveforms"][0]
    print({k: pulse[k] for k in ("name", "mean_error_reduction_percent")}, pulse["compensated"])
    assert pulse["name"] == f"fingerbp_AAC3_3_{'mean' if beat == 'mean' else 'beat2'}"
    assert pulse["compensated"]["mean_abs_error_percent"] < 2.0
    assert pulse["mean_error_reduction_percent"] > 80.0
    # what was played is the recorded beat: same shape, scaled to the force range
    t, p = np.loadtxt(RECORD, delimiter=",", skiprows=1).T
    beats = find_beats(Shape("x", t, p))
    one = beats.mean() if beat == "mean" else beats.single(2)
    with h5py.File(tmp_path / "drive.h5") as file:
        scored = file["scored"][:].astype(bool)
        target = file["target"][:][scored]
    size = round(one.period_s * 1000)  # the first beat is not scored; a period is no whole number of steps
    at = ((np.arange(size) + size) / 1000.0) % one.period_s
    wanted = np.interp(at, np.append(one.time_s, one.period_s), np.append(one.normalised, one.normalised[0]))
    np.testing.assert_allclose((target[:size] - target.min()) / np.ptp(target), wanted, atol=0.005)


def test_a_beat_that_is_not_there_is_exit_3(small_chain, tmp_path):
    """And no drive is written."""
    words = ["invert", RECORD, "--beat", "9", "--model", small_chain / "model.h5", "-o", "drive.h5"]
    refusal(pulsetrainer(tmp_path, *words, "--json"), 3, "no such beat")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("columns", [2, 3])
def test_a_table_of_several_columns_says_which_one_is_played(small_chain, tmp_path, columns):
    """A whole record, given by mistake, plays its input."""
    t, p = np.loadtxt(RECORD, delimiter=",", skiprows=1).T
    table = np.stack([t, p, 2 * p], axis=1)[:, :columns]
    heading = ",".join(["t_s", "u", "y"][:columns])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=heading, comments="")
    words = ["invert", "a.csv", "--beat", "2", "--model", small_chain / "model.h5", "-o", "drive.h5"]
    done = pulsetrainer(tmp_path, *words)
    assert done.code == 0, done
    assert ("of the 3 columns of a.csv the second is played, u" in done.err) == (columns == 3)


def test_a_session_says_what_it_makes_of_a_recording(small_chain, tmp_path):
    """As an inversion does: which column is played, and that several beats would be one."""
    t = np.arange(800) * 0.004
    p = np.maximum(np.sin(2 * np.pi * t / 0.8), 0.0)
    table = np.stack([t, p, 2 * p], axis=1)
    np.savetxt(tmp_path / "scope.csv", table, delimiter=",", header="t_s,p,q", comments="")
    words = ["session", "--model", small_chain / "model.h5", "-o", "session.h5", "--beats", "2", "--dry-run"]
    done = pulsetrainer(tmp_path, *words, "--pulses", "normal,scope.csv")
    assert done.code == 0, done
    tells(done.err, "second column")
    tells(done.err, "several beats")
