"""Files that version 0.1.0 wrote are read: each gives its noun, with the shapes and figures it had."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pulsetrainer.artefacts import KINDS, Diagnosis, Evaluation, Model, Playback, Run, Waveform
from pulsetrainer.files.store import read, read_any, read_header

FOLDER = Path(__file__).resolve().parents[1] / "data" / "files-0.1"
ABOUT = {"rel": 1e-12}
NEWER = {"session"}  # kinds that 0.1.0 did not know


def test_there_is_a_file_of_every_kind():
    """Whatever 0.1.0 could write is tried; every header says that it did."""
    files = sorted(FOLDER.glob("*.h5"))
    assert {read_any(path).kind for path in files} == set(KINDS) - NEWER
    for path in files:
        header = read_header(path)
        assert header.provenance.version == "0.1.0"
        assert header.history
        assert header.created.startswith("2026-11-21T23:4")


def test_runs():
    """A capture, with its reference; an imported table, with its own units."""
    run = read(FOLDER / "run.h5", Run)
    for values in (run.time_s, run.input, run.output, run.reference):
        assert values.shape == (3277,)
    assert run.output.sum() == pytest.approx(23359.149, **ABOUT)
    assert run.reference.sum() == pytest.approx(2067.985, **ABOUT)
    assert (run.complete, run.dropped_samples, run.seam) == (True, 0, None)
    device = read_header(FOLDER / "run.h5").provenance.device
    assert device.serial == "BENCH-0"

    imported = read(FOLDER / "imported.h5", Run)
    assert imported.input.shape == (400,)
    assert (imported.input_unit, imported.output_unit) == ("V", "mm")
    assert imported.reference is None
    assert imported.output.sum() == pytest.approx(21.4035, **ABOUT)


def test_models():
    """The weights, the fit, and what a model was extended by."""
    model = read(FOLDER / "model.h5", Model)
    assert (model.edges.shape, model.weights.shape, model.covered.shape) == ((9,), (36,), (36,))
    assert model.weights.sum() == pytest.approx(277.9277628248693, **ABOUT)
    assert model.offset == pytest.approx(6.377516766121884, **ABOUT)
    assert model.covered.all()
    assert model.reading == "continuous"
    assert model.fit.rms_percent == pytest.approx(0.5342465773107551, **ABOUT)
    assert model.fit.predicted.shape == (3277,)

    extended = read(FOLDER / "model-extended.h5", Model)
    assert extended.weights.shape == (1176,)
    assert [one.cause for one in extended.extensions] == ["field-lag", "thermal-drift", "creep"]
    (tau,) = extended.extensions[0].parameters
    assert (tau.name, tau.unit) == ("tau", "s")
    assert tau.value == pytest.approx(0.002546979526857895, **ABOUT)


def test_a_drive_and_its_playback():
    """The drives, the target, the model behind them; what was measured, repeat by repeat."""
    drive = read(FOLDER / "drive.h5", Waveform)
    assert drive.compensated.shape == drive.scored.shape == (6042,)
    assert drive.compensated.sum() == pytest.approx(2995.066428450634, **ABOUT)
    assert int(drive.scored.sum()) == 3030
    assert drive.name == "pulse"
    assert drive.model.weights.shape == (36,)

    played = read(FOLDER / "played.h5", Playback)
    assert played.compensated.output.shape == (1, 6042)
    assert played.compensated.output.sum() == pytest.approx(32398.951, **ABOUT)
    assert played.scaled.input.sum() == pytest.approx(3000.1465, **ABOUT)
    np.testing.assert_array_equal(played.waveform.target, drive.target)


def test_evaluations():
    """Of a played waveform, and of a model on a run."""
    (waveform,) = read(FOLDER / "evaluation.h5", Evaluation).waveforms
    assert waveform.compensated.mean_abs_error_percent == pytest.approx(0.4562923925027507, **ABOUT)
    assert waveform.scaled.mean_abs_error_percent == pytest.approx(9.831002328369559, **ABOUT)
    assert waveform.mean_error_reduction_percent == pytest.approx(95.35863814022282, **ABOUT)
    assert waveform.target.shape == (3030,)

    (model,) = read(FOLDER / "evaluation-run.h5", Evaluation).models
    assert model.name == "model.h5"
    assert model.rms_percent == pytest.approx(0.5342465773107551, **ABOUT)
    assert model.predicted.shape == (3277,)


def test_a_diagnosis():
    """The verdict, every cause that was tried, and the record before and after."""
    found = read(FOLDER / "diagnosis.h5", Diagnosis)
    assert found.verdict == "accommodation"
    assert len(found.causes) == 20
    first = found.causes[0]
    assert (first.cause, first.found, first.p_value) == ("accommodation", True, 0.005)
    assert first.parameters[0].value == pytest.approx(0.11148566983039102, **ABOUT)
    assert np.isnan(first.held_out_gain_percent)
    assert found.static_percent == pytest.approx(0.19356542950942315, **ABOUT)
    assert found.before.shape == found.after.shape == (656,)
    assert len(found.profiles) == 5
