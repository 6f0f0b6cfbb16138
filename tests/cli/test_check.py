"""``check`` from the command line: its figures, its update, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.artefacts import Extension, Parameter
from wording import refusal, tells

KEYS = {"verdict", "offset", "gain", "shape_percent", "temperature_K", "error_percent"}


@pytest.fixture(scope="module")
def calibrated(made_once):
    """A folder with a model of the as-built bench."""

    def fill(folder):
        from program import pulsetrainer

        for words in (
            ("capture", "identification", "--levels", 24, "--speed", 2, "-o", "run.h5"),
            ("identify", "run.h5", "--levels", 24, "-o", "model.h5"),
        ):
            done = pulsetrainer(folder, *words)
            assert done.code == 0, done.err

    return made_once("calibrated", fill)


def test_the_contract_and_the_update(run, calibrated, tmp_path):
    """Every key, each value with its interval; what is written is true of the device as it is now."""
    port = "bench:?condition-offset=0.3&noise-seed=4"
    done = run("check", calibrated / "model.h5", "--port", port, "--update", "-o", "updated.h5", "--json")
    assert done.code == 0, done.err
    assert set(done.json) >= KEYS
    assert done.json["verdict"] == "shifted"
    for name in ("offset", "gain", "shape_percent", "temperature_K"):
        assert set(done.json[name]) == {"value", "interval"}
    assert done.json["error_percent"]["after"] < 0.5 * done.json["error_percent"]["before"]
    before, after = pt.load(calibrated / "model.h5"), pt.load(tmp_path / "updated.h5")
    assert after.predict([0.0, 1.0]) == pytest.approx(before.predict([0.0, 1.0]) + 0.3, abs=0.15)
    again = run("check", "updated.h5", "--port", port, "--json")
    assert again.json["verdict"] == "true"


@pytest.mark.parametrize(("offset", "better"), [(0.3, "updated.h5"), (0.0, "model.h5")])
def test_it_is_said_which_model_to_use_after_an_update(run, calibrated, offset, better):
    """The updated one where something moved; where nothing did, the one that there was."""
    port = f"bench:?condition-offset={offset}&noise-seed=4"
    done = run("check", calibrated / "model.h5", "--port", port, "--update", "-o", "updated.h5")
    (row,) = (line for line in done.out.splitlines() if line.startswith("  next "))
    assert row.split()[row.split().index("use" if offset else "with") + 1].strip(":,").endswith(better)


def test_the_update_is_for_the_device_that_was_checked(run, calibrated):
    """Copied, the command went to the usual port."""
    port = "bench:?condition-offset=0.3&noise-seed=4"
    done = run("check", calibrated / "model.h5", "--port", port)
    (row,) = (line for line in done.out.splitlines() if line.startswith("  next "))
    assert row.endswith(f"--update -o updated.h5 --port '{port}'")


def test_a_stronger_force_is_told_by_how_much(run, calibrated):
    """By which share it moved, and what the limit is."""
    done = run("check", calibrated / "model.h5", "--port", "bench:?condition-gain=0.052")
    assert done.code == 0, done.err
    tells(done.out, "stronger")


def test_samples_that_the_wire_lost_count_nowhere(calibrated, monkeypatch):
    """Every turn of the current is lost, and a tenth of the rest: the shape is that of the whole record."""
    model = pt.load(calibrated / "model.h5")
    with pt.open_device("bench:") as device:
        whole = pt.check(model, device)
        play = type(device).play

        def lossy(self, reference, *args, **kwargs):
            trace = play(self, reference, *args, **kwargs)
            turns = np.flatnonzero(np.diff(np.sign(np.diff(reference))))
            away = np.abs(trace.tick[:, None] / 10 - turns).min(axis=1) > 25
            kept = away & (trace.tick // 250 % 10 > 0)
            names = ("tick", "reference_A", "current_A", "force_N", "duty")
            return replace(trace, **{name: getattr(trace, name)[kept] for name in names})

        monkeypatch.setattr(type(device), "play", lossy)
        thinned = pt.check(model, device)
    assert (whole.verdict, thinned.verdict) == ("true", "true")
    assert thinned.shape_percent.value == pytest.approx(whole.shape_percent.value, abs=0.02)


def test_another_device_is_not_updated(run, calibrated, tmp_path):
    """A changed density: exit 3, nothing written; the verdict alone is no error. The limit is told."""
    words = ("check", calibrated / "model.h5", "--port", "bench:?seed=9&serial=0")
    shown = run(*words)
    assert shown.code == 0
    tells(shown.out, "changed")
    refused = run(*words, "--json", "--update", "-o", "updated.h5")
    assert (refused.code, refused.json["error"]["kind"]) == (3, "data")
    assert not (tmp_path / "updated.h5").exists()


def test_the_model_of_another_serial_number_is_refused(run, calibrated, tmp_path):
    """Exit 3 before anything is played, both numbers, nothing written."""
    words = ("check", calibrated / "model.h5", "--port", "bench:?seed=9", "--update", "-o", "updated.h5")
    done = run(*words, "--json")
    assert (done.code, done.json["error"]["kind"]) == (3, "data")
    assert "the device BENCH-0, this is BENCH-9" in done.json["error"]["message"]
    assert list(tmp_path.iterdir()) == []


def test_causes_that_cannot_be_updated_are_refused_before_the_device_is_opened(run, calibrated, tmp_path):
    """Exit 3 with the cause, although no device is there; nothing written."""
    sticking = Extension("stick-slip", (Parameter("jump", 0.3, "N", 0.2, 0.4),))
    model = replace(pt.load(calibrated / "model.h5"), extensions=(sticking,))
    pt.save(model, tmp_path / "sticks.h5")
    words = ("check", "sticks.h5", "--port", "/dev/absent", "--update", "-o", "updated.h5")
    done = run(*words, "--json")
    assert (done.code, done.json["error"]["kind"]) == (3, "data")
    assert "stick-slip" in done.json["error"]["message"]
    assert not (tmp_path / "updated.h5").exists()


def test_a_supply_that_does_not_fit_is_named(run, calibrated):
    """Half the voltage: exit 4, and what to look at."""
    done = run("check", calibrated / "model.h5", "--port", "bench:?supply=6", "--json")
    refusal(done, 4, "another supply", during="conditioning")


def test_a_limit_below_the_models_range_is_named(run, calibrated):
    """It is the limit that is too low, as a check plays the whole range."""
    done = run("check", calibrated / "model.h5", "--limit-current", 0.5, "--json")
    refusal(done, 3, "limit below the model's range", limit="0.5", got="1.5")


@pytest.mark.parametrize("words", [("--update",), ("-o", "updated.h5")])
def test_an_update_has_a_file_and_a_file_an_update(run, calibrated, tmp_path, words):
    """One without the other is a mistake: exit 2."""
    done = run("check", calibrated / "model.h5", *words, "--json")
    assert (done.code, done.json["error"]["kind"]) == (2, "usage")
    assert not list(tmp_path.iterdir())


def test_a_play_tells_the_temperature_in_its_object(run, calibrated, tmp_path):
    """``play --json`` where heat is tracked, as it is by default with a thermal term: a number a repeat."""
    heat = Parameter("coefficient", 0.006, "1/A^2", 0.005, 0.007), Parameter("tau", 20.0, "s", 15.0, 25.0)
    warm = replace(pt.load(calibrated / "model.h5"), extensions=(Extension("thermal-drift", heat),))
    pt.save(pt.invert("normal", warm, periods=2), tmp_path / "drive.h5")
    done = run("play", "drive.h5", "-o", "played.h5", "--repeats", 2, "--json")
    assert done.code == 0, done.err
    assert done.json["temperature_K"] == pytest.approx([0.0, 0.0], abs=2.0)
