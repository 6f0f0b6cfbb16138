"""Plays of healthy devices over a bad wire: none may be stopped.

    python tests/link/healthy_plays.py --plays 2000 --seed 1

Six pulses, sines, squares, saws and plateaus on drawn devices, half of them with noise as built and half with
three times that, one byte in 10 000 damaged on the way. What the firmware alone does without a wire is
counted by ``make -C firmware healthy``.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pulsetrainer import open_device

WAVEFORMS = sorted((Path(__file__).parents[2] / "waveforms").glob("*.csv"))
RATE_HZ = 1000
SIGNALS = (*(path.stem for path in WAVEFORMS), "sine", "square", "saw", "plateaus")
NOISES = (0.003, 0.009)  # of the bench as built, and three times that
WIRE = 1e-4
DEVICES = 20  # with each noise


def pulse(path: Path) -> np.ndarray:
    """One period of a library pulse at 1 kHz, 0 to 1."""
    rows = [line for line in path.read_text().splitlines() if line and not line.startswith("#")][1:]
    time, value = np.array([[float(cell) for cell in row.split(",")[:2]] for row in rows]).T
    grid = np.interp(np.arange(time[0], time[-1], 1 / RATE_HZ), time, value)
    return (grid - grid.min()) / np.ptp(grid)


def beats(path: Path, peak_A: float, seconds: float = 6.0) -> np.ndarray:
    """A library pulse again and again, A."""
    one = pulse(path)
    samples = round(RATE_HZ * seconds)
    return peak_A * np.tile(one, int(np.ceil(samples / one.size)))[:samples]


def signal(name: str, rng: np.random.Generator, seconds: float = 4.0) -> np.ndarray:
    """A signal of ``SIGNALS`` at a rate and range of its own, A."""
    time = np.arange(round(RATE_HZ * seconds)) / RATE_HZ
    rate, low = float(np.exp(rng.uniform(np.log(0.4), np.log(8)))), rng.uniform(0, 0.7)
    span = rng.uniform(0.2, 1.5 - low)
    match name:
        case "sine":
            return low + span * (0.5 - 0.5 * np.cos(2 * np.pi * rate * time))
        case "square":
            return np.where((time * rate) % 1 < 0.5, low, low + span)
        case "saw":
            return low + span * ((time * rate) % 1)
        case "plateaus":
            return np.repeat(rng.uniform(0, 1.5, 4), time.size // 4)
    (path,) = (path for path in WAVEFORMS if path.stem == name)
    return beats(path, rng.uniform(0.3, 1.5), seconds)


def stopped(plays: int, seed: int) -> Iterator[str]:
    """Play, device after device; yield what stopped a play and should not have."""
    each = -(-plays // (DEVICES * len(NOISES)))
    for number in range(DEVICES * len(NOISES)):
        rng = np.random.default_rng([seed, number])
        noise = NOISES[number % len(NOISES)]
        port = (
            f"bench:?seed={int(rng.integers(1, 2**24))}&noise={noise}&wire={WIRE}&wire-seed={seed + number}"
        )
        with open_device(port) as device:
            for play in range(min(each, plays - number * each)):
                name = SIGNALS[play % len(SIGNALS)]
                trace = device.play(signal(name, rng), RATE_HZ)
                if not trace.complete:
                    yield f"{port}, play {play} ({name}): {trace.fault}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--plays", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    found = list(stopped(given.plays, given.seed))
    print(*found, f"{len(found)} of {given.plays} plays stopped, seed {given.seed}", sep="\n")
    raise SystemExit(bool(found))
