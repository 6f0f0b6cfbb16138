"""Tables from other benches: real records, any units, rising and falling loops, no time at all."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

DATA = Path(__file__).resolve().parents[1] / "data"


@pytest.mark.parametrize("name", ["bh_ferrite_mnzn_1", "bh_steel_m130_27s_1"])
def test_a_magnetic_loop_without_time_fits_within_a_third_of_a_percent(run, name):
    """Field in A/m, flux density in T: nothing depends on the unit's size."""
    words = ["--input", "u", "--output", "y", "--input-unit", "A/m", "--output-unit", "T", "--time", "t_s"]
    assert run("import", DATA / f"{name}.csv", *words, "-o", "run.h5").code == 0
    done = run("identify", "run.h5", "-o", "model.h5", "--json")
    assert done.code == 0, done
    assert done.json["fit_rms_percent"] <= 0.3
    assert done.json["polarity"] == 1


def test_a_falling_loop_is_found_said_and_fitted(run):
    """The surgical tool's jaw closes when the spindle turns up; another speed is predicted within 2 %."""
    for speed, samples in (("f0p1", 10000), ("f0p3", 9987)):
        done = run(
            "import", DATA / f"davinci_{speed}_torque10.csv", "--input", "u", "--output", "y",
            "--input-unit", "deg", "--output-unit", "deg", "-o", f"{speed}.h5", "--json",
        )  # fmt: skip
        assert done.code == 0, done
        assert done.json["facts"]["samples"] == samples
        assert done.json["facts"]["rate_Hz"] == pytest.approx(500.0)
    done = run("identify", "f0p1.h5", "-o", "model.h5", "--json")
    assert done.json["polarity"] == -1
    assert done.json["fit_rms_percent"] <= 0.3
    assert "falls when the input rises" in done.err
    held_out = run("evaluate", "f0p3.h5", "--model", "model.h5", "--json")
    assert held_out.json["models"][0]["rms_percent"] <= 2.0


def test_units_come_from_the_header_and_milliseconds_become_seconds(run, tmp_path):
    """Semicolons, decimal commas, bracketed units."""
    rows = "\n".join(f"{k};{k / 10:.2f};{2 * k / 10:.2f}".replace(".", ",") for k in range(20))
    (tmp_path / "scope.csv").write_text(f"# from the scope\ntime [ms];coil current (A);Force (N)\n{rows}\n")
    words = ["--time", "time", "--input", "coil current", "--output", "Force", "-o", "run.h5"]
    done = run("import", "scope.csv", *words)
    assert done.code == 0, done
    with h5py.File(tmp_path / "run.h5") as file:
        assert (file["input"].attrs["units"], file["output"].attrs["units"]) == ("A", "N")
        np.testing.assert_allclose(file["time"][:3], [0.0, 0.001, 0.002])
        np.testing.assert_allclose(file["output"][:3], [0.0, 0.2, 0.4])


def test_a_rate_replaces_the_time_column(run, tmp_path):
    """Without time stamps --rate gives them."""
    (tmp_path / "bare.csv").write_text("\n".join(f"{k % 7},{k % 5}" for k in range(30)))
    words = ["--input", "column1", "--output", "column2", "--rate", "200", "-o", "run.h5", "--json"]
    done = run("import", "bare.csv", *words)
    assert done.code == 0, done
    assert done.json["facts"]["rate_Hz"] == pytest.approx(200.0)


def test_a_column_that_is_not_there_offers_the_nearest(run, tmp_path):
    """Exit 3, and the names that are there."""
    (tmp_path / "a.csv").write_text("t_s,current_A,force_N\n0,0,0\n1,1,1\n")
    done = run("import", "a.csv", "--input", "curent_A", "--output", "force_N", "-o", "run.h5")
    assert done.code == 3
    assert "did you mean 'current_A'" in done.err
    assert not (tmp_path / "run.h5").exists()
