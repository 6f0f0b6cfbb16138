"""The floors of the house are checked by import-linter; here, that each contract can fail."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LINTER = Path(sys.executable).with_name("lint-imports")


@pytest.fixture
def check(tmp_path):
    """Check a copy of the package into which one line was written; return exit code and what was said."""

    def run(module: str = "", line: str = "") -> tuple[int, str]:
        shutil.copytree(
            ROOT / "pulsetrainer",
            tmp_path / "pulsetrainer",
            ignore=shutil.ignore_patterns("__pycache__", "_firmware", "_waveforms"),
        )
        shutil.copy(ROOT / "pyproject.toml", tmp_path)
        if module:
            path = tmp_path / "pulsetrainer" / module
            path.write_text(f"{path.read_text()}\n{line}\n")
        done = subprocess.run(
            [LINTER, "--no-cache"], cwd=tmp_path, capture_output=True, text=True, timeout=200, check=False
        )
        return done.returncode, done.stdout + done.stderr

    return run


def test_the_house_as_it_stands(check):
    """Without a bad line every contract is kept."""
    code, said = check()
    assert code == 0, said


@pytest.mark.parametrize(
    ("module", "line", "contract"),
    [
        ("device/device.py", "import pulsetrainer.simulation.bench", "Floors"),
        ("device/schemes.py", "import pulsetrainer.files.store", "Device, files and diagnosis"),
        ("files/store.py", "import pulsetrainer.device.codes", "Device, files and diagnosis"),
        ("diagnosis/raw.py", "import pulsetrainer.files.store", "Device, files and diagnosis"),
        ("core/plane.py", "import h5py", "The core is numpy and scipy only"),
        ("steps/identify.py", "import pathlib", "Verbs know no file"),
        ("diagnosis/raw.py", "import rich", "Libraries do not print"),
    ],
)
def test_a_bad_import_breaks_its_contract(check, module, line, contract):
    """One import in the wrong direction, and the check fails and names the contract."""
    code, said = check(module, line)
    assert code == 1, said
    broken = [row for row in said.splitlines() if row.endswith("BROKEN")]
    assert any(row.startswith(contract) for row in broken), said
