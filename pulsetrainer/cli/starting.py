"""The way in: Ctrl-C while the program loads ends it with one line, as it does later with more to say."""

from __future__ import annotations

import os
import signal
import sys
import time
from types import FrameType

_EXIT = 130  # of errors.Interrupted; that is not here yet
_SAID = "stopped by you; nothing was written"
_AS_JSON = '{"schema": 1, "command": "", "error": {"kind": "interrupted", "message": "%s", "hint": "%s"}}\n'
_AGAIN = "run the command again"
_SAME_S = 2.0  # a hand that trembles, or `timeout`, signals twice


def _stop(_number: int, _frame: FrameType | None) -> None:
    """End at once: a library in the middle of its import would tell it in its own way, or not at all."""
    if "--json" in sys.argv:
        os.write(1, (_AS_JSON % (_SAID, _AGAIN)).encode())
    os.write(2, f"error: {_SAID}\n  try: {_AGAIN}\n".encode())
    os._exit(_EXIT)


def _open_what_was_closed() -> None:
    """Open on nothing what the shell closed (``>&-``): else the next file opened is what is printed into."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115, PTH123 - to the end


def main() -> None:
    """Load the program and run it."""
    _open_what_was_closed()
    heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # not in the background of a shell
    if heard:
        signal.signal(signal.SIGINT, _stop)
    # after the handler: it is this that takes its time
    from pulsetrainer.cli.app import main as run

    try:
        run()
    finally:
        if heard:  # all is said and done
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def loaded() -> None:
    """Let Ctrl-C be an exception from now on, which commands know how to end with."""
    if signal.getsignal(signal.SIGINT) is _stop:
        signal.signal(signal.SIGINT, interrupt)


class _Once:
    """Raises KeyboardInterrupt, but not again for what comes right after: by then data is being saved."""

    def __init__(self) -> None:
        self._heard_s = float("-inf")

    def __call__(self, _number: int, _frame: FrameType | None) -> None:
        now_s = time.monotonic()
        if now_s - self._heard_s > _SAME_S:
            self._heard_s = now_s
            raise KeyboardInterrupt


interrupt = _Once()
