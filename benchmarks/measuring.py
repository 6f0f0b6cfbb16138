"""Times, memory and the table of the benchmarks."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple


class Row(NamedTuple):
    """One line of the table."""

    job: str
    ours: str
    baseline: str
    figure: str
    bar: str


@dataclass
class Table:
    """Rows in the order in which they were measured."""

    rows: list[Row] = field(default_factory=list)

    def add(self, job: str, *, ours: str, figure: str, bar: str, baseline: str = "") -> None:
        """Append a row."""
        self.rows.append(Row(job, ours, baseline, figure, bar))

    def lines(self) -> list[str]:
        """Return the table in Markdown, columns aligned."""
        table = [Row("job", "ours", "baseline", "figure", "bar"), *self.rows]
        width = [max(len(row[k]) for row in table) for k in range(len(Row._fields))]
        lines = [
            "| " + " | ".join(c.ljust(w) for c, w in zip(row, width, strict=True)) + " |" for row in table
        ]
        lines.insert(1, "|" + "|".join("-" * (w + 2) for w in width) + "|")
        return lines


class Times(NamedTuple):
    """Seconds of two jobs that took turns."""

    ours: float  # median
    baseline: float  # median
    ratio: float  # median of the ratios of neighbours: what slows the machine slows both


def seconds(job: Callable[[], object]) -> float:
    """Return the wall time of one call."""
    begun = time.perf_counter()
    job()
    return time.perf_counter() - begun


def taking_turns(ours: Callable[[], object], baseline: Callable[[], object], rounds: int) -> Times:
    """Time both in turn ``rounds`` times, ours before and after each baseline."""
    ours()  # imports, caches
    mine, theirs, ratios = [], [], []
    for _ in range(rounds):
        before, slow, after = seconds(ours), seconds(baseline), seconds(ours)
        mine += [before, after]
        theirs.append(slow)
        ratios.append(2.0 * slow / (before + after))
    return Times(statistics.median(mine), statistics.median(theirs), statistics.median(ratios))


class Cost(NamedTuple):
    """What a command took."""

    peak_MB: float
    processor_s: float
    wall_s: float


# a small process in between: a child is charged with the memory of who starts it
_PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
usage = resource.getrusage(resource.RUSAGE_CHILDREN)
print(usage.ru_maxrss, usage.ru_utime + usage.ru_stime)
"""


def of_command(folder: Path, *words: str) -> Cost:
    """Run a command of pulsetrainer in a folder."""
    begun = time.perf_counter()
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-c", _PEAK, sys.executable, "-m", "pulsetrainer", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    peak, processor = done.stdout.splitlines()[-1].split()
    return Cost(int(peak) * 1024 / 1e6, float(processor), time.perf_counter() - begun)


class Peak(NamedTuple):
    """What a job took in a process of its own."""

    seconds: float
    start_MB: float  # resident when imports and data were there
    peak_MB: float
    result: dict[str, float]

    @property
    def more_MB(self) -> float:
        """Memory the job itself took at its peak."""
        return self.peak_MB - self.start_MB


def in_own_process(job: str) -> Peak:
    """Run a job of ``memory_jobs`` in a fresh interpreter."""
    script = Path(__file__).with_name("memory_jobs.py")
    path = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}  # tests/ is on it
    done = subprocess.run(  # noqa: S603
        [sys.executable, str(script), job], check=True, capture_output=True, text=True, env=path
    )
    return Peak(**json.loads(done.stdout))
