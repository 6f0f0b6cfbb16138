"""Opening a device: which port is meant, who opens it, and the limits that are put in force."""

from __future__ import annotations

import logging
import os
import time

from pulsetrainer.device.device import Device
from pulsetrainer.device.limits import Limits
from pulsetrainer.device.ports import find_device_port
from pulsetrainer.device.schemes import OpenPort, find_opener, redact
from pulsetrainer.device.transport import SerialTransport

_LOG = logging.getLogger(__name__)
PORT_VARIABLE = "PULSETRAINER_PORT"
DEFAULT_PORT = "bench:"


def open_device(port: str | None, *, limits: Limits | None = None) -> Device:
    """Open a device and greet it; without a port the environment's ``PULSETRAINER_PORT``, else the bench.

    UsageError if the port's text makes no sense; ArgumentError if a limit is beyond the device's own;
    DeviceError if the port is absent, busy or not permitted, nobody answers, or the protocol differs.
    """
    opened = _open_port(port or os.environ.get(PORT_VARIABLE) or DEFAULT_PORT)
    try:
        device = Device(opened)
        _LOG.info(
            "%s: %s, firmware %s, protocol %s, limits %g A and %g N",
            *(opened.name, device.info.serial, device.info.firmware, device.info.protocol),
            *(device.info.current_limit_A, device.info.force_limit_N),
        )
        device.lower(limits or Limits())
        return device  # noqa: TRY300 - what fails up to here closes the port
    except BaseException:
        opened.close()
        raise


def _open_port(port: str) -> OpenPort:
    opener = find_opener(port)
    if opener is not None:
        return opener(port, time.monotonic)
    name = find_device_port() if port == "auto" else port
    return OpenPort(SerialTransport(name), redact(name))
