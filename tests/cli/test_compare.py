"""Evaluations side by side: as a table, as JSON, as a file."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pulsetrainer as pt
from program import pulsetrainer
from pulsetrainer.artefacts import Beats, ModelEvaluation, Quiz, Session
from wording import refusal

KEPT = Path(__file__).resolve().parents[1] / "data" / "files-0.1"


@pytest.fixture
def folder(built_small, run):
    """Run in the tests' own folder with the evaluations of the paper's and our method."""

    def call(*words):
        return run(
            "compare", built_small / "evaluation-relay.h5", built_small / "evaluation-continuous.h5", *words
        )

    return call


def test_before_and_after(folder, built_small):
    """The values are those of the evaluations; the change has the right sign and word."""
    import json

    done = folder("--json")
    assert done.code == 0, done
    before, after = (
        json.loads((built_small / f"{name}.json").read_text()) for name in ("relay", "continuous")
    )
    metrics = {m["name"]: m for m in done.json["metrics"]}
    for k, pulse in enumerate(("normal", "bifid")):
        one = metrics[f"{pulse}.mean_error_reduction_percent"]
        wanted = [d["waveforms"][k]["mean_error_reduction_percent"] for d in (before, after)]
        assert one["values"] == pytest.approx(wanted)
        assert one["change"] == pytest.approx(wanted[1] - wanted[0])
        assert one["better"] is True
        worst = metrics[f"{pulse}.compensated.max_abs_error_percent"]
        assert worst["better"] is True
        assert worst["change"] < 0
    assert len(folder("--json", "--all").json["metrics"]) > len(metrics)


def test_as_text(folder):
    """A row for each figure, and the word for the change."""
    done = folder()
    assert done.code == 0
    changed = {one["name"]: one["change"] for one in folder("--json").json["metrics"]}
    (row,) = (line for line in done.out.splitlines() if "normal: reduction" in line)
    assert f"{changed['normal.mean_error_reduction_percent']:+.2f}" in row.split()
    assert row.split()[-1] == "better"
    assert "worse" not in done.out


def test_as_figure_and_as_table(folder, tmp_path):
    """PNG and SVG are pictures; CSV can be read back; what exists is not replaced."""
    assert folder("-o", tmp_path / "c.png").code == 0
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")
    assert folder("-o", tmp_path / "c.svg").code == 0
    assert b"<svg" in (tmp_path / "c.svg").read_bytes()
    assert folder("-o", tmp_path / "c.csv").code == 0
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "file"
    metrics = {one["name"]: one["values"] for one in folder("--json").json["metrics"]}
    assert rows[0][1:] == list(metrics)
    assert [list(map(float, row[1:])) for row in rows[1:]] == [
        pytest.approx([values[k] for values in metrics.values()]) for k in range(2)
    ]
    assert folder("-o", tmp_path / "c.csv").code == 2
    assert folder("-o", tmp_path / "c.docx").code == 2


def test_bad_input(run, built_small):
    """One file, a file of another kind: each its message."""
    refusal(run("compare", built_small / "evaluation-relay.h5", "--json"), 2, "one evaluation")
    done = run("compare", built_small / "evaluation-relay.h5", built_small / "run.h5", "--json")
    names = {"file": "run.h5", "expected": "an evaluation", "got": "a run", "verb": "evaluate"}
    refusal(done, 3, "wrong kind", **names)


def test_a_file_beside_itself_or_a_copy_is_told(run, built_small, tmp_path):
    """No difference is not a finding then."""
    one, other = (built_small / f"evaluation-{name}.h5" for name in ("relay", "continuous"))
    copy = tmp_path / "copy.h5"
    copy.write_bytes(one.read_bytes())
    for files, told in (((one, one), True), ((other, one, copy), True), ((one, other), False)):
        done = run("compare", *files)
        assert done.code == 0
        assert ("are the same file" in done.err) is told
    models = ("--model", KEPT / "model.h5") * 2
    assert "are the same file" in run("evaluate", KEPT / "run.h5", *models).err


def _predicted(unit: str, rms: float, offset: float = 0.0) -> pt.Evaluation:
    y = rms * np.ones(3)
    return pt.Evaluation(models=(ModelEvaluation("m.h5", rms, 2.0, 5.0, 0.0, None, y, y, unit, offset),))


def test_figures_in_different_units_are_not_compared(tmp_path):
    """They stand beside each other with their units, without change or verdict; percentages have them."""
    for name, one in (("force", _predicted("N", 0.2)), ("field", _predicted("T", 0.01))):
        pt.save(one, tmp_path / f"{name}.h5")
    files = ("force.h5", "field.h5", "--all")
    done = pulsetrainer(tmp_path, "compare", *files)
    (row,) = (line for line in done.out.splitlines() if "model: rms error " in line and "0.01" in line)
    assert row.split()[3:] == ["0.20", "N", "0.0100", "T", "-"]
    assert "force.h5 is in N, field.h5 is in T" in done.err
    found = {m["name"]: m for m in pulsetrainer(tmp_path, "compare", *files, "--json").json["metrics"]}
    assert [found[f"model.{name}"]["change"] for name in ("rms", "offset", "rms_percent")] == [
        None,
        None,
        0.0,
    ]
    assert [m["better"] for m in found.values()] == [None] * len(found)


def test_figures_in_one_small_unit_are_compared(tmp_path):
    """Their unit is told, a change of half is one, and a zero that lies closer is better on either side."""
    for name, one in (("old", _predicted("T", 0.004, -0.003)), ("new", _predicted("T", 0.002, -0.001))):
        pt.save(one, tmp_path / f"{name}.h5")
    done = pulsetrainer(tmp_path, "compare", "old.h5", "new.h5", "--all")
    rows = {line.split()[1]: line.split() for line in done.out.splitlines() if " T " in line}
    assert rows["rms"][3:] == ["T", "0.00400", "0.00200", "-0.00200", "better"]
    assert rows["offset"][2:] == ["T", "-0.00300", "-0.00100", "+0.00200", "better"]


def test_two_evaluations_without_a_common_figure(run, built_small, tmp_path):
    """A pulse against a prediction: nothing to compare, said so."""
    model = built_small / "model-continuous.h5"
    assert run("evaluate", built_small / "run.h5", "--model", model, "-o", tmp_path / "fit.h5").code == 0
    done = run("compare", tmp_path / "fit.h5", built_small / "evaluation-relay.h5", "--json")
    refusal(done, 3, "nothing in common")


def _session() -> Session:
    time, two = np.arange(40) / 1000, np.ones(2)
    beats = Beats(np.array([0.0, 0.02]), 0.02 * two, np.array([0, 1]), *(two,) * 5)
    asked = Quiz(("normal", "bifid"), ("normal", "bifid"), ("bifid", "bifid"), two)
    arrays = (np.ones(40),) * 4
    return Session(time, *arrays, beats, ("normal", "bifid"), *(1.0,) * 8, mean_force=1.0, quiz=asked)


def test_learners_side_by_side(tmp_path):
    """Share right with its interval, how true the pulses were; sessions do not mix with evaluations."""
    quiz = pt.load(KEPT / "evaluation.h5")
    plain = _session()
    better = replace(plain, quiz=replace(plain.quiz, answered=plain.quiz.asked))
    for name, artefact in (("anna", plain), ("ben", better), ("other", quiz)):
        pt.save(artefact, tmp_path / f"{name}.h5")
    done = pulsetrainer(tmp_path, "compare", "anna.h5", "ben.h5", "--json")
    assert done.code == 0, done.err
    found = {m["name"]: m for m in done.json["metrics"]}
    assert found["quiz.right_percent"]["values"] == [50.0, 100.0]
    assert found["quiz.right_percent"]["better"] is True
    low, high = (found[f"quiz.right_{end}_percent"]["values"][0] for end in ("from", "to"))
    assert low < 50.0 < high
    assert found["session.pressed.mean_abs_error_percent"]["values"] == [1.0, 1.0]
    assert "difference" in pulsetrainer(tmp_path, "compare", "anna.h5", "ben.h5").out
    pt.save(plain, tmp_path / "cleo.h5")
    assert "difference" not in pulsetrainer(tmp_path, "compare", "anna.h5", "ben.h5", "cleo.h5").out
    assert pulsetrainer(tmp_path, "compare", "anna.h5", "other.h5").code == 3
    refusal(pulsetrainer(tmp_path, "evaluate", "anna.h5", "ben.h5", "--json"), 2, "two sessions at once")
    whole = pulsetrainer(tmp_path, "evaluate", "anna.h5.partial")
    assert "it was not cut off: anna.h5 is whole" in whole.err
    for name in ("carl", "dora"):
        pt.save(replace(plain, quiz=None), tmp_path / f"{name}.h5")
    done = pulsetrainer(tmp_path, "compare", "carl.h5", "dora.h5", "-o", "pressed.svg")
    assert done.code == 0, done.err
