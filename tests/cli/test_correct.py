"""The command `correct`: what it says and writes, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pulsetrainer as pt
from program import pulsetrainer
from pulsetrainer.artefacts import Cause, Diagnosis, Parameter, Recorded
from pulsetrainer.cli.diagnose import next_commands


def _diagnosis(run: pt.Run, verdict: str, causes: tuple[Cause, ...]) -> Diagnosis:
    lists = (causes, (), "", ())
    told = Diagnosis(verdict, False, *[0.0] * 6, *lists, *[np.empty(0)] * 5)
    return replace(
        told, records=(Recorded(run.fingerprint, 0.01),), correctable=tuple(c.cause for c in causes)
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run with a drift and five wild samples, its diagnosis; another run; one that found nothing."""
    path = tmp_path_factory.mktemp("correct")
    t = np.arange(2000) / 100
    u = 0.5 - 0.5 * np.cos(t)
    y = u**2 + 0.001 * np.random.default_rng(1).standard_normal(t.size)
    spoilt = y + 0.01 * t
    spoilt[100:600:100] += 3.0
    run = pt.Run(time_s=t, input=u, output=spoilt)
    drift = Cause("offset-drift", True, 0.005, 90.0, 90.0, (Parameter("rate", 0.01, "N/s", 0.009, 0.011),))
    wild = Cause("outliers", True, None, 0.0, 0.0, (Parameter("size", 3.0, "N", 3.0, 3.0),))
    pt.save(run, path / "run.h5")
    pt.save(replace(run, output=y), path / "other.h5")
    pt.save(_diagnosis(run, "offset-drift", (drift, wild)), path / "diagnosis.h5")
    pt.save(_diagnosis(run, "none", ()), path / "none.h5")
    return path


def test_it_says_what_was_corrected_and_masks_the_rest(folder):
    """The ids, the number of samples left out, and the run itself."""
    words = ("correct", "run.h5", "--diagnosis", "diagnosis.h5", "-o", "corrected.h5", "--json")
    done = pulsetrainer(folder, *words)
    assert done.code == 0, done
    assert done.json["corrected"] == ["outliers", "offset-drift"]
    assert done.json["masked_samples"] == 5
    said = pulsetrainer(folder, *words[:-1], "--overwrite")
    assert "largest change    0.2 N, beside the samples left out" in said.out, (
        said
    )  # the drift's, not the wild samples' 3
    assert ", filled in between their neighbours" in said.out
    assert "a run that the model is tested on may have the same fault" in said.err
    corrected, clean = pt.load(folder / "corrected.h5"), pt.load(folder / "other.h5")
    assert np.flatnonzero(corrected.masked).tolist() == [100, 200, 300, 400, 500]
    np.testing.assert_allclose(corrected.output, clean.output, atol=0.01)
    fitted = pulsetrainer(folder, "identify", "corrected.h5", "--levels", "12", "-o", "m.h5", "--json")
    assert fitted.json["masked_samples"] >= 5


def test_it_says_how_far_the_input_moved(folder):
    """`correct` of a slow thermometer said "taken out: nothing", and that the output was left as it was."""
    run = pt.load(folder / "other.h5")
    slow = Cause("input-lag", True, 0.005, 90.0, 90.0, (Parameter("tau", 0.1, "s", 0.09, 0.11),))
    pt.save(_diagnosis(run, "input-lag", (slow,)), folder / "slow.h5")
    words = ("correct", "other.h5", "--diagnosis", "slow.h5", "-o", "sharp.h5")
    said = pulsetrainer(folder, *words)
    assert "taken out              input-lag" in said.out, said
    assert "largest change, input  0.05 A" in said.out  # 0.1 s at 0.5 A/s
    assert "left as it was" not in said.err
    assert pulsetrainer(folder, *words, "--overwrite", "--json").json["corrected"] == ["input-lag"]


def test_where_nothing_tells_what_lies_between_steps_that_is_said(folder):
    """Noise as large as they are averages them out."""
    run = pt.load(folder / "other.h5")
    noisy = run.output + 0.02 * np.random.default_rng(2).standard_normal(run.output.size)
    stepped = replace(run, output=0.02 * np.round(noisy / 0.02))
    cause = Cause("quantisation", True, None, 0.0, 0.0, (Parameter("size", 0.02, "N", 0.02, 0.02),))
    pt.save(stepped, folder / "stepped.h5")
    pt.save(_diagnosis(stepped, "quantisation", (cause,)), folder / "steps.h5")
    words = ("correct", "stepped.h5", "--diagnosis", "steps.h5", "-o", "unchanged.h5")
    done = pulsetrainer(folder, *words)
    assert done.code == 0, done
    assert "the output is left as it was" in done.err
    assert pulsetrainer(folder, *words, "--overwrite", "--json").json["corrected"] == []
    np.testing.assert_array_equal(pt.load(folder / "unchanged.h5").output, stepped.output)


