"""Numbers of the wire: limits, units, states, faults, refusals, parameters.

With ``messages`` the one source from which ``firmware/core/protocol.h`` is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

MAGIC = 0x52545031  # "1PTR" on the wire: tells our firmware from whatever else sits behind a port
PROTOCOL_MAJOR = 2
PROTOCOL_MINOR = 2
FIRMWARE_MAJOR = (
    0  # of the firmware that comes with this program; below 1.0.0 each minor version is another one
)
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


class State(IntEnum):
    """What the device is doing; the output is off in all but RUNNING and RAMPING."""

    IDLE = 0
    ARMED = 1
    RUNNING = 2
    RAMPING = 3
    FAULT = 4


class Fault(IntEnum):
    """Why the device latched a fault. OUTPUT_NOT_OFF is the gravest: nothing in the device can switch off."""

    NONE = 0
    HEARTBEAT = 1
    OVER_CURRENT = 2
    OVER_FORCE = 3
    UNDERRUN = 4
    COIL_HEAT = 5
    ON_TIME = 6
    FORCE_RAIL = 8
    CURRENT_FROZEN = 9
    FORCE_FROZEN = 10
    NO_CURRENT = 11
    NO_FORCE = 12
    TICK_OVERRUN = 13
    WAVE_CRC = 14
    STRAY_CURRENT = 15
    CURRENT_IMPLAUSIBLE = 16
    FORCE_IMPLAUSIBLE = 17
    FORCE_ZERO = 18
    COMPARATOR = 19
    OUTPUT_NOT_OFF = 20
    TICK_LOST = 21
    CONVERTER = 22


FAULT_TEXT: dict[Fault, str] = {
    Fault.NONE: "",
    Fault.HEARTBEAT: "the device heard nothing from the host for its heartbeat time and switched off",
    Fault.OVER_CURRENT: "coil current above its hard limit",
    Fault.OVER_FORCE: "force above its limit",
    Fault.UNDERRUN: "the reference did not arrive in time (buffer underrun)",
    Fault.COIL_HEAT: "the coil's heat model (I2t) reached its limit",
    Fault.ON_TIME: "longest permitted on-time reached",
    Fault.FORCE_RAIL: "force sensor at the end of its range",
    Fault.CURRENT_FROZEN: "current reading frozen while the reference moved",
    Fault.FORCE_FROZEN: "force reading frozen while the current moved",
    Fault.NO_CURRENT: "full drive, but the current does not follow",
    Fault.NO_FORCE: "full current, but no force follows",
    Fault.TICK_OVERRUN: "the control interrupt missed its tick",
    Fault.WAVE_CRC: "the uploaded reference does not match its checksum",
    Fault.STRAY_CURRENT: "current flows although the reference is zero",
    Fault.CURRENT_IMPLAUSIBLE: "the current reading does not fit the voltage on the coil",
    Fault.FORCE_IMPLAUSIBLE: "the force reading does not fit the current",
    Fault.FORCE_ZERO: "the force sensor does not read zero before the play",
    Fault.COMPARATOR: "the hardware's own over-current limit was reached",
    Fault.OUTPUT_NOT_OFF: "current is still read although the output was switched off: CUT THE SUPPLY NOW",
    Fault.TICK_LOST: "the control interrupt stayed away; a timer of its own switched off",
    Fault.CONVERTER: "a sensor's converter gave no new reading",
}


class NakCode(IntEnum):
    """Why a command was refused."""

    UNKNOWN = 1
    LENGTH = 2
    STATE = 3
    RANGE = 4
    OFFSET = 5
    CREDIT = 6
    VERSION = 7
    NONCE = 8
    CRC = 9
    FAULT = 10
    PARAM = 11


NAK_TEXT: dict[NakCode, str] = {
    NakCode.UNKNOWN: "it does not know this command",
    NakCode.LENGTH: "the command has the wrong length",
    NakCode.STATE: "not possible in its present state",
    NakCode.RANGE: "a value is outside its limits",
    NakCode.OFFSET: "samples out of order",
    NakCode.CREDIT: "more samples than it has room for",
    NakCode.VERSION: "no handshake with a protocol it speaks",
    NakCode.NONCE: "the device has restarted since the handshake",
    NakCode.CRC: "the reference does not match its checksum",
    NakCode.FAULT: "a latched fault has to be cleared first",
    NakCode.PARAM: "it has no such parameter",
}


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
