"""The wire's messages: with codes the one source from which ``firmware/core/protocol.h`` is made.

A message is a frozen dataclass; the annotation of each field is its place on the wire (little-endian,
no padding), so ``pack`` and ``parse`` mirror each other by construction. Messages with an ``item`` end
in a counted array of equal items. ``firmware/protocol_header.py`` prints the same tables as C.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, ClassVar, Self, dataclass_transform, get_type_hints

U8 = Annotated[int, "B"]
U16 = Annotated[int, "H"]
I16 = Annotated[int, "h"]
U32 = Annotated[int, "I"]
I32 = Annotated[int, "i"]
Text16 = Annotated[bytes, "16s"]


@dataclass_transform(frozen_default=True)
class Message:
    """A payload with a type id; each subclass is a frozen dataclass of wire types.

    ``item``: bytes of one item of the array at its end, which holds ``least`` to ``most``; 0: there is none.
    """

    TYPE: ClassVar[int]
    ITEM: ClassVar[int]
    MIN_ITEMS: ClassVar[int]
    MAX_ITEMS: ClassVar[int]

    def __init_subclass__(cls, *, code: int, item: int = 0, least: int = 1, most: int = 0) -> None:
        cls.TYPE, cls.ITEM, cls.MIN_ITEMS, cls.MAX_ITEMS = code, item, least, most
        dataclass(frozen=True)(cls)

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


class Hello(Message, code=0x01):
    """Who are you? Stops whatever an earlier host left running and restores every parameter's default."""

    magic: U32
    major: U8
    minor: U8


class Status(Message, code=0x02):
    """Ask for the full state with the snapshot of the first fault."""


class Heartbeat(Message, code=0x03):
    """The host is alive; a sign of life only if ``counter`` is larger than any since the greeting."""

    counter: U32


class GetParam(Message, code=0x04):
    """Read a parameter."""

    id: U8


class SetParam(Message, code=0x05):
    """Set a parameter; refused unless idle."""

    id: U8
    value: I32


class WaveBegin(Message, code=0x06):
    """Announce a reference: samples in all, ticks per sample, CRC-32 of all its int16 bytes."""

    total: U32
    ticks_per_sample: U16
    crc32: U32


class WaveData(Message, code=0x07, item=2, most=61):
    """Samples of the reference [100 uA, int16] from ``offset`` on."""

    offset: U32
    count: U8
    items: bytes


class WaveCommit(Message, code=0x08):
    """The first ``count`` samples are there and have this CRC-32: the device may be armed."""

    count: U32
    crc32: U32


class Arm(Message, code=0x09):
    """Permit START; ``nonce`` proves that this is the device that answered HELLO, not restarted."""

    nonce: U32


class Start(Message, code=0x0A):
    """Play."""


class Stop(Message, code=0x0B):
    """Ramp to zero, switch off, disarm; always accepted."""


class ClearFault(Message, code=0x0C):
    """Forget just this latched fault and this worst one (see ``StatusReply``); refused if others are."""

    fault: U8
    worst: U8


class Stream(Message, code=0x0D):
    """Telemetry at every ``decimation``-th tick."""

    decimation: U16


class CoilHeat(Message, code=0x0E):
    """Tell the device how hot its coil is, in units of ``codes.HEAT_UNIT``.

    A lower value than the device's own is taken only while that is assumed (``STATUS_HEAT_ASSUMED``).
    """

    heat: U16


class WaveCheck(Message, code=0x0F):
    """The first ``count`` samples of the running wave have this CRC-32; ``end``: no more will come.

    A wrong CRC ramps down; ``end`` is for a wave that was begun with ``codes.WAVE_OPEN`` samples.
    """

    count: U32
    crc32: U32
    end: U8


# --- device to host ------------------------------------------------------------------------------


class HelloReply(Message, code=0x81):
    """Who the device is and what it will do at most.

    This layout and that of ``Hello`` are the same in all versions: else two could not tell each other apart.
    """

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


class StatusReply(Message, code=0x82):
    """The full state; ``fault`` is the first cause, ``fault_*`` its snapshot, ``worst`` the gravest since.

    ``current`` and ``force`` are the readings of now, in every state; ``flags`` are ``codes.STATUS_*``.
    """

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


class Ack(Message, code=0x83):
    """Done: free samples of the buffer, and where the device stands."""

    credit: U16
    state: U8
    fault: U8
    session: U8
    tick: U32
    produced: U32


class Nak(Message, code=0x84):
    """Refused, and why."""

    code: U8
    command: U8
    state: U8
    fault: U8


class ParamReply(Message, code=0x85):
    """The value of a parameter and the range the device accepts."""

    id: U8
    value: I32
    minimum: I32
    maximum: I32


class Telemetry(Message, code=0x90, item=6, least=0, most=19):
    """Samples of (reference, current, force), the first one at ``first_tick`` of the session.

    ``dropped`` counts the samples lost on the device since the session began; it saturates. The last
    block may have no samples.
    """

    session: U8
    flags: U8
    first_tick: U32
    dropped: U16
    count: U8
    items: bytes


class TelemetryDuty(Telemetry, code=0x91, item=8, least=0, most=14):
    """Samples of (reference, current, force, duty): what a host of protocol 2.2 or later gets.

    The duty is that of the tick that ends with the sample, in counts of ``codes.DUTY_FULL``.
    """


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
