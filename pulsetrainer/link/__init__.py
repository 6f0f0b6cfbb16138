"""Frames, messages, transport, session, device and the virtual bench."""

from pulsetrainer.link.device import DEFAULT_PORT, Device, DeviceInfo, Limits, open_device, redact
from pulsetrainer.link.ports import PortInfo, list_ports
from pulsetrainer.link.recording import Block, Recording

__all__ = [
    "DEFAULT_PORT",
    "Block",
    "Device",
    "DeviceInfo",
    "Limits",
    "PortInfo",
    "Recording",
    "list_ports",
    "open_device",
    "redact",
]
