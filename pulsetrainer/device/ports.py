"""Serial ports: which there are, which one is the device, and why one cannot be opened."""

from __future__ import annotations

import errno
import os
import re
from dataclasses import dataclass
from pathlib import Path

from serial.tools import list_ports as serial_ports

from pulsetrainer.errors import DeviceError

DEVICE_VID_PID = (0x0403, 0x6015)  # the USB bridge of the real device, an FT230X


@dataclass(frozen=True, slots=True)
class PortInfo:
    """A serial port that the system lists."""

    device: str
    description: str
    serial: str
    vid_pid: str
    status: str  # "free", "busy", "no permission" or "absent"
    is_device: bool  # has the USB bridge of the real device


def _status(device: str) -> str:
    path = Path(device)
    if os.name != "posix":
        return "free"
    if not path.exists():
        return "absent"
    if not os.access(path, os.R_OK | os.W_OK):
        return "no permission"
    return "busy" if _is_open_somewhere(path) else "free"


def _is_open_somewhere(path: Path) -> bool:
    """Return whether a process that we may look into has the port open (Linux; elsewhere unknown, False).

    Opening the port to find out could pulse its control lines and reset the board.
    """
    target = path.resolve()
    for descriptor in Path("/proc").glob("[0-9]*/fd/*"):
        try:
            if descriptor.readlink() == target:
                return True
        except OSError:
            continue  # closed meanwhile, or somebody else's
    return False


def list_ports() -> list[PortInfo]:
    """Return the serial ports of this computer, the device's own kind first."""
    found = [
        PortInfo(
            device=port.device,
            description=port.description or "",
            serial=port.serial_number or "",
            vid_pid=f"{port.vid:04x}:{port.pid:04x}" if port.vid is not None else "",
            status=_status(port.device),
            is_device=(port.vid, port.pid) == DEVICE_VID_PID,
        )
        for port in serial_ports.comports()
    ]
    return sorted(found, key=lambda p: (not p.is_device, p.device))


def find_device_port() -> str:
    """Return the one port with the device's USB bridge; none or several are an error that lists them."""
    every = list_ports()
    ours = [p.device for p in every if p.is_device]
    if len(ours) == 1:
        return ours[0]
    if ours:
        raise DeviceError(
            f"{len(ours)} devices are connected: {', '.join(ours)}", hint=f"choose one: `port` {ours[0]}"
        )
    others = ", ".join(p.device for p in every) or "none"
    raise DeviceError(
        f"no device found: no port has the USB id 0403:6015 (ports here: {others})",
        hint="connect the device, name its `port`, or use the virtual bench: `port` bench:",
    )


def cannot_open(port: str, error: Exception) -> DeviceError:
    """Return what to tell about a port that would not open: absent, busy or not permitted."""
    # pyserial drops the number of what stopped it; the exception it came from still has it.
    number = getattr(error, "errno", None) or next(iter(getattr(error.__context__, "args", error.args)), None)
    text = str(error)
    if "://" in port:
        whole = not re.fullmatch(r"socket://[^:/]+/?", port)
        return DeviceError(
            f"cannot reach {port}: {text.rpartition('] ')[2] if whole else 'it has no port number'}",
            hint="check the host and the port number, and that the other side is listening"
            if whole
            else f"give the port number too, such as {port.rstrip('/')}:5000",
        )
    if number == errno.EACCES and os.name == "posix":
        return DeviceError(
            f"no permission to open the port {port}",
            hint="add yourself to its group (often: sudo usermod -aG dialout $USER), then log in again",
        )
    if number in {errno.EBUSY, errno.EAGAIN, errno.EACCES} or "exclusively lock" in text:
        return DeviceError(
            f"the port {port} is busy: another program has it open",
            hint="close the other program (a terminal, a second pulsetrainer), then try again",
        )
    if number in {errno.ENOENT, errno.ENODEV, errno.ENXIO} or "FileNotFoundError" in text:
        present = ", ".join(p.device for p in list_ports()) or "none"
        hint, nor = "check the cable, then `pulsetrainer ports`", ""
        if os.name == "posix" and re.fullmatch("COM[0-9]+", port):
            hint = "COM ports exist on Windows only; pulsetrainer ports lists the ports of this computer"
        elif re.match(r"(tty|cu\.)\w", port) and Path("/dev", port).exists():
            hint = f"write its path: `port` /dev/{port}"
        elif os.name == "posix" and re.match(r"(tty|cu\.)\w", port):
            hint, nor = f"{hint}; give the whole path that it shows", f", nor /dev/{port}"
        return DeviceError(
            f"there is no port {port}{nor} (ports here: {present})",
            hint=f"{hint}; without a device use `port` bench:, over a network socket://host:port",
        )
    if number in {errno.ENOTTY, errno.EINVAL, errno.EISDIR}:
        return DeviceError(f"{port} is not a serial port", hint="`pulsetrainer ports` lists the ports")
    return DeviceError(f"cannot open the port {port}: {text}", hint="`pulsetrainer ports` lists the ports")
