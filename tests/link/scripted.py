"""A device that a test writes the script of: it answers at once, in time that only passes when one waits."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.device import Device
from pulsetrainer.device.frames import Frame, FrameReader, encode
from pulsetrainer.device.schemes import OpenPort

SLICE_S = 0.01  # as long as a port waits for a byte
M = TypeVar("M", bound=m.Message)


def message(kind: type[M], **values: object) -> M:
    """Return a message with the values given, and zeros."""
    return kind(**{name: 0 for name, _ in kind.wire_fields()} | values)


class ScriptedDevice:
    """A transport with a device at its end; ``heard`` is what came, and when.

    ``answer`` may replace its reply to a command: by another message, or by None, which is silence.
    """

    def __init__(self) -> None:
        self.now_s = 100.0
        self.heard: list[tuple[float, m.Message]] = []
        self.answer: Callable[[m.Message, m.Message], m.Message | None] = lambda _, usual: usual
        self.state, self.session = codes.State.IDLE, 0
        self.last_tick = 0
        self.ticks_per_sample = 1
        self.started_s = 0.0
        self.hello: dict[str, object] = {}
        self.status: dict[str, object] = {}
        self._reader = FrameReader()
        self._out = b""

    def open(self) -> Device:
        """Return the device as a program sees it."""
        return Device(OpenPort(self, "scripted:"), monotonic=self.clock, sleep=self.sleep)

    def clock(self) -> float:
        """Return the time."""
        return self.now_s

    def sleep(self, _seconds: float) -> None:
        """Leave the time to those who wait for the device: two threads must not both make it pass."""

    def when(self, kind: type[m.Message]) -> list[float]:
        """Return when a command of this kind came."""
        return [at for at, command in self.heard if isinstance(command, kind)]

    # --- the transport ---------------------------------------------------------------------------

    def read(self) -> bytes:
        """Return what was answered; waiting lets time pass."""
        if not self._out:
            self.now_s += SLICE_S
        data, self._out = self._out, b""
        return data

    def write(self, data: bytes) -> None:
        """Hear a command and answer it."""
        for frame in self._reader.feed(data):
            command = m.BY_TYPE[frame.type].parse(frame.payload)
            self.heard.append((self.now_s, command))
            reply = self.answer(command, self._usual(command))
            if reply is not None:
                self._out += encode(Frame(reply.TYPE, frame.seq, reply.pack()))

    def discard(self) -> None:
        """Forget what was answered."""
        self._out = b""

    def close(self) -> None:
        """Let go."""

    # --- the device ------------------------------------------------------------------------------

    @property
    def tick(self) -> int:
        """Ticks since the play began."""
        return round((self.now_s - self.started_s) * codes.TICK_RATE_HZ) if self.session else 0

    def _usual(self, command: m.Message) -> m.Message:
        if self.state == codes.State.RUNNING and self.tick > self.last_tick:
            self.state = codes.State.IDLE
        if isinstance(command, m.Hello):
            said = {
                "magic": codes.MAGIC, "major": codes.PROTOCOL_MAJOR, "minor": codes.PROTOCOL_MINOR,
                "firmware_major": codes.FIRMWARE_MAJOR, "firmware_minor": codes.FIRMWARE_MINOR,
                "tick_rate_Hz": codes.TICK_RATE_HZ, "wave_buffer": codes.WAVE_BUFFER_SAMPLES,
                "current_limit": 15_000, "force_trip": 15_000, "on_time_s": 900, "heartbeat_ms": 200,
                "serial": b"SCRIPT".ljust(16, b"\0"),
            }  # fmt: skip
            return message(m.HelloReply, **said | self.hello)
        if isinstance(command, m.Status):
            now = {"state": self.state, "session": self.session, "tick": self.tick}
            return message(m.StatusReply, **now | self.status)
        if isinstance(command, m.SetParam | m.GetParam):
            return message(m.ParamReply, id=command.id, value=getattr(command, "value", 0))
        if isinstance(command, m.WaveBegin):
            self.last_tick = (command.total - 1) * command.ticks_per_sample
            self.ticks_per_sample = command.ticks_per_sample
        if isinstance(command, m.WaveCheck) and command.end:
            self.last_tick = (command.count - 1) * self.ticks_per_sample
        if isinstance(command, m.Start):
            self.state, self.session, self.started_s = codes.State.RUNNING, self.session + 1, self.now_s
        if isinstance(command, m.Stop):
            self.state = codes.State.IDLE
        credit = codes.WAVE_BUFFER_SAMPLES
        return message(m.Ack, credit=credit, state=self.state, session=self.session, tick=self.tick)
