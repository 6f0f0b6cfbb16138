"""What a dry run promises, the device does: drawn plays and captures by both ways, with the same verdict.

DRY_RUNS=300 python -m pytest tests/link/test_dry_run.py draws more of them.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.core.excitations import Signal
from pulsetrainer.device.limits import Limits
from pulsetrainer.errors import PulsetrainerError
from pulsetrainer.steps import capture, play

COUNT = int(os.environ.get("DRY_RUNS", "40"))
MODEL = Path(__file__).parents[1] / "data/files-0.1/model.h5"
pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="the bench needs a pty")]


def verdict(work) -> int:
    """Exit code that a command would end with."""
    try:
        work()
    except PulsetrainerError as error:
        return error.exit_code
    return 0


def drawn_limits(rng: np.random.Generator, current_A: float, force_N: float | None) -> Limits:
    """Limits around what will be asked for; a force within a tenth of its limit cannot be told before."""
    around = (*rng.uniform(0.3, 0.95, 2), *rng.uniform(1.02, 1.6, 2))
    limit_A = None if rng.random() < 0.4 else current_A * rng.choice(around)
    apart = (*rng.uniform(0.2, 0.9, 2), *rng.uniform(1.1, 1.6, 2))
    limit_N = None if force_N is None or rng.random() < 0.4 else force_N * rng.choice(apart)
    return Limits(limit_A, limit_N)


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_play(seed):
    """Drives of several heights, some beyond what any device plays; some long, some repeated."""
    rng = np.random.default_rng([1, seed])
    model = pt.load(MODEL)
    drive = pt.invert(str(rng.choice(["normal", "bifid"])), model, periods=int(rng.integers(1, 3)))
    gain = rng.choice([rng.uniform(0.5, 1.0), 1.0, rng.uniform(1.3, 1.6)])
    drive = replace(
        drive,
        compensated=gain * drive.compensated,
        scaled=gain * drive.scaled,
        predicted=np.asarray(model.predict(np.minimum(gain, 1.0) * drive.compensated, 1e-3)),
    )
    if seed % 8 == 0:  # as long as no device stays on
        drive = replace(drive, time_s=drive.time_s * 1000.0)
    peak = float(max(drive.compensated.max(), drive.scaled.max()))
    limits = drawn_limits(rng, peak, float(drive.predicted.max()))

    def real() -> None:
        with pt.open_device("bench:", limits=limits) as device:
            pt.play(drive, device, repeats=1)

    foretold = verdict(lambda: play.plan(drive, repeats=1, limits=limits))
    print(seed, peak, limits, foretold)
    assert foretold == verdict(real)


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_capture(seed):
    """Signals of one's own, at rates that the device has and has not."""
    rng = np.random.default_rng([2, seed])
    rate = float(rng.choice([100.0, 300.0, 1000.0, 2000.0]))
    top = rng.uniform(0.2, 1.7)
    t = np.arange(int(rng.integers(2, 4) * rate)) / rate
    signal = Signal(0.5 * top * (1 - np.cos(2 * np.pi * t)), rate, "drawn")
    limits = drawn_limits(rng, top, None)
    keywords = {"rate_Hz": rate, "condition": bool(rng.random() < 0.7), "repeats": int(rng.integers(1, 4))}

    def real() -> None:
        with pt.open_device("bench:", limits=limits) as device:
            pt.capture(signal, device, **keywords)

    def foretell() -> None:
        known = {k: v for k, v in keywords.items() if k != "rate_Hz"}
        played = capture.excitation(signal, levels=8, current_max_A=1.5, speed_A_per_s=1.0, rate_Hz=rate)
        capture.plan(played, limits=limits, **known)

    foretold = verdict(foretell)
    print(seed, top, rate, limits, foretold)
    assert foretold == verdict(real)
