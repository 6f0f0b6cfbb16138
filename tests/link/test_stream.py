"""An open-ended wave: made while it is played, on the real firmware."""

from __future__ import annotations

import time
import zlib

import numpy as np
import pytest
from link_wire import within
from scripted import ScriptedDevice

from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import CURRENT_UNIT_A, WAVE_OPEN
from pulsetrainer.device.feed import Feed
from pulsetrainer.device.opening import open_device
from pulsetrainer.errors import ArgumentError, DeviceError


class Pieces:
    """Gives pieces one after the other, and counts how many were asked for."""

    def __init__(self, *pieces: np.ndarray) -> None:
        self.left = list(pieces)
        self.asked = 0

    def __call__(self) -> np.ndarray | None:
        """Return the next piece."""
        self.asked += 1
        return self.left.pop(0) if self.left else None


def test_a_wave_made_in_pieces_is_played_as_one(device, pulse):
    """Every sample comes back, in order, over more than the device's buffer holds."""
    blocks = []
    trace = device.stream(Pieces(*np.array_split(np.tile(pulse, 3), 17)), 1000, on_block=blocks.append)
    assert trace.complete
    assert (trace.fault, trace.dropped_samples, trace.samples) == ("", 0, 6000)
    played = np.concatenate([b.reference_A for b in blocks])
    np.testing.assert_allclose(played, np.tile(pulse, 3), atol=CURRENT_UNIT_A)


@pytest.mark.realtime
def test_the_next_piece_is_asked_for_as_late_as_the_lead_allows(pulse):
    """At real speed a piece of 0.2 s is made when less than the lead is left, by telemetry 0.1 s old."""
    ahead, made, seen = [], [0], [0]

    def more() -> np.ndarray | None:
        ahead.append(made[0] - seen[0])
        if len(ahead) > 15:
            return None
        made[0] += 200
        return pulse[:200]

    def on_block(block) -> None:
        seen[0] = int(block.tick[-1]) // 10

    with open_device("bench:?speed=real") as device:
        assert device.stream(more, 1000, lead_s=0.5, on_block=on_block).complete
    assert max(ahead) < 600


def test_a_wave_of_one_sample_is_a_play(device):
    """The shortest one."""
    assert device.stream(Pieces(np.array([0.2])), 1000).complete


def test_nothing_to_play_is_refused(device):
    """No sample, no play; the device is ready for the next one."""
    with pytest.raises(ArgumentError):
        device.stream(Pieces(), 1000)
    assert device.stream(Pieces(np.zeros(10)), 1000).complete


@pytest.mark.parametrize("bad", [np.array([np.nan]), np.array([9.0]), np.array([-0.1])])
def test_a_piece_that_cannot_be_played_stops_the_output(device, pulse, bad):
    """What is wrong in mid-play ends the play, and says so."""
    with pytest.raises(ArgumentError):
        device.stream(Pieces(pulse, bad, pulse), 1000)
    assert device.stream(Pieces(np.zeros(10)), 1000).complete


def test_a_maker_that_fails_stops_the_output(device, pulse):
    """The maker's own error comes through, and the device is ready for the next play."""
    pieces = Pieces(pulse)

    def more() -> np.ndarray | None:
        if pieces.asked:
            raise ZeroDivisionError
        return pieces()

    with pytest.raises(ZeroDivisionError):
        device.stream(more, 1000)
    assert device.stream(Pieces(np.zeros(10)), 1000).samples == 10


def test_a_maker_that_is_too_slow_is_an_underrun(pulse):
    """At real speed a second without samples ramps down: the fault is told, nothing is held."""
    pieces = Pieces(pulse[:600], pulse[:600], pulse[:600])

    def more() -> np.ndarray | None:
        if pieces.asked:
            time.sleep(1.5)
        return pieces()

    with open_device("bench:?speed=real") as device, within(10):
        trace = device.stream(more, 1000)
        assert not trace.complete
        assert trace.underrun
        assert device.stream(Pieces(np.zeros(10)), 1000).complete


def test_stopping_ends_the_wave(device, pulse):
    """``should_stop`` ends an endless wave."""
    seen = []
    trace = device.stream(
        lambda: pulse, 1000, on_block=lambda b: seen.append(b.tick[-1]), should_stop=lambda: len(seen) > 3
    )
    assert trace.fault == "stopped"
    assert not trace.complete


def test_the_host_asks_whether_all_has_arrived(pulse):
    """Each thousand samples, and at the end: the CRC-32 of what was sent."""
    script = ScriptedDevice()
    with script.open() as device:
        device.stream(Pieces(*([pulse] * 3)), 1000, lead_s=10.0)
    checks = [command for _, command in script.heard if isinstance(command, m.WaveCheck)]
    begun = [command for _, command in script.heard if isinstance(command, m.WaveBegin)]
    wire = np.rint(np.tile(pulse, 3) / CURRENT_UNIT_A).astype("<i2").tobytes()
    assert begun[0].total == WAVE_OPEN
    assert [c.end for c in checks] == [0] * (len(checks) - 1) + [1]
    assert checks[-1].count == 6000
    for check in checks:
        assert check.crc32 == zlib.crc32(wire[: 2 * check.count])


def test_firmware_that_knows_no_open_ended_wave_is_told_so(pulse):
    """Minor version 0 of the protocol plays as before, and both versions are named when it is to stream."""
    script = ScriptedDevice()
    script.hello = {"minor": 0}
    with script.open() as device:
        with pytest.raises(DeviceError) as raised:
            device.stream(Pieces(pulse), 1000)
        assert "2.0" in raised.value.message
        assert "2.1" in raised.value.message
        assert not script.when(m.WaveBegin)
        assert device.play(np.zeros(10), 1000).samples == 0
        assert script.when(m.WaveBegin)


def test_a_feed_lets_go_of_what_was_taken():
    """What lies before the sample that is asked for is no longer held."""
    feed = Feed()
    for k in range(1000):
        feed.append(np.full(100, k, dtype=np.int16))
        assert feed.piece(100 * k, 61) == np.full(61, k, dtype="<i2").tobytes()
    assert feed.size == 100_000
    assert len(feed._held) < 1000


@pytest.mark.parametrize(("produced", "dropped"), [(12, 12), (0, 0)])
def test_what_the_device_made_and_nobody_received_is_lost(produced, dropped):
    """By the device's own count, where it can be asked: here no telemetry came at all."""
    script = ScriptedDevice()
    script.status = {"produced": produced}
    with script.open() as device:
        trace = device.play(np.zeros(120), 1000)
    assert (trace.samples, trace.dropped_samples) == (0, dropped)
