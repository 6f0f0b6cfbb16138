"""The firmware as a Cortex-M4F image in an emulator, at the pace of the wall clock."""

from __future__ import annotations

import contextlib
import os
import secrets
import select
import signal
import socket
import struct
import subprocess
import tempfile
import time
from collections.abc import Callable

from pulsetrainer.device.codes import TICK_RATE_HZ
from pulsetrainer.device.schemes import OpenPort
from pulsetrainer.device.transport import PortLostError
from pulsetrainer.errors import DeviceError
from pulsetrainer.simulation.bad_wire import through
from pulsetrainer.simulation.build import find_emulator, firmware_image
from pulsetrainer.simulation.options import BREAKS, QEMU_SETTINGS, QemuOptions, parse_qemu

QEMU_PORT = "qemu:"
# The line loses nothing but is slow, some 10 kB/s and less on a busy computer: a command repeated early
# would only make it slower.
QEMU_TIMEOUTS_S = (0.5, 0.5, 1.0)
# A long frame takes 10 ms on an idle computer and 200 ms on a crowded one, and the device takes it for a sign
# of life only when it is whole: short ones, while the buffer is well filled.
QEMU_PIECE_S = 0.02
# Behind a bad wire a lost command must come again before the device takes its host for gone.
QEMU_BAD_WIRE_TIMEOUTS_S = (0.06, 0.06, 0.06, 0.1, 0.5, 1.0)
_SLICE_S = 0.01
_GATHER_S = 0.001  # the emulator sends byte by byte: without a pause each would wake this process
_WRITE_S = 2.0
_LEAVE_S = 2.0
_PIECE = 65_536
_SEND_ROOM = 4_000_000  # the system takes it down to its limit
_SEED_ADDRESS = 0x2000_0000  # `retained` in port/mps2/mps2.ld
_BREAKS_ADDRESS = _SEED_ADDRESS + 16  # its break_tick
_SETTINGS_ADDRESS = _BREAKS_ADDRESS + 4 * len(BREAKS) + 12  # its setting, behind what is kept of the heat
# 2^5 ns of the device's time an instruction, held to the wall clock: 31 MIPS is what the real board's
# 25 MHz give about, twice what tick and simulated world need, and light enough for a busy computer.
_REAL_TIME = "shift=5,align=on"
# The emulator's serial line is a socket that only this process has the other end of (its file descriptor
# 3). The shell is the leash: it waits for its standard input to close, which happens however we end,
# and takes the emulator with it.
_LEASH = '"$@" 3>&1 1>&2 </dev/null & exec 1>&-; read -r _; kill -9 $!; wait'


def _loads(options: QemuOptions) -> list[str]:
    """Return the emulator's arguments that put breaks and settings into the device's memory."""
    words = [(_BREAKS_ADDRESS + 4 * what, int(second * TICK_RATE_HZ) + 1) for what, second in options.breaks]
    for name, value in options.settings:
        (bits,) = struct.unpack("<I", struct.pack("<f", value))
        words.append((_SETTINGS_ADDRESS + 4 * [*QEMU_SETTINGS].index(name), bits))
    return [
        word
        for address, data in words
        for word in ("-device", f"loader,addr={address:#x},data={data:#x},data-len=4")
    ]


class SocketTransport:
    """Bytes to and from a socket; ``name`` is what messages call it, ``last_words`` why it was closed."""

    def __init__(self, wire: socket.socket, name: str, last_words: Callable[[], str]) -> None:
        self._socket = wire
        self._name = name
        self._last_words = last_words
        wire.setblocking(False)

    def _lost(self, why: str) -> PortLostError:
        return PortLostError(
            f"the port {self._name} is gone: {self._last_words() or why}",
            hint="open it again; a fresh device starts switched off",
        )

    def read(self) -> bytes:
        """Return what has arrived, waiting at most 10 ms for the first byte."""
        try:
            ready, _, _ = select.select([self._socket], [], [], _SLICE_S)
            if not ready:
                return b""
            time.sleep(_GATHER_S)
            data = self._socket.recv(_PIECE)
        except (OSError, ValueError) as error:  # ValueError: closed by another thread
            raise self._lost(str(error)) from error
        if not data:
            raise self._lost("the emulator has ended")
        return data

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        rest = memoryview(data)
        deadline = time.monotonic() + _WRITE_S
        try:
            while rest:
                _, ready, _ = select.select([], [self._socket], [], _SLICE_S)
                if ready:
                    rest = rest[self._socket.send(rest) :]
                elif time.monotonic() > deadline:
                    raise self._lost(f"it has taken no bytes for {_WRITE_S:g} s")
        except (OSError, ValueError) as error:
            raise self._lost(str(error)) from error

    def discard(self) -> None:
        """Forget what has arrived."""
        while select.select([self._socket], [], [], 0)[0]:
            self.read()

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()


class Emulator:
    """A running emulator; ``transport`` is its serial line."""

    def __init__(self, port: str) -> None:
        self.options = parse_qemu(port)
        if os.name != "posix":
            raise DeviceError(
                "the emulated device needs a POSIX shell, which this system does not have",
                hint="use Linux, macOS or WSL for qemu:, or a real device with `port` COM3",
            )
        words = [find_emulator(), "-M", "mps2-an386", "-kernel", str(firmware_image())]
        words += ["-display", "none", "-monitor", "none", "-icount", _REAL_TIME]
        words += ["-chardev", "socket,id=wire,fd=3", "-serial", "chardev:wire"]
        seed = secrets.randbits(32)
        words += ["-device", f"loader,addr={_SEED_ADDRESS:#x},data={seed:#x},data-len=4"]
        words += _loads(self.options)
        ours, theirs = socket.socketpair()
        # The emulator sends single bytes, each of which takes the room of a kilobyte in here.
        theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_ROOM)
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        self.transport = SocketTransport(ours, QEMU_PORT, self._last_words)
        try:
            # A session of its own: Ctrl-C must reach the host program only, which stops the device in order.
            self._process = subprocess.Popen(
                ["sh", "-c", _LEASH, "leash", *words],
                stdin=subprocess.PIPE,
                stdout=theirs.fileno(),
                stderr=self._said,
                start_new_session=True,
            )
        except BaseException:
            self.transport.close()
            self._said.close()
            raise
        finally:
            theirs.close()

    @property
    def pid(self) -> int:
        """Process id of the leash, which is also the emulator's process group."""
        return self._process.pid

    def _last_words(self) -> str:
        if self._said.closed:
            return ""
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").splitlines()
        return " ".join(line for line in lines if not line.startswith("Warning: The guest is now"))

    def close(self) -> None:
        """End the emulator."""
        self.transport.close()
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(timeout=_LEAVE_S)
        except subprocess.TimeoutExpired:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        self._said.close()


def open_emulator(port: str, monotonic: Callable[[], float]) -> OpenPort:
    """Start an emulator; its line is slow, which the port says.

    UsageError where the port's text makes no sense; DeviceError where there is no emulator, or no compiler
    for its image.
    """
    emulator = Emulator(port)
    wire = emulator.options.wire
    return OpenPort(
        through(wire, emulator.transport, monotonic),
        QEMU_PORT,
        timeouts_s=QEMU_BAD_WIRE_TIMEOUTS_S if wire.rate else QEMU_TIMEOUTS_S,
        piece_s=QEMU_PIECE_S,
        starts_cold=True,
        machine=emulator,
    )
