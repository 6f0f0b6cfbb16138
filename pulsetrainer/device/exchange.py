"""Commands and replies: stop-and-wait with sequence numbers, beside a stream of telemetry."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.frames import Frame, FrameReader, encode
from pulsetrainer.device.schemes import TIMEOUTS_S, Clock
from pulsetrainer.device.transport import Transport
from pulsetrainer.device.wording import FLASH, told
from pulsetrainer.errors import UPDATE, DeviceError

_HELLO_S = 3.0
_HELLO_TRY_S = 0.2
_GREETING_AT_LEAST = 9  # bytes: magic, protocol and firmware version, which no version moves
_TELEMETRY = {kind.TYPE: kind for kind in (m.Telemetry, m.TelemetryDuty)}
_ABOVE_0 = ("tick_rate_Hz", "wave_buffer", "heartbeat_ms", "current_limit", "force_trip", "on_time_s")
_NAMES = {c.TYPE: c.__name__ for c in m.COMMANDS}


class NoAnswerError(DeviceError):
    """The device did not answer a command."""


class AbandonedError(DeviceError):
    """The caller no longer waits for the answer to a command: something is more urgent."""


class RefusedError(DeviceError):
    """The device answered no."""

    def __init__(self, port: str, nak: m.Nak) -> None:
        self.nak = nak
        fault = told(codes.Fault, nak.fault)
        super().__init__(
            f"the device on {port} refused {_NAMES.get(nak.command, hex(nak.command))}: "
            f"{told(codes.NakCode, nak.code)}" + (f" (latched fault: {fault})" if fault else ""),
            hint="run the command again; if it is refused again, restart the device",
        )


class Exchange:
    """One command at a time; telemetry goes to ``on_telemetry`` whenever it comes."""

    def __init__(
        self, transport: Transport, port: str, *, monotonic: Clock, timeouts_s: tuple[float, ...] = TIMEOUTS_S
    ) -> None:
        self._transport = transport
        self._port = port
        self._monotonic = monotonic
        self._timeouts_s = timeouts_s
        self._reader = FrameReader()
        # Not always from the same number: a late reply to an earlier program must not fit.
        self._seq = int(monotonic() * 1000) & 0xFF
        self._replies: list[Frame] = []
        self._heard = 0
        self.on_telemetry: Callable[[m.Telemetry], None] = lambda _: None
        self.sent_at_s = 0.0
        self.rejected = 0
        self._beats = 0

    @property
    def damaged(self) -> int:
        """Number of frames that arrived damaged and were thrown away."""
        return self._reader.damaged + self.rejected

    def receive(self) -> None:
        """Take in what has arrived, waiting a few milliseconds for it."""
        data = self._transport.read()
        self._heard += len(data)
        for frame in self._reader.feed(data):
            kind = _TELEMETRY.get(frame.type)
            if kind is not None:
                try:
                    block = kind.parse(frame.payload)
                except ValueError:
                    self.rejected += 1
                    continue
                self.on_telemetry(block)
            else:
                self._replies.append(frame)

    def _send(self, command: m.Message, seq: int) -> None:
        self._transport.write(encode(Frame(command.TYPE, seq, command.pack())))
        self.sent_at_s = self._monotonic()

    def _reply(
        self, command: m.Message, timeout_s: float, abandon: Callable[[], bool] | None = None
    ) -> m.Message | None:
        """Return the reply to ``command``, just sent; replies to anything earlier are stale and dropped."""
        deadline = self._monotonic() + timeout_s
        while True:
            while self._replies:
                frame = self._replies.pop(0)
                kind = m.BY_TYPE.get(frame.type)
                if frame.seq != self._seq or kind is None:
                    continue
                try:
                    reply = _parsed(kind, frame.payload)
                except ValueError:
                    self.rejected += 1
                    continue
                if m.answers(reply, command):  # else it is 256 commands old, or damage that fits the checksum
                    return reply
                self.rejected += 1
            if abandon is not None and abandon():
                raise AbandonedError(f"{type(command).__name__} was not waited for")
            if self._monotonic() >= deadline:
                return None
            self.receive()

    def request(self, command: m.Message, abandon: Callable[[], bool] | None = None) -> Any:
        """Return the reply to ``command``, of the kind that answers it: see ``messages.answers``.

        Commands are idempotent, so a lost one is simply sent again.

        AbandonedError as soon as ``abandon`` says so, when the device may have done what was asked;
        NoAnswerError where none of the tries was answered; RefusedError where the device said no.
        """
        self._seq = (self._seq + 1) & 0xFF
        for timeout_s in self._timeouts_s:
            self._send(command, self._seq)
            reply = self._reply(command, timeout_s, abandon)
            if isinstance(reply, m.Nak):
                raise RefusedError(self._port, reply)
            if reply is not None:
                return reply
        raise NoAnswerError(
            f"the device on {self._port} did not answer {type(command).__name__} "
            f"({len(self._timeouts_s)} tries, {sum(self._timeouts_s):g} s)",
            hint="its output goes off by itself; check cable and power, then open it again",
        )

    def next_beat(self) -> m.Heartbeat:
        """Return a heartbeat that the device has not heard yet."""
        self._beats += 1
        return m.Heartbeat(self._beats)

    def hello(self) -> m.HelloReply:
        """Find out who is there, from whatever state and noise the line is in.

        DeviceError where nobody answers, somebody else does, or the protocol's major version differs.
        """
        self._transport.discard()
        self._reader.clear()
        deadline = self._monotonic() + _HELLO_S
        command = m.Hello(codes.MAGIC, codes.PROTOCOL_MAJOR, codes.PROTOCOL_MINOR)
        while self._monotonic() < deadline:
            self._seq = (self._seq + 1) & 0xFF
            self._send(command, self._seq)
            reply = self._reply(command, _HELLO_TRY_S)
            if isinstance(reply, m.HelloReply) and reply.magic == codes.MAGIC:
                self._check_version(reply)
                self._check_sense(reply)
                return reply
        if self._heard:
            raise DeviceError(
                f"what answers on {self._port} is not a pulsetrainer device "
                f"({self._heard} bytes, none of them a greeting)",
                hint="check the port with `pulsetrainer ports`; flash the firmware if this is the device",
            )
        raise NoAnswerError(
            f"nobody answers on {self._port}",
            hint="check that the device has power and that this is its port: `pulsetrainer ports`",
        )

    def _check_sense(self, reply: m.HelloReply) -> None:
        for name in _ABOVE_0:
            if getattr(reply, name) <= 0:
                raise DeviceError(
                    f"the device on {self._port} says {name} = {getattr(reply, name)} in its greeting; "
                    "that must be above 0",
                    hint=FLASH,
                )

    def _check_version(self, reply: m.HelloReply) -> None:
        firmware = (reply.firmware_major, reply.firmware_minor, reply.firmware_patch)
        name = f"the device on {self._port} (firmware {_dotted(firmware)})"
        theirs: tuple[int, ...] = (reply.major, reply.minor)
        ours: tuple[int, ...] = (codes.PROTOCOL_MAJOR, codes.PROTOCOL_MINOR)
        if reply.major != codes.PROTOCOL_MAJOR:
            said = f"speaks protocol {_dotted(theirs)}, this program {_dotted(ours)}"
        else:
            theirs, ours = firmware, (codes.FIRMWARE_MAJOR, codes.FIRMWARE_MINOR, codes.FIRMWARE_PATCH)
            if _generation(theirs) == _generation(ours):
                return
            said = f"is of another generation than this program's firmware {_dotted(ours)}"
        if theirs < ours:
            older, remedy = "device", FLASH
        else:
            older, remedy = "program", UPDATE
        raise DeviceError(f"{name} {said}: the {older} is older", hint=remedy)


def _parsed(kind: type[m.Message], payload: bytes) -> m.Message:
    """Return the message; a greeting of another major version by its first fields, whatever follows them.

    ValueError where the payload has not the length of its kind.
    """
    size = kind.layout().size
    if kind is m.HelloReply and len(payload) >= _GREETING_AT_LEAST and len(payload) != size:
        greeting = m.HelloReply.parse(payload[:size].ljust(size, b"\0"))
        if greeting.magic == codes.MAGIC and greeting.major != codes.PROTOCOL_MAJOR:
            return greeting
    return kind.parse(payload)


def _dotted(version: tuple[int, ...]) -> str:
    return ".".join(map(str, version))


def _generation(version: tuple[int, ...]) -> tuple[int, ...]:
    """Return the part of a firmware version that must agree: below 1.0.0 that is also the minor one."""
    return version[:1] if version[0] else version[:2]
