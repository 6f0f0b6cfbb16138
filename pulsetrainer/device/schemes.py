"""Kinds of ports: what kind a port's text names, and who opens it.

A serial port is opened here. Every other kind announces itself with ``register`` under its scheme, the word
before the colon, so that this package knows transports and not what pretends to be a device.
"""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from pulsetrainer.errors import DeviceError, UsageError

if TYPE_CHECKING:
    from pulsetrainer.device.transport import Transport

# Five quick tries; the last wait is long because a busy computer may just have been away.
TIMEOUTS_S = (0.05, 0.05, 0.05, 0.05, 0.05, 0.5)

Clock = Callable[[], float]
Sleep = Callable[[float], None]


class Machine(Protocol):
    """What runs behind a port and has to be ended with it."""

    def close(self) -> None:
        """End it."""


@dataclass(frozen=True, slots=True)
class OpenPort:
    """A port that is open, and how a device behind it has to be talked to."""

    transport: Transport
    name: str  # in messages and files: without whatever parameters opened it
    timeouts_s: tuple[float, ...] = TIMEOUTS_S  # patience for each try of a command
    piece_s: float = math.inf  # of the reference in one frame while it plays
    starts_cold: bool = False  # nothing can have heated its coil before it was opened
    machine: Machine | None = None

    def close(self) -> None:
        """Give the port back and end what runs behind it."""
        try:
            self.transport.close()
        finally:
            if self.machine is not None:
                self.machine.close()


Opener = Callable[[str, Clock], OpenPort]
_OPENERS: dict[str, Opener] = {}


def register(scheme: str, opener: Opener) -> None:
    """Let ``opener`` open every port whose text begins with ``scheme`` and a colon."""
    _OPENERS[scheme] = opener


def find_opener(port: str) -> Opener | None:
    """Return who opens a port of this text; None for a serial port, and for ``socket://`` and its like.

    UsageError where nobody has announced its scheme; DeviceError where one is written in capitals, or without
    its colon.
    """
    match = re.match(r"([a-z][a-z0-9+-]*):(//)?", port)
    if match is None:
        name, mark, rest = port.partition("?")
        meant = f"{name.lower().rstrip(':')}:{mark}{rest}"
        if name.lower().rstrip(":") in _OPENERS:
            how = "add the colon" if name.islower() else "write it in lower case"
            raise DeviceError(f"there is no port {port}", hint=f"{how}: `port` {shlex.quote(meant)}")
        return None
    scheme, slashes = match.groups()
    if scheme not in _OPENERS and not slashes:
        raise UsageError(
            f"`port`: {port!r} is of no known kind",
            hint=f"a port is {''.join(f'{known}:, ' for known in _OPENERS)}/dev/ttyUSB0, COM3 or "
            "socket://host:port",
        )
    if slashes and scheme not in _OPENERS:
        _check_url(port)
    return _OPENERS.get(scheme)


def _check_url(port: str) -> None:
    """Raise DeviceError for ``tcp://`` and its like, which pyserial does not know; nothing is opened."""
    import serial  # noqa: PLC0415 - slow to load, and needed by few ports

    try:
        serial.serial_for_url(port, do_not_open=True)
    except ValueError as error:
        raise not_a_port(port, error) from error


def not_a_port(port: str, error: Exception) -> DeviceError:
    """Return what to tell about a text that makes no sense as a port."""
    return DeviceError(
        f"{port!r} is not a port: {error}",
        hint="a port is bench:, qemu:, /dev/ttyUSB0, COM3 or socket://host:port",
    )


def redact(port: str) -> str:
    """Return the port without its parameters, which must never reach a file: they may hold what is hidden.

    Seed and serial number stay: they say which device, and a command can be replayed by them.
    """
    name, _, parameters = port.partition("?")
    kept = [one for one in parameters.split("&") if re.fullmatch(r"(seed|serial)=\d{1,9}", one)]
    return f"{name}?{'&'.join(kept)}" if kept else name
