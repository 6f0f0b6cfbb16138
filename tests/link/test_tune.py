"""Tuning on the real firmware: other coils, what cannot be tuned, and that it is off and as before then."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.device.codes import State
from pulsetrainer.device.gains import DELIVERED
from pulsetrainer.device.limits import Limits
from pulsetrainer.errors import ArgumentError, DeviceError
from wording import raises

RANGE_A = 1.5
DATA = Path(__file__).resolve().parents[1] / "data" / "files-0.1"


@pytest.mark.parametrize(
    ("ohm", "henry", "volts"),
    [(5.0, 0.012, 12.0), (2.0, 0.005, 24.0), (4.0, 0.08, 18.0), (9.0, 0.02, 22.0)],
)
def test_a_coil_is_measured_and_followed(ohm, henry, volts, pulse):
    """R within 1 %, L within 5 %, tracking under 1 % of the range on a pulse that it was not tuned with."""
    with pt.open_device(f"bench:?resistance={ohm}&inductance={henry}&supply={volts}&seed=4") as device:
        found = pt.tune(device)
        played = device.play(pulse, 1000)
    assert found.resistance_ohm == pytest.approx(ohm, rel=0.01)
    assert found.inductance_H == pytest.approx(henry, rel=0.05)
    assert found.supply_V == pytest.approx(volts, rel=0.01)
    assert played.complete, played.fault
    assert np.abs(played.current_A - played.reference_A).max() < 0.01 * RANGE_A
    assert found.tracking_percent.after < 1.0
    assert found.margins.stable
    assert found.margins.gain > 3
    assert found.margins.phase_deg > 60
    assert found.settle_ms < 10
    assert found.overshoot_percent < 20


def test_gains_that_would_ring_are_not_tried():
    """24 V and 5 mH: the delivered gains are unstable there, so nobody plays with them."""
    with pt.open_device("bench:?resistance=2&inductance=0.005&supply=24") as device:
        found = pt.tune(device)
    assert not found.margins_before.stable
    assert found.tracking_percent.before is None
    assert any("ring" in note for note in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("port", "names"),
    [
        ("bench:?resistance=100000", "no coil"),
        ("bench:?break=current-zero@0", "no coil"),
        ("bench:?resistance=0.1&inductance=0.0001", "shorted"),
        ("bench:?resistance=0.5&inductance=0.005&supply=24", "shorted"),
        ("bench:?resistance=10&supply=9", "voltage"),
        ("bench:?supply-sag=5&supply=9", "voltage"),
        ("bench:?resistance=6&inductance=0.2&supply=10", "time constant"),
        ("bench:?condition-offset=1.6", "take the finger off"),
        ("bench:?periodic=0.4", "take the finger off"),
        ("bench:?step=1.3&step-time=1.2", "finger off"),
    ],
)
def test_what_cannot_be_tuned_is_named_and_off(port, names):
    """Exit 4, the reason in words, the output off, the gains those from before."""
    with pt.open_device(port) as device:
        with pytest.raises(DeviceError) as raised:
            pt.tune(device)
        assert names in raised.value.message + raised.value.hint
        assert raised.value.exit_code == 4
        assert device.gains == DELIVERED
        assert device._status().state in {State.IDLE, State.FAULT}
        assert device._status().current < 200


@pytest.mark.parametrize("broken", ["force-high@0", "shunt-half@0.5", "force-zero@0"])
def test_a_fault_while_tuning_calls_for_no_finger_and_no_other_force(broken):
    """Nobody presses anything, and nobody's finger should be there."""
    with (
        pt.open_device(f"bench:?break={broken}") as device,
        raises(DeviceError, "tuning is no play") as raised,
    ):
        pt.tune(device)
    assert not re.search("force_max|rests on the finger", raised.value.hint)


def test_a_device_that_cannot_be_stopped_has_its_gains_back_all_the_same(monkeypatch):
    """Else the next play would take its current for a duty. The first error is the one that is told."""
    with pt.open_device("bench:?resistance=100000") as device:

        def stop():
            raise DeviceError("STOP was not answered", hint="check the cable")

        with monkeypatch.context() as patched, raises(DeviceError, "names it", named="no coil"):
            patched.setattr(device, "stop", stop)
            pt.tune(device)
        assert device.gains == DELIVERED


def test_a_supply_that_sags_is_told_from_one_of_too_little_voltage():
    """12 V without a load are more than the 7.5 V that the coil needs."""
    with pt.open_device("bench:?supply-sag=5") as device, raises(DeviceError, "a supply that sags"):
        pt.tune(device)


def test_a_coil_is_judged_by_the_drives_that_it_is_to_follow():
    """6 ohm, 0.1 H at 10 V follow the library's pulses; a drive that rises twice as fast they do not."""
    drive = pt.load(DATA / "drive.h5")
    rise = 1.4 * np.clip((drive.time_s - 1.0) * 20, 0.0, 1.0) * np.clip((2.0 - drive.time_s) * 20, 0.0, 1.0)
    fast = replace(drive, compensated=rise)
    with pt.open_device("bench:?resistance=6&inductance=0.1&supply=10") as device:
        assert pt.tune(device, pulses=["normal", "bifid"]).tracking_percent.after < 1.0
        with pytest.raises(DeviceError) as raised:
            pt.tune(device, pulses=[fast])
    assert "time constant" in raised.value.message


def test_a_drive_beyond_the_range_is_refused():
    """Before anything is measured."""
    with (
        pt.open_device("bench:", limits=Limits(current_A=0.8)) as device,
        pytest.raises(ArgumentError),
    ):
        pt.tune(device, pulses=[pt.load(DATA / "drive.h5")])


def test_limits_that_were_lowered_hold_while_it_is_tuned():
    """A range of 0.8 A: no sample of the current above it, and the range is what it is judged by."""
    with pt.open_device("bench:", limits=Limits(current_A=0.8)) as device:
        seen = []
        play = device.play

        def watched(*words, **more):
            trace = play(*words, **more)
            seen.append(float(trace.current_A.max()))
            return trace

        device.play = watched
        found = pt.tune(device)
    assert max(seen) < 0.82
    assert found.resistance_ohm == pytest.approx(5.0, rel=0.01)


def test_a_measured_supply_makes_the_ohms():
    """A diode of another drop would scale all by the same: the given voltage is the yardstick then.

    It is said where a usual diode makes it another one, and that the loop gains do not mind.
    """
    with pt.open_device("bench:") as device:
        found, usual = pt.tune(device, supply_V=24.0), pt.tune(device, supply_V=12.1)
    assert (found.resistance_ohm, found.inductance_H) == pytest.approx((10.0, 0.024), rel=0.01)
    assert [note for note in found.notes if "24 V" in note and "12.0 V" in note]
    assert not usual.notes


def test_a_supply_that_no_diode_explains_is_refused():
    """230 V for 12 V would be a diode that drops 11 V: the output is off and nothing is written."""
    with (
        pt.open_device("bench:") as device,
        raises(ArgumentError, "names it", named="the free-wheeling diode would drop 11 V"),
    ):
        pt.tune(device, supply_V=230.0)
