"""What a finger would feel: the whole firmware on the simulated device, judged by the true force."""

from __future__ import annotations

import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pulsetrainer.resources import firmware_dir

FIRMWARE = firmware_dir()
HEALTHY_PLAYS = 240
HEALTHY_FIRST = 40_000  # other draws than those that the thresholds were set on


def built(what: str, folder: Path) -> str:
    """Build a program by the Makefile's own rule and return its path."""
    words = ["make", "-s", "-C", str(FIRMWARE), f"{folder}/{what}", f"BUILD={folder}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return str(folder / what)


@pytest.mark.slow
def test_every_break_alone_and_in_pairs_is_off_in_time(tmp_path):
    """At 20 moments, four references, three trips; the table in PROTOCOL.md is the one of this very run."""
    done = subprocess.run([built("matrix", tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    text = (FIRMWARE / "PROTOCOL.md").read_text(encoding="utf-8")
    told = re.search(r"<!-- matrix: begin -->\n(.*?)<!-- matrix: end -->", text, re.DOTALL)
    assert told is not None
    assert done.stdout == told[1], "make -C firmware matrix"
    plays = sum(int(line.split("|")[4]) for line in done.stdout.splitlines()[2:])
    assert plays > 30_000


@pytest.mark.slow
def test_nothing_trips_where_nothing_is_wrong(tmp_path):
    """Pulses, sines, squares, saws, plateaus on twenty devices, noise as built and three times that."""
    program = built("healthy", tmp_path)
    for first in range(HEALTHY_FIRST, HEALTHY_FIRST + 1600, 200):  # each 200: another trip or noise
        count = HEALTHY_PLAYS // 8
        done = subprocess.run([program, str(first), str(count)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout
        assert f"plays {count} false trips 0" in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(
    platform.machine() not in {"x86_64", "AMD64"} or sys.platform != "linux",
    reason="steps through x86-64 instructions by the trap flag",
)
def test_a_tick_at_every_instruction_of_the_main_loop(tmp_path):
    """Each command, interrupted everywhere: what is latched has its way, what was not seen is not cleared."""
    done = subprocess.run([built("forks", tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = re.findall(r"^(\w+)\s+(\d+) instructions\s+(\d+) ticks", done.stdout, re.MULTILINE)
    assert {name for name, _, _ in rows} >= {"START", "ARM", "WAVE_COMMIT", "CLEAR_FAULT", "STOP", "HELLO"}
    assert all(int(ticks) > 200 for _, _, ticks in rows)
