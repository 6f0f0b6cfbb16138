"""Each thing that may not happen to a finger, provoked on the host's firmware and on the emulated Cortex-M4F.

The same test on both: off within its time, the first cause latched with its snapshot, the host told, nothing
that goes on by itself. To the tick exactly the same is tested in C, in firmware/test/test_app.c.
"""

from __future__ import annotations

import shutil
import time

import numpy as np
import pytest

from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import (
    FLAG_LAST,
    PARAMETERS,
    STATUS_OUTPUT_NOT_OFF,
    Fault,
    NakCode,
    ResetCause,
    State,
)
from pulsetrainer.device.exchange import RefusedError
from pulsetrainer.device.opening import open_device
from pulsetrainer.simulation.build import DEBIAN_PACKAGES

QEMU = pytest.param(
    "qemu:",
    marks=[
        pytest.mark.realtime,
        pytest.mark.slow,
        pytest.mark.skipif(
            not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")),
            reason=f"needs apt-get install -y --no-install-recommends {DEBIAN_PACKAGES}",
        ),
    ],
)
everywhere = pytest.mark.parametrize("port", ["bench:", QEMU])

STROKES = (7500 - 7500 * np.cos(2 * np.pi * 2 * np.arange(1000) / 1000)).astype(np.int16)  # two a second
HELD = np.full(1000, 14_500, dtype=np.int16)
PLATEAU = np.full(1000, 5_000, dtype=np.int16)
WEAK = np.full(1000, 1_000, dtype=np.int16)
BETWEEN = np.full(1000, 5_003, dtype=np.int16)  # between two readings, 5001 and 5006: none is right
BREAK_TICK = 3000


def refusal(one, command: m.Message) -> NakCode:
    """Return why the device refuses a command; it must."""
    with pytest.raises(RefusedError) as caught:
        one.ask(command)
    return NakCode(caught.value.nak.code)


def stays_off(one, status: m.StatusReply) -> None:
    """The first cause is latched and told; nothing can be started before it is cleared, nothing after."""
    fault = status.fault
    assert one.beat().fault == fault  # told with every answer
    assert refusal(one, m.WaveBegin(10, 10, 0)) == NakCode.FAULT
    assert refusal(one, m.Arm(status.boot_nonce)) == NakCode.FAULT
    assert refusal(one, m.Start()) == NakCode.STATE
    later = one.status()
    assert (later.state, later.fault, later.fault_tick) == (State.FAULT, fault, status.fault_tick)
    assert one.clear_fault().state == State.IDLE
    assert refusal(one, m.Start()) == NakCode.STATE
    # The record ends with the run: its last block came, and no sample is later than the fault.
    assert one.telemetry[-1].flags & FLAG_LAST
    assert max(b.first_tick for b in one.telemetry if b.count) <= status.fault_tick  # the last may be empty
    assert sum(b.count for b in one.telemetry) == status.produced


@everywhere
@pytest.mark.parametrize(
    ("what", "samples", "fault", "ticks"),
    [
        ("current-rail", STROKES, Fault.OVER_CURRENT, 0),  # in the same tick
        ("force-high", STROKES, Fault.OVER_FORCE, 2),  # the third sample
        ("force-rail", STROKES, Fault.FORCE_RAIL, 2),
        ("current-zero", STROKES, Fault.NO_CURRENT, 60),
        ("current-frozen", STROKES, Fault.CURRENT_FROZEN, 200),
        ("force-frozen", STROKES, Fault.FORCE_FROZEN, 2000),  # once the current has moved 0.9 A
        ("force-zero", HELD, Fault.NO_FORCE, 510),
        ("force-zero", STROKES, Fault.NO_FORCE, 3000),  # counted across strokes
        ("force-half", HELD, Fault.FORCE_IMPLAUSIBLE, 510),
        ("current-stuck", WEAK, Fault.CURRENT_FROZEN, 110),
        ("shunt-half", PLATEAU, Fault.CURRENT_IMPLAUSIBLE, 4100),
        ("stuck-on", PLATEAU, Fault.OVER_CURRENT, 40),
        ("comparator", PLATEAU, Fault.COMPARATOR, 3),
        ("converter", PLATEAU, Fault.CONVERTER, 1),
        ("tick-overrun", STROKES, Fault.TICK_OVERRUN, 2),
    ],
)
def test_what_breaks_is_off_within_its_time(wire, port, what, samples, fault, ticks):
    """A stuck, frozen or lying sensor, too much current or force, a tick that came too late."""
    one = wire(f"{port}?break={what}@{BREAK_TICK / 10_000}")
    one.start(samples)
    status = one.wait_for(State.FAULT)
    assert Fault(status.fault) == fault
    assert BREAK_TICK <= status.fault_tick <= BREAK_TICK + ticks
    assert status.fault_state == State.RUNNING
    assert abs(status.fault_reference - np.interp(status.fault_tick / 10, np.arange(1000), samples)) <= 200
    stays_off(one, status)


