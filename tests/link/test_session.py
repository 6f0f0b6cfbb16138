"""Greeting and talking through noise, strangers and other versions."""

from __future__ import annotations

import os
import threading
import time
import tty

import numpy as np
import pytest

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import MAGIC, Fault, State
from pulsetrainer.device.exchange import Exchange, NoAnswerError
from pulsetrainer.device.frames import Frame, encode
from pulsetrainer.device.transport import SerialTransport
from pulsetrainer.errors import DeviceError
from pulsetrainer.simulation.build import firmware_executable
from wording import raises


def test_greeting_gets_through_garbage(wire):
    """Whatever bytes lie on the line when the port opens, the handshake finds the device."""
    one = wire("bench:")
    one.transport.write(os.urandom(700) + encode(Frame(3, 1, b""))[:3])
    assert one.session.hello().magic == MAGIC


def test_a_program_killed_in_mid_upload_leaves_nothing_behind(wire):
    """Half a reference, half a frame and unread replies: the next program greets and plays as if alone."""
    one = wire("bench:")
    one.session.hello()
    one.ask(m.WaveBegin(5000, 10, 1))
    for at in range(0, 610, 61):
        one.ask(m.WaveData(at, 61, bytes(122)))
    for seq in range(5):
        one.transport.write(encode(Frame(m.Status.TYPE, seq, b"")))  # nobody reads the answers
    one.transport.write(encode(Frame(m.WaveData.TYPE, 7, m.WaveData(610, 61, bytes(122)).pack()))[:70])
    one.session = Exchange(one.transport, "bench:", monotonic=time.monotonic)
    one.session.on_telemetry = one.telemetry.append
    one.start(np.full(200, 3000, dtype=np.int16))
    assert one.wait_for(State.IDLE).fault == Fault.NONE
    while not one.telemetry or not one.telemetry[-1].flags & 1:
        one.session.receive()
    assert sum(b.count for b in one.telemetry) == 200


@pytest.mark.slow
def test_the_whole_firmware_under_the_sanitizers(wire):
    """Garbage, a play, a fault and a stop: neither address nor undefined-behaviour sanitizer has a word."""
    sanitized = firmware_executable(("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"))
    one = wire("bench:?break=tick-overrun@0.2", sanitized)
    one.transport.write(np.random.default_rng(4).bytes(3000))
    one.start((5000 - 5000 * np.cos(np.arange(900) / 50)).astype(np.int16), decimation=1)
    assert one.wait_for(State.FAULT).fault == Fault.TICK_OVERRUN
    one.clear_fault()
    one.start(np.full(300, 3000, dtype=np.int16))
    one.ask(m.Stop())
    one.wait_for(State.IDLE)
    assert one.bench._process.poll() is None  # a sanitizer that finds something ends the process


def test_a_repeated_command_is_done_once(wire):
    """The same sequence number again: the same answer, from memory."""
    one = wire("bench:")
    one.session.hello()
    for _ in range(2):  # a lost reply, simulated by rewinding the sequence
        one.session._seq = 76
        reply = one.ask(m.SetParam(2, 5000))
        assert isinstance(reply, m.ParamReply)


def test_late_and_doubled_replies_are_ignored(wire):
    """Three times the same command on the wire: the next command still gets its own answer."""
    one = wire("bench:")
    one.session.hello()
    for _ in range(3):
        one.transport.write(encode(Frame(m.Heartbeat.TYPE, 99, m.Heartbeat(1).pack())))
    assert isinstance(one.ask(m.Status()), m.StatusReply)
    assert isinstance(one.ask(m.GetParam(0)), m.ParamReply)


def test_another_protocol_major_is_named_with_the_remedy(wire):
    """Both versions and what to do are in the message."""
    newer = wire("bench:", firmware_executable(("-DPT_PROTOCOL_MAJOR=3u",)))
    minor = codes.PROTOCOL_MINOR
    with raises(DeviceError, "older program", ours=f"program 2.{minor}", theirs=f"protocol 3.{minor}"):
        newer.session.hello()
    older = wire("bench:", firmware_executable(("-DPT_PROTOCOL_MAJOR=0u",)))
    with raises(DeviceError, "older device", ours=f"program 2.{minor}", theirs=f"protocol 0.{minor}"):
        older.session.hello()


def test_another_minor_version_is_fine(wire):
    """A newer minor version of the same protocol is spoken to, and a patched firmware."""
    assert wire("bench:", firmware_executable(("-DPT_PROTOCOL_MINOR=7u",))).session.hello().minor == 7
    assert (
        wire("bench:", firmware_executable(("-DPT_FIRMWARE_PATCH=9u",))).session.hello().firmware_patch == 9
    )


