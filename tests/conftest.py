"""How long the laws are tried, and what is made once for all workers.

Laws are tried quickly by default, longer with ``HYPOTHESIS_PROFILE=full`` as ``make test-slow`` does, longest
with ``ci``. Runs are not derandomised, so every run looks at new examples; a failure prints the blob that
replays it.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import signal
from collections.abc import Callable
from pathlib import Path

# as the program does: two workers with two threads each wait for each other
os.environ.setdefault("OMP_NUM_THREADS", "1")

# what a shell starts in the background ignores Ctrl-C, and so would all that the tests start
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "quick", max_examples=25, deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("full", parent=settings.get_profile("quick"), max_examples=100)
settings.register_profile("ci", parent=settings.get_profile("quick"), max_examples=300)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "quick"))


@pytest.fixture(scope="session", autouse=True)
def _no_trace_of_tests(tmp_path_factory) -> None:
    """Keep what is remembered of devices out of the user's own folder."""
    os.environ["XDG_STATE_HOME"] = str(tmp_path_factory.mktemp("state"))


@pytest.fixture(scope="session")
def made_once(tmp_path_factory) -> Callable[[str, Callable[[Path], None]], Path]:
    """Return a folder by its name, filled by the first worker that asks; the others wait and share it."""
    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root

    def folder(name: str, fill: Callable[[Path], None]) -> Path:
        there, whole = root / name, root / f"{name}.whole"
        with (root / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not whole.exists():
                shutil.rmtree(there, ignore_errors=True)
                there.mkdir()
                fill(there)
                whole.touch()
        return there

    return folder
