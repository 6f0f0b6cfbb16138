"""Diagnose and extend: what must work, and what bad records must not do."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

import pulsetrainer as pt
from program import pulsetrainer
from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.diagnosis.extended import Extended
from wording import tells

RATE_HZ = 100.0
LAG_S = 0.04
ONE_SPEED = 1.5  # A/s


def _device(u, *, lag_s=LAG_S):
    """Output of a device whose sensor is slow: nothing of it is known to the program."""
    plane = Plane.uniform(0.0, 1.5, 40)
    i, j = plane.cell_indices
    mass = (0.3 + np.exp(-(((i - j) / 40 - 0.2) ** 2) / 0.02)) * plane.areas
    static = Preisach(plane, 7.0 * mass / mass.sum() / plane.areas, 7.0)
    y = Extended.of(static, [("output-lag", (lag_s,))])(u, 1.0 / RATE_HZ)
    return y + 0.02 * np.random.default_rng(u.size).standard_normal(u.size)


def _write(folder, name, u, y, *, t=None, units=("A", "N")):
    """Write a table and import it as a run."""
    t = np.arange(u.size) / RATE_HZ if t is None else t
    table = "\n".join(f"{a:.5f},{b:.6f},{c:.6f}" for a, b, c in zip(t, u, y, strict=True))
    (folder / f"{name}.csv").write_text(f"t_s,u,y\n{table}\n")
    words = ["--time", "t_s", "--input", "u", "--output", "y"]
    units = ["--input-unit", units[0], "--output-unit", units[1]]
    done = pulsetrainer(folder, "import", f"{name}.csv", *words, *units, "-o", f"{name}.h5")
    assert done.code == 0, done


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A folder with a diagnostic run and the model of the device."""
    folder = tmp_path_factory.mktemp("diagnose")
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    _write(folder, "diagnostic", u, _device(u))
    slow = excitations.identification(0.0, 1.5, n_h=16, speed=ONE_SPEED, rate_Hz=RATE_HZ).value
    _write(folder, "slow", slow, _device(slow))
    done = pulsetrainer(folder, "identify", "slow.h5", "-o", "model.h5", "--levels", "32")
    assert done.code == 0, done
    return folder


def _diagnose(folder, *runs, model="model.h5", out="diagnosis.h5", more=()):
    return pulsetrainer(
        folder, "diagnose", *runs, "--model", model, "-o", out, "--overwrite", "--json", *more
    )


def test_a_device_connected_the_other_way_round_is_told_as_such(bench):
    """Its output falls where the model's rises: no velocity, no extension, but identify again."""
    u = excitations.identification(0.0, 1.5, n_h=16, speed=ONE_SPEED, rate_Hz=RATE_HZ).value
    _write(bench, "reversed", u, 9.0 - _device(u))
    done = _diagnose(bench, "reversed.h5", out="reversed-diagnosis.h5", more=("--quick",))
    assert done.code == 0, done
    assert done.json["verdict"] == "condition-change"
    tells(done.json["evidence"][0], "reversed")
    assert done.json["causes"][0]["parameters"]["gain"]["value"] == pytest.approx(-2.0, abs=0.05)


