"""Large records from other benches, by the commands: how memory and time grow with the file."""

from __future__ import annotations

import core_jobs
import numpy as np
import pytest
from measuring import of_command

from pulsetrainer.artefacts import Run
from pulsetrainer.files.store import read

COLUMNS = ("--input", "current", "--output", "force")
KEPT = 24  # bytes of a row: time, input, output
ROWS_A_BLOCK = 100_000


def _write(path, rows):
    """Write a record of four columns, one of them of no use, block by block."""
    rng = np.random.default_rng(1)
    with path.open("w") as out:
        out.write("t_s,current_A,force_N,temperature_C\n")
        for start in range(0, rows, ROWS_A_BLOCK):
            time = 1e-4 * np.arange(start, min(start + ROWS_A_BLOCK, rows))
            current = 0.5 + 0.4 * np.sin(2.0 * time) + rng.normal(0.0, 1e-3, time.size)
            force = 3.0 * current**2 + rng.normal(0.0, 5e-3, time.size)
            cells = zip(
                time.tolist(), current.tolist(), force.tolist(), (20 + 1e-3 * time).tolist(), strict=True
            )
            out.writelines("%.4f,%.6f,%.5f,%.2f\n" % row for row in cells)  # noqa: UP031 - twice as fast
    return path.stat().st_size / 1e6


@pytest.mark.timeout(0)
def test_import_keeps_the_numbers_and_nothing_else(tmp_path, table):
    """Four times the file: memory grows by the three columns that are kept, and a fifth."""
    rows = {"small": 850_000, "large": 3_400_000}
    size = {name: _write(tmp_path / f"{name}.csv", count) for name, count in rows.items()}
    cost = {
        name: of_command(tmp_path, "import", f"{name}.csv", *COLUMNS, "-o", f"{name}.h5") for name in rows
    }
    kept = {name: KEPT * count / 1e6 for name, count in rows.items()}
    growth = (cost["large"].peak_MB - cost["small"].peak_MB) / (kept["large"] - kept["small"])
    table.add(
        f"import, CSV of {size['large']:.0f} MB, {rows['large']} rows",
        ours=f"{cost['large'].peak_MB:.0f} MB in all, {cost['large'].processor_s:.0f} s of processor",
        baseline=f"{cost['small'].peak_MB:.0f} MB at {size['small']:.0f} MB",
        figure=f"{growth:.2f} bytes for each byte kept",
        bar="1.2, and 200 MB",
    )
    assert growth < 1.2
    assert cost["large"].peak_MB < 1.2 * kept["large"] + 200
    assert read(tmp_path / "large.h5", Run).input.size == rows["large"]


def test_identify_a_million_samples(tmp_path, table):
    """From an imported run, with noise of 0.2 % in the input and 0.5 % in the output."""
    job, rng = core_jobs.job(7, n=1_000_000), np.random.default_rng(3)
    current = job.input + rng.normal(0.0, 0.002 * np.ptp(job.input) / 2, job.input.size)
    force = job.output + rng.normal(0.0, 0.005 * job.span, job.input.size)
    np.savez(tmp_path / "r.npz", time_s=1e-3 * np.arange(current.size), current_A=current, force_N=force)
    of_command(tmp_path, "import", "r.npz", "--input", "current_A", "--output", "force_N", "-o", "run.h5")
    idle = of_command(tmp_path, "identify", "--help")
    took = of_command(tmp_path, "identify", "run.h5", "-o", "model.h5")
    table.add(
        "pulsetrainer identify, 1 000 000 noisy samples",
        ours=f"{took.processor_s:.1f} s of processor, {took.peak_MB:.0f} MB in all",
        baseline=f"{idle.peak_MB:.0f} MB for --help",
        figure=f"{(took.peak_MB - idle.peak_MB) / (KEPT * current.size / 1e6):.0f} bytes a byte of the run",
        bar="20 s, 600 MB",
    )
    assert took.peak_MB < 600
    assert took.processor_s < 20
