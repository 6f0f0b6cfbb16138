"""Numbers of the wire: limits, units, states, faults, refusals, parameters.

With ``messages`` the one source from which ``firmware/core/protocol.h`` is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Self

MAGIC = 0x52545031  # "1PTR" on the wire: tells our firmware from whatever else sits behind a port
PROTOCOL_MAJOR = 2
PROTOCOL_MINOR = 2
# Of the firmware that comes with this program; below 1.0.0 each minor version is another one.
FIRMWARE_MAJOR = 0
FIRMWARE_MINOR = 2
FIRMWARE_PATCH = 2

MAX_PAYLOAD = 128  # bytes: the longest frame stays under 254, so COBS adds exactly one byte
TICK_RATE_HZ = 10_000
WAVE_BUFFER_SAMPLES = 1024
WAVE_OPEN = 0xFFFFFFFF  # samples of a wave whose end is not known when it begins; since protocol 2.1
MAX_TICKS_PER_SAMPLE = 10_000  # one reference sample a second
MAX_DECIMATION = 10_000
HEARTBEAT_MAX_MS = 200
DUTY_FULL = 7853  # counts of the PWM: on all the time
DUTY_SINCE_MINOR = 2  # of protocol 2: telemetry carries the duty
CURRENT_UNIT_A = 1e-4
FORCE_UNIT_N = 1e-3
HEAT_UNIT = 1e-3  # of the heat at which the device stops: a squared current of HEAT_LIMIT_A2, averaged
HEAT_LIMIT_A2 = 1.25**2
HEAT_TAU_S = 2**20 / TICK_RATE_HZ  # the coil's heat decays by a factor of e in this time


class Told(IntEnum):
    """Numbers of the wire, each with what it means in words."""

    text: str

    def __new__(cls, number: int, text: str) -> Self:  # noqa: D102 - how an enum takes a second value
        member = int.__new__(cls, number)
        member._value_ = number
        member.text = text
        return member


class State(IntEnum):
    """What the device is doing; the output is off in all but RUNNING and RAMPING."""

    IDLE = 0
    ARMED = 1
    RUNNING = 2
    RAMPING = 3
    FAULT = 4


class Fault(Told):
    """Why the device latched a fault. OUTPUT_NOT_OFF is the gravest: nothing in the device can switch off."""

    NONE = 0, ""
    HEARTBEAT = 1, "the device heard nothing from the host for its heartbeat time and switched off"
    OVER_CURRENT = 2, "coil current above its hard limit"
    OVER_FORCE = 3, "force above its limit"
    UNDERRUN = 4, "the reference did not arrive in time (buffer underrun)"
    COIL_HEAT = 5, "the coil's heat model (I2t) reached its limit"
    ON_TIME = 6, "longest permitted on-time reached"
    FORCE_RAIL = 8, "force sensor at the end of its range"
    CURRENT_FROZEN = 9, "current reading frozen while the reference moved"
    FORCE_FROZEN = 10, "force reading frozen while the current moved"
    NO_CURRENT = 11, "full drive, but the current does not follow"
    NO_FORCE = 12, "full current, but no force follows"
    TICK_OVERRUN = 13, "the control interrupt missed its tick"
    WAVE_CRC = 14, "the uploaded reference does not match its checksum"
    STRAY_CURRENT = 15, "current flows although the reference is zero"
    CURRENT_IMPLAUSIBLE = 16, "the current reading does not fit the voltage on the coil"
    FORCE_IMPLAUSIBLE = 17, "the force reading does not fit the current"
    FORCE_ZERO = 18, "the force sensor does not read zero before the play"
    COMPARATOR = 19, "the hardware's own over-current limit was reached"
    OUTPUT_NOT_OFF = 20, "current is still read although the output was switched off: CUT THE SUPPLY NOW"
    TICK_LOST = 21, "the control interrupt stayed away; a timer of its own switched off"
    CONVERTER = 22, "a sensor's converter gave no new reading"


class NakCode(Told):
    """Why a command was refused."""

    UNKNOWN = 1, "it does not know this command"
    LENGTH = 2, "the command has the wrong length"
    STATE = 3, "not possible in its present state"
    RANGE = 4, "a value is outside its limits"
    OFFSET = 5, "samples out of order"
    CREDIT = 6, "more samples than it has room for"
    VERSION = 7, "no handshake with a protocol it speaks"
    NONCE = 8, "the device has restarted since the handshake"
    CRC = 9, "the reference does not match its checksum"
    FAULT = 10, "a latched fault has to be cleared first"
    PARAM = 11, "it has no such parameter"


class ResetCause(IntEnum):
    """Why the device last started."""

    POWER = 0
    EXTERNAL = 1
    WATCHDOG = 2
    BROWN_OUT = 3
    SOFTWARE = 4
    CLOCK = 5


FLAG_LAST = 1  # the last block of a session
FLAG_SLEW = 2  # the slew limit held the reference back within this block

STATUS_OUTPUT_NOT_OFF = 1  # current flows although the output is off, now or since the fault was latched
STATUS_HEAT_ASSUMED = 2  # nobody has told the device how hot the coil is since power-on: it assumes the limit


@dataclass(frozen=True, slots=True)
class Parameter:
    """One setting of the device: wire id, range and default in device units."""

    name: str
    id: int
    minimum: int
    default: int
    maximum: int
    unit: str


# The gains are for the coil of 5 ohm and 20 mH at 12 V with a free-wheeling diode of 0.6 V.
# The maximum of a limit is the absolute one compiled into the firmware: a parameter can only lower it.
PARAMETERS: tuple[Parameter, ...] = (
    Parameter("current_limit", 0, 0, 15_000, 15_000, "100 uA"),
    Parameter("current_trip", 1, 0, 16_500, 16_500, "100 uA"),
    Parameter("force_trip", 2, 0, 15_000, 15_000, "mN"),
    Parameter("slew_limit", 3, 1, 150, 150, "100 uA per tick"),
    Parameter("on_time", 4, 1, 900, 900, "s"),
    Parameter("heartbeat", 5, 20, HEARTBEAT_MAX_MS, HEARTBEAT_MAX_MS, "ms"),
    Parameter("pid_kp", 6, 0, 7680, 32_767, "counts per 4096 units"),
    Parameter("pid_ki", 7, 0, 3680, 32_767, "counts per 65536 units and tick"),
    Parameter("feed_resistance", 8, 0, 20_423, 65_535, "counts per 65536 units"),
    Parameter("feed_inductance", 9, 0, 3191, 65_535, "counts per 256 units per tick"),
    Parameter("feed_offset", 10, 0, 374, 1000, "counts while the reference is not zero"),
)
PARAMETER = {row.name: row for row in PARAMETERS}
