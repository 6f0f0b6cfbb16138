"""What a notebook pays for the verb around the core, in a process that may use all threads."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

MOST_TIMES = 1.1


def test_identify_is_as_quick_as_the_core(table):
    """``pulsetrainer.identify`` against the functions of the core that it calls, in one thread."""
    limits = {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"}
    free = {name: value for name, value in os.environ.items() if name not in limits}
    done = subprocess.run(  # noqa: S603
        [sys.executable, str(Path(__file__).with_name("identify_job.py"))],
        env={**free, "PYTHONPATH": os.pathsep.join(sys.path)},
        check=True,
        capture_output=True,
        text=True,
    )
    took = json.loads(done.stdout)
    table.add(
        "pulsetrainer.identify(run), no limit of threads set",
        ours=f"{took['api_s']:.2f} s",
        baseline=f"{took['core_s']:.2f} s, the core's own work",
        figure=f"{took['ratio']:.2f} times",
        bar=f"{MOST_TIMES} times",
    )
    assert took["ratio"] < MOST_TIMES
