"""Who a device is."""

from __future__ import annotations

from dataclasses import dataclass

from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import ResetCause
from pulsetrainer.device.wording import serial_text, told


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Who the device is and its limits, as it reports them."""

    serial: str
    firmware: str
    protocol: str
    build: str
    tick_rate_Hz: float
    current_limit_A: float
    force_limit_N: float
    on_time_limit_s: float
    heartbeat_s: float
    reset_cause: str
    latched_fault: str  # what an earlier play ended with; the next play clears it

    @classmethod
    def from_wire(cls, hello: m.HelloReply, latched_fault: str) -> DeviceInfo:
        """Return what a greeting says."""
        return cls(
            serial=serial_text(hello.serial),
            firmware=f"{hello.firmware_major}.{hello.firmware_minor}.{hello.firmware_patch}",
            protocol=f"{hello.major}.{hello.minor}",
            build=f"{hello.build_hash:08x}",
            tick_rate_Hz=float(hello.tick_rate_Hz),
            current_limit_A=hello.current_limit / 10_000,
            force_limit_N=hello.force_trip / 1_000,
            on_time_limit_s=float(hello.on_time_s),
            heartbeat_s=hello.heartbeat_ms / 1_000,
            reset_cause=told(ResetCause, hello.reset_cause),
            latched_fault=latched_fault,
        )
