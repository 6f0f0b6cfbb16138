"""The wire's messages: with codes the one source from which ``firmware/core/protocol.h`` is made.

A message is a frozen dataclass; the annotation of each field is its place on the wire (little-endian,
no padding), so ``pack`` and ``parse`` mirror each other by construction. Messages marked ``tail`` end
in a counted array of equal items. ``firmware/protocol_header.py`` prints the same tables as C.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, ClassVar, Self, get_type_hints

U8 = Annotated[int, "B"]
U16 = Annotated[int, "H"]
I16 = Annotated[int, "h"]
U32 = Annotated[int, "I"]
I32 = Annotated[int, "i"]
Text16 = Annotated[bytes, "16s"]


class Message:
    """A payload with a type id; subclasses are frozen dataclasses annotated with wire types."""

    __slots__ = ()
    TYPE: ClassVar[int]
    ITEM: ClassVar[int] = 0  # bytes of one item of the trailing array, 0: there is none
    MIN_ITEMS: ClassVar[int] = 1
    MAX_ITEMS: ClassVar[int] = 0

    @classmethod
    @cache
    def layout(cls) -> struct.Struct:
        """Return the fixed part's layout."""
        return struct.Struct("<" + "".join(code for _, code in cls.wire_fields()))

    @classmethod
    @cache
    def wire_fields(cls) -> tuple[tuple[str, str], ...]:
        """Return (name, struct code) of each fixed field in wire order."""
        hints = get_type_hints(cls, include_extras=True)
        make: Any = cls  # a subclass is a dataclass
        return tuple((f.name, hints[f.name].__metadata__[0]) for f in fields(make) if f.name != "items")

    def pack(self) -> bytes:
        """Return the payload bytes."""
        values = [getattr(self, name) for name, _ in self.wire_fields()]
        tail: bytes = getattr(self, "items", b"")
        return self.layout().pack(*values) + tail

    @classmethod
    def parse(cls, payload: bytes) -> Self:
        """Return the message in ``payload``; raises ValueError unless the length is exactly right."""
        make: Any = cls  # a subclass is a dataclass of just these fields
        fixed = cls.layout().size
        values = cls.layout().unpack_from(payload) if len(payload) >= fixed else ()
        if not cls.ITEM:
            if len(payload) != fixed:
                raise ValueError(f"{cls.__name__} is {fixed} bytes, got {len(payload)}")
            return make(*values)
        # A counted array: the count is always the last fixed field.
        count = values[-1] if values else -1
        if not cls.MIN_ITEMS <= count <= cls.MAX_ITEMS or len(payload) != fixed + cls.ITEM * count:
            raise ValueError(f"{cls.__name__} of {len(payload)} bytes does not match its count")
        return make(*values, payload[fixed:])


# --- host to device ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Hello(Message):
    """Who are you? Stops whatever an earlier host left running and restores every parameter's default."""

    TYPE: ClassVar[int] = 0x01
    magic: U32
    major: U8
    minor: U8


@dataclass(frozen=True, slots=True)
class Status(Message):
    """Ask for the full state with the snapshot of the first fault."""

    TYPE: ClassVar[int] = 0x02


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """The host is alive; a sign of life only if ``counter`` is larger than any since the greeting."""

    TYPE: ClassVar[int] = 0x03
    counter: U32


@dataclass(frozen=True, slots=True)
class GetParam(Message):
    """Read a parameter."""

    TYPE: ClassVar[int] = 0x04
    id: U8


@dataclass(frozen=True, slots=True)
class SetParam(Message):
    """Set a parameter; refused unless idle."""

    TYPE: ClassVar[int] = 0x05
    id: U8
    value: I32


@dataclass(frozen=True, slots=True)
class WaveBegin(Message):
    """Announce a reference: samples in all, ticks per sample, CRC-32 of all its int16 bytes."""

    TYPE: ClassVar[int] = 0x06
    total: U32
    ticks_per_sample: U16
    crc32: U32


@dataclass(frozen=True, slots=True)
class WaveData(Message):
    """Samples of the reference [100 uA, int16] from ``offset`` on."""

    TYPE: ClassVar[int] = 0x07
    ITEM: ClassVar[int] = 2
    MAX_ITEMS: ClassVar[int] = 61
    offset: U32
    count: U8
    items: bytes


@dataclass(frozen=True, slots=True)
class WaveCommit(Message):
    """The first ``count`` samples are there and have this CRC-32: the device may be armed."""

    TYPE: ClassVar[int] = 0x08
    count: U32
    crc32: U32


@dataclass(frozen=True, slots=True)
class Arm(Message):
    """Permit START; ``nonce`` proves that this is the device that answered HELLO, not restarted."""

    TYPE: ClassVar[int] = 0x09
    nonce: U32


@dataclass(frozen=True, slots=True)
class Start(Message):
    """Play."""

    TYPE: ClassVar[int] = 0x0A


@dataclass(frozen=True, slots=True)
class Stop(Message):
    """Ramp to zero, switch off, disarm; always accepted."""

    TYPE: ClassVar[int] = 0x0B


@dataclass(frozen=True, slots=True)
class ClearFault(Message):
    """Forget just this latched fault and this worst one (see ``StatusReply``); refused if others are."""

    TYPE: ClassVar[int] = 0x0C
    fault: U8
    worst: U8


