"""Whatever goes wrong near a finger ends with output off, the first cause told, the data kept."""

from __future__ import annotations

import os
import signal
import time
import zlib

import numpy as np
import pytest

from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import Fault, NakCode, State
from pulsetrainer.device.exchange import RefusedError
from pulsetrainer.device.frames import Frame, encode
from pulsetrainer.device.opening import open_device
from pulsetrainer.errors import ArgumentError
from wording import raises

HALF_AMP = np.full(3000, 0.5)


@pytest.mark.parametrize(
    ("what", "says"),
    [
        ("current-rail", "current above its hard limit"),
        ("current-zero", "current does not follow"),
        ("force-high", "force above its limit"),
        ("force-rail", "force sensor at the end of its range"),
        ("tick-overrun", "missed its tick"),
    ],
)
def test_a_broken_sensor_or_clock_trips_at_once(what, says):
    """The fault of the second that breaks it is the fault that is told, and the record ends there."""
    with open_device(f"bench:?break={what}@1.0") as device:
        recording = device.play(HALF_AMP, 1000)
        status = device._status()
    assert not recording.complete
    assert says in recording.fault
    if what == "tick-overrun":  # as a busy computer does to an emulated device
        assert "keep pace" in recording.remedy
    assert "at 1.0" in recording.fault
    assert status.state == State.FAULT
    assert recording.dropped_samples == 0
    assert 9_900 <= recording.tick[-1] <= 11_000


@pytest.mark.parametrize(
    ("what", "says"),
    [
        ("current-frozen", "current reading frozen"),
        ("force-frozen", "no force"),  # it stands where there was none
        ("force-zero", "no force"),
    ],
)
def test_a_sensor_that_lies_is_found_by_what_should_move_it(what, says):
    """A frozen converter shows itself when the current moves, a dead force sensor at full current."""
    stroke = np.concatenate([np.linspace(0, 1.5, 300), np.full(2000, 1.5)])
    with open_device(f"bench:?break={what}") as device:
        recording = device.play(stroke, 1000)
        assert device._status().state == State.FAULT
    assert not recording.complete
    assert says in recording.fault


def test_lowered_limits_trip():
    """Over-current and over-force by limits lowered beforehand; the next play clears the latch."""
    with open_device("bench:") as device:
        device.set_parameter("current_trip", 4000)
        recording = device.play(HALF_AMP, 1000)
        assert "current above its hard limit" in recording.fault
        device.set_parameter("current_trip", 16_500)
        device.set_parameter("force_trip", 3000)
        recording = device.play(np.linspace(0, 1.5, 1000), 1000)
        assert "force above its limit" in recording.fault
        assert 2.9 < recording.force_N.max() < 3.5
        device.set_parameter("force_trip", 15_000)
        assert device.play([0.1], 1000).complete


def test_too_long_an_on_time_is_refused(wire):
    """A reference longer than the on-time is refused by the program, and by the device itself."""
    with open_device("bench:") as device:
        device.set_parameter("on_time", 2)
        with raises(ArgumentError, "not in so long"):
            device.play(HALF_AMP, 1000)
        assert device.play(HALF_AMP[:1890], 1000).complete
    one = wire("bench:")
    one.session.hello()
    one.ask(m.WaveBegin(899_900, 10, 0))
    with pytest.raises(RefusedError) as caught:
        one.ask(m.WaveBegin(899_901, 10, 0))
    assert caught.value.nak.code == NakCode.RANGE


@pytest.mark.parametrize(("speed", "silent_s"), [("real", 1.0), ("max", 2.5)])
def test_a_silent_host_trips_the_heartbeat(wire, speed, silent_s):
    """200 ms of device time without a command: ramp down, off, latched."""
    one = wire(f"bench:?speed={speed}")
    one.start(np.full(1000, 5000, dtype=np.int16))
    time.sleep(silent_s)
    status = one.wait_for(State.FAULT)
    assert status.fault == Fault.HEARTBEAT
    assert 2000 <= status.fault_tick <= 2100


@pytest.mark.parametrize(("speed", "pause_s"), [("real", 0.08), ("max", 0.3), ("max", 1.5)])
def test_a_slow_host_does_not_trip_the_heartbeat(wire, speed, pause_s):
    """A command now and then is enough; at full speed the device waits for a host that is merely slow."""
    one = wire(f"bench:?speed={speed}")
    one.start(np.full(900, 5000, dtype=np.int16))
    for _ in range(4 if pause_s < 1 else 1):
        time.sleep(pause_s)
        one.beat()
    assert one.status().fault == Fault.NONE


def test_a_shorter_heartbeat_is_kept():
    """The host beats five times in whatever patience the device has."""
    with open_device("bench:") as device:
        device.set_parameter("heartbeat", 50)
        assert device.info.heartbeat_s == 0.05
        assert device.play(np.full(20_000, 0.5), 1000).complete


def test_an_armed_device_left_alone_disarms(wire):
    """ARM without START is no resting place."""
    one = wire("bench:?speed=real")
    hello = one.session.hello()
    one.ask(m.WaveBegin(1, 10, 0))
    one.ask(m.WaveData(0, 1, b"\1\0"))
    with pytest.raises(RefusedError) as caught:
        one.ask(m.WaveCommit(1, 0))
    assert caught.value.nak.code == NakCode.CRC
    one.ask(m.WaveCommit(1, zlib.crc32(b"\1\0")))
    one.ask(m.Arm(hello.boot_nonce))
    time.sleep(0.5)
    assert one.wait_for(State.FAULT).fault == Fault.HEARTBEAT


