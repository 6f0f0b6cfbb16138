"""Records in other units, up to a drive: the error that the model expects is small, or the reason is said."""

from __future__ import annotations

from pathlib import Path

import form_devices as devices
import numpy as np
import pytest

from program import pulsetrainer
from wording import refusal

DATA = Path(__file__).resolve().parents[1] / "data"
EXACT = 1e-3  # % of the largest output: what rounding leaves of an exact inverse
WORTH_A_WARNING = 5.0  # %
# who draws the device, the form that describes it, units and sizes of input and output, time step in s
BENCHES = {
    "piezo": (devices.play_sum, "direct", ("mV", 1.2e5), ("um", 35.0), 1e-4),
    "thermistor": (devices.falling, "direct", ("kPa", 400.0), ("kOhm", 0.02), 0.5),
    "rubber": (devices.stop_sum, "dual", ("bar", 6.0), ("mm", 80.0), 60.0),
    "butterfly": (devices.butterfly_density, "signed", ("kV/mm", 2.0), ("nm", 4e-3), 2e-8),
}


def inverted(folder, table, columns):
    """Import, identify and invert; the JSON of the last two."""
    done = pulsetrainer(folder, "import", table, *columns, "-o", "run.h5")
    assert done.code == 0, done
    done = pulsetrainer(folder, "identify", "run.h5", "--levels", "16", "-o", "model.h5", "--json")
    assert done.code == 0, done
    drive = pulsetrainer(folder, "invert", "normal", "--model", "model.h5", "-o", "drive.h5", "--json")
    assert drive.code == 0, drive
    return done.json, drive.json, drive.err


@pytest.mark.slow
@pytest.mark.parametrize("bench", BENCHES)
def test_a_model_in_other_units_is_inverted(tmp_path, bench):
    """No limit that nobody asked for: nothing but rounding is left where an exact inverse exists."""
    draw, form, (given, reach), (made, size), step = BENCHES[bench]
    rng = np.random.default_rng(11)
    device, u = draw(rng), devices.record(rng, 2000)
    y = device(u)
    y = size * (y + 0.002 * np.ptp(y) * rng.normal(size=u.size))
    rows = "".join(
        f"{k * step:.17g},{reach * a:.17g},{b:.17g}\n" for k, (a, b) in enumerate(zip(u, y, strict=True))
    )
    (tmp_path / "a.csv").write_text(f"t_s,u ({given}),y ({made})\n{rows}")
    model, drive, said = inverted(tmp_path, "a.csv", ("--input", "u", "--output", "y"))
    assert model["form"] == form
    assert (drive["input_unit"], drive["output_unit"]) == (given, made)
    error = drive["predicted_max_error_percent"]
    if form == "signed":  # its branches turn within the range: what is beyond is named
        assert error < WORTH_A_WARNING
        assert "inverse exists" in said
    else:
        assert error < EXACT
        assert "warning" not in said
    low, high = drive["current_range"]
    assert -0.02 * reach <= low < high <= 1.02 * reach


def test_a_small_output_is_told_in_digits_that_it_has(tmp_path):
    """A stroke of 13 um in metres was 0.000 to 0.000."""
    u = np.concatenate([a * np.sin(np.linspace(0, 2 * np.pi, 400)) for a in (100.0, 60.0, 30.0)])
    (tmp_path / "small.csv").write_text("u_V,x_m\n" + "".join(f"{a},{1.3e-7 * a}\n" for a in u))
    inverted(tmp_path, "small.csv", ("--input", "u", "--output", "x", "--no-time"))
    done = pulsetrainer(tmp_path, "invert", "normal", "--model", "model.h5", "-o", "drive.h5", "--overwrite")
    assert "-1.3e-05 .. 1.3e-05 m" in done.out
    assert "-99.999 .. 99.999 V" in done.out


def test_a_measured_magnet_is_inverted(tmp_path):
    """A licensed record, in its own units."""
    columns = ("--input", "u", "--output", "y", "--input-unit", "T", "--output-unit", "nA m^2")
    _, drive, said = inverted(tmp_path, DATA / "forc_sediment_msm33.csv", columns)
    assert drive["predicted_max_error_percent"] < EXACT
    assert "warning" not in said


def test_a_limit_that_is_too_slow_is_named_with_its_unit(tmp_path):
    """The same pulse within a limit that was asked for: the error is large, and the warning says why."""
    test_a_model_in_other_units_is_inverted(tmp_path, "piezo")
    words = ("--slew", "1000", "--json", "-o", "slow.h5")
    done = pulsetrainer(tmp_path, "invert", "normal", "--model", "model.h5", *words)
    assert done.code == 0, done
    assert done.json["predicted_max_error_percent"] > WORTH_A_WARNING
    assert "1000 mV/s" in done.err


def test_a_model_of_another_kind_of_device_is_named(tmp_path):
    """It can neither be checked nor played in a session."""
    test_a_model_in_other_units_is_inverted(tmp_path, "piezo")
    for words in (("check", "model.h5"), ("session", "--model", "model.h5", "-o", "session.h5")):
        refusal(pulsetrainer(tmp_path, *words), 3, "another kind of device", file="model.h5")


def test_a_model_without_units_is_told_apart_from_one_of_another_device(small_chain):
    """Its table is imported again, with its units."""
    done = pulsetrainer(small_chain, "evaluate", "run.h5", "--model", "plain/model.h5")
    refusal(done, 3, "no units", file="plain/model.h5")