@everywhere
def test_a_reading_that_stands_still_beside_a_plateau_is_off_as_the_integral_winds_up(wire, port):
    """400 counts of duty at ki times the error a tick; how far beside it stands is a matter of the noise."""
    one = wire(f"{port}?break=current-low@{BREAK_TICK / 10_000}")
    one.start(BETWEEN)
    status = one.wait_for(State.FAULT)
    assert Fault(status.fault) == Fault.CURRENT_FROZEN
    (ki,) = (p.default for p in PARAMETERS if p.name == "pid_ki")
    winds_up = 400 * 65_536 / (ki * abs(status.fault_reference - status.fault_current))
    assert BREAK_TICK <= status.fault_tick <= BREAK_TICK + winds_up + 100
    stays_off(one, status)


@everywhere
@pytest.mark.parametrize(
    ("limit", "value", "fault"),
    [("current_trip", 4000, Fault.OVER_CURRENT), ("force_trip", 3000, Fault.OVER_FORCE)],
)
def test_a_lowered_limit_trips_on_the_true_value(wire, port, limit, value, fault):
    """Over-current and over-force with sensors that are well."""
    one = wire(port)
    (row,) = (p for p in PARAMETERS if p.name == limit)
    one.start(STROKES, parameters={row.id: value})
    status = one.wait_for(State.FAULT)
    assert Fault(status.fault) == fault
    measured = status.fault_current if limit == "current_trip" else status.fault_force
    assert value < measured < 1.2 * value
    stays_off(one, status)


@everywhere
def test_a_silent_host(wire, port):
    """200 ms after its last command the ramp begins; it ends switched off."""
    one = wire("bench:?speed=real" if port == "bench:" else port)
    one.start(HELD)
    time.sleep(0.6)
    status = one.wait_for(State.FAULT)
    assert Fault(status.fault) == Fault.HEARTBEAT
    assert 2000 <= status.fault_tick <= 2100
    stays_off(one, status)


@everywhere
def test_a_reference_that_stops_coming(wire, port):
    """The host lives but sends no more: ramp from the very tick at which the next sample is missing."""
    one = wire(port)
    one.start(HELD[:122], total=1000)
    status = one.wait_for(State.FAULT)
    assert Fault(status.fault) == Fault.UNDERRUN
    assert status.fault_tick == 121 * 10
    stays_off(one, status)


@everywhere
@pytest.mark.parametrize(("what", "cause"), [("reset", ResetCause.EXTERNAL), ("hang", ResetCause.WATCHDOG)])
def test_a_restart_in_mid_play(wire, port, what, cause):
    """A chip that is reset, and a main loop that hangs until the watchdog resets it: off, told, forgotten."""
    one = wire(f"{port}?break={what}@{BREAK_TICK / 10_000}")
    hello = one.start(STROKES)
    deadline = time.monotonic() + 10
    status = one.status()
    while status.boot_nonce == hello.boot_nonce:
        assert status.state == State.RUNNING
        assert time.monotonic() < deadline
        time.sleep(0.01)
        one.beat()
        status = one.status()
    assert (status.state, status.fault, status.session) == (State.IDLE, Fault.NONE, 0)
    assert ResetCause(status.reset_cause) == cause
    assert refusal(one, m.Start()) == NakCode.STATE
    assert refusal(one, m.Arm(hello.boot_nonce)) == NakCode.VERSION  # not greeted since
    one.session.hello()
    assert refusal(one, m.Arm(hello.boot_nonce)) == NakCode.NONCE
    assert one.telemetry[-1].first_tick < BREAK_TICK


@everywhere
def test_a_tick_that_stays_away(wire, port):
    """A timer of its own has switched off; the main loop says so, and the watchdog starts the device anew."""
    one = wire(f"{port}?break=tick-lost@{BREAK_TICK / 10_000}")
    hello = one.start(STROKES)
    deadline = time.monotonic() + 10
    status = one.status()
    while status.state == State.RUNNING:
        assert time.monotonic() < deadline
        one.beat()
        status = one.status()
    if status.boot_nonce == hello.boot_nonce:
        assert (Fault(status.fault), status.fault_tick) == (Fault.TICK_LOST, BREAK_TICK)
    else:  # a busy computer: the watchdog was quicker than the question
        assert ResetCause(status.reset_cause) == ResetCause.WATCHDOG
        assert status.state == State.IDLE


