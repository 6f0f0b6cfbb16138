"""What a diagnosis of the 94 s of the diagnostic signal costs, beside an identification of the same run."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys

import pytest

PROGRAM = [sys.executable, "-m", "pulsetrainer"]
ROUNDS = 3
MOST_S, QUICK_S, MOST_MB = 10.0, 3.0, 1000.0  # of processor time, and of memory


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a run of the bench as built, and a model of another."""
    here = tmp_path_factory.mktemp("diagnosed")
    for words in (
        ("capture", "identification", "-o", "run.h5"),
        ("identify", "run.h5", "-o", "model.h5"),
        ("capture", "diagnostic", "-o", "diagnostic.h5"),
    ):
        subprocess.run([*PROGRAM, *words], cwd=here, check=True, capture_output=True)  # noqa: S603
    return here


def _spent(folder, *words: str) -> tuple[float, float]:
    """Return the seconds of processor of a command, and its peak of memory in MB."""
    with subprocess.Popen(  # noqa: S603
        [*PROGRAM, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        _, code, used = os.wait4(process.pid, 0)
        process.returncode = code
    assert code == 0
    return used.ru_utime + used.ru_stime, used.ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def test_a_diagnosis_costs_seconds(table, folder):
    """By turns with an identification, whose time tells what the machine is like."""
    diagnose = ("diagnose", "diagnostic.h5", "--model", "model.h5", "-o", "found.h5", "--overwrite")
    identify = ("identify", "diagnostic.h5", "-o", "again.h5", "--overwrite")
    rounds = [
        (_spent(folder, *diagnose), _spent(folder, *identify), _spent(folder, *diagnose, "--quick"))
        for _ in range(ROUNDS)
    ]
    whole, beside, quick = (statistics.median(row[k][0] for row in rounds) for k in range(3))
    memory = max(row[0][1] for row in rounds)
    table.add(
        "diagnose, 94 s of the bench as built, processor time",
        ours=f"{whole:.1f} s, {memory:.0f} MB; --quick {quick:.1f} s",
        baseline=f"identify, {beside:.1f} s",
        figure=f"{whole / beside:.1f} times",
        bar=f"{MOST_S:g} s, {MOST_MB:g} MB; {QUICK_S:g} s",
    )
    assert whole <= MOST_S
    assert quick <= QUICK_S
    assert memory <= MOST_MB