@dataclass(frozen=True, slots=True)
class Stream(Message):
    """Telemetry at every ``decimation``-th tick."""

    TYPE: ClassVar[int] = 0x0D
    decimation: U16


@dataclass(frozen=True, slots=True)
class CoilHeat(Message):
    """Tell the device how hot its coil is, in units of ``codes.HEAT_UNIT``.

    A lower value than the device's own is taken only while that is assumed (``STATUS_HEAT_ASSUMED``).
    """

    TYPE: ClassVar[int] = 0x0E
    heat: U16


@dataclass(frozen=True, slots=True)
class WaveCheck(Message):
    """The first ``count`` samples of the running wave have this CRC-32; ``end``: no more will come.

    A wrong CRC ramps down; ``end`` is for a wave that was begun with ``codes.WAVE_OPEN`` samples.
    """

    TYPE: ClassVar[int] = 0x0F
    count: U32
    crc32: U32
    end: U8


# --- device to host ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class HelloReply(Message):
    """Who the device is and what it will do at most.

    This layout and that of ``Hello`` are the same in all versions: else two could not tell each other apart.
    """

    TYPE: ClassVar[int] = 0x81
    magic: U32
    major: U8
    minor: U8
    firmware_major: U8
    firmware_minor: U8
    firmware_patch: U8
    build_hash: U32
    capabilities: U32
    rx_window: U16
    tick_rate_Hz: U32
    wave_buffer: U16
    current_limit: I16
    current_trip: I16
    force_trip: I16
    slew_limit: U16
    on_time_s: U16
    heartbeat_ms: U16
    reset_cause: U8
    boot_nonce: U32
    serial: Text16


@dataclass(frozen=True, slots=True)
class StatusReply(Message):
    """The full state; ``fault`` is the first cause, ``fault_*`` its snapshot, ``worst`` the gravest since.

    ``current`` and ``force`` are the readings of now, in every state; ``flags`` are ``codes.STATUS_*``.
    """

    TYPE: ClassVar[int] = 0x82
    state: U8
    fault: U8
    session: U8
    tick: U32
    produced: U32
    dropped: U32
    fault_tick: U32
    fault_reference: I16
    fault_current: I16
    fault_force: I16
    fault_duty: U16
    fault_state: U8
    reset_cause: U8
    boot_nonce: U32
    worst: U8
    flags: U8
    current: I16
    force: I16
    heat: U16


@dataclass(frozen=True, slots=True)
class Ack(Message):
    """Done: free samples of the buffer, and where the device stands."""

    TYPE: ClassVar[int] = 0x83
    credit: U16
    state: U8
    fault: U8
    session: U8
    tick: U32
    produced: U32


@dataclass(frozen=True, slots=True)
class Nak(Message):
    """Refused, and why."""

    TYPE: ClassVar[int] = 0x84
    code: U8
    command: U8
    state: U8
    fault: U8


@dataclass(frozen=True, slots=True)
class ParamReply(Message):
    """The value of a parameter and the range the device accepts."""

    TYPE: ClassVar[int] = 0x85
    id: U8
    value: I32
    minimum: I32
    maximum: I32


@dataclass(frozen=True, slots=True)
class Telemetry(Message):
    """Samples of (reference, current, force), the first one at ``first_tick`` of the session.

    ``dropped`` counts the samples lost on the device since the session began; it saturates.
    """

    TYPE: ClassVar[int] = 0x90
    ITEM: ClassVar[int] = 6
    MIN_ITEMS: ClassVar[int] = 0  # the LAST block may have nothing left to say
    MAX_ITEMS: ClassVar[int] = 19
    session: U8
    flags: U8
    first_tick: U32
    dropped: U16
    count: U8
    items: bytes


@dataclass(frozen=True, slots=True)
class TelemetryDuty(Telemetry):
    """Samples of (reference, current, force, duty): what a host of protocol 2.2 or later gets.

    The duty is that of the tick that ends with the sample, in counts of ``codes.DUTY_FULL``.
    """

    TYPE: ClassVar[int] = 0x91
    ITEM: ClassVar[int] = 8
    MAX_ITEMS: ClassVar[int] = 14


COMMANDS: tuple[type[Message], ...] = (
    Hello, Status, Heartbeat, GetParam, SetParam, WaveBegin, WaveData,
    WaveCommit, Arm, Start, Stop, ClearFault, Stream, CoilHeat, WaveCheck,
)  # fmt: skip
REPLIES: tuple[type[Message], ...] = (HelloReply, StatusReply, Ack, Nak, ParamReply, Telemetry, TelemetryDuty)
BY_TYPE: dict[int, type[Message]] = {m.TYPE: m for m in (*COMMANDS, *REPLIES)}
_ANSWERS: dict[type[Message], type[Message]] = {
    Hello: HelloReply,
    Status: StatusReply,
    GetParam: ParamReply,
    SetParam: ParamReply,
}


def answers(reply: Message, command: Message) -> bool:
    """Return whether ``reply`` can be the answer to ``command``: the kind asked for, or its refusal."""
    if isinstance(reply, Nak):
        return reply.command == command.TYPE
    if isinstance(command, GetParam | SetParam) and isinstance(reply, ParamReply):
        return reply.id == command.id
    return isinstance(reply, _ANSWERS.get(type(command), Ack))
