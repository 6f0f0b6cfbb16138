"""A play that did not reach its end: what is raised, with what was recorded until then."""

from __future__ import annotations

from typing import Any

from pulsetrainer.artefacts.units import counted
from pulsetrainer.device.follower import INTERRUPTED
from pulsetrainer.device.wording import UNKNOWN_REMEDY
from pulsetrainer.errors import DeviceError, Interrupted


def raise_if_stopped(fault: str, remedy: str, what: str, kept: Any = None) -> None:
    """Raise DeviceError or Interrupted for a play that did not reach its end, with what was ``kept``."""
    if not fault:
        return
    if fault == INTERRUPTED:
        raise Interrupted(f"stopped by you during {what}; the output was switched off first", kept=kept)
    raise DeviceError(
        f"{fault}, during {what}",  # the fault first: it may say that current still flows
        hint=remedy or UNKNOWN_REMEDY,
        kept=kept,
    )


def kept_in(where: object, many: int, what: str) -> str:
    """Say what a file keeps of a play that did not reach its end: how many beats, or samples."""
    return f"; {counted(many, what, 'was', 'were')} kept in {where} (complete=false)"


def in_part(fault: str, begun_s: float) -> str:
    """Add to a fault when its part began: the time in it counts from there."""
    if begun_s == 0 or fault in ("", INTERRUPTED):
        return fault
    return f"{fault}, in the part that began at {begun_s:.1f} s"


def raise_if_lost(samples: int, dropped: int, what: str) -> None:
    """Raise DeviceError where less than half of a play came back: too little to tell anything by."""
    if samples == 0 or dropped > samples:
        raise DeviceError(
            f"of {samples + dropped} samples of {what} {dropped} were lost on the wire",
            hint="check the cable to the device and close what else keeps the computer busy, then run the "
            "command again",
        )