@everywhere
def test_the_first_cause_does_not_hide_the_worst(wire, port):
    """A shorted transistor: over-current first, and then the device says that it could not switch off."""
    one = wire(
        f"{port.replace('bench:', 'bench:?speed=real')}{'&' if port == 'bench:' else '?'}break=stuck-on@0.3"
    )
    one.start(PLATEAU)
    status = one.wait_for(State.FAULT)
    deadline = time.monotonic() + 10
    while status.worst != Fault.OUTPUT_NOT_OFF:
        assert time.monotonic() < deadline
        status = one.status()
    assert Fault(status.fault) == Fault.OVER_CURRENT
    assert status.flags & STATUS_OUTPUT_NOT_OFF
    assert status.current > 16_500  # live, not the snapshot
    assert status.fault_current < status.current
    assert refusal(one, m.ClearFault(status.fault, status.fault)) == NakCode.FAULT
    one.clear_fault()
    hello = one.session.hello()
    assert refusal(one, m.Arm(hello.boot_nonce)) in {NakCode.FAULT, NakCode.STATE}


@pytest.mark.parametrize("offset", [-0.9, 2.0])
def test_a_force_sensor_that_does_not_read_zero(wire, offset):
    """Before the play, at ARM: refused, latched, the reading in the snapshot."""
    one = wire(f"bench:?speed=real&condition-offset={offset}")
    one.session.hello()
    time.sleep(0.1)
    with pytest.raises(RefusedError) as caught:
        one.start(WEAK)
    assert (caught.value.nak.command, caught.value.nak.fault) == (m.Arm.TYPE, Fault.FORCE_ZERO)
    status = one.status()
    assert status.state == State.FAULT
    assert abs(status.fault_force - 1000 * offset) < 250


def test_a_play_may_begin_as_soon_as_another_is_over():
    """Whatever it ended at: its current counts for what flows before the next one no more."""
    with open_device("bench:?speed=real") as device:
        for _ in range(2):
            trace = device.play(np.append(np.linspace(0.0, 1.0, 100), np.full(60, 1.0)), 1000)
            assert trace.complete, trace.fault


@everywhere
def test_no_parameter_goes_above_its_compiled_limit(wire, port):
    """Refused by the device itself, whatever the program thinks; lower is fine, and not while it plays."""
    one = wire(port)
    one.session.hello()
    for row in PARAMETERS:
        assert refusal(one, m.SetParam(row.id, row.maximum + 1)) == NakCode.RANGE
        assert refusal(one, m.SetParam(row.id, row.minimum - 1)) == NakCode.RANGE
        reply = one.ask(m.GetParam(row.id))
        assert (reply.value, reply.minimum, reply.maximum) == (row.default, row.minimum, row.maximum)
    assert one.ask(m.SetParam(0, 10_000)).value == 10_000
    one.ask(m.WaveBegin(61, 10, 0))
    too_much = np.full(61, 10_001, dtype="<i2").tobytes()
    assert refusal(one, m.WaveData(0, 61, too_much)) == NakCode.RANGE
    one.start(STROKES // 2)
    assert refusal(one, m.SetParam(0, 5000)) == NakCode.STATE
    one.ask(m.Stop())
    assert one.wait_for(State.IDLE).fault == Fault.NONE


@everywhere
def test_the_output_is_off_until_everything_says_on(wire, port):
    """No START without ARM, no ARM without a greeting of this very start and a whole, committed reference."""
    one = wire(port)
    assert one.status().state == State.IDLE
    assert refusal(one, m.Start()) == NakCode.STATE
    assert refusal(one, m.Arm(0)) == NakCode.VERSION
    hello = one.session.hello()
    assert refusal(one, m.Arm(hello.boot_nonce ^ 1)) == NakCode.NONCE
    assert refusal(one, m.Arm(hello.boot_nonce)) == NakCode.STATE
    one.ask(m.WaveBegin(2, 10, 0))
    one.ask(m.WaveData(0, 1, b"\1\0"))
    assert refusal(one, m.Arm(hello.boot_nonce)) == NakCode.STATE
    assert refusal(one, m.WaveCommit(1, 1)) == NakCode.CRC
    assert refusal(one, m.Arm(hello.boot_nonce)) == NakCode.STATE
    assert refusal(one, m.Start()) == NakCode.STATE
    assert one.status().session == 0
    one.start(STROKES[:20])  # and after a whole run it is disarmed again
    one.wait_for(State.IDLE)
    assert refusal(one, m.Arm(hello.boot_nonce)) == NakCode.STATE
    assert refusal(one, m.Start()) == NakCode.STATE
