"""An hour at 1 kHz on the bench at full speed: memory, time, and what is readable on the way."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from pulsetrainer.artefacts.kinds import Run
from pulsetrainer.artefacts.store import read

# a small process in between: a child is charged with the memory of who starts it
_PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
usage = resource.getrusage(resource.RUSAGE_CHILDREN)
print(usage.ru_maxrss, usage.ru_utime + usage.ru_stime)
"""


def _capture(folder, repeats):
    """Capture the diagnostic signal so often; return the peak of memory [MB], CPU time [s], wall time [s]."""
    words = ["capture", "diagnostic", "--repeats", str(repeats), "--force", "-o", "run.h5"]
    begun = time.perf_counter()
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-c", _PEAK, sys.executable, "-m", "pulsetrainer", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    peak, cpu = done.stdout.splitlines()[-1].split()
    return int(peak) / 1024, float(cpu), time.perf_counter() - begun


@pytest.mark.timeout(0)
def test_an_hour_takes_the_memory_of_ten_minutes(tmp_path, table):
    """The hour is 40 repeats of 91 s; ten minutes are 7."""
    short, _, _ = _capture(tmp_path, 7)
    long, cpu, wall = _capture(tmp_path, 40)
    run = read(tmp_path / "run.h5", Run)
    assert run.complete
    assert run.input.size == 40 * 90_771
    table.add(
        f"capture, {run.input.size} samples, one hour at 1 kHz",
        ours=f"{long:.0f} MB in all, {cpu:.0f} s CPU, {wall:.0f} s",
        baseline=f"{short:.0f} MB for ten minutes",
        figure=f"{long - short:+.0f} MB more, {(tmp_path / 'run.h5').stat().st_size / 1e6:.0f} MB file",
        bar="15 MB more",
    )
    assert long - short < 15
