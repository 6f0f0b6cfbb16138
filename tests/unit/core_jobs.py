"""The job of the benchmarks, smaller or larger: a fine continuous plant, measured with noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.core.excitations import through
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane

FloatArray = NDArray[np.float64]


class Job(NamedTuple):
    """A plant, what was measured on it, and a noise-free signal it never saw."""

    plant: Preisach
    input: FloatArray  # (n,)
    output: FloatArray  # (n,) with noise
    unseen_input: FloatArray
    unseen_output: FloatArray
    span: float  # of the output

    def percent(self, predicted: FloatArray) -> float:
        """Rms error of a prediction of the unseen output, in percent of the output span."""
        return float(100.0 * np.sqrt(np.mean((predicted - self.unseen_output) ** 2)) / self.span)


def plant(n_h: int = 960, *, low: float = -1.0, high: float = 1.0, offset: float = 0.3) -> Preisach:
    """Return a device whose density is a ridge with long tails, and a reversible part along the diagonal."""
    plane = Plane.uniform(low, high, n_h)
    i, j = plane.cell_indices
    x = (plane.thresholds - low) / (high - low)  # 0..1
    width, middle = x[i] - x[j], 0.5 * (x[i] + x[j])
    density = np.exp(-(((width - 0.18) / 0.16) ** 2) - ((middle - 0.55) / 0.25) ** 2)
    density += 0.15 / (1.0 + (width / 0.3) ** 2)
    masses = density * plane.areas / (density @ plane.areas)
    diagonal = i == j
    reversible = 1.0 + 0.5 * np.sin(3.0 * middle[diagonal])
    masses[diagonal] += 0.2 * reversible / reversible.sum()
    return Preisach(plane, masses / plane.areas / masses.sum(), offset)


def curves(n: int, count: int = 48, swings: int = 60, low: float = -1.0, high: float = 1.0) -> FloatArray:
    """Return ``n`` samples of ``count`` first-order reversal curves and a decaying triangle."""
    bottoms = low + (high - low) * (np.arange(count) + 0.5) / count
    forc = np.empty(2 * count + 1)
    forc[0::2], forc[1::2] = high, bottoms
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    decay = middle + half * (1.0 - np.arange(swings) / swings) * np.where(np.arange(swings) % 2, 1.0, -1.0)
    points = np.concatenate(([low], forc, decay))
    length = float(np.abs(np.diff(points)).sum())
    return through(points, length / (n - 1.5), 1.0)[:n]


def random_reversals(
    rng: np.random.Generator, n: int, count: int, low: float = -1.0, high: float = 1.0
) -> FloatArray:
    """Return ``n`` samples of straight pieces between ``count`` random turning points."""
    points = np.concatenate(([low], rng.uniform(low, high, count)))
    return np.interp(np.linspace(0.0, count, n), np.arange(count + 1.0), points)


def job(seed: int, *, n: int = 20_000, noise: float = 0.005, levels: int = 960, count: int = 48) -> Job:
    """Return the job; ``noise`` is a share of the output span."""
    rng = np.random.default_rng(seed)
    device = plant(levels)
    u = curves(n, count)
    clean = device(u)
    span = float(np.ptp(clean))
    unseen = random_reversals(rng, 5000, 100)
    return Job(device, u, clean + rng.normal(0.0, noise * span, n), unseen, device(unseen), span)
