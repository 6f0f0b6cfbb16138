"""A play that did not reach its end: what is raised, with what was recorded until then."""

from __future__ import annotations

from typing import Any

from pulsetrainer.errors import DeviceError, Interrupted

INTERRUPTED = "interrupted"  # the fault of a recording that the user stopped


def raise_if_stopped(fault: str, remedy: str, what: str, kept: Any = None) -> None:
    """Raise DeviceError or Interrupted for a play that did not reach its end, with what was ``kept``."""
    if not fault:
        return
    if fault == INTERRUPTED:
        raise Interrupted(f"stopped by you during {what}; the output was switched off first", kept=kept)
    raise DeviceError(
        f"{fault}, during {what}",  # what is wrong first: it may be that current flows on
        hint=remedy or "remove the cause; the next command clears the fault",
        kept=kept,
    )
