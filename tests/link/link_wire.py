"""A hand on the wire of a real firmware process, one command at a time."""

from __future__ import annotations

import time
import zlib
from contextlib import contextmanager
from typing import TYPE_CHECKING

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.exchange import Exchange
from pulsetrainer.device.schemes import TIMEOUTS_S
from pulsetrainer.device.transport import SerialTransport, Transport
from pulsetrainer.simulation.bench import Bench
from pulsetrainer.simulation.emulator import QEMU_TIMEOUTS_S, Emulator

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import numpy as np


class Wire:
    """A session on a bench or an emulated device, one command at a time."""

    def __init__(self, port: str, executable: Path | None = None) -> None:
        self.bench: Bench | Emulator
        self.transport: Transport
        timeouts_s = TIMEOUTS_S
        if port.startswith("qemu:"):
            self.bench = Emulator(port)
            self.transport = self.bench.transport
            timeouts_s = QEMU_TIMEOUTS_S
        else:
            self.bench = Bench(port, executable)
            self.transport = SerialTransport(self.bench.path)
        self.session = Exchange(
            self.transport, port.partition("?")[0], monotonic=time.monotonic, timeouts_s=timeouts_s
        )
        self.telemetry: list[m.Telemetry] = []
        self.session.on_telemetry = self.telemetry.append

    def close(self) -> None:
        """Let go of the port and end the firmware process."""
        self.transport.close()
        self.bench.close()

    def ask(self, command: m.Message) -> m.Message:
        """Return the reply to a command."""
        return self.session.request(command)

    def beat(self) -> m.Ack:
        """Return the acknowledgement of a heartbeat."""
        reply = self.ask(self.session.next_beat())
        assert isinstance(reply, m.Ack)
        return reply

    def clear_fault(self) -> m.Message:
        """Clear just the faults that the device tells of."""
        status = self.status()
        return self.ask(m.ClearFault(status.fault, status.worst))

    def status(self) -> m.StatusReply:
        """Return the full state."""
        reply = self.ask(m.Status())
        assert isinstance(reply, m.StatusReply)
        return reply

    def start(
        self,
        samples: np.ndarray,
        *,
        total: int | None = None,
        decimation: int = 10,
        parameters: Mapping[int, int] | None = None,
    ) -> m.HelloReply:
        """Greet, set, upload ``samples`` [100 uA] at 1 kHz of ``total`` announced, arm and start."""
        hello = self.session.hello()
        for number, value in (parameters or {}).items():
            self.ask(m.SetParam(number, value))
        if self.status().flags & codes.STATUS_HEAT_ASSUMED:
            self.ask(m.CoilHeat(0))
        wire = samples.astype("<i2").tobytes()
        self.ask(m.Stream(decimation))
        self.ask(m.WaveBegin(total or len(samples), 10, zlib.crc32(wire)))
        for at in range(0, len(samples), 61):
            piece = wire[2 * at : 2 * (at + 61)]
            self.ask(m.WaveData(at, len(piece) // 2, piece))
        self.ask(m.WaveCommit(len(samples), zlib.crc32(wire)))
        self.ask(m.Arm(hello.boot_nonce))
        self.ask(m.Start())
        return hello

    def wait_for(self, *states: codes.State, seconds: float = 10.0) -> m.StatusReply:
        """Return the status once the device is in one of ``states``."""
        deadline = time.monotonic() + seconds
        while True:
            self.beat()
            status = self.status()
            if status.state in states:
                return status
            assert time.monotonic() < deadline, f"still {codes.State(status.state).name} after {seconds} s"
            time.sleep(0.01)


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Assert that the block takes no longer than a generous limit."""
    begun = time.monotonic()
    yield
    assert time.monotonic() - begun < seconds
