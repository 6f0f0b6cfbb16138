"""How long until the program answers: help, completion, and what is wrong with a command line."""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
from typing import NamedTuple

import pytest
from measuring import seconds

ROUNDS = 7
HELP_S, USAGE_S = 0.25, 0.5  # the bars, on a machine with nothing else to do
EMPTY_S = 0.010  # there an empty interpreter takes as long: the bars as ratios are 25 and 50


class Start(NamedTuple):
    """Medians of several starts; the ratios are against an empty interpreter beside it."""

    wall_s: float
    cpu_s: float  # what a loaded machine cannot add to
    wall_ratio: float
    cpu_ratio: float


def _once(command: list[str], environment: dict[str, str], code: int) -> tuple[float, float]:
    """Return the wall and the processor time of one start."""

    def job() -> None:
        done = subprocess.run(command, capture_output=True, env=environment, check=False)  # noqa: S603
        assert done.returncode == code, done.stderr

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    wall = seconds(job)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def starts(words: list[str], code: int, more: dict[str, str] | None = None) -> Start:
    """Start the program and ``python -c pass`` in turns."""
    program = [sys.executable, "-m", "pulsetrainer", *words]
    empty = [sys.executable, "-c", "pass"]
    environment = {**os.environ, **(more or {})}
    _once(program, environment, code)
    ours, theirs = [], []
    for _ in range(ROUNDS):
        theirs.append(_once(empty, dict(os.environ), 0))
        ours.append(_once(program, environment, code))
    walls, cpus = zip(*ours, strict=True)
    empty_walls, empty_cpus = zip(*theirs, strict=True)
    return Start(
        statistics.median(walls),
        statistics.median(cpus),
        statistics.median(walls) / statistics.median(empty_walls),
        statistics.median(cpus) / statistics.median(empty_cpus),
    )


COMPLETION = {"_PULSETRAINER_COMPLETE": "complete_bash", "COMP_WORDS": "pulsetrainer i", "COMP_CWORD": "1"}
JOBS = {
    "pulsetrainer --help": (["--help"], 0, {}, HELP_S),
    "pulsetrainer capture --help": (["capture", "--help"], 0, {}, USAGE_S),
    "completion of a command": ([], 0, COMPLETION, USAGE_S),
    "usage error: no such command": (["captur"], 2, {}, USAGE_S),
    "usage error: no such option": (["capture", "identification", "--speeed", "1"], 2, {}, USAGE_S),
    "usage error: an option is missing": (["capture", "identification"], 2, {}, USAGE_S),
    "no such file": (["show", "nowhere.h5"], 3, {}, 2 * USAGE_S),
    "usage error: no such signal": (["capture", "nothing", "-o", "run.h5"], 2, {}, USAGE_S),
    "no such model": (
        ["invert", "nothing", "--model", "no.h5", "-o", "x.h5"],
        None,
        {},
        USAGE_S,
    ),
}


@pytest.mark.parametrize("job", JOBS)
def test_start(table, job, tmp_path, monkeypatch):
    """The bar is held as a ratio of processor times: other work on the machine lengthens both."""
    monkeypatch.chdir(tmp_path)
    words, code, more, bar = JOBS[job]
    start = starts(words, code, more)
    table.add(
        job,
        ours=f"{start.wall_s:.3f} s, {start.cpu_s:.3f} s of processor",
        baseline="python -c pass",
        figure=f"{start.wall_ratio:.0f} times, {start.cpu_ratio:.0f} of processor",
        bar=f"{bar} s, {bar / EMPTY_S:.0f} times",
    )
    assert start.cpu_ratio < bar / EMPTY_S
