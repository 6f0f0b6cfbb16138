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

from mistakes import INSIDE, PREPARATION, TABLES, Mistake, at_once, lay_out

ROUNDS = 7
HELP_S, USAGE_S = 0.25, 0.5  # the bars, on a machine with nothing else to do
IMPORT_TIMES = 5.0  # an empty interpreter
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


def starts(words: list[str], code: int, more: dict[str, str] | None = None, rounds: int = ROUNDS) -> Start:
    """Start python with ``words`` and ``python -c pass`` in turns."""
    program = [sys.executable, *words]
    empty = [sys.executable, "-c", "pass"]
    # as after an installation: the modules are compiled, by the first start if by nobody else
    installed = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment = {**installed, **(more or {})}
    _once(program, environment, code)
    ours, theirs = [], []
    for _ in range(rounds):
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


PROGRAM = ["-m", "pulsetrainer"]
COMPLETION = {"_PULSETRAINER_COMPLETE": "complete_bash", "COMP_WORDS": "pulsetrainer i", "COMP_CWORD": "1"}
JOBS = {
    "pulsetrainer --help": (["--help"], {}, HELP_S),
    "pulsetrainer capture --help": (["capture", "--help"], {}, USAGE_S),
    "completion of a command": ([], COMPLETION, USAGE_S),
}


def test_import(table):
    """``import pulsetrainer`` in a notebook: names are loaded when first used."""
    start = starts(["-c", "import pulsetrainer"], 0, rounds=3 * ROUNDS)
    table.add(
        "import pulsetrainer",
        ours=f"{start.wall_s:.3f} s, {start.cpu_s:.3f} s of processor",
        baseline="python -c pass",
        figure=f"{start.wall_ratio:.1f} times, {start.cpu_ratio:.1f} of processor",
        bar=f"{IMPORT_TIMES:.0f} times",
    )
    assert start.cpu_ratio < IMPORT_TIMES


@pytest.mark.parametrize("job", JOBS)
def test_start(table, job, tmp_path, monkeypatch):
    """The bar is held as a ratio of processor times: other work on the machine lengthens both."""
    monkeypatch.chdir(tmp_path)
    words, more, bar = JOBS[job]
    start = starts([*PROGRAM, *words], 0, more)
    table.add(
        job,
        ours=f"{start.wall_s:.3f} s, {start.cpu_s:.3f} s of processor",
        baseline="python -c pass",
        figure=f"{start.wall_ratio:.0f} times, {start.cpu_ratio:.0f} of processor",
        bar=f"{bar} s, {bar / EMPTY_S:.0f} times",
    )
    assert start.cpu_ratio < bar / EMPTY_S


def slowest(table, what: str, cases: dict[str, Mistake]) -> float:
    """Time every mistake and add a row with the one that takes longest; return its ratio."""
    found = {name: starts([*PROGRAM, *one.words], one.code, rounds=3) for name, one in cases.items()}
    for name, start in found.items():
        print(f"{start.wall_s:.3f} s, {start.cpu_s:.3f} s of processor: {name}")
    name, start = max(found.items(), key=lambda pair: pair[1].cpu_s)
    table.add(
        f"{what}: the slowest of {len(found)}, {name}",
        ours=f"{start.wall_s:.3f} s, {start.cpu_s:.3f} s of processor",
        baseline="python -c pass",
        figure=f"{start.wall_ratio:.0f} times, {start.cpu_ratio:.0f} of processor",
        bar=f"{USAGE_S} s, {USAGE_S / EMPTY_S:.0f} times",
    )
    return start.cpu_ratio


def test_every_mistake_in_a_name(table, tmp_path, monkeypatch):
    """Each command with each input absent and each output in the way, and every name that can be wrong."""
    lay_out(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert slowest(table, "a mistake in a name", at_once()) < USAGE_S / EMPTY_S


def test_every_mistake_that_a_look_inside_tells(table, tmp_path, monkeypatch):
    """Usage errors for which an artefact is opened, or the device asked."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plain").mkdir()
    for words in PREPARATION:
        subprocess.run([sys.executable, "-m", "pulsetrainer", *words], check=True, capture_output=True)  # noqa: S603
    for name, text in TABLES.items():
        (tmp_path / name).write_text(text)
    assert slowest(table, "a mistake that a look inside tells", INSIDE) < USAGE_S / EMPTY_S