def test_a_step_of_another_recording_takes_nothing_out_of_this_one(folder):
    """Nor is a word said of coarse steps between which something may lie."""
    run = pt.load(folder / "other.h5")
    numbers = (("offset", 4.0, "N"), ("gain", 0.6, "1"), ("time", 50.0, "s"))  # the run lasts 20 s
    step = Cause("step", True, 0.005, 9.0, 9.0, tuple(Parameter(n, v, unit, v, v) for n, v, unit in numbers))
    pt.save(replace(_diagnosis(run, "step", (step,)), empty=0.0), folder / "later.h5")
    done = pulsetrainer(folder, "correct", "other.h5", "--diagnosis", "later.h5", "-o", "same.h5")
    assert done.code == 0, done
    assert "what was found lies wholly outside this run" in done.err
    assert "between the steps" not in done.err
    assert "taken out         nothing" in done.out
    assert "largest change" not in done.out


def test_a_fault_in_doubt_is_left_in(folder):
    """A step that was found, but predicts worse or may be nothing, changes no sample; the rest is said."""
    told = pt.load(folder / "diagnosis.h5")
    numbers = (("offset", 4.0, "N"), ("gain", 0.6, ""), ("time", 2.0, "s"))
    step = Cause(
        "step", True, 0.005, 9.0, -90.0, tuple(Parameter(n, v, unit, -v, v) for n, v, unit in numbers)
    )
    pt.save(replace(told, causes=(*told.causes, replace(step, doubts=("worse",)))), folder / "doubt.h5")
    done = pulsetrainer(folder, "correct", "run.h5", "--diagnosis", "doubt.h5", "-o", "left.h5")
    assert done.code == 0, done
    assert "largest change" in done.out
    run, known = pt.load(folder / "run.h5"), pt.load(folder / "diagnosis.h5")
    np.testing.assert_array_equal(pt.load(folder / "left.h5").output, pt.correct(run, known).output)


@pytest.mark.parametrize(
    ("run", "diagnosis", "words"),
    [
        ("other.h5", "diagnosis.h5", "diagnosis.h5 is not a diagnosis of other.h5"),
        ("run.h5", "none.h5", "there is nothing to correct"),
    ],
)
def test_what_cannot_be_corrected_is_refused_and_nothing_is_written(folder, run, diagnosis, words):
    """A diagnosis of another run; a verdict with nothing to take out."""
    done = pulsetrainer(folder, "correct", run, "--diagnosis", diagnosis, "-o", "no.h5", "--json")
    assert done.code == 3
    assert words in done.json["error"]["message"]
    assert done.json["error"]["hint"]
    assert not list(folder.glob("no.h5*"))


def test_the_advice_names_the_model_that_was_diagnosed(folder):
    """Copied, it ended with: model.h5 does not exist."""
    for words in (
        ("identify", "other.h5", "--levels", 12, "-o", "mine.h5"),
        ("diagnose", "other.h5", "--model", "mine.h5", "--quick", "-o", "quick.h5"),
    ):
        assert pulsetrainer(folder, *words).code == 0
    done = pulsetrainer(folder, "correct", "other.h5", "--diagnosis", "quick.h5", "-o", "no.h5", "--json")
    assert done.code == 3
    assert "--model mine.h5" in done.json["error"]["hint"]


def test_extend_points_at_correct(folder):
    """Where only the measurement is at fault."""
    model = pt.identify(pt.load(folder / "other.h5"), levels=12)
    pt.save(model, folder / "model.h5", overwrite=True)
    done = pulsetrainer(folder, "extend", "diagnosis.h5", "--model", "model.h5", "-o", "no.h5", "--json")
    assert done.code == 3
    assert "pulsetrainer correct" in done.json["error"]["hint"]


