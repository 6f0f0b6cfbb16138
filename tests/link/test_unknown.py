"""Numbers that this program does not know, and exceptions that no port should raise: told in words."""

from __future__ import annotations

import os
import struct
import termios
import tty

import numpy as np
import pytest
from scripted import ScriptedDevice, message

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.schemes import OpenPort
from pulsetrainer.device.transport import PortLostError, SerialTransport
from pulsetrainer.device.wording import told
from pulsetrainer.errors import DeviceError
from wording import raises

UNKNOWN = 201
HALF_AMP = np.full(500, 0.5)


@pytest.mark.parametrize("kind", [codes.Fault, codes.NakCode, codes.ResetCause, codes.State])
def test_every_number_has_words(kind):
    """Each known number has words of its own; an unknown one is named as it is."""
    texts = [told(kind, number) for number in kind]
    assert len(set(texts)) == len(texts)
    for number in range(256):
        assert isinstance(told(kind, number), str)
    assert str(UNKNOWN) in told(kind, UNKNOWN)
    assert str(UNKNOWN) not in "".join(texts)


def test_a_greeting_with_unknown_numbers():
    """An unknown reset cause and a serial number of odd bytes are shown, not stumbled over."""
    script = ScriptedDevice()
    script.hello = {"reset_cause": UNKNOWN, "serial": b"A\0\x1b[31m\xff".ljust(16, b"\0")}
    with script.open() as device:
        assert str(UNKNOWN) in device.info.reset_cause
        assert device.info.serial.isprintable()
        assert device.info.serial.startswith("A")


@pytest.mark.parametrize("name", ["tick_rate_Hz", "wave_buffer", "heartbeat_ms", "force_trip"])
def test_a_greeting_that_makes_no_sense(name):
    """A zero that everything would be divided by is a device error that names it."""
    script = ScriptedDevice()
    script.hello = {name: 0}
    with raises(DeviceError, "names it", named=name):
        script.open()


@pytest.mark.parametrize("fault", [UNKNOWN, 255, max(codes.Fault) + 1])
def test_an_unknown_fault_ends_a_play_with_its_number(fault):
    """A later firmware may latch what this program has no words for."""
    script = ScriptedDevice()
    with script.open() as device:
        script.status = {"fault": fault, "fault_tick": 1234}
        trace = device.play(HALF_AMP, 1000)
        assert not trace.complete
        assert str(fault) in trace.fault
        assert "0.1234 s" in trace.fault


def test_an_unknown_state_ends_a_play():
    """It is neither running nor at rest: STOP, and the state's number is told."""
    script = ScriptedDevice()
    with script.open() as device:
        script.status = {"state": UNKNOWN}
        trace = device.play(HALF_AMP, 1000)
    assert not trace.complete
    assert str(UNKNOWN) in trace.fault


def test_an_unknown_refusal_names_its_number():
    """The refusal of a parameter with a code from the future."""
    script = ScriptedDevice()
    refusal = message(m.Nak, code=UNKNOWN, command=m.SetParam.TYPE, fault=UNKNOWN + 1)
    with script.open() as device:
        script.answer = lambda command, usual: refusal if isinstance(command, m.SetParam) else usual
        with raises(DeviceError, "refused by number", code=UNKNOWN, fault=UNKNOWN + 1):
            device.set_parameter("force_trip", 3000)


def test_an_unknown_reset_cause_in_mid_play():
    """The restart is told, and its cause by number."""
    script = ScriptedDevice()
    with script.open() as device:
        script.status = {"boot_nonce": 77, "reset_cause": UNKNOWN}
        trace = device.play(HALF_AMP, 1000)
    assert "restarted in mid-play" in trace.fault
    assert str(UNKNOWN) in trace.fault


class _Library:
    """A pyserial port that raises."""

    in_waiting = 1

    def __init__(self, error: Exception) -> None:
        self.error = error

    def _fail(self, *_: object) -> bytes:
        raise self.error

    read = write = reset_input_buffer = close = _fail


RAISED = [
    termios.error(5, "Input/output error"),
    OSError(5, "Input/output error"),
    TypeError("'NoneType' object cannot be interpreted as an integer"),
    ValueError("file descriptor cannot be a negative integer (-1)"),
    AttributeError("'NoneType' object has no attribute 'hEvent'"),
    struct.error("unpack requires a buffer of 4 bytes"),
]


@pytest.fixture
def port():
    """A transport on a pty of our own."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    transport = SerialTransport(os.ttyname(theirs), "the-port")
    yield transport
    for end in (ours, theirs):
        os.close(end)


@pytest.mark.parametrize("error", RAISED, ids=lambda error: type(error).__name__)
def test_whatever_a_port_raises_it_is_gone(port, error):
    """Reading, sending and clearing say which port and what to do; closing says nothing."""
    port._serial.close()
    port._serial = _Library(error)
    for act in (port.read, lambda: port.write(b"\0"), port.discard):
        with raises(PortLostError, "names it", named="the-port"):
            act()
    port.close()


@pytest.mark.parametrize("error", RAISED, ids=lambda error: type(error).__name__)
def test_whatever_opening_raises_is_a_device_error(monkeypatch, error):
    """The port is named, and there is a next step."""

    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("pulsetrainer.device.transport.serial.serial_for_url", fail)
    with raises(DeviceError, "names it", named="/dev/ttyUSB3"):
        SerialTransport("/dev/ttyUSB3")


@pytest.mark.parametrize("error", RAISED, ids=lambda error: type(error).__name__)
def test_a_port_that_fails_in_mid_play_ends_it(error):
    """What was recorded is kept; the fault says that the port is gone."""
    script = ScriptedDevice()
    lost = SerialTransport.__new__(SerialTransport)
    lost._port, lost._serial = "scripted:", _Library(error)
    intact = script.read

    def read() -> bytes:
        return lost.read() if script.session and script.tick > 2000 else intact()

    script.read = read
    device = script.open()
    trace = device.play(HALF_AMP, 1000)
    device.close()
    assert not trace.complete
    assert "scripted:" in trace.fault
    assert trace.remedy
    assert isinstance(device._port, OpenPort)
