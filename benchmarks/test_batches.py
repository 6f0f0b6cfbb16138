"""Batches use both cores: twenty bench devices by Snakemake, with one core and with two, in one run."""

from __future__ import annotations

import json
import os
import resource
import statistics
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
BURN = "for _ in range(25_000_000): pass"  # about a second of one core


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


def cores_given() -> float:
    """Return how many cores the machine gives at this moment: two loops one after the other, and at once."""

    def burn(at_once: int) -> float:
        begun = time.perf_counter()
        loops = [subprocess.Popen([sys.executable, "-c", BURN]) for _ in range(at_once)]  # noqa: S603
        assert not any(loop.wait() for loop in loops)
        return time.perf_counter() - begun

    return (burn(1) + burn(1)) / burn(2)


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core cannot show what two do")
def test_twenty_benches_use_both_cores(table, tmp_path):
    """Ten devices with one core and then with two, the other ten with two and then with one."""
    pytest.importorskip("snakemake", reason="Snakemake is not installed")
    wall, cpu, given = {1: 0.0, 2: 0.0}, {1: 0.0, 2: 0.0}, [cores_given()]
    for half, order in enumerate(HALVES):
        seeds = range(1 + half * DEVICES // 2, 1 + (half + 1) * DEVICES // 2)
        for cores in order:
            took = batch(tmp_path / f"{half}-{cores}", seeds, cores)
            wall[cores] += took[0]
            cpu[cores] += took[1]
            given.append(cores_given())
    ratio, idle = wall[1] / wall[2], statistics.fmean(given)
    table.add(
        f"batch of {DEVICES} bench devices, --cores 2",
        ours=f"{wall[2]:.0f} s, {cpu[2]:.0f} s of processor",
        baseline=f"{wall[1]:.0f} s, {cpu[1]:.0f} s of processor, --cores 1",
        figure=f"{ratio:.2f} times faster; two bare loops: {idle:.2f} times",
        bar=f"{LEAST} times, or {LEAST / 2} of the loops'",
    )
    # with other work on the machine the second core is not ours: then as much of it as bare loops get
    assert ratio >= LEAST * min(1.0, idle / 2.0)
