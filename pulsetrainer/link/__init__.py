"""Frames, messages, transport, session, device and the virtual bench."""

from pulsetrainer.link.device import Device, DeviceInfo, open_device, redact
from pulsetrainer.link.ports import PortInfo, list_ports
from pulsetrainer.link.recording import Block, Recording

__all__ = ["Block", "Device", "DeviceInfo", "PortInfo", "Recording", "list_ports", "open_device", "redact"]
