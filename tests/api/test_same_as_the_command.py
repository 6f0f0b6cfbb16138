"""Command and function give the same bits: each verb by both ways on the same files."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import pulsetrainer as pt
from program import pulsetrainer
from pulsetrainer.cli.console import plain
from pulsetrainer.diagnosis.causes.frame import low_pass
from pulsetrainer.errors import DataError
from pulsetrainer.steps.check import updated

DATA = Path(__file__).resolve().parents[1] / "data"
KEPT = DATA / "files-0.1"
LOOP, TENDON = "bh_ferrite_mnzn_1.csv", "davinci_f0p5_torque10.csv"


def same(one: object, other: object, where: str = "") -> None:
    """Compare two artefacts field by field, arrays bit by bit."""
    assert type(one) is type(other), where
    if is_dataclass(one):
        for field in fields(one):
            same(getattr(one, field.name), getattr(other, field.name), f"{where}.{field.name}")
    elif isinstance(one, np.ndarray):
        assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), where
    elif isinstance(one, tuple):
        assert len(one) == len(other), where
        for number, pair in enumerate(zip(one, other, strict=True)):
            same(*pair, f"{where}[{number}]")
    else:
        assert one == other or (isinstance(one, float) and np.isnan([one, other]).all()), where


def stored(noun: object, folder: Path) -> object:
    """Return an artefact as its file holds it, where lists of arrays and texts have their stored form."""
    path = folder / "by-function.h5"
    pt.save(noun, path, overwrite=True)
    return pt.load(path)


def by_command(folder: Path, *words: object) -> object:
    """Run a command that writes one file and return what is in it."""
    done = pulsetrainer(folder, *words, "-o", "by-command.h5", "--overwrite")
    assert done.code == 0, done.err
    return pt.load(folder / "by-command.h5")


def test_identify(tmp_path):
    """A run that a device recorded, with intervals."""
    run, words = KEPT / "run.h5", ("--levels", 12, "--bootstrap", 4, "--seed", 3)
    model = pt.identify(pt.load(run), levels=12, bootstrap=4, seed=3, names=["run"])
    same(by_command(tmp_path, "identify", run, *words), stored(model, tmp_path))


@pytest.mark.parametrize("name", [LOOP, pytest.param(TENDON, marks=pytest.mark.slow)])
def test_records_of_other_laboratories(tmp_path, name):
    """Imported, identified, evaluated: a magnetic loop and a tendon."""
    run = pt.read_table(DATA / name, input="u", output="y")
    words = ("import", DATA / name, "--input", "u", "--output", "y")
    same(by_command(tmp_path, *words), stored(run, tmp_path))
    pt.save(run, tmp_path / "run.h5")
    model = pt.identify(run, levels=16, names=["run"])
    same(by_command(tmp_path, "identify", "run.h5", "--levels", 16), stored(model, tmp_path))
    pt.save(model, tmp_path / "model.h5")
    errors = pt.evaluate(run, model, names=["run.h5"], model_names=["model.h5"])
    same(by_command(tmp_path, "evaluate", "run.h5", "--model", "model.h5"), stored(errors, tmp_path))
    found = pt.diagnose(run, model, quick=True, names=["run.h5", "model.h5"])
    words = ("diagnose", "run.h5", "--model", "model.h5", "--quick")
    for seed in ((), ("--seed", 0)):  # the usual one
        same(by_command(tmp_path, *words, *seed), stored(found, tmp_path))
    drive = pt.invert("normal", model, periods=2)
    words = ("invert", "normal", "--model", "model.h5", "--periods", 2)
    same(by_command(tmp_path, *words), stored(drive, tmp_path))


@pytest.mark.slow
def test_causes_of_other_laboratories(tmp_path):
    """A tendon diagnosed whole, the delay of its recorder taken out, and nothing to extend its model by."""
    run = pt.read_table(DATA / TENDON, input="u", output="y")
    pt.save(run, tmp_path / "run.h5")
    model = pt.identify(run, levels=16)
    pt.save(model, tmp_path / "model.h5")
    found = pt.diagnose(run, model, names=["run.h5", "model.h5"])
    same(by_command(tmp_path, "diagnose", "run.h5", "--model", "model.h5"), stored(found, tmp_path))
    pt.save(found, tmp_path / "diagnosis.h5")
    corrected = pt.correct(run, found, delay_s=0.01)
    words = ("correct", "run.h5", "--diagnosis", "diagnosis.h5", "--delay", 0.01)
    same(by_command(tmp_path, *words), stored(corrected, tmp_path))
    with pytest.raises(DataError) as refused:
        pt.extend(model, found, names=["model.h5", "diagnosis.h5"])
    done = pulsetrainer(tmp_path, "extend", "diagnosis.h5", "--model", "model.h5", "-o", "x.h5", "--json")
    assert done.json["error"]["message"] == refused.value.message


@pytest.mark.parametrize("pulse", ["normal", "bifid"])
def test_invert(tmp_path, pulse):
    """A pulse of the library by a static and by an extended model."""
    for name in ("model.h5", "model-extended.h5"):
        drive = pt.invert(pulse, pt.load(KEPT / name), periods=2)
        words = ("invert", pulse, "--model", KEPT / name, "--periods", 2)
        same(by_command(tmp_path, *words), stored(drive, tmp_path))


def test_play_and_evaluate(tmp_path):
    """On two benches that are alike in every bit."""
    drive = pt.load(KEPT / "drive.h5")
    with pt.open_device("bench:?seed=5") as device:
        played = pt.play(drive, device, repeats=1)
    words = ("play", KEPT / "drive.h5", "--repeats", 1, "--port", "bench:?seed=5")
    same(by_command(tmp_path, *words), stored(played, tmp_path))
    pt.save(played, tmp_path / "played.h5")
    errors = pt.evaluate(played, names=["played.h5"])
    same(by_command(tmp_path, "evaluate", "played.h5"), stored(errors, tmp_path))


def test_capture(tmp_path):
    """An excitation, faster than usual."""
    with pt.open_device("bench:?seed=5") as device:
        run = pt.capture("identification", device, levels=6, speed_A_per_s=6.0)
    words = ("capture", "identification", "--levels", 6, "--speed", 6, "--port", "bench:?seed=5")
    same(by_command(tmp_path, *words), stored(run, tmp_path))


@pytest.mark.parametrize("quick", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_diagnose_and_extend(tmp_path, quick):
    """What a screen finds of a slow sensor, what the whole diagnosis finds, and what extends a model."""
    run, model = pt.load(KEPT / "run.h5"), KEPT / "model.h5"
    slow = replace(run, output=low_pass(run.output, 0.03, run.time_s[1] - run.time_s[0]))
    pt.save(slow, tmp_path / "slow.h5")
    found = pt.diagnose([slow], pt.load(model), quick=quick, seed=2, names=["slow.h5", str(model)])
    words = ("diagnose", "slow.h5", "--model", model, "--seed", 2, *(["--quick"] if quick else []))
    same(by_command(tmp_path, *words), stored(found, tmp_path))
    if not quick:
        pt.save(found, tmp_path / "diagnosis.h5")
        extended = pt.extend(pt.load(model), pt.load(tmp_path / "diagnosis.h5"))
        words = ("extend", "diagnosis.h5", "--model", model)
        same(by_command(tmp_path, *words), stored(extended, tmp_path))


def test_refine(tmp_path):
    """On two benches that are alike in every bit."""
    drive = KEPT / "drive.h5"
    with pt.open_device("bench:?seed=5") as device:
        refined = pt.refine(pt.load(drive), device, passes=2)
    words = ("refine", drive, "--passes", 2, "--port", "bench:?seed=5")
    same(by_command(tmp_path, *words), stored(refined, tmp_path))
    model = pt.load(KEPT / "model.h5")
    with pt.open_device("bench:") as device:
        refined = pt.refine(pt.invert("normal", model, periods=2), device, passes=2)
    pt.save(refined, tmp_path / "refined.h5")
    other = pt.transfer(pt.invert("bifid", model), pt.load(tmp_path / "refined.h5"))
    words = ("invert", "bifid", "--model", KEPT / "model.h5", "--learnt", "refined.h5")
    same(by_command(tmp_path, *words), stored(other, tmp_path))


@pytest.mark.slow
def test_correct(tmp_path):
    """A run with a hum of 2 % of its span."""
    run, model = pt.load(KEPT / "run.h5"), KEPT / "model.h5"
    hum = 0.02 * np.ptp(run.output) * np.sin(2 * np.pi * 37.0 * run.time_s)
    pt.save(replace(run, output=run.output + hum), tmp_path / "humming.h5")
    pt.save(pt.diagnose(pt.load(tmp_path / "humming.h5"), pt.load(model)), tmp_path / "diagnosis.h5")
    humming, found = (pt.load(tmp_path / name) for name in ("humming.h5", "diagnosis.h5"))
    assert found.correctable == ("periodic",)
    corrected = pt.correct(humming, found)
    words = ("correct", "humming.h5", "--diagnosis", "diagnosis.h5")
    same(by_command(tmp_path, *words), stored(corrected, tmp_path))


def test_check(tmp_path):
    """A verdict, and the model that it updates, on two benches that are alike in every bit."""
    port = "bench:?seed=5"
    with pt.open_device(port) as device:
        run = pt.capture("identification", device, levels=8, speed_A_per_s=3.0)
    model = pt.identify(run, levels=8)
    pt.save(model, tmp_path / "model.h5")
    with pt.open_device(port) as device:
        checked = pt.check(model, device)
    done = pulsetrainer(tmp_path, "check", "model.h5", "--port", port, "--json")
    assert {name: done.json[name] for name in ("verdict", "offset", "gain", "shape_percent")} == {
        name: plain(getattr(checked, name)) for name in ("verdict", "offset", "gain", "shape_percent")
    }
    words = ("check", "model.h5", "--port", port, "--update")
    same(by_command(tmp_path, *words), stored(updated(model, checked), tmp_path))


def test_tune(tmp_path):
    """The coil and the gains, on two benches that are alike in every bit."""
    with pt.open_device("bench:?seed=5") as device:
        tuned = pt.tune(device)
    done = pulsetrainer(tmp_path, "tune", "--port", "bench:?seed=5", "--json")
    assert done.code == 0, done.err
    assert {name: done.json[name] for name in plain(tuned)} == plain(tuned)


def test_compare(tmp_path):
    """The same figures, and the same words for what became better."""
    evaluation = pt.load(KEPT / "evaluation.h5")
    metrics = pt.compare([evaluation, evaluation])
    done = pulsetrainer(tmp_path, "compare", KEPT / "evaluation.h5", KEPT / "evaluation.h5", "--json")
    assert [m["name"] for m in done.json["metrics"]] == [m.name for m in metrics]
    assert [m["values"] for m in done.json["metrics"]] == [list(m.values) for m in metrics]


def test_session(tmp_path):
    """Pulses with a rhythm, on two benches that are alike in every bit; the learner has the file's name."""
    model = KEPT / "model-extended.h5"
    with pt.open_device("bench:?seed=5") as device:
        pressed = pt.session(
            pt.load(model), device, pulses=["normal", "bifid"], beats=4, variability=5, ectopic=20, seed=2
        )
    words = ("--pulses", "normal,bifid", "--beats", 4, "--variability", 5, "--ectopic", 20, "--seed", 2)
    same(
        by_command(tmp_path, "session", "--model", model, *words, "--port", "bench:?seed=5"),
        stored(pressed, tmp_path),
    )