def test_another_firmware_generation_is_named_with_the_remedy(wire):
    """The same protocol, but a firmware that this program does not come with."""
    newer = wire("bench:", firmware_executable(("-DPT_FIRMWARE_MAJOR=1u",)))
    ours, patch = f"firmware 0.2.{codes.FIRMWARE_PATCH}", codes.FIRMWARE_PATCH
    with raises(DeviceError, "older program", ours=ours, theirs=f"firmware 1.2.{patch}"):
        newer.session.hello()
    older = wire("bench:", firmware_executable(("-DPT_FIRMWARE_MINOR=0u",)))
    with raises(DeviceError, "older device", ours=ours, theirs=f"firmware 0.0.{patch}"):
        older.session.hello()


def test_an_answer_to_something_else_is_none(wire):
    """Left-over replies that carry just the next sequence number, but are of another kind, are not taken."""
    one = wire("bench:")
    one.session.hello()
    one.session._seq = 40
    for seq in range(41, 44):
        one.transport.write(encode(Frame(m.Heartbeat.TYPE, seq, m.Heartbeat(1).pack())))
        one.transport.write(encode(Frame(m.GetParam.TYPE, seq, b"\x07")))
        one.transport.write(encode(Frame(m.Start.TYPE, seq, b"")))  # a refusal
    assert isinstance(one.ask(m.Status()), m.StatusReply)
    reply = one.ask(m.GetParam(3))
    assert isinstance(reply, m.ParamReply)
    assert reply.id == 3
    assert isinstance(one.beat(), m.Ack)
    assert one.session.rejected >= 3


def test_a_start_that_comes_twice_is_one_run(wire):
    """A wire that repeats ARM and START after the reply got lost: acknowledged, the same session goes on."""
    one = wire("bench:?speed=real")
    hello = one.start(np.full(900, 3000, dtype=np.int16))
    last, session = one.session._seq, one.status().session
    for frame in (
        Frame(m.Arm.TYPE, (last - 1) & 0xFF, m.Arm(hello.boot_nonce).pack()),
        Frame(m.Start.TYPE, last, b""),
    ):
        one.transport.write(encode(frame))
    one.session._seq = (last - 1) & 0xFF  # the next command carries START's number
    ack = one.ask(m.Start())
    assert isinstance(ack, m.Ack)
    assert (ack.state, ack.session) == (State.RUNNING, session)
    assert one.status().fault == Fault.NONE


def test_a_new_program_on_a_running_device_stops_it(wire):
    """Who greets takes over: the run that was left ends, its stale telemetry harms nobody."""
    one = wire("bench:?speed=real")
    one.start(np.full(1000, 5000, dtype=np.int16))
    time.sleep(0.1)
    later = Exchange(one.transport, "bench:", monotonic=time.monotonic)
    assert later.hello().magic == MAGIC
    one.session = later
    assert one.wait_for(State.IDLE).fault == Fault.NONE


@pytest.fixture
def stranger():
    """A pty with somebody else behind it: call with what it says, again and again."""
    ends, stop = os.openpty(), threading.Event()
    tty.setraw(ends[1])
    threads: list[threading.Thread] = []

    def behave(says: bytes) -> str:
        def talk() -> None:
            os.set_blocking(ends[0], False)
            while not stop.wait(0.02):
                try:
                    os.write(ends[0], says)
                except BlockingIOError:
                    continue

        threads.append(threading.Thread(target=talk, daemon=True))
        threads[-1].start()
        return os.ttyname(ends[1])

    yield behave
    stop.set()
    for thread in threads:
        thread.join()
    for end in ends:
        os.close(end)


@pytest.fixture
def impatient(monkeypatch):
    """Give up greeting early: these tests wait for exactly that."""
    monkeypatch.setattr("pulsetrainer.device.exchange._HELLO_S", 0.5)


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("says", [b"$GPGGA,123519,4807.038,N*47\r\n", b"\0\x05abcd\0" * 20])
def test_a_device_that_is_not_ours_is_told(stranger, says):
    """Something talks, but it is not the firmware."""
    transport = SerialTransport(stranger(says))
    with raises(DeviceError, "not our device", port="port"):
        Exchange(transport, "port", monotonic=time.monotonic).hello()
    transport.close()


@pytest.mark.usefixtures("impatient")
def test_nobody_is_told(stranger):
    """Silence is another message than a stranger."""
    transport = SerialTransport(stranger(b""))
    with raises(NoAnswerError, "nobody answers", port="port"):
        Exchange(transport, "port", monotonic=time.monotonic).hello()
    transport.close()


def test_damaged_replies_are_asked_for_again(wire):
    """A flipped byte in a reply costs a retry, not an error."""
    one = wire("bench:")
    one.session.hello()
    intact, count = one.transport.read, [0]

    def damage() -> bytes:
        data = bytearray(intact())
        if data:
            count[0] += 1
            if count[0] % 3 == 1:
                data[len(data) // 2] ^= 0x10
        return bytes(data)

    one.transport.read = damage
    for k in range(30):
        reply = one.ask(m.GetParam(k % 10))
        assert isinstance(reply, m.ParamReply)
        assert reply.id == k % 10
    assert one.session.damaged > 5
