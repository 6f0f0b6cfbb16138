"""The pulse library: files equal the script, every record is periodic, and each shows its clinical sign."""

from __future__ import annotations

import importlib.util
import sys

import numpy as np
import pytest

from pulsetrainer.resources import waveforms_dir

FOLDER = waveforms_dir()
NAMES = ("normal", "bifid", "alternans", "paradoxus", "parvus-et-tardus", "bigeminus")


def _script():
    spec = importlib.util.spec_from_file_location("waveforms_make", FOLDER / "make.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up by name
    spec.loader.exec_module(module)
    return module


MAKE = _script()


def _read(name: str):
    """Return (comments, time, p) of a record."""
    lines = (FOLDER / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert lines[: len(comments)] == comments, "comments come first"
    assert lines[len(comments)] == "t_s,p"
    rows = np.array([[float(v) for v in line.split(",")] for line in lines[len(comments) + 1 :]])
    return comments, rows[:, 0], rows[:, 1]


def _turning_points(p):
    """Return (peaks, troughs) as sample numbers of the periodic record."""
    before, after = p - np.roll(p, 1), np.roll(p, -1) - p
    return np.flatnonzero((before > 0) & (after <= 0)), np.flatnonzero((before < 0) & (after >= 0))


def test_library_is_complete():
    """The script draws the six records, and the folder holds no other."""
    assert tuple(pulse.name for pulse in MAKE.LIBRARY) == NAMES
    assert {path.stem for path in FOLDER.glob("*.csv")} == set(NAMES)


@pytest.mark.parametrize("pulse", MAKE.LIBRARY, ids=lambda pulse: pulse.name)
def test_file_equals_what_the_script_draws(pulse):
    """Comments word for word; samples to the last decimal, which may round differently elsewhere."""
    comments, t_s, p = _read(pulse.name)
    drawn = MAKE.draw(pulse)
    assert comments == [line for line in MAKE.table(pulse).splitlines() if line.startswith("#")]
    np.testing.assert_allclose(t_s, np.arange(drawn.size) * MAKE.DT_S, atol=1e-9)
    np.testing.assert_allclose(p, drawn, atol=1.1e-6)


def test_script_writes_into_a_folder(tmp_path):
    """``make.py FOLDER`` leaves the shipped files alone."""
    MAKE.main([str(tmp_path)])
    assert {path.stem for path in tmp_path.glob("*.csv")} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_comments_name_meaning_and_source(name):
    """A reader of the file alone learns what it is and where it comes from."""
    comments, _, _ = _read(name)
    fields = dict(line[2:].split(": ", 1) for line in comments)
    assert list(fields) == ["name", "meaning", "source", "scale", "licence"]
    assert fields["name"] == name
    assert "drawn for this project" in fields["licence"]


@pytest.mark.parametrize("name", NAMES)
def test_record_is_normalised_and_periodic(name):
    """0..1 from the diastolic minimum on; at the seam value and slope meet, no rougher than elsewhere."""
    _, t_s, p = _read(name)
    assert p[0] == p.min() == 0.0
    assert p.max() == 1.0
    assert np.isclose(t_s.size * MAKE.DT_S / 0.8 % 1, 0) or np.isclose(t_s.size * MAKE.DT_S / 0.8 % 1, 1)
    slope = np.diff(p, append=p[0]) / MAKE.DT_S
    bend = np.diff(slope, prepend=slope[-1]) / MAKE.DT_S
    assert abs(slope[0]) < 0.1
    assert abs(slope[-1]) < 0.1
    assert max(abs(bend[0]), abs(bend[-1])) < np.abs(bend[2:-2]).max()


@pytest.mark.parametrize("name", NAMES)
def test_mean_rate_is_75_beats_per_minute(name):
    """Steepest rises counted: one per beat, 0.8 s on the average."""
    _, t_s, p = _read(name)
    slope = np.gradient(np.tile(p, 3))[p.size : 2 * p.size]
    rising = slope > 0.3 * slope.max()
    onsets = np.count_nonzero(rising & ~np.roll(rising, 1))
    assert onsets == round(t_s.size * MAKE.DT_S / 0.8)


def test_normal_has_the_shape_of_a_recorded_beat():
    """Rise, notch and dicrotic wave where recorded finger pressure beats have them."""
    _, t_s, p = _read("normal")
    peaks, troughs = _turning_points(p)
    assert 0.095 <= t_s[peaks[0]] <= 0.125  # recorded: 0.10 s
    assert 0.30 <= t_s[troughs[1]] <= 0.36  # the notch; recorded: 0.33 s
    assert 0.36 <= t_s[peaks[1]] <= 0.42  # the dicrotic peak; recorded: 0.39 s
    assert 0.3 < p[troughs[1]] < p[peaks[1]] < 0.5
    diastole = p[450:]
    assert np.all(np.diff(diastole) < 0)
    assert np.all(np.diff(diastole[60:320], 2) > -2.1e-6)  # convex, as a decay is; steps are of 1e-6


def test_bifid_has_two_systolic_peaks():
    """Two peaks of nearly one height within systole, a clear dip between them."""
    _, t_s, p = _read("bifid")
    peaks, troughs = _turning_points(p)
    assert peaks.size == 2
    assert t_s[peaks[1]] < 0.30
    assert np.all(p[peaks] > 0.9)
    assert p[troughs[troughs > peaks[0]][0]] < 0.85


def _systolic_peaks(p, count):
    beats = np.array_split(p, count)
    return np.array([beat.max() for beat in beats])


def test_alternans_alternates():
    """The second beat is as early as the first and clearly weaker."""
    _, _, p = _read("alternans")
    strong, weak = _systolic_peaks(p, 2)
    assert strong == 1.0
    assert 0.5 < weak < 0.8
    assert abs(int(np.argmax(p[800:])) - int(np.argmax(p[:800]))) < 5


def test_paradoxus_falls_by_more_than_10_mmHg():
    """Over one breath the systolic pressure falls by more than the clinical threshold."""
    _, _, p = _read("paradoxus")
    peaks = _systolic_peaks(p, 5)
    low, high = next(pulse.mmHg for pulse in MAKE.LIBRARY if pulse.name == "paradoxus")
    assert np.ptp(peaks) * (high - low) > 10


def test_parvus_et_tardus_is_late_and_slow():
    """Against the normal pulse: peak over twice as late, rise less than half as steep, no second peak."""
    _, t_s, p = _read("parvus-et-tardus")
    _, _, normal = _read("normal")
    assert t_s[np.argmax(p)] > 2 * t_s[np.argmax(normal)]
    assert np.diff(p).max() < 0.5 * np.diff(normal).max()
    assert _turning_points(p)[0].size == 1
    pulse_pressure = {x.name: x.mmHg[1] - x.mmHg[0] for x in MAKE.LIBRARY}
    assert pulse_pressure["parvus-et-tardus"] < 0.7 * pulse_pressure["normal"]


def test_bigeminus_couples_a_premature_beat():
    """A weaker beat well before its time, then a pause longer than a beat."""
    _, t_s, p = _read("bigeminus")
    second = 450 + int(np.argmax(p[450:]))
    first = int(np.argmax(p))
    coupling_s = t_s[second] - t_s[first]
    assert coupling_s < 0.6
    assert 1.6 - coupling_s > 1.0
    assert 0.4 < p[second] < 0.8
