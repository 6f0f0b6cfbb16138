"""An hour at 1 kHz on the bench at full speed: memory, time, and what is readable on the way."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from measuring import Cost, of_command

from pulsetrainer.artefacts import Run
from pulsetrainer.files.store import read


def _words(repeats) -> list[str]:
    """Words that capture the diagnostic signal so often."""
    return ["capture", "diagnostic", "--repeats", str(repeats), "--force", "-o", "run.h5"]


def _samples(repeats) -> int:
    """Samples that the plan promises."""
    command = [sys.executable, "-m", "pulsetrainer", *_words(repeats), "--dry-run", "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["samples"]  # noqa: S603


def _capture(folder, repeats) -> Cost:
    """Capture it, and say what that costs."""
    return of_command(folder, *_words(repeats))


@pytest.mark.timeout(0)
def test_an_hour_takes_the_memory_of_a_quarter_of_one(tmp_path, table):
    """The hour is 40 repeats of 94 s, a quarter of it 10; its samples alone are 121 MB."""
    short = _capture(tmp_path, 10).peak_MB
    long, cpu, wall = _capture(tmp_path, 40)
    run = read(tmp_path / "run.h5", Run)
    assert run.complete
    assert run.input.size == _samples(40) > 3_600_000
    table.add(
        f"capture, {run.input.size} samples, one hour at 1 kHz",
        ours=f"{long:.0f} MB in all, {cpu:.0f} s CPU, {wall:.0f} s",
        baseline=f"{short:.0f} MB for a quarter of it",
        figure=f"{long - short:+.0f} MB more, {(tmp_path / 'run.h5').stat().st_size / 1e6:.0f} MB file",
        bar="20 MB more",
    )
    assert long - short < 20
