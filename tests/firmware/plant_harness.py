"""Compile the plant's command-line harness once per test process and run it on an input."""

from __future__ import annotations

import functools
import itertools
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
PLANT = ROOT / "firmware" / "plant"
TICK_S = 1e-4
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Wpedantic", "-Werror")

# keeps the folder until the process ends
_folder = tempfile.TemporaryDirectory(prefix="plant-")


class Run(NamedTuple):
    """What the harness writes, one value per tick."""

    current: Vector  # A, true
    field: Vector  # A, what the static hysteresis sees
    magnetic: Vector  # N, static hysteresis alone
    force: Vector  # N, on the finger
    sensed: Vector  # N, with the disturbances of the sensor
    adc_current: Vector
    adc_force: Vector


@functools.cache
def harness(optimise: str = "-O2", real: str = "double") -> str:
    """Build the harness and return its path."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    program = Path(_folder.name) / f"harness{optimise}-{real}"
    sources = sorted(str(path) for path in PLANT.glob("*.c"))
    options = ("-std=c99", optimise, "-ffp-contract=off", *WARNINGS, f"-DPLANT_REAL={real}")
    built = subprocess.run(
        [compiler, *options, *sources, "-o", str(program)], capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    return str(program)


Done = subprocess.CompletedProcess[bytes]


def call(*arguments: str, data: bytes = b"", program: str | None = None) -> Done:
    """Run the harness as it is."""
    return subprocess.run([program or harness(), *arguments], input=data, capture_output=True, check=False)


def run(drive: ArrayLike, *arguments: str, program: str | None = None) -> Run:
    """Run the harness on one input value per tick; without `base=` the ideal device without any noise."""
    if not any(a.startswith("base=") for a in arguments):
        arguments = ("base=ideal", "noise=0", "current-noise=0", *arguments)
    done = call(*arguments, data=np.asarray(drive, dtype=np.float64).tobytes(), program=program)
    assert done.returncode == 0, done.stderr
    table = np.frombuffer(done.stdout).reshape(-1, 7)
    return Run(*table.T)


def with_current(current: ArrayLike, *arguments: str) -> Run:
    """Run the harness with the coil current imposed."""
    return run(current, "drive=current", *arguments)


def path(*corners: float, rate: float = 5.0) -> Vector:
    """Return a current [A] in straight lines at a rate [A/s] to each corner after the first."""
    pieces = [
        np.linspace(a, b, max(2, round(abs(b - a) / rate / TICK_S) + 1))[1:]
        for a, b in itertools.pairwise(corners)
    ]
    return np.concatenate(pieces)


def hold(current: float, seconds: float) -> Vector:
    """Return a constant current [A]."""
    return np.full(round(seconds / TICK_S), current)
