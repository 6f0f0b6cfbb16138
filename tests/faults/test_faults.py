"""A sample of the fault table in every test run; ``make faults`` tries all of it hundreds of times."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

_RUN = Path(__file__).with_name("run.py")


@pytest.mark.parametrize("fault", ["kill -9", "damaged", "others"])
def test_a_sample_of_the_fault_table(fault, tmp_path):
    """Nothing lost, nothing half-written, no hang, no wrong exit: another seed each day would show the same."""
    only = {
        "kill -9": ["kill"],
        "damaged": ["truncated", "bit-flipped", "unsealed", "fuzzed artefacts", "fuzzed tables"],
        "others": ["full", "read-only", "together", "locked", "fuzzed arguments"],
    }[fault]
    table = tmp_path / "table.json"
    words = [
        sys.executable,
        _RUN,
        "--sample",
        "--json",
        table,
        *(w for name in only for w in ("--only", name)),
    ]
    done = subprocess.run(words, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = json.loads(table.read_text())
    assert len(rows) >= 4
    assert all(row["tries"] > 0 for row in rows)
    counts = ("lost", "half_written", "hangs", "wrong_exits")
    assert sum(row[count] for row in rows for count in counts) == 0, done.stdout
