"""The scripts that measure still run, each as small as it goes; what they print is for docs, not for here."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SMALLEST = {
    "benchmarks/coarse_steps.py": "--count 1 --quick",
    "benchmarks/corrected_records.py": "--count 1 --only drift",
    "benchmarks/drawn_coils.py": "tests/data/files-0.1/drive.h5 --coils 1",
    "benchmarks/forms_named.py": "--direct 1 --others 1",
    "benchmarks/heat.py": "--devices 1 --minutes 0.5",
    "benchmarks/heavy_tails.py": "--count 1 --levels 12",
    "benchmarks/learnt_elsewhere.py": "--plants 1 --pulses normal,stiff",
    "benchmarks/shifted_devices.py": "--devices 1 --unchanged 1",
    "benchmarks/unlisted_dependences.py": "--kinds speed",
    "benchmarks/wild_samples.py": "--count 1 --levels 12 --forms direct",
    "tests/blind/noises.py": "controls --each 1 --noise white --processes 1",
}


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("script", SMALLEST)
def test_a_script_that_measures_runs(script):
    """A name that it uses may have moved."""
    command = [sys.executable, ROOT / script, *SMALLEST[script].split()]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_every_script_is_tried():
    """But those that are tests themselves, or jobs of theirs."""
    jobs = {"conftest.py", "identify_job.py", "measuring.py", "memory_jobs.py", "prandtl_ishlinskii.py"}
    scripts = {f"benchmarks/{one.name}" for one in (ROOT / "benchmarks").glob("*.py")}
    tried = {one for one in SMALLEST if one.startswith("benchmarks")}
    assert tried == {one for one in scripts if one.split("/")[1] not in jobs and "/test_" not in one}
