"""Batches use both cores: twenty bench devices by Snakemake, with one core and with two, in one run."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# a short record and one pulse: a job is mostly starting, computing and ending, as in a real batch
SHORT = {
    "capture": "--levels 12 --speed 3",
    "identify": "--levels 12",
    "play": "--repeats 1",
    "pulses": ["normal"],
}
HALVES = ((1, 2), (2, 1))  # cores, in the order of each half: what slows the machine slows both
DEVICES = 20
LEAST = 1.6


def batch(folder: Path, seeds: range, cores: int) -> tuple[float, float]:
    """Run the batch of some devices from nothing; return its wall and its processor time."""
    folder.mkdir()
    rows = [f"bench-{seed}\tbench:?seed={seed}\n" for seed in seeds]
    (folder / "devices.tsv").write_text("name\tport\n" + "".join(rows))
    config = {"devices": "devices.tsv", "out": "out", "program": f"{sys.executable} -m pulsetrainer", **SHORT}
    (folder / "my.json").write_text(json.dumps(config))
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "workflow" / "Snakefile")]
    command += ["--configfile", "my.json", "--cores", str(cores), "--quiet"]
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode == 0, done.stderr
    assert len(list(folder.glob("out/*/report.html"))) == len(seeds)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core cannot show what two do")
def test_twenty_benches_use_both_cores(table, tmp_path):
    """Ten devices with one core and then with two, the other ten with two and then with one."""
    pytest.importorskip("snakemake", reason="Snakemake is not installed")
    wall, cpu = {1: 0.0, 2: 0.0}, {1: 0.0, 2: 0.0}
    for half, order in enumerate(HALVES):
        seeds = range(1 + half * DEVICES // 2, 1 + (half + 1) * DEVICES // 2)
        for cores in order:
            took = batch(tmp_path / f"{half}-{cores}", seeds, cores)
            wall[cores] += took[0]
            cpu[cores] += took[1]
    ratio = wall[1] / wall[2]
    table.add(
        f"batch of {DEVICES} bench devices, --cores 2",
        ours=f"{wall[2]:.0f} s, {cpu[2]:.0f} s of processor",
        baseline=f"{wall[1]:.0f} s, {cpu[1]:.0f} s of processor, --cores 1",
        figure=f"{ratio:.2f} times faster, load {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores",
        bar=f"{LEAST} times",
    )
    assert ratio >= LEAST
