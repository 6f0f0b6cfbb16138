"""An hour at 1 kHz on the bench at full speed: memory, time, and what is readable on the way."""

from __future__ import annotations

import pytest
from measuring import Cost, of_command

from pulsetrainer.artefacts.kinds import Run
from pulsetrainer.artefacts.store import read


def _capture(folder, repeats) -> Cost:
    """Capture the diagnostic signal so often."""
    words = ["capture", "diagnostic", "--repeats", str(repeats), "--force", "-o", "run.h5"]
    return of_command(folder, *words)


@pytest.mark.timeout(0)
def test_an_hour_takes_the_memory_of_a_quarter_of_one(tmp_path, table):
    """The hour is 40 repeats of 91 s, a quarter of it 10; its samples alone are 116 MB."""
    short = _capture(tmp_path, 10).peak_MB
    long, cpu, wall = _capture(tmp_path, 40)
    run = read(tmp_path / "run.h5", Run)
    assert run.complete
    assert run.input.size == 40 * 90_771
    table.add(
        f"capture, {run.input.size} samples, one hour at 1 kHz",
        ours=f"{long:.0f} MB in all, {cpu:.0f} s CPU, {wall:.0f} s",
        baseline=f"{short:.0f} MB for a quarter of it",
        figure=f"{long - short:+.0f} MB more, {(tmp_path / 'run.h5').stat().st_size / 1e6:.0f} MB file",
        bar="20 MB more",
    )
    assert long - short < 20