@pytest.mark.slow
def test_a_slow_sensor_is_named_extended_and_gains_on_a_run_never_fitted(bench):
    """The name, the constant within its interval, and half the error gone at another rate."""
    done = _diagnose(bench, "diagnostic.h5", more=["--html", "diagnosis.html"])
    assert done.code == 0, done
    assert done.json["schema"] == 1
    assert done.json["verdict"] == "output-lag"
    first = done.json["causes"][0]
    low, high = first["parameters"]["tau"]["interval"]
    assert low <= LAG_S <= high
    assert first["parameters"]["tau"]["value"] == pytest.approx(LAG_S, rel=0.05)
    page = (bench / "diagnosis.html").read_text(encoding="utf-8")
    for words in ('data-verdict="output-lag"', "What to do next"):
        assert words in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    done = pulsetrainer(bench, "extend", "diagnosis.h5", "--model", "model.h5", "-o", "extended.h5")
    assert done.code == 0, done
    fresh = excitations.identification(0.0, 1.5, n_h=12, speed=8.0, rate_Hz=RATE_HZ).value
    _write(bench, "fresh", fresh, _device(fresh))
    models = ["--model", "model.h5", "--model", "extended.h5"]
    done = pulsetrainer(bench, "evaluate", "fresh.h5", *models, "--json")
    assert "was made with" not in done.err
    plain, extended = done.json["models"]
    assert plain["gain_percent"] == 0.0
    assert extended["gain_percent"] > 50.0
    assert extended["rms"] < 0.5 * plain["rms"]
    words = ("extend", "diagnosis.h5", "--model", "model.h5", "--json", "--verify")
    done = pulsetrainer(bench, *words, "fresh.h5", "-o", "verified.h5")
    assert done.json["verified"]["with_percent"] == pytest.approx(extended["rms_percent"])
    assert done.json["verified"]["without_percent"] == pytest.approx(plain["rms_percent"])
    assert "identified from" not in done.err
    done = pulsetrainer(bench, *words, "slow.h5", "-o", "seen.h5")
    tells(done.err, "seen before")
    done = pulsetrainer(bench, *words, "model.h5", "-o", "never.h5")  # by model.h5 nothing is verified
    assert done.code == 3
    assert "model.h5 (--verify) is a model, expected a run\n" in done.err
    assert "used neither to identify model.h5 nor for the diagnosis" in done.json["error"]["hint"]
    done = pulsetrainer(bench, "evaluate", "diagnostic.h5", *models)  # which proves nothing
    assert "extended.h5 was made with diagnostic.h5" in done.err
    assert " model.h5 was made with" not in done.err


def test_a_quick_look_repeats_what_the_model_says_of_itself(bench):
    """A step of twelve newtons was found with a model that describes nothing."""
    model = pt.load(bench / "model.h5")
    pt.save(replace(model, fit=replace(model.fit, warning="No static form fits.")), bench / "poor.h5")
    done = _diagnose(bench, "diagnostic.h5", model="poor.h5", out="poor-quick.h5", more=["--quick"])
    assert "note: poor.h5: No static form fits." in done.err


def test_quick_says_that_it_is_quick(bench):
    """Marked in the answer, and nothing to extend by; the next step is the full diagnosis."""
    done = _diagnose(bench, "diagnostic.h5", out="quick.h5", more=["--quick"])
    assert done.json["quick"] is True
    full = "pulsetrainer diagnose diagnostic.h5 --model model.h5 -o quick-full.h5"
    assert done.json["next_commands"] == [full]
    done = pulsetrainer(bench, "extend", "quick.h5", "--model", "model.h5", "-o", "no.h5")
    assert done.code == 3
    assert "without --quick: pulsetrainer diagnose diagnostic.h5 --model model.h5" in done.err


@pytest.mark.slow
def test_one_single_rate_without_holds_gives_a_set_and_the_next_experiment(bench):
    """A lag and a model fitted at one rate: no unique name, what is missing, what to record."""
    done = _diagnose(bench, "slow.h5")
    assert done.code == 0, done
    assert {"rates", "holds"} <= set(done.json["lacks"])
    assert "between 0 A and 1.5 A" in done.json["next_experiment"]  # imported: in numbers of the user's bench
    for cause in done.json["causes"]:
        if cause["found"] and cause["id"] in ("delay", "output-lag", "field-lag", "viscous", "rate-widening"):
            assert cause["confounded_with"], cause


def test_a_short_record_says_so(bench):
    """Six seconds: an answer that names the shortness; half a second: none."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value[: round(6 * RATE_HZ)]
    _write(bench, "short", u, _device(u))
    done = _diagnose(bench, "short.h5")
    assert done.code == 0, done
    assert "length" in done.json["lacks"]
    named = [c for c in done.json["causes"] if c["found"] and c["id"] != "output-lag"]
    assert all(c["confounded_with"] for c in named), named
    _write(bench, "tiny", u[:50], _device(u[:50]))
    done = _diagnose(bench, "tiny.h5")
    assert done.code == 3
    assert "tiny.h5 has only 50 samples" in done.json["error"]["message"]


def test_a_model_of_another_range_is_refused(bench):
    """Most of the input beyond what was identified."""
    u = 10.0 + 5.0 * excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    _write(bench, "other", u, _device(u / 5.0 - 2.0))
    done = _diagnose(bench, "other.h5")
    assert done.code == 3
    assert "outside the range of model.h5" in done.json["error"]["message"]


def test_other_units_are_refused(bench):
    """Of the model, and of a second run."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    _write(bench, "milli", 1e3 * u, _device(u), units=("mA", "N"))
    for runs in (("milli.h5",), ("diagnostic.h5", "milli.h5")):
        done = _diagnose(bench, *runs)
        assert done.code == 3
        message = done.json["error"]["message"]
        assert "milli.h5 is in mA and N" in message
        assert "A and N" in message


