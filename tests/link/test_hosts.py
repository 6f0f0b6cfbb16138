"""Hosts: two in a row, old and new ones, and wires that say again what a host once said."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scripted import ScriptedDevice

from pulsetrainer.device import codes, exchange
from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import PARAMETERS, Fault, State
from pulsetrainer.device.device import Device
from pulsetrainer.device.exchange import RefusedError
from pulsetrainer.device.frames import Frame, encode
from pulsetrainer.device.limits import Limits
from pulsetrainer.device.opening import open_device
from pulsetrainer.device.schemes import OpenPort
from pulsetrainer.device.wording import describe_not_off, flows_A
from pulsetrainer.errors import DeviceError
from pulsetrainer.simulation.build import firmware_executable
from wording import raises

# --- two hosts in a row ----------------------------------------------------------------------------------


def test_what_one_host_sets_does_not_hold_for_the_next(wire):
    """Limits and gains end with the host that set them: the next one plays by the defaults."""
    port = OpenPort(wire("bench:").transport, "bench:", starts_cold=True)
    first = Device(port)
    first.lower(Limits(current_A=0.4, force_N=2.0))
    for row in PARAMETERS:
        if row.name.startswith(("pid", "feed")):
            first.set_parameter(row.name, row.minimum)
    assert (first.info.current_limit_A, first.info.force_limit_N) == (0.4, 2.0)
    second = Device(port)
    held = {row.name: second._ask(m.GetParam(row.id)).value for row in PARAMETERS}
    assert held == {row.name: row.default for row in PARAMETERS}
    assert (second.info.current_limit_A, second.info.force_limit_N) == (1.5, 15.0)
    trace = second.play(np.linspace(0, 0.9, 1000), 1000)
    assert trace.complete
    assert np.abs(trace.current_A - trace.reference_A).max() < 0.015


def test_limits_hold_for_every_play_of_the_host_that_set_them():
    """No later command of the same host takes them back."""
    with open_device("bench:", limits=Limits(force_N=3.0)) as device:
        for _ in range(3):
            device.set_parameter("heartbeat", 150)
            trace = device.play(np.linspace(0, 1.0, 1000), 1000)
            assert "force above its limit" in trace.fault
            assert trace.force_N.max() < 3.5


def test_a_fault_that_nobody_was_told_of_is_told_before_it_is_cleared():
    """Latched between two plays: the next play says so and clears nothing, the one after that clears it."""
    script = ScriptedDevice()
    latched = {"fault": Fault.STRAY_CURRENT, "worst": Fault.STRAY_CURRENT, "fault_current": 2400}
    with script.open() as device:
        assert device.play([0.1, 0.1], 1000).complete
        script.status = {"state": State.FAULT} | latched
        usual_ack = script.answer

        def answer(command, usual):
            if isinstance(usual, m.Ack) and script.status:
                usual = m.Ack(*(getattr(usual, name) for name, _ in m.Ack.wire_fields()))
                usual = m.Ack(usual.credit, State.FAULT, Fault.STRAY_CURRENT, usual.session, usual.tick, 0)
            if isinstance(command, m.ClearFault):
                script.status = {}
            return usual

        script.answer = answer
        with raises(DeviceError, "stray current"):
            device.play([0.1, 0.1], 1000)
        assert script.when(m.ClearFault) == []
        device.play([0.1, 0.1], 1000)
        cleared = [command for _, command in script.heard if isinstance(command, m.ClearFault)]
        assert [(one.fault, one.worst) for one in cleared] == [(Fault.STRAY_CURRENT, Fault.STRAY_CURRENT)]
        assert usual_ack is not answer


def test_a_fault_that_was_cleared_is_not_that_of_the_next_play():
    """The play before ended in an underrun; this one because the device has gone."""
    script = ScriptedDevice()
    told = {"fault": Fault.UNDERRUN, "worst": Fault.UNDERRUN}
    script.status = told

    def answer(command, usual):
        if isinstance(usual, m.Ack) and script.status:
            usual = m.Ack(usual.credit, State.FAULT, Fault.UNDERRUN, usual.session, usual.tick, 0)
        if isinstance(command, m.ClearFault):
            script.status = {}
        return None if isinstance(command, m.Start) else usual

    with script.open() as device:
        script.answer = answer
        trace = device.play(np.full(100, 0.1), 1000)
        assert script.when(m.ClearFault)
        script.answer = lambda _, usual: usual
    assert "did not answer Start" in trace.fault
    assert (trace.underrun, trace.fault_code) == (False, 0)


@pytest.mark.parametrize("first", [Fault.UNDERRUN, Fault.HEARTBEAT])
def test_a_play_is_known_by_its_first_fault(first):
    """An underrun is what began it, whatever was worse on the way to rest."""
    script = ScriptedDevice()
    with script.open() as device:

        def answer(command, usual):
            if isinstance(command, m.Start):
                script.status = {"state": State.FAULT, "fault": first, "worst": Fault.STRAY_CURRENT}
            return usual

        script.answer = answer
        trace = device.play(np.full(100, 0.1), 1000)
    assert (trace.underrun, trace.fault_code) == (first == Fault.UNDERRUN, first)


def test_a_fault_of_the_last_play_is_cleared_by_the_next(device):
    """It was told when the play ended."""
    device.set_parameter("current_trip", 4000)
    assert "current above" in device.play(np.full(300, 0.5), 1000).fault
    device.set_parameter("current_trip", 16_500)
    assert device.play([0.1, 0.1], 1000).complete


# --- current that flows on -------------------------------------------------------------------------------


def test_current_that_flows_on_is_said_before_anything_else():
    """The first cause stands behind it; the next step is the plug."""
    script = ScriptedDevice()
    with script.open() as device:
        script.status = {
            "state": State.FAULT, "fault": Fault.OVER_CURRENT, "worst": Fault.OUTPUT_NOT_OFF,
            "flags": codes.STATUS_OUTPUT_NOT_OFF, "current": 24_000,
        }  # fmt: skip
        trace = device.play(np.full(100, 0.5), 1000)
    assert not trace.complete
    assert trace.fault.startswith("the output could not be switched off: 2.4 A still flow")
    assert "hard limit" in trace.fault
    assert "plug" in trace.remedy


@pytest.mark.parametrize(
    ("state", "current", "flows"),
    [
        (State.IDLE, 990, 0.0),
        (State.IDLE, 1010, 0.101),
        (State.FAULT, 1010, 0.101),
        (State.RUNNING, 1010, 0.0),
        (State.RAMPING, 1010, 0.0),
    ],
)
def test_a_tenth_of_an_ampere_flows_on(state, current, flows):
    """In every state in which the output is off; less is the zero of the sensor."""
    nothing = dict.fromkeys([name for name, _ in m.StatusReply.wire_fields()], 0)
    status = m.StatusReply(**nothing | {"state": state, "current": current})
    assert flows_A(status) == pytest.approx(flows)
    assert bool(describe_not_off(status)) is (flows > 0)


def test_current_that_flows_at_rest_is_said_without_the_device_knowing():
    """The host looks at the live reading itself, and it waits for a current that is just decaying."""
    script = ScriptedDevice()
    with script.open() as device:
        script.status = {"current": 5000}
        assert "0.5 A still flow" in device.play(np.full(100, 0.5), 1000).fault
    late = ScriptedDevice()
    with late.open() as device:

        def answer(command, usual):
            stopped = [at for at in late.when(m.Stop) if late.session and at > late.started_s]
            if stopped and isinstance(command, m.Status):
                late.status = {"current": 5000 if late.now_s < stopped[0] + 0.05 else 0}
                return late._usual(command)
            return usual

        late.answer = answer
        assert device.play(np.full(100, 0.5), 1000).complete


def test_no_device_is_opened_while_its_current_flows():
    """Nothing is played on it, and the plug is the next step."""
    script = ScriptedDevice()
    script.status = {"current": 24_000, "flags": codes.STATUS_OUTPUT_NOT_OFF}
    with raises(DeviceError, "current flows on", amperes="2.4 A"):
        script.open()


# --- a wire that repeats ---------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("repeated", ["heartbeat", "status", "samples", "start"])
def test_a_stuck_wire_does_not_keep_a_play_alive(wire, repeated):
    """One frame again and again, on the real firmware: it switches off within its heartbeat, and says why."""
    one = wire("bench:?speed=real")
    samples = np.full(900, 3000, dtype=np.int16)
    hello = one.start(samples)
    beat = one.session.next_beat()
    one.ask(beat)
    again = {
        "heartbeat": beat,
        "status": m.Status(),
        "samples": m.WaveData(0, 61, samples[:61].astype("<i2").tobytes()),
        "start": m.Start(),
    }[repeated]
    frame = encode(Frame(again.TYPE, one.session._seq, again.pack()))
    deadline = time.monotonic() + 0.6
    while time.monotonic() < deadline:
        one.transport.write(frame)
        time.sleep(0.02)
        one.transport.read()
    status = one.wait_for(State.FAULT)
    assert Fault(status.fault) == Fault.HEARTBEAT
    assert status.fault_tick <= 10 * hello.heartbeat_ms + 1000  # ticks: its patience, and a slow start


# --- versions --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("host", "older"),
    [(codes.PROTOCOL_MAJOR - 1, "program"), (codes.PROTOCOL_MAJOR + 1, "device")],
)
def test_an_old_and_a_new_host_on_this_firmware(wire, monkeypatch, host, older):
    """Both versions and what to do are said; and whoever arms nevertheless is refused by the firmware."""
    theirs = f"protocol {codes.PROTOCOL_MAJOR}."
    monkeypatch.setattr(codes, "PROTOCOL_MAJOR", host)
    one = wire("bench:")
    with raises(DeviceError, f"older {older}", ours=f"this program {host}.", theirs=theirs):
        one.session.hello()
    one.ask(m.WaveBegin(1, 10, 0))
    with pytest.raises(RefusedError) as refused:
        one.ask(m.Arm(0))
    assert refused.value.nak.code == codes.NakCode.VERSION


@pytest.mark.parametrize(
    ("major", "older"),
    [(codes.PROTOCOL_MAJOR - 1, "device"), (codes.PROTOCOL_MAJOR + 1, "program")],
)
def test_this_host_on_an_old_and_a_new_firmware(wire, major, older):
    """The firmware compiled with another version of the protocol."""
    one = wire("bench:", firmware_executable((f"-DPT_PROTOCOL_MAJOR={major}u",)))
    ours = f"this program {codes.PROTOCOL_MAJOR}."
    with raises(DeviceError, f"older {older}", ours=ours, theirs=f"protocol {major}."):
        one.session.hello()


@pytest.mark.parametrize("length", [-1, 1, 40])
def test_a_greeting_of_another_layout_is_told_by_its_version(length):
    """Should a later version have changed the greeting after all: its first fields still say which it is."""
    script = ScriptedDevice()
    major = codes.PROTOCOL_MAJOR + 1
    script.hello = {"major": major, "firmware_major": 3}
    raw = script._usual(m.Hello(0, 0, 0)).pack()
    payload = raw[:length] if length < 0 else raw + bytes(length)
    write = script.write

    def answer(data: bytes) -> None:
        before = len(script.heard)
        write(data)
        if len(script.heard) > before and isinstance(script.heard[-1][1], m.Hello):
            frame = next(iter(exchange.FrameReader().feed(data)))
            script._out = encode(Frame(m.HelloReply.TYPE, frame.seq, payload))

    script.write = answer
    theirs = f"protocol {major}.{codes.PROTOCOL_MINOR}"
    with raises(DeviceError, "older program", ours="this program", theirs=theirs):
        script.open()
