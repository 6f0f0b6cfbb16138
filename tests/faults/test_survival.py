"""A sample of the fault table in every test run; ``make faults`` tries all of it hundreds of times."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from pulsetrainer.cli.app import app

pytestmark = pytest.mark.slow
_RUN = Path(__file__).with_name("run.py")


@pytest.fixture(scope="module")
def table(made_once) -> list[dict]:
    """The rows of a small table, tried once for all tests."""

    def fill(folder: Path) -> None:
        path = folder / "table.json"
        words = [sys.executable, _RUN, "--sample", "--json", path]
        done = subprocess.run(words, capture_output=True, text=True, timeout=280, check=False)
        assert path.exists(), done.stdout + done.stderr

    return json.loads((made_once("faults", fill) / "table.json").read_text())


@pytest.mark.parametrize(
    "fault", ["kill -9", "full", "read-only", "input", "recording", "output", "locked", "fuzzed"]
)
def test_nothing_is_lost_and_every_failure_is_told(table, fault):
    """Nothing lost, nothing half-written, no hang, no wrong exit."""
    rows = [row for row in table if fault in row["fault"]]
    assert sum(row["tries"] for row in rows) >= 3
    for count in ("lost", "half_written", "hangs", "wrong_exits"):
        assert sum(row[count] for row in rows) == 0, [row["complaints"] for row in rows]


def test_the_arguments_of_every_command_are_fuzzed(table):
    """Taken from the program's own list: a new command is among them without being named here."""
    (row,) = (row for row in table if row["fault"] == "fuzzed arguments")
    assert row["commands"] == sorted(typer.main.get_command(app).commands)
    assert row["tries"] >= len(row["commands"])
