"""What `identify` says of its fit: smoothing, noise in the input, and what it never saw of the plane."""

from __future__ import annotations

import numpy as np
import pytest

from wording import refusal, tells

ROWS = 4000


@pytest.fixture
def record(run, tmp_path):
    """Import a record of a relay-like device; return a function that takes the noise and the range."""

    def make(noise=0.0, low=0.0, high=1.0):
        rng = np.random.default_rng(1)
        t = np.arange(ROWS) * 0.01
        u = low + (high - low) * 0.5 * (1 - np.cos(2 * np.pi * t / 8.0) * np.linspace(1.0, 0.2, ROWS))
        u[:2] = 0.0, 1.0  # the range of the levels
        y = np.tanh(3 * u - 1.5)
        measured = u + rng.normal(0.0, noise, ROWS)
        table = np.column_stack((t, measured, y + rng.normal(0.0, 0.01, ROWS)))
        np.savetxt(tmp_path / "run.csv", table, delimiter=",", header="t_s,u,y", comments="")
        done = run(
            "import",
            "run.csv",
            "--time",
            "t_s",
            "--input",
            "u",
            "--output",
            "y",
            "-o",
            "run.h5",
            "--overwrite",
        )
        assert done.code == 0, done.err

    return make


def test_smoothing_is_chosen_reported_and_stored(run, record, tmp_path):
    """By itself; as asked; none for relays, as in the paper."""
    from pulsetrainer.artefacts import Model
    from pulsetrainer.files import store

    record()
    base = ("identify", "run.h5", "--levels", "12", "-o", "model.h5", "--overwrite", "--json")
    chosen = run(*base).json["smoothing"]
    assert 0 <= chosen <= 0.3
    assert run(*base, "--smoothing", "auto").json["smoothing"] == chosen
    stored = store.read(tmp_path / "model.h5", Model).fit
    assert stored is not None
    assert stored.smoothing == chosen
    assert run(*base, "--smoothing", "0.04").json["smoothing"] == 0.04
    assert run(*base, "--smoothing", "0").json["smoothing"] == 0
    assert run(*base, "--reading", "relay").json["smoothing"] == 0


def test_the_reading_has_an_older_name(run, record, tmp_path):
    """``--operator`` still says how the weights are read; the file keeps its attribute ``operator``."""
    import h5py

    record()
    base = ("identify", "run.h5", "--levels", "12", "--overwrite", "-o")
    assert run(*base, "new.h5", "--reading", "relay").code == 0
    assert run(*base, "old.h5", "--operator", "relay").code == 0
    with h5py.File(tmp_path / "new.h5") as new, h5py.File(tmp_path / "old.h5") as old:
        assert new.attrs["operator"] == old.attrs["operator"] == "relay"
        assert np.array_equal(new["weights"], old["weights"])


@pytest.mark.parametrize("text", ["much", "-1", "2", "nan"])
def test_smoothing_must_be_auto_or_a_share(run, record, text):
    """Anything else is a usage error that says what is expected."""
    record()
    done = run("identify", "run.h5", "-o", "model.h5", "--smoothing", text, "--json")
    refusal(done, 2, "not a smoothing", got=text)


def test_false_reversals_are_counted(run, record):
    """Noise in the input is measured, and a note says what was taken out; a clean record has neither."""
    record(noise=0.005)
    done = run("identify", "run.h5", "--levels", "12", "-o", "model.h5", "--json")
    assert done.json["input_noise"] == pytest.approx(0.005, rel=0.1)
    assert done.json["false_reversals"] > 500
    tells(done.err, "false reversals")
    record()
    done = run("identify", "run.h5", "--levels", "12", "-o", "model.h5", "--overwrite", "--json")
    assert done.json["false_reversals"] == 0
    assert "note: " not in done.err


def test_the_missing_part_of_the_plane_is_named(run, record):
    """Below 99 % coverage a note names the region in the input's unit."""
    record(low=0.3, high=0.8)
    done = run("identify", "run.h5", "--levels", "20", "-o", "model.h5", "--json")
    assert done.json["coverage_percent"] < 99
    tells(done.err, "cells never switched")


@pytest.mark.parametrize("draws", [20, pytest.param(60, marks=pytest.mark.slow)])
def test_a_bootstrap_gives_intervals_that_hold_the_device(run, record, tmp_path, draws):
    """Stored beside weights and fit, around them, repeatable by seed, and wide enough to hold the truth."""
    from pulsetrainer.artefacts import Model
    from pulsetrainer.files import store

    record()
    base = ("identify", "run.h5", "--levels", "12", "-o", "model.h5", "--overwrite", "--json")
    assert run(*base).json["output_uncertainty"] is None
    first = run(*base, "--bootstrap", str(draws), "--seed", "5").json["output_uncertainty"]
    assert 1e-4 < first < 0.01  # noise of 0.01 on 4000 samples, 78 cells
    model = store.read(tmp_path / "model.h5", Model)
    assert model.fit.draws == draws
    assert np.all(model.weights_lower <= model.weights_upper)
    inside = (model.fit.predicted_lower <= model.fit.predicted) & (
        model.fit.predicted <= model.fit.predicted_upper
    )
    assert inside.mean() > 0.9
    truth = np.tanh(3 * model.fit.input - 1.5)
    spread = np.abs(truth - model.fit.predicted)
    assert np.median(spread) < 3 * first
    again = run(*base, "--bootstrap", str(draws), "--seed", "5")
    assert again.json["output_uncertainty"] == first
    assert "says little" not in again.err
    assert run(*base, "--bootstrap", str(draws), "--seed", "6").json["output_uncertainty"] != first


def test_a_band_from_few_draws_says_so(run, record):
    """Two have no quantiles."""
    record()
    done = run("identify", "run.h5", "--levels", "12", "-o", "model.h5", "--bootstrap", "2")
    assert "note: a band from 2 draws says little: --bootstrap 200 is usual" in " ".join(done.err.split())


def test_an_output_that_stands_still_is_named_with_its_file_and_unit(run, tmp_path):
    """Of several runs too, nothing but the file says which sensor was not connected."""
    rows = "".join(f"{k},{k % 3},1\n" for k in range(9))
    (tmp_path / "still.csv").write_text(f"t_s,current_A,force_N\n{rows}")
    columns = ("--input", "current_A", "--output", "force_N")
    run("import", "still.csv", *columns, "-o", "still.h5")
    done = run("identify", "still.h5", "-o", "model.h5", "--json")
    refusal(done, 3, "constant output", file="still.h5")