def test_a_diagnosis_that_extends_the_model_sends_no_one_to_correct(folder):
    """The drift is out of the extended model; without one, the run is corrected and fitted anew."""
    model = pt.Model(np.linspace(0.0, 1.0, 3), np.ones(3), 0.0, np.ones(3, bool))
    found = replace(pt.load(folder / "diagnosis.h5"), verdict="creep", extended=model)
    fault, nothing = replace(found, extended=None), replace(found, extended=None, correctable=())

    def commands(one: Diagnosis, name: str = "a.h5", *, own: bool = True) -> list[str]:
        return next_commands(one, [Path("r.h5")], Path(name), Path("d.h5"), own=own)

    assert [[line.split()[1] for line in commands(one)] for one in (found, fault, nothing)] == [
        ["extend"],
        ["correct", "identify", "diagnose"],
        [],
    ]
    changed = replace(nothing, verdict="condition-change", records=found.records[:1])
    assert commands(changed) == commands(changed, own=False)
    assert [line.split()[1] for line in commands(changed)] == ["identify", "diagnose"]
    assert commands(replace(changed, records=2 * changed.records)) == []  # some may be those of the model
    for name, again in (("a", "a-corrected"), ("a-corrected", "a-corrected-2")):  # a second round, too
        assert commands(fault, f"{name}.h5")[1] == f"pulsetrainer identify r-corrected.h5 -o {again}.h5"
    assert commands(fault, own=False)[1:] == [
        "pulsetrainer diagnose r-corrected.h5 --model a.h5 -o d-corrected.h5"
    ]


def test_the_way_on_overwrites_nothing(folder, tmp_path, monkeypatch):
    """It always said extended.h5, and was refused where that was there already."""
    model = pt.Model(np.linspace(0.0, 1.0, 3), np.ones(3), 0.0, np.ones(3, bool))
    fault = pt.load(folder / "diagnosis.h5")
    monkeypatch.chdir(tmp_path)
    for name in ("extended.h5", "r-corrected.h5", "a-corrected.h5"):
        (tmp_path / name).touch()
    good, run, page = replace(fault, verdict="creep", extended=model), Path("r.h5"), Path("d-corrected.html")
    for name, last in (
        ("model", "extended-2"),
        ("a-model", "a-extended"),
        ("a", "a-extended"),
        ("extended", "extended-2"),
    ):
        (extend,) = next_commands(good, [run], Path(f"{name}.h5"), Path("d.h5"), own=True)
        assert extend.endswith(f"-o {last}.h5")
    bad = replace(fault, extended=None)
    lines = next_commands(bad, [run], Path("a.h5"), Path("d.h5"), own=True)
    assert [line.count("r-corrected-2.h5") for line in lines] == [1, 1, 1]
    # a second round does not add to the names, and makes a report where the first one did
    run, made = Path("r-corrected.h5"), Path("d-corrected.h5")
    again = next_commands(bad, [run], Path("a-corrected.h5"), made, own=True, html=page)
    assert again == [
        f"pulsetrainer correct {run} --diagnosis {made} -o r-corrected-2.h5",
        "pulsetrainer identify r-corrected-2.h5 -o a-corrected-2.h5",
        (
            "pulsetrainer diagnose r-corrected-2.h5 --model a-corrected-2.h5 -o d-corrected-2.h5 "
            "--html d-corrected-2.html"
        ),
    ]


def test_a_model_of_the_run_before_it_was_corrected_is_told(folder):
    """It holds what was taken out, which looked like another condition of the device."""
    for words in (
        ("correct", "run.h5", "--diagnosis", "diagnosis.h5", "-o", "sound.h5"),
        ("identify", "run.h5", "--levels", 12, "-o", "before.h5"),
        ("identify", "sound.h5", "--levels", 12, "-o", "after.h5"),
    ):
        assert pulsetrainer(folder, *words).code == 0
    said = [
        pulsetrainer(folder, "diagnose", "sound.h5", "--model", name, "--quick", "-o", f"of-{name}").err
        for name in ("before.h5", "after.h5")
    ]
    assert ["so it holds what was taken out" in one for one in said] == [True, False]


def test_the_way_on_names_the_diagnosis_that_was_given(folder):
    """Not one that stands for it."""
    plane = np.linspace(0.0, 1.0, 3)
    model = pt.Model(plane, np.ones(3), 0.0, np.ones(3, bool))
    pt.save(replace(pt.load(folder / "none.h5"), extended=model), folder / "not at fault.h5")
    done = pulsetrainer(folder, "correct", "run.h5", "--diagnosis", "not at fault.h5", "-o", "x.h5", "--json")
    assert done.code == 3
    assert "extend 'not at fault.h5' --model" in done.json["error"]["hint"]


@pytest.mark.parametrize(("delay", "long"), [("5", True), ("0.05", False)])
def test_a_delay_in_milliseconds_is_noticed(folder, delay, long):
    """Five seconds of a run of twenty were taken out without a word."""
    done = pulsetrainer(folder, "correct", "other.h5", "--delay", delay, "-o", f"late-{delay}.h5")
    assert ("--delay is in seconds: 5 ms are --delay 0.005" in " ".join(done.err.split())) is long
