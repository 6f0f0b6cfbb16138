"""A device that stays true: `check` tells what moved, and a play makes up for the coil's heat."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.artefacts.model import Extension, Parameter
from pulsetrainer.core.temperature import COPPER_PER_K
from pulsetrainer.device.transport import PortLostError
from pulsetrainer.diagnosis.prediction import operator_of, predict
from pulsetrainer.errors import DataError, DeviceError, Interrupted
from pulsetrainer.steps.check import RATE_HZ, check_updatable, signal, updated
from pulsetrainer.steps.heat import rest_force, take_temperature, thermometer
from pulsetrainer.steps.session import InMemory
from wording import raises

# What a diagnosis of the as-built bench finds.
THERMAL = Extension(
    "thermal-drift",
    (
        Parameter("coefficient", 0.006, "1/A^2", 0.005, 0.007),
        Parameter("tau", 20.0, "s", 15.0, 25.0),
    ),
)


@pytest.fixture(scope="module")
def model():
    """A model of the as-built bench, captured with the duty."""
    with pt.open_device("bench:?seed=1") as device:
        run = pt.capture("identification", device)
    return pt.identify(run)


def test_the_model_knows_its_coil(model):
    """5 ohm at 12 V: duty over current, the diode, the serial number; it survives a file."""
    assert model.coil.duty_per_A == pytest.approx(5 / 12.6, rel=2e-3)
    assert model.coil.duty_offset == pytest.approx(0.6 / 12.6, rel=0.02)
    assert model.coil.rise_per_A2 == pytest.approx(0.012, rel=0.15)
    assert model.serial == "BENCH-1"


@pytest.mark.parametrize(
    ("moved", "verdict", "offset", "gain", "kelvin"),
    [
        ("", "true", 0.0, 1.0, 0.0),
        ("&condition-offset=0.3", "shifted", 0.3, 1.0, 0.0),
        ("&condition-gain=0.05", "shifted", 0.0, 1.05, 0.0),
        ("&ambient=20", "shifted", 0.0, 0.961, 20.0),
        ("&condition-offset=-0.3&condition-gain=-0.05&ambient=-20", "shifted", -0.3, 0.987, -20.0),
    ],
)
def test_what_moved_is_told(model, moved, verdict, offset, gain, kelvin):
    """Zero within 0.05 N, gain within 0.5 %, temperature within 2 K; an updated model is true again."""
    with pt.open_device(f"bench:?seed=1&noise-seed=3{moved}") as device:
        found = pt.check(model, device)
        mended = updated(model, found)
        again = pt.check(mended, device)
    assert found.verdict == verdict, found
    assert found.offset.value == pytest.approx(offset, abs=0.05)
    assert found.gain.value == pytest.approx(gain, abs=0.005)
    assert found.temperature_K.value == pytest.approx(kelvin, abs=2.0)
    for one in (found.offset, found.gain, found.shape_percent, found.temperature_K):
        assert one.interval[0] <= one.value <= one.interval[1]
    # the coil counts from the heat of now: what it needs is more, and what it rises by is as much as before
    warmer = 1.0 + COPPER_PER_K * found.temperature_K.value
    assert mended.coil.duty_per_A == pytest.approx(model.coil.duty_per_A * warmer)
    assert mended.coil.duty_per_A * mended.coil.rise_per_A2 == pytest.approx(
        model.coil.duty_per_A * model.coil.rise_per_A2
    )
    assert found.seconds <= 12
    assert again.verdict == "true", again
    assert again.error_percent.before == pytest.approx(found.error_percent.after, abs=0.1)


@pytest.mark.parametrize("seed", [101, 123])
def test_another_density_is_changed_and_not_updated(model, seed):
    """No offset and no gain makes one device another; the second is the next but one of sixty."""
    with pt.open_device(f"bench:?seed={seed}&serial=1") as device:
        found = pt.check(model, device)
    assert found.verdict == "changed"
    with raises(DataError, "another shape"):
        updated(model, found)


def test_a_density_a_quarter_of_a_percent_away_is_changed():
    """The nearest of forty pairs: offset and gain leave 0.27 % of the span, 0.14 % on what nobody touched."""
    with pt.open_device("bench:?seed=736") as device:
        own = pt.identify(pt.capture("identification", device))
    verdicts = []
    for port in ("bench:?seed=736&noise-seed=7", "bench:?seed=1736&serial=736"):
        with pt.open_device(port) as device:
            verdicts.append(pt.check(own, device).verdict)
    assert verdicts == ["true", "changed"]


def test_a_coarse_and_fast_calibration_stays_true():
    """12 levels at 4 A/s, five times as fast as delivered; another device is still told."""
    with pt.open_device("bench:?seed=4") as device:
        run = pt.capture("identification", device, levels=12, speed_A_per_s=4.0)
    coarse = pt.identify(run, levels=12)
    verdicts = []
    for port in ("bench:?seed=4&noise-seed=3", "bench:?seed=104&serial=4"):
        with pt.open_device(port) as device:
            verdicts.append(pt.check(coarse, device).verdict)
    assert verdicts == ["true", "changed"]


def test_a_dual_model_is_checked_over_its_current():
    """The levels of the dual form are forces, which no device plays."""
    with pt.open_device("bench:?ideal") as device:
        run = pt.capture("identification", device, levels=6, speed_A_per_s=4.0)
        dual = pt.identify(run, levels=12, form="dual")
        found = pt.check(dual, device)
    operator = operator_of(dual)
    assert found.seconds == signal(max(operator.low, 0.0), operator.high).size / RATE_HZ


@pytest.mark.parametrize("polarity", [1, -1])
@pytest.mark.parametrize("extensions", [(), (THERMAL,)])
def test_the_force_at_rest_is_what_the_model_predicts(model, polarity, extensions):
    """With causes and without, rising and falling."""
    whole = replace(model, polarity=polarity, extensions=extensions)
    resting = np.full(3, operator_of(whole).low)
    assert rest_force(whole) == pytest.approx(predict(whole, resting, 1.0 / RATE_HZ)[0])


def test_what_an_offset_and_a_gain_do_not_mend_is_refused(model):
    """Causes in newtons, and another form."""
    sticking = Extension("stick-slip", (Parameter("jump", 0.3, "N", 0.2, 0.4),))
    for hindered in (replace(model, extensions=(sticking,)), replace(model, form="signed")):
        with pytest.raises(DataError):
            check_updatable(hindered)
    check_updatable(replace(model, extensions=(THERMAL,)))


def test_a_short_capture_tells_its_device_too(tmp_path):
    """Although it is too short to tell the coil; a model of two devices is of neither, and says so."""
    runs = []
    for seed in (1, 2):
        with pt.open_device(f"bench:?seed={seed}") as device:
            runs.append(pt.capture("identification", device, levels=4, speed_A_per_s=6.0))
    pt.save(pt.identify(runs[0]), tmp_path / "model.h5")
    alone, both = pt.load(tmp_path / "model.h5"), pt.identify(runs)
    assert (alone.serial, alone.coil, both.serial) == ("BENCH-1", None, "")
    assert any("several devices, BENCH-1 and BENCH-2" in note for note in both.fit.notes)
    with pt.open_device("bench:?seed=2") as device, pytest.raises(DataError, match="BENCH-1, this is"):
        pt.check(alone, device)


def test_the_model_of_another_device_is_refused(model):
    """By its serial number: check, and heat that is asked for; heat by default is then off."""
    other = replace(model, serial="OTHER", extensions=(THERMAL,))
    drive = pt.invert("normal", other, periods=2)
    with pt.open_device("bench:?seed=1") as device:
        with raises(DataError, "names it", named="OTHER"):
            pt.check(other, device)
        with raises(DataError, "names it", named="OTHER"):
            pt.play(drive, device, repeats=1, track_heat=True)
        assert pt.play(drive, device, repeats=1).temperature_K is None


def test_a_temperature_that_no_room_has_is_told(model):
    """Another coil behind the same serial number: nothing is made up for, and what to do is said."""
    drive = pt.invert("normal", replace(model, extensions=(THERMAL,)), periods=2)
    with (
        pt.open_device("bench:?seed=1&coil=40") as device,
        raises(DeviceError, "names it", named="this is a different coil or supply"),
    ):
        pt.play(drive, device, repeats=1)


def test_a_play_makes_up_for_the_room(model):
    """16 K colder: told within 2 K before the first drive, and the force is as in the room of calibration."""
    drive = pt.invert("normal", replace(model, extensions=(THERMAL,)), periods=2)
    force = {}
    for ambient, track in ((0, False), (0, None), (-16, False), (-16, None)):
        with pt.open_device(f"bench:?seed=1&ambient={ambient}") as device:
            played = pt.play(drive, device, repeats=2, track_heat=track)
        force[ambient, track] = np.nanmean(played.compensated.output[:, drive.scored], axis=0)
        if track is None:
            assert played.temperature_K[0] == pytest.approx(ambient, abs=2.0)
    moved, left = (
        force[-16, track] @ force[0, track] / (force[0, track] @ force[0, track]) - 1.0
        for track in (False, None)
    )
    assert moved == pytest.approx(0.00195 * 16, abs=0.006)
    assert abs(left) < 0.35 * moved


@pytest.mark.parametrize("top_A", [0.3, 0.8])
def test_the_temperature_is_told_below_the_whole_range(model, top_A):
    """A lower range is over before a second is: the loop goes around until one window is whole."""
    meter = thermometer(model.coil, None)
    with pt.open_device("bench:?seed=1&ambient=15") as device:
        take_temperature(device, meter, top_A)
    assert meter.temperature_K == pytest.approx(15.0, abs=1.0)


def test_a_temperature_that_was_not_told_is_no_temperature(model, monkeypatch):
    """Where the line loses it the play does not begin as if the room were that of the calibration."""
    meter = thermometer(model.coil, None)
    with pt.open_device("bench:?seed=1") as device:
        played = device.play

        def lost(reference, rate_Hz):
            whole = played(reference, rate_Hz)
            return replace(whole, duty=np.full(whole.duty.size, np.nan))

        monkeypatch.setattr(device, "play", lost)
        with raises(DeviceError, "names it", named="does not give the coil's temperature"):
            take_temperature(device, meter, 1.5)


def test_nothing_changes_where_there_is_no_thermal_term(model):
    """By default a model without it is played as it was, to the bit."""
    drive = pt.invert("normal", model, periods=2)
    played = []
    for track in (None, False):
        with pt.open_device("bench:?seed=1") as device:
            played.append(pt.play(drive, device, repeats=1, track_heat=track))
    np.testing.assert_array_equal(played[0].compensated.output, played[1].compensated.output)
    assert played[0].temperature_K is None


def test_a_session_keeps_the_temperature_that_it_told(model, tmp_path):
    """Every second, across two parts: room and own heat are told; the file has it, to the bit."""
    warm = replace(model, extensions=(THERMAL,))
    with pt.open_device("bench:?seed=1&ambient=16") as device:
        device.set_parameter("on_time", 10)
        pressed = pt.session(warm, device, pulses="normal", beats=12, track_heat=True)
    assert np.diff(pressed.time_s).max() > 0.5
    assert pressed.temperature_K.size >= 5
    assert ((pressed.temperature_K > 15.0) & (pressed.temperature_K < 18.0)).all()
    assert 0 < pressed.temperature_s[0] < pressed.temperature_s[-1] <= pressed.time_s[-1]
    pt.save(pressed, tmp_path / "s.h5")
    again = pt.load(tmp_path / "s.h5")
    np.testing.assert_array_equal(again.temperature_K, pressed.temperature_K)
    np.testing.assert_array_equal(again.temperature_s, pressed.temperature_s)


def test_a_beat_starts_where_its_samples_are(model):
    """In every part of a session: the error of the samples from its start on is the one told of the beat."""
    with pt.open_device("bench:?seed=1") as device:
        device.set_parameter("on_time", 6)
        pressed = pt.session(model, device, beats=8)
    beats = pressed.beats
    assert np.diff(pressed.time_s).max() > 0.5
    for start_s, interval_s, told in zip(beats.start_s, beats.interval_s, beats.mean_error, strict=True):
        since_s = pressed.time_s - start_s
        of_beat = (since_s > -1e-6) & (since_s < interval_s - 1e-6)
        error = np.abs(pressed.output - pressed.target)[of_beat].mean()
        assert error == pytest.approx(told, rel=1e-6)


def test_what_a_ctrl_c_took_from_a_session_is_counted(model, monkeypatch):
    """The samples that were just being written: they are missing in the file, and it says how many."""
    append, calls = InMemory.append, []

    def interrupted(self, *columns):
        calls.append(len(columns[0]))
        if len(calls) == 3:
            raise KeyboardInterrupt
        append(self, *columns)

    monkeypatch.setattr(InMemory, "append", interrupted)
    with pt.open_device("bench:?seed=1") as device, pytest.raises(Interrupted) as caught:
        pt.session(model, device, beats=8)
    kept = caught.value.kept
    assert kept.dropped_samples == calls[2] > 0
    assert kept.time_s.size == sum(calls) - calls[2]


@pytest.mark.parametrize("verb", ["session", "capture"])
def test_a_fault_in_a_later_part_says_when_that_began(model, monkeypatch, verb):
    """Its own time counts from the beginning of the part; the file's from that of the recording."""
    with pt.open_device("bench:?seed=1") as device:
        device.set_parameter("on_time", 6)
        name = "stream" if verb == "session" else "play"
        played, longest = getattr(type(device), name), []

        def stops(self, reference, *given, **options):
            trace = played(self, reference, *given, **options)
            if verb == "session" or options.get("on_block"):  # no conditioning
                longest.append(1)
            return replace(trace, fault="too much (at 1.0 s)") if len(longest) == 2 else trace

        monkeypatch.setattr(type(device), name, stops)
        run = {
            "session": lambda: pt.session(model, device, pulses="normal", beats=12),
            "capture": lambda: pt.capture("identification", device, levels=6, speed_A_per_s=1.0),
        }
        with pytest.raises(DeviceError) as caught:
            run[verb]()
    kept = caught.value.kept
    (seam,) = np.flatnonzero(np.diff(kept.time_s) > 0.5)
    began_s = float(re.search(r"began at ([\d.]+) s", caught.value.message)[1])
    assert began_s == pytest.approx(kept.time_s[seam + 1], abs=0.06)