@pytest.mark.slow
def test_a_reference_that_stops_coming_is_an_underrun(wire):
    """The host lives but sends no samples: ramp to zero and fault, never hold the last value."""
    one = wire("bench:")
    one.start(np.full(122, 5000, dtype=np.int16), total=1000)
    deadline = time.monotonic() + 10
    ack = one.beat()
    while ack.state == State.RUNNING:
        assert time.monotonic() < deadline
        time.sleep(0.02)
        ack = one.beat()
    status = one.wait_for(State.FAULT)
    assert status.fault == Fault.UNDERRUN
    assert status.fault_tick == 121 * 10


def test_credit_is_never_exceeded(wire):
    """More samples than there is room for are refused, and what is announced as free is free."""
    one = wire("bench:")
    one.session.hello()
    one.ask(m.WaveBegin(5000, 10, 0))
    sent, ack = 0, one.beat()
    while ack.credit >= 61:
        ack = one.ask(m.WaveData(sent, 61, bytes(122)))
        sent += 61
        assert ack.credit == 1024 - sent
    with pytest.raises(RefusedError) as caught:
        one.ask(m.WaveData(sent, 61, bytes(122)))
    assert caught.value.nak.code == NakCode.CREDIT


def test_a_reset_in_mid_play_is_told_and_nothing_restarts():
    """The device forgets everything; the record until then is kept."""
    with open_device("bench:?break=reset@1.0") as device:
        recording = device.play(HALF_AMP, 1000)
        assert not recording.complete
        assert "restarted in mid-play (cause: external)" in recording.fault
        assert 5000 < recording.tick[-1] <= 10_000
        assert device._status().state == State.IDLE


def test_a_hanging_main_loop_is_reset_by_the_watchdog():
    """The tick goes on, but nobody feeds: the watchdog restarts the device."""
    with open_device("bench:?break=hang@1.0") as device:
        recording = device.play(HALF_AMP, 1000)
    assert not recording.complete
    assert "restarted in mid-play (cause: watchdog)" in recording.fault


def test_a_port_that_vanishes_keeps_what_came():
    """The firmware process killed in mid-play is a lost port, not a hang; the samples stay."""
    with open_device("bench:?speed=real") as device:

        def kill(block):
            if block.tick[-1] > 3000:
                os.kill(device._port.machine.pid, signal.SIGKILL)

        recording = device.play(np.full(20_000, 0.5), 1000, on_block=kill)
    assert not recording.complete
    assert "gone" in recording.fault or "did not answer" in recording.fault
    assert len(recording.tick) > 300
    assert recording.dropped_samples == 0


def test_a_fault_left_by_an_earlier_program_is_reported(wire):
    """Who opens the device after a fault learns of it."""
    one = wire("bench:?speed=real")
    one.start(np.full(1000, 5000, dtype=np.int16))
    time.sleep(0.5)
    one.wait_for(State.FAULT)
    with pytest.raises(RefusedError) as caught:
        one.ask(m.WaveBegin(10, 10, 0))
    assert caught.value.nak.code == NakCode.FAULT
    assert "heard nothing" in caught.value.message


def test_a_host_that_does_not_read_loses_counted_samples(wire):
    """Telemetry that finds no room is counted and left out; what arrives is right."""
    one = wire("bench:?speed=real")  # at full speed the device would wait for its reader
    one.start(np.arange(1000, dtype=np.int16), decimation=1)
    for k in range(60):  # alive, but deaf
        one.transport.write(encode(Frame(m.Heartbeat.TYPE, k, one.session.next_beat().pack())))
        time.sleep(0.02)
    one.wait_for(State.IDLE)
    deadline = time.monotonic() + 3
    while not (one.telemetry and one.telemetry[-1].flags & 1):
        one.session.receive()
        assert time.monotonic() < deadline
    status = one.status()
    received = sum(b.count for b in one.telemetry)
    assert status.produced == 9991
    assert status.dropped > 0
    assert received + status.dropped == status.produced
    for block in one.telemetry:
        references = np.frombuffer(block.items, dtype="<i2").reshape(block.count, -1)[:, 0]
        np.testing.assert_array_equal(references, (block.first_tick + np.arange(block.count)) // 10)


def test_lost_blocks_are_counted_not_filled(pulse):
    """Damage on the way to the host costs whole blocks; the record has a gap of just that size."""
    with open_device("bench:") as device:
        intact, hurt = device._port.transport.read, [0]

        def damage():
            data = bytearray(intact())
            if len(data) > 100 and hurt[0] < 5:
                data[len(data) // 2] ^= 0x55
                hurt[0] += 1
            return bytes(data)

        device._port.transport.read = damage
        recording = device.play(np.tile(pulse, 10), 1000)
        device._port.transport.read = intact
    assert hurt[0] > 0
    assert recording.complete
    assert recording.dropped_samples > 0
    assert len(recording.tick) + recording.dropped_samples == 20_000
    expected = np.tile(pulse, 10)[recording.tick // 10]
    np.testing.assert_allclose(recording.reference_A, expected, atol=1e-4)
