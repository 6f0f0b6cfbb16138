"""Commands in forked children: the program as it runs from the command line, the imports done beforehand.

The parent imports everything once. A child has a folder, a command line and files for its output of its own,
and goes through ``cli.app.main``, as the installed program does.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pkgutil
import resource
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pulsetrainer
from pulsetrainer.cli import app

for _module in pkgutil.walk_packages(pulsetrainer.__path__, "pulsetrainer."):
    if not _module.name.endswith("__main__"):
        importlib.import_module(_module.name)

HANG_S = 90.0
DOCUMENTED = (0, 1, 2, 3, 4, 5, 130)


@dataclass(frozen=True)
class Ended:
    """How a child ended."""

    words: tuple[str, ...]
    code: int  # negative: by that signal
    out: str
    err: str
    seconds: float
    hung: bool

    @property
    def spoke(self) -> bool:
        """Whether a failure was told in the program's words: a message, a next step, no traceback."""
        told = "error: " in self.err and "\n  try: " in self.err
        return "Traceback" not in self.err and "a bug:" not in self.err and (self.code in (0, 1) or told)


class Child:
    """One command under way."""

    def __init__(
        self, folder: Path, words: tuple[str, ...], log: Path, before: Callable[[], None] = lambda: None
    ) -> None:
        self.words, self._log, self.begun_s = words, log, time.monotonic()
        self._code: int | None = None
        sys.stdout.flush()
        sys.stderr.flush()
        self.pid = os.fork()
        if self.pid == 0:
            self._become(folder, before)

    def _become(self, folder: Path, before: Callable[[], None]) -> None:
        """Be the program; never returns."""
        code = 70
        try:
            os.chdir(folder)
            for number, name in ((0, os.devnull), (1, f"{self._log}.out"), (2, f"{self._log}.err")):
                handle = os.open(name, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600)
                os.dup2(handle, number)
            sys.argv = ["pulsetrainer", *self.words]
            before()
            app.main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 70
        except BaseException as error:
            os.write(2, f"Traceback past the funnel: {error!r}\n".encode())
        finally:
            with contextlib.suppress(Exception):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)

    def ended(self) -> bool:
        """Whether it has ended."""
        if self._code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self._code = os.waitstatus_to_exitcode(status)
        return self._code is not None

    def kill(self) -> None:
        """End it at once."""
        if not self.ended():
            os.kill(self.pid, signal.SIGKILL)

    def wait(self, patience_s: float = HANG_S) -> Ended:
        """Wait for its end; who does not end in time is killed and counts as hung."""
        deadline, pause, hung = time.monotonic() + patience_s, 0.0002, False
        while not self.ended():
            if time.monotonic() > deadline:
                hung, deadline = True, deadline + patience_s
                self.kill()
            time.sleep(pause)
            pause = min(2 * pause, 0.01)
        seconds = time.monotonic() - self.begun_s
        texts = []
        for end in ("out", "err"):
            path = Path(f"{self._log}.{end}")
            texts.append(path.read_text(errors="replace") if path.exists() else "")
        assert self._code is not None
        return Ended(self.words, self._code, texts[0], texts[1], seconds, hung)


def run(folder: Path, words: tuple[str, ...], log: Path, before: Callable[[], None] = lambda: None) -> Ended:
    """Run a command to its end."""
    return Child(folder, words, log, before).wait()


def file_size_limit(count: int) -> Callable[[], None]:
    """Return what makes a child fail to write beyond so many bytes of any file, like a full quota."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (count, resource.RLIM_INFINITY))

    return limit
