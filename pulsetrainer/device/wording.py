"""What the numbers that a device sends mean, in words; also numbers that this program does not know."""

from __future__ import annotations

from enum import IntEnum

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.limits import FORCE_N

FORCE_REMEDY = "remove the cause: check the force sensor, its plug, and that it rests on the finger"
# Faults of which the force sensor is the likely cause.
FORCE_READING = (
    codes.Fault.NO_FORCE, codes.Fault.FORCE_FROZEN, codes.Fault.FORCE_IMPLAUSIBLE, codes.Fault.FORCE_ZERO,
    codes.Fault.FORCE_RAIL,
)  # fmt: skip
_OTHERWISE = "otherwise "
# What to do about a fault whose cause is not in the device, or known.
_REMEDY: dict[int, str] = {
    codes.Fault.OVER_FORCE: f"if the force cannot have been so high, check the force sensor; {_OTHERWISE}"
    "capture with `current_max_A` well below that current, identify that run, and go on with its model",
    codes.Fault.CURRENT_IMPLAUSIBLE: "check the supply, its plug, and the current sensor; where the supply "
    "or the coil has been changed, set the gains again: pulsetrainer tune -o pulsetrainer.toml",
    codes.Fault.CURRENT_FROZEN: "check the current sensor, its wires and its supply",
    codes.Fault.NO_CURRENT: "check the supply, its plug, and the wires of the coil and of the current sensor",
    codes.Fault.HEARTBEAT: "the computer was busy or asleep, or the line is bad: keep it from sleeping, "
    "check the cable",
    codes.Fault.UNDERRUN: "the computer is too busy or the line bad: close other programs, check the cable",
    codes.Fault.TICK_OVERRUN: "the emulated device (qemu:) must keep pace with the clock: close other "
    "programs, or use bench:, which has time; on a real device the firmware is too slow",
    codes.Fault.COIL_HEAT: "let the coil cool for two minutes, then play less, or with less current",
    codes.Fault.ON_TIME: "play it in several pieces",
    codes.Fault.WAVE_CRC: "check the cable, then run the command again",
    **dict.fromkeys(FORCE_READING, FORCE_REMEDY),
}

UNKNOWN_REMEDY = "remove the cause; the next command clears the fault"
FLASH = "flash the firmware that came with this program (make -C firmware)"
NOT_OFF_REMEDY = "pull the supply's plug, then have the device's output transistor and current sensor checked"
_KINDS: dict[type[IntEnum], str] = {
    codes.Fault: "fault",
    codes.NakCode: "refusal",
    codes.ResetCause: "cause",
    codes.State: "state",
}
# Above the noise and the zero of the current sensor; the firmware calls it stray current, too.
_FLOWS_A = 0.1


def told(kind: type[IntEnum], number: int) -> str:
    """Return what a number of the wire means, of a fault or a refusal in its own words; no fault is empty."""
    try:
        known = kind(number)
    except ValueError:
        return f"{_KINDS[kind]} {number}, which this program does not know"
    return known.text if isinstance(known, codes.Told) else known.name.lower().replace("_", " ")


def remedy_of(fault: int, limit_N: float = FORCE_N) -> str:
    """Return what to do about a fault, empty where nothing better than finding its cause is known."""
    known = _REMEDY.get(fault, "")
    raised = f"raise `limit_force_N` (the device's own is {FORCE_N:g} N), or "
    return known.replace(_OTHERWISE, _OTHERWISE + raised) if limit_N < FORCE_N else known


def serial_text(serial: bytes) -> str:
    """Return a serial number that can be shown and stored, whatever bytes came."""
    text = serial.rstrip(b"\0").decode("ascii", errors="replace")
    return "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in text)


def describe_fault(status: m.StatusReply, tick_rate_Hz: float, limit_N: float | None = None) -> str:
    """Return the latched fault with its snapshot, empty if there is none; the force's limit, where known."""
    if not status.fault:
        return ""
    of = f" of {limit_N:g} N" if limit_N and status.fault == codes.Fault.OVER_FORCE else ""
    return (
        f"{told(codes.Fault, status.fault)}{of} (at {status.fault_tick / tick_rate_Hz:.4f} s: "
        f"reference {status.fault_reference * codes.CURRENT_UNIT_A:.4f} A, "
        f"current {status.fault_current * codes.CURRENT_UNIT_A:.4f} A, "
        f"force {status.fault_force * codes.FORCE_UNIT_N:.3f} N)"
    )


def flows_A(status: m.StatusReply) -> float:
    """Return the current that flows although the output is off, A; 0 if none does, or while it is on."""
    current_A = status.current * codes.CURRENT_UNIT_A
    driven = status.state in {codes.State.RUNNING, codes.State.RAMPING}
    return 0.0 if driven or current_A < _FLOWS_A else current_A


def describe_not_off(status: m.StatusReply) -> str:
    """Return that the output could not be switched off, empty if it could."""
    current_A = flows_A(status)
    if current_A:
        return f"the output could not be switched off: {current_A:.1f} A still flows"
    if status.flags & codes.STATUS_OUTPUT_NOT_OFF:
        return "the output could not be switched off: current flowed on for a while"
    return ""