@pytest.mark.parametrize("verb", ["session", "capture", "play"])
def test_what_was_recorded_is_kept_where_the_next_part_cannot_begin(model, monkeypatch, verb):
    """The port is gone between two plays, or the coil too hot for the next: the others are in ``kept``."""
    drive = pt.invert("normal", model, periods=2)
    with pt.open_device("bench:?seed=1") as device:
        device.set_parameter("on_time", 8)
        name = "stream" if verb == "session" else "play"
        played, recorded = getattr(type(device), name), []

        def goes(self, *given, **options):
            if recorded and recorded[-1] >= (2 if verb == "play" else 1):
                raise PortLostError("the port is gone", hint="check cable and power")
            trace = played(self, *given, **options)
            if options.get("on_block"):  # no conditioning
                recorded.append(len(recorded) + 1)
            return trace

        monkeypatch.setattr(type(device), name, goes)
        run = {
            "session": lambda: pt.session(model, device, pulses="normal", beats=12),
            "capture": lambda: pt.capture("identification", device, levels=6, speed_A_per_s=1.0),
            "play": lambda: pt.play(drive, device, repeats=3),
        }
        with pytest.raises(DeviceError) as caught:
            run[verb]()
    assert "the port is gone" in caught.value.message
    assert caught.value.hint == "check cable and power"
    kept = caught.value.kept
    assert not kept.complete
    if verb == "play":
        assert kept.compensated.output.shape[0] == 1
        assert "port is gone" in kept.fault
    else:
        assert kept.time_s.size > 4000


@pytest.mark.parametrize("share", [0.0, 0.3])
@pytest.mark.parametrize("verb", ["check", "tune"])
def test_what_the_wire_lost_is_no_measurement(model, monkeypatch, verb, share):
    """Nothing, or less than half, came back of a play: it is told so, by how many samples."""
    with pt.open_device("bench:?seed=1") as device:
        played = type(device).play

        def loses(self, reference, *given, **options):
            trace = played(self, reference, *given, **options)
            kept = slice(int(share * trace.tick.size))
            names = ("tick", "reference_A", "current_A", "force_N", "duty")
            arrays = {name: getattr(trace, name)[kept] for name in names}
            left = arrays["tick"].size
            return replace(trace, **arrays, samples=left, dropped_samples=trace.samples - left)

        monkeypatch.setattr(type(device), "play", loses)
        with raises(DeviceError, "lost on the wire"):
            {"check": lambda: pt.check(model, device), "tune": lambda: pt.tune(device)}[verb]()
