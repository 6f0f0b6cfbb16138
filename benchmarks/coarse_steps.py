"""Coarse steps of the output, written to a table in a few digits: whether the diagnosis names them.

    python benchmarks/coarse_steps.py --first 900 --count 20 [--quick]

Each seed draws a device whose output lags, an input at two rates, a step of 0.4 to 6 % of the span, noise of
up to a third of it, and 5 to 9 digits. The record goes through a table in CSV, `read_table`, `identify` and
`diagnose`. Printed for each: the step, the verdict and what else was found.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pulsetrainer as pt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "unit"))

import form_devices as devices

STEPS = (0.004, 0.06)  # of the span
DIGITS = (5, 9)
SAMPLES, LEVELS, RATE_HZ = 4000, 24, 100.0
FloatArray = NDArray[np.float64]


def signal(rng: np.random.Generator) -> FloatArray:
    """Input (n,) in 0..1: drawn once slowly and once three times as fast, with a rest between."""
    slow, fast = devices.record(rng, 3 * SAMPLES // 4), devices.record(rng, SAMPLES // 4)
    return np.concatenate((slow, np.linspace(slow[-1], 0.0, 100), np.zeros(100), fast))


class Case:
    """A table of a drawn device, and what was drawn."""

    def __init__(self, seed: int, folder: Path) -> None:
        rng = np.random.default_rng(seed)
        device = devices.DIRECT[seed % len(devices.DIRECT)](rng)
        u = signal(rng)
        clean = device(u)
        span = float(np.ptp(clean))
        self.step = float(np.exp(rng.uniform(*np.log(STEPS))))
        self.noise = self.step * float(rng.uniform(0.0, 1 / 3))
        self.digits = int(rng.integers(DIGITS[0], DIGITS[1] + 1))
        gain, zero = 10.0 ** rng.uniform(-4, 4), rng.uniform(-2.0, 2.0)
        size = self.step * span
        read = size * np.round((clean + self.noise * span * rng.normal(size=u.size)) / size)
        columns = np.arange(u.size) / RATE_HZ, u, gain * (read + zero * span)
        rows = (",".join(f"{x:.{self.digits}g}" for x in row) for row in zip(*columns, strict=True))
        self.table = folder / f"{seed}.csv"
        self.table.write_text("\n".join(["t_s,u_V,y_um", *rows, ""]))


def main() -> None:
    """Print a line for each table, and the count."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=900)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args()
    named = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.first, asked.first + asked.count):
            case = Case(seed, Path(folder))
            run = pt.read_table(case.table, input="u", output="y")
            model = pt.identify(run, levels=LEVELS)
            found = pt.diagnose(run, model, quick=asked.quick)
            others = [one.cause for one in found.causes if one.found and one.cause != "quantisation"]
            named += found.verdict == "quantisation"
            print(
                f"{seed} step {100 * case.step:.2f} % noise {100 * case.noise:.2f} % {case.digits} digits: "
                f"{found.verdict}; besides: {', '.join(others) or 'nothing'}",
                flush=True,
            )
    print(f"{named} of {asked.count} named")


if __name__ == "__main__":
    main()
