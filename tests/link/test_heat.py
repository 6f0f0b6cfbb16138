"""The heat of the coil: foretold, told to the device, remembered by serial number, waited for."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest
from scripted import ScriptedDevice

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import HEAT_LIMIT_A2, HEAT_TAU_S, HEAT_UNIT
from pulsetrainer.device.device import Device
from pulsetrainer.device.heat import HeatMemory, added, cooled, in_words, wait_s
from pulsetrainer.device.opening import open_device
from pulsetrainer.device.schemes import OpenPort
from pulsetrainer.errors import ArgumentError, DeviceError
from wording import raises

FULL = np.full(60_000, 1.5)
RATE_HZ = 1000.0


def test_heat_by_the_equation():
    """What is added is the solution of the equation; what is left decays by e in its time."""
    time = np.arange(1, FULL.size + 1) / RATE_HZ
    expected = 1.5**2 / HEAT_LIMIT_A2 * -np.expm1(-time / HEAT_TAU_S)
    np.testing.assert_allclose(added(FULL, RATE_HZ), expected, rtol=1e-9)
    assert cooled(0.8, HEAT_TAU_S) == pytest.approx(0.8 / math.e)
    assert cooled(0.8, -5.0) == 0.8


@pytest.mark.parametrize("heat", [0.3, 0.7, 1.0, 1.2])
def test_the_wait_is_just_long_enough(heat):
    """After it the reference just fits; a second less, and it does not. Naive: one step after another."""
    wait = wait_s(heat, FULL, RATE_HZ)

    def peak(start: float) -> float:
        highest = level = start
        for current in FULL[::100]:
            level += (current**2 / HEAT_LIMIT_A2 - level) * -math.expm1(-0.1 / HEAT_TAU_S)
            highest = max(highest, level)
        return highest

    if wait:
        assert peak(cooled(heat, wait)) == pytest.approx(1.0, abs=1e-3)
        assert peak(cooled(heat, wait - 1.0)) > 1.0
    else:
        assert peak(heat) <= 1.0
    assert wait_s(heat, FULL, RATE_HZ) <= wait_s(heat + 0.1, FULL, RATE_HZ)
    assert math.isinf(wait_s(0.0, np.full(130_000, 1.5), RATE_HZ))


def test_what_is_foretold_is_what_the_firmware_counts():
    """After 40 s at 1.4 A the real firmware tells the heat that the equation gives."""
    reference = np.full(40_000, 1.4)
    with open_device("bench:") as device:
        assert device._status().heat == 0
        assert device.play(reference, RATE_HZ).complete
        heat = device._status().heat * HEAT_UNIT
    assert heat == pytest.approx(float(added(reference, RATE_HZ)[-1]), rel=0.02)


def test_a_play_that_would_be_too_hot_says_how_long_to_wait():
    """Twice 80 s at full current: the second is refused before it starts, and the wait is right."""
    reference = np.full(80_000, 1.5)
    with open_device("bench:") as device:
        assert device.play(reference, RATE_HZ).complete
        before = device._status()
        with raises(DeviceError, "too hot now") as caught:
            device.play(reference, RATE_HZ)
        after = device._status()
        expected = wait_s(before.heat * HEAT_UNIT, reference, RATE_HZ)
        assert re.search(r"wait \d+ (seconds|minutes)", caught.value.hint)
        assert in_words(expected) in caught.value.hint
        assert (after.session, after.fault) == (before.session, 0)
        with raises(ArgumentError, "too hot ever"):
            device.play(np.full(140_000, 1.5), RATE_HZ)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.1, "10 seconds"), (61, "70 seconds"), (91, "2 minutes"), (121, "3 minutes")],
)
def test_a_wait_in_words(seconds, words):
    """Rounded up."""
    assert in_words(seconds) == words


def _open(script, memory, now):
    return Device(
        OpenPort(script, "/dev/ttyUSB0"), monotonic=script.clock, sleep=script.sleep, now=now, memory=memory
    )


def _told(script):
    return [command.heat for _, command in script.heard if isinstance(command, m.CoilHeat)]


def test_the_heat_of_a_real_port_outlives_program_and_power(tmp_path):
    """Remembered after a play; after power-on the device is told what is left of it by then."""
    memory, clock = HeatMemory(tmp_path), [1_000_000.0]
    first = ScriptedDevice()
    first.status = {"heat": 900}
    with _open(first, memory, lambda: clock[0]) as device:
        device.play(np.full(100, 0.1), RATE_HZ)
    assert _told(first) == []  # nobody assumed anything
    clock[0] += HEAT_TAU_S
    again = ScriptedDevice()
    again.status = {"flags": codes.STATUS_HEAT_ASSUMED, "heat": 1000}
    with _open(again, memory, lambda: clock[0]):
        assert _told(again) == [math.ceil(900 / math.e)]
    other = ScriptedDevice()
    other.hello = {"serial": b"OTHER".ljust(16, b"\0")}
    other.status = dict(again.status)
    with _open(other, memory, lambda: clock[0]):
        assert _told(other) == []  # what is not known is not told


def test_a_device_that_vanishes_in_mid_play_is_remembered_as_hot_as_it_can_be(tmp_path):
    """Nobody can ask it any more: what the whole play would have added counts, from its end on."""
    memory, reference = HeatMemory(tmp_path), np.full(20_000, 1.5)
    script = ScriptedDevice()
    script.answer = lambda command, usual: None if script.session and script.tick > 5000 else usual
    device = _open(script, memory, lambda: 5000.0)
    assert "did not answer" in device.play(reference, RATE_HZ).fault
    device.close()
    expected = float(added(reference, RATE_HZ)[-1])
    assert memory.recall("SCRIPT", 5000.0) == pytest.approx(expected)
    assert memory.recall("SCRIPT", 5020.0 + HEAT_TAU_S) == pytest.approx(expected / math.e)


def test_what_the_coil_had_before_a_play_that_nobody_saw_end_counts_too(tmp_path):
    """The heat before, as far as it is left, and what the play adds."""
    memory, reference = HeatMemory(tmp_path), np.full(20_000, 1.5)
    script = ScriptedDevice()
    script.status = {"heat": 500}
    script.answer = lambda command, usual: None if script.session and script.tick > 5000 else usual
    with _open(script, memory, lambda: 5000.0) as device:
        assert "did not answer" in device.play(reference, RATE_HZ).fault
    expected = cooled(0.5, 20.0) + float(added(reference, RATE_HZ)[-1])
    assert memory.recall("SCRIPT", 5020.0) == pytest.approx(expected)


def test_simulated_devices_are_told_that_they_are_cold_and_not_remembered(tmp_path, monkeypatch):
    """They were made a moment ago."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with open_device("bench:") as device:
        assert device._status().heat == 0
        device.play(np.full(1000, 1.0), RATE_HZ)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "damage",
    [b"", b"{", b"[1, 2]", b"null", b"\xff\xfe", b'{"heat": 1}', b'{"heat": "hot", "time_s": 1}',
     b'{"heat": NaN, "time_s": 1}', b'{"heat": -1, "time_s": 1}', b'{"heat": 9, "time_s": 1}',
     b'{"heat": 0.5, "time_s": Infinity}', b'{"heat": null, "time_s": 1}', b'{"heat": 1e999, "time_s": 1}'],
)  # fmt: skip
def test_a_damaged_memory_counts_as_unknown(tmp_path, damage):
    """Whatever the file holds: nothing is told then, and the next play writes it anew."""
    memory = HeatMemory(tmp_path)
    memory.remember("A", 0.5, 100.0)
    (path,) = tmp_path.iterdir()
    assert json.loads(path.read_text()) == {"heat": 0.5, "time_s": 100.0}
    path.write_bytes(damage)
    assert memory.recall("A", 100.0) is None
    memory.remember("A", 0.5, 100.0)
    assert memory.recall("A", 100.0) == 0.5
    assert list(tmp_path.iterdir()) == [path]


def test_a_memory_that_cannot_be_written_stops_nobody(tmp_path):
    """A folder that is a file, and a device without a serial number."""
    (tmp_path / "file").write_text("")
    blocked = HeatMemory(tmp_path / "file")
    blocked.remember("A", 0.5, 1.0)
    assert blocked.recall("A", 1.0) is None
    memory = HeatMemory(tmp_path / "folder")
    memory.remember("", 0.5, 1.0)
    assert memory.recall("", 1.0) is None
    memory.remember("../../..", 0.5, 1.0)
    assert memory.recall("../../..", 1.0) == 0.5
    assert [path.parent for path in (tmp_path / "folder").iterdir()] == [tmp_path / "folder"]
