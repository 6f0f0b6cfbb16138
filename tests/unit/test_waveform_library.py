"""The pulse library: files equal the script, every record is periodic, and each shows its clinical sign."""

from __future__ import annotations

import importlib.util
import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

from pulsetrainer.core.beats import find_beats
from pulsetrainer.core.heartbeat import Pulse
from pulsetrainer.core.pulses import Shape
from pulsetrainer.files.pulses import read_pulse
from pulsetrainer.resources import waveforms_dir

FOLDER = waveforms_dir()
DATA = Path(__file__).resolve().parents[1] / "data"


def _script():
    spec = importlib.util.spec_from_file_location("waveforms_make", FOLDER / "make.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up by name
    spec.loader.exec_module(module)
    return module


MAKE = _script()
NAMES = tuple(pulse.name for pulse in MAKE.LIBRARY)


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
    """The script draws these records, and the folder holds no other."""
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
    assert list(fields) == ["name", "meaning", "source", "scale", "beats", "licence"]
    assert fields["name"] == name
    assert "drawn for this project" in fields["licence"]


@pytest.mark.parametrize("name", NAMES)
def test_record_is_normalised_and_periodic(name):
    """0..1 from the diastolic minimum on; at the seam value and slope meet, no rougher than elsewhere."""
    _, t_s, p = _read(name)
    assert p[0] == p.min() == 0.0
    assert p.max() == 1.0
    assert t_s.size == round(next(x.period_s for x in MAKE.LIBRARY if x.name == name) / MAKE.DT_S)
    slope = np.diff(p, append=p[0]) / MAKE.DT_S
    bend = np.diff(slope, prepend=slope[-1]) / MAKE.DT_S
    assert abs(slope[0]) < 0.1
    assert abs(slope[-1]) < 0.1
    assert max(abs(bend[0]), abs(bend[-1])) < np.abs(bend[2:-2]).max()


@pytest.mark.parametrize("name", NAMES)
def test_each_beat_begins_at_a_foot(name):
    """One steep rise in each beat, after its foot, which is a low point of the record."""
    shape = read_pulse(name)
    p, feet = shape.value, np.round(np.asarray(shape.feet_s) / MAKE.DT_S).astype(int)
    _, troughs = _turning_points(p)
    for begin, end in zip(feet, [*feet[1:], p.size], strict=True):
        assert np.abs(troughs - begin).min() <= 1 or begin == 0
        beat = p[begin:end]
        assert np.argmax(np.diff(beat)) < min(0.35, 0.5 * beat.size * MAKE.DT_S) / MAKE.DT_S
        assert beat.max() > beat[0] + 0.2
    assert len(feet) == len(next(x.beats for x in MAKE.LIBRARY if x.name == name))


@pytest.mark.parametrize(
    ("name", "bpm"),
    [(n, 75) for n in NAMES[:10]] + [("tachycardia", 130), ("bradycardia", 45), ("atrial-fibrillation", 91)],
)
def test_mean_rates(name, bpm):
    """As the table says."""
    shape = read_pulse(name)
    assert 60 * len(shape.feet_s) / shape.period_s == pytest.approx(bpm, abs=0.5)


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


def test_dicrotic_has_a_second_wave_that_a_finger_feels():
    """After a deep notch the second wave is over half as high as the first, and comes in diastole."""
    _, t_s, p = _read("dicrotic")
    peaks, troughs = _turning_points(p)
    assert peaks.size == 2
    assert t_s[peaks[1]] > 0.35
    assert p[peaks[1]] > 0.5
    assert p[peaks[1]] - p[troughs[1]] > 0.3


def test_water_hammer_rises_and_falls_faster_than_normal():
    """Half the time above half the height; the widest pulse pressure of the library; no second peak."""
    _, _, p = _read("water-hammer")
    _, _, normal = _read("normal")
    assert np.count_nonzero(p > 0.5) < 0.65 * np.count_nonzero(normal > 0.5)
    assert np.diff(p).max() > np.diff(normal).max()
    assert np.diff(p).min() < 1.2 * np.diff(normal).min()
    assert _turning_points(p)[0].size == 1
    assert max(MAKE.LIBRARY, key=lambda x: x.mmHg[1] - x.mmHg[0]).name == "water-hammer"


def test_anacrotic_has_its_notch_on_the_way_up():
    """A small peak in the first half of the rise, then the late and higher one."""
    _, t_s, p = _read("anacrotic")
    peaks, troughs = _turning_points(p)
    assert peaks.size == 2
    assert t_s[peaks[0]] < 0.12
    assert 0.2 < t_s[peaks[1]] < 0.35
    assert 0.3 < p[peaks[0]] < 0.8
    assert p[peaks[0]] - p[troughs[1]] > 0.02


def test_stiff_arteries_peak_late():
    """Type A of Murgo: the second systolic peak is higher by more than 12 % of the pulse."""
    _, t_s, p = _read("stiff")
    peaks, _ = _turning_points(p)
    assert t_s[peaks[0]] < 0.13 < t_s[peaks[1]] < 0.25
    assert p[peaks[1]] - p[peaks[0]] > 0.12


def test_fast_and_slow_hearts_keep_the_root_of_the_interval():
    """The peak comes at the root of the interval's change, as systole is shortened (Bazett)."""
    _, t_s, normal = _read("normal")
    for name in ("tachycardia", "bradycardia"):
        _, t, p = _read(name)
        expected = t_s[np.argmax(normal)] * np.sqrt(t.size / t_s.size)
        assert t[np.argmax(p)] == pytest.approx(expected, rel=0.12)


def test_atrial_fibrillation_is_irregularly_irregular():
    """Intervals vary by a fifth, none is tied to the one before, and a beat is weaker after a short one."""
    shape = read_pulse("atrial-fibrillation")
    feet = np.append(shape.feet_s, shape.period_s)
    intervals = np.diff(feet)
    assert 0.15 < intervals.std() / intervals.mean() < 0.3
    assert abs(np.corrcoef(intervals[1:], intervals[:-1])[0, 1]) < 0.45
    at = np.round(feet / MAKE.DT_S).astype(int)
    heights = np.array([shape.value[a:b].max() - shape.value[a] for a, b in itertools.pairwise(at)])
    assert np.corrcoef(intervals, np.roll(heights, -1))[0, 1] > 0.7


def test_premature_atrial_beat_resets_the_rhythm():
    """Early and weaker; the interval after it is longer than usual, but together they are under two."""
    shape = read_pulse("premature-atrial")
    intervals = np.diff(np.append(shape.feet_s, shape.period_s))
    coupling, pause = intervals[-2], intervals[-1]
    assert coupling < 0.7 * 0.8
    assert pause > 0.8
    assert coupling + pause < 1.9 * 0.8


def test_alternans_of_three_depths():
    """18, 38 and 68 % between strong and weak beats, to what the run-off of the beat before adds."""
    depths = []
    for name in ("alternans-mild", "alternans", "alternans-severe"):
        strong, weak = _systolic_peaks(_read(name)[2], 2)
        depths.append(1.0 - weak / strong)
    np.testing.assert_allclose(depths, [0.18, 0.38, 0.68], atol=0.08)


HEALTHY = (
    "normal",
    "tachycardia",
    "bradycardia",
    "atrial-fibrillation",
    "premature-atrial",
    "alternans-mild",
)
SICK = ("bifid", "dicrotic", "water-hammer", "anacrotic", "parvus-et-tardus")
VOLUNTEERS = ("fingerbp_AAC249_0", "fingerbp_AAC3_3", "fingerbp_AAC409_0")


def _beat(shape: Shape) -> np.ndarray:
    """The first beat of a pulse at 75 beats a minute, in 200 steps, from 0 to 1."""
    level = Pulse(shape).level(0, 0.8, np.arange(200) / 250)
    return (level - level.min()) / np.ptp(level)


def _recorded_beat(name: str) -> np.ndarray:
    """The mean beat of a volunteer."""
    t, p = np.loadtxt(DATA / f"{name}.csv", delimiter=",", skiprows=1).T
    return _beat(find_beats(Shape(name, t, p)).mean())


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2)))


def test_single_beats_against_recorded_ones():
    """Where the beat is a healthy one it is as near to some volunteer as two volunteers are; else to none.

    The volunteers lie 0.08 to 0.15 of the height apart, rms over the beat.
    """
    recorded = [_recorded_beat(name) for name in VOLUNTEERS]
    between = [_apart(a, b) for a, b in itertools.combinations(recorded, 2)]
    for name in (*HEALTHY, *SICK):
        nearest = min(_apart(_beat(read_pulse(name)), one) for one in recorded)
        assert nearest < min(between) if name in HEALTHY else nearest > 0.9 * max(between), name


def test_the_stiff_pulse_is_nearest_to_the_volunteer_with_a_late_systolic_peak():
    """Of the three recorded ones one peaks late in systole and has no dicrotic wave to speak of."""
    late, *others = (_recorded_beat(name) for name in VOLUNTEERS)
    assert np.argmax(late) > 1.4 * max(np.argmax(one) for one in others)
    stiff = _beat(read_pulse("stiff"))
    assert _apart(stiff, late) < 0.75 * min(_apart(stiff, one) for one in others)
