"""One thread, unless the user wants more: threads that wait for each other slow everything down."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import report_examples
from store_examples import header

from pulsetrainer.files import store

TASKS = Path("/proc/self/task")
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
JOB = """
import os, sys
from pulsetrainer.cli import app
sys.argv = ["pulsetrainer", "show", "model.h5", "--json"]
try:
    app.main()
except SystemExit as end:
    assert end.code == 0
assert "numpy" in sys.modules
print(os.environ["OMP_NUM_THREADS"], len(os.listdir("/proc/self/task")), file=sys.stderr)
"""


@pytest.mark.skipif(not TASKS.is_dir(), reason="no /proc to count threads in")
@pytest.mark.parametrize(("asked", "expected"), [(None, "1 1"), ("1", "1 1"), ("2", f"2 {min(2, CORES)}")])
def test_the_threads_of_linear_algebra(tmp_path, asked, expected):
    """Counted by the system in a process that has loaded numpy by a command."""
    store.write(tmp_path / "model.h5", report_examples.model(), header())
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {k: v for k, v in os.environ.items() if k not in names}
    environment |= {} if asked is None else {"OMP_NUM_THREADS": asked}
    done = subprocess.run(
        [sys.executable, "-c", JOB], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stderr.strip() == expected
