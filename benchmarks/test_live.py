"""What ``--live`` costs: a capture with it over the same capture without, in turns, on a terminal."""

from __future__ import annotations

import os
import pty
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROUNDS = 9
SLOWER = 1.02  # the bar
WORDS = ("capture", "identification", "-o", "out.h5", "--overwrite")


def _once(folder: Path, *more: str) -> tuple[float, float]:
    """Return the wall and the processor time of one capture on a terminal of its own."""
    main, terminal = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "90", "LINES": "30", "PYTHONUTF8": "1"}
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    running = subprocess.Popen(  # noqa: S603
        [sys.executable, "-m", "pulsetrainer", *WORDS, *more],
        cwd=folder,
        env=environment,
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
    )
    os.close(terminal)
    try:
        while os.read(main, 65536):
            pass
    except OSError:  # the other end was closed: Linux says so with an error
        pass
    os.close(main)
    assert running.wait() == 0
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def test_a_live_view_costs_two_percent_at_most(table, tmp_path):
    """98 s of the device, of which every third of a second is drawn, by the median of the ratios of pairs."""
    _once(tmp_path)  # compiles the firmware where nobody has
    walls, cpus = [], []
    for _ in range(ROUNDS):
        plain, live = _once(tmp_path), _once(tmp_path, "--live")
        walls.append(live[0] / plain[0])
        cpus.append(live[1] / plain[1])
    wall, cpu = statistics.median(walls), statistics.median(cpus)
    table.add(
        "capture --live", ours=f"{wall:.3f} of the wall", figure=f"{cpu:.3f} of the processor", bar="1.02"
    )
    assert cpu <= SLOWER, (walls, cpus)  # what a busy computer cannot add to
