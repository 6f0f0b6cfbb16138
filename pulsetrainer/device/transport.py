"""Bytes to and from a port, through pyserial: a real port, ``socket://`` or the bench's pty."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any, Protocol

import serial

from pulsetrainer.device.ports import cannot_open
from pulsetrainer.device.schemes import not_a_port
from pulsetrainer.errors import DeviceError

BAUD = 921_600  # U1BRG = 18 on the real device: 0.04 % off
_SLICE_S = 0.01  # longest single wait; short enough for every deadline of ``exchange``


class PortLostError(DeviceError):
    """The port went away while it was open."""


class Transport(Protocol):
    """What ``exchange`` needs of a port."""

    def read(self) -> bytes:
        """Return what has arrived, waiting a few milliseconds for the first byte."""

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""

    def discard(self) -> None:
        """Forget what has arrived."""

    def close(self) -> None:
        """Give the port back."""


class SerialTransport:
    """A port opened by pyserial, for this program alone; ``name`` is what messages call it.

    Beneath pyserial lie the drivers and libraries of three operating systems, which raise ``OSError``,
    ``termios.error``, ``struct.error``, ``TypeError`` and more on a port that has gone. Whatever it is, to
    the caller the port is gone.
    """

    def __init__(self, port: str, name: str = "") -> None:
        self._port = name or port
        try:
            self._serial: Any = serial.serial_for_url(port, do_not_open=True)
            self._serial.baudrate = BAUD
            self._serial.timeout = _SLICE_S
            self._serial.write_timeout = 2.0
            if "://" not in port:
                self._serial.exclusive = True
                # Set before opening, else some bridges pulse the line and reset the board.
                self._serial.dtr = True
                self._serial.rts = False
            self._serial.open()
        except (ValueError, LookupError) as error:  # pyserial's way to say that the text makes no sense
            raise not_a_port(port, error) from error
        except Exception as error:
            raise cannot_open(port, error) from error

    @contextlib.contextmanager
    def _present(self) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            raise PortLostError(
                f"the port {self._port} is gone: {error or type(error).__name__}",
                hint="the device switches its output off by itself; check cable and power, "
                "then open it again",
            ) from error

    def read(self) -> bytes:
        """Return what has arrived, waiting at most 10 ms for the first byte."""
        with self._present():
            first: bytes = self._serial.read(1)
            return first + bytes(self._serial.read(self._serial.in_waiting)) if first else b""

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        with self._present():
            self._serial.write(data)

    def discard(self) -> None:
        """Forget what has arrived."""
        with self._present():
            self._serial.reset_input_buffer()

    def close(self) -> None:
        """Give the port back; one that has gone needs nothing more."""
        with contextlib.suppress(Exception):
            self._serial.close()