@pytest.mark.slow
def test_gaps_are_left_out_and_a_record_of_gaps_is_refused(bench):
    """Three holes in the middle of a record change no verdict; a tenth of the samples is no record."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    y, t = _device(u), np.arange(u.size) / RATE_HZ
    kept = np.ones(u.size, dtype=bool)
    for begin in (1500, 4000, 7000):
        kept[begin : begin + 150] = False
    _write(bench, "gaps", u[kept], y[kept], t=t[kept])
    done = _diagnose(bench, "gaps.h5")
    assert done.code == 0, done
    assert done.json["verdict"] == "output-lag"
    few = np.flatnonzero(np.arange(u.size) % 500 < 50)
    _write(bench, "holes", u[few], y[few], t=t[few])
    done = _diagnose(bench, "holes.h5")
    assert done.code == 3
    assert "gaps" in done.json["error"]["message"]


@pytest.mark.parametrize("constant", ["input", "output"])
def test_what_does_not_vary_is_an_error(bench, constant):
    """A resting device tells nothing."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    flat = np.full_like(u, 0.7)
    _write(bench, constant, flat if constant == "input" else u, flat if constant == "output" else _device(u))
    done = _diagnose(bench, f"{constant}.h5")
    assert done.code == 3
    assert f"the {constant} does not vary" in done.json["error"]["message"]


def test_the_wrong_files_are_named(bench):
    """A model where a run belongs; a diagnosis of another model."""
    done = _diagnose(bench, "model.h5")
    assert done.code == 3
    assert "expected a run, got a model" in done.json["error"]["message"]
    shutil.copy(bench / "model.h5", bench / "same.h5")
    done = _diagnose(bench, "diagnostic.h5", model="nowhere.h5")
    assert done.code in (2, 3)
    assert "nowhere.h5" in json.dumps(done.json["error"])


@pytest.mark.timeout(600)
@pytest.mark.slow
def test_the_as_built_bench_is_told_what_it_hides(extended):
    """Its causes by name without being told, with the truth within the intervals."""
    answer = json.loads((extended / "diagnosis.json").read_text())
    found = {c["id"]: c["parameters"] for c in answer["causes"] if c["found"]}
    assert set(found) == {"field-lag", "creep", "thermal-drift"}
    # the lag relative to the measured current, which its filter makes late by 0.2 ms
    for cause, name, truth in (
        ("field-lag", "tau", 0.0025),
        ("creep", "amplitude", 0.03),
        ("thermal-drift", "coefficient", 0.006),
    ):
        low, high = found[cause][name]["interval"]
        assert low <= truth <= high, (cause, found[cause])


@pytest.mark.timeout(600)
@pytest.mark.slow
def test_the_extended_model_tracks_and_predicts_better(extended):
    """88 % less mean error and at most 3 % on both pulses; 40 % less on a run that was never fitted."""
    played = [f"played-{name}-extended.h5" for name in ("normal", "bifid")]
    for figures in pulsetrainer(extended, "evaluate", *played, "--json").json["waveforms"]:
        assert figures["inversion"] == "extended"
        assert figures["mean_error_reduction_percent"] >= 88.0, figures
        assert figures["compensated"]["max_abs_error_percent"] <= 3.0, figures
    assert pulsetrainer(extended, "capture", "identification", "--speed", "6", "-o", "fresh.h5").code == 0
    models = ["--model", "model-continuous.h5", "--model", "model-extended.h5"]
    compared = pulsetrainer(extended, "evaluate", "fresh.h5", *models, "--json").json["models"]
    assert compared[1]["gain_percent"] > 40.0
