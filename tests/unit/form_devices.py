"""Devices whose loops run either way, by formulas that no Preisach plane of the package made.

Each ``draw`` returns a function from an input (n,) in 0..1, that begins at 0, to an output (n,).
"""

from __future__ import annotations

from collections.abc import Callable

import core_jobs
import numpy as np
from numpy.typing import NDArray

from pulsetrainer.core.inversion import invert
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane

FloatArray = NDArray[np.float64]
Device = Callable[[FloatArray], FloatArray]
Generator = np.random.Generator


def play(u: FloatArray, radius: FloatArray) -> FloatArray:
    """Play operators (n, k) that follow with a slack of their radius (k,), after a falling input."""
    state, out = u[0] + radius, np.empty((u.size, radius.size))
    for n, value in enumerate(u):
        state = np.minimum(np.maximum(state, value - radius), value + radius)
        out[n] = state
    return out


def _radii(rng: Generator) -> tuple[FloatArray, FloatArray]:
    radius = np.linspace(0.01, 0.45, 40)
    weight = radius ** rng.uniform(0.0, 1.5) * np.exp(-radius / rng.uniform(0.1, 0.5))
    return radius, weight / weight.sum()


def _bend(x: FloatArray, much: float) -> FloatArray:
    """Return a rising curve through 0 and 1."""
    return x + much * x * (1.0 - x)


def bump_plane(rng: Generator, n_h: int = 240, reversible: tuple[float, float] = (0.2, 0.8)) -> Preisach:
    """Return a fine plane with a ridge and a reversible part, of random shape."""
    plane = Plane.uniform(0.0, 1.0, n_h)
    i, j = plane.cell_indices
    x = plane.thresholds
    width, middle = x[i] - x[j], 0.5 * (x[i] + x[j])
    at, broad = rng.uniform(0.05, 0.35), rng.uniform(0.06, 0.2)
    centre, long = rng.uniform(0.3, 0.7), rng.uniform(0.15, 0.5)
    density = np.exp(-(((width - at) / broad) ** 2) - ((middle - centre) / long) ** 2)
    masses = density * plane.areas / (density @ plane.areas)
    diagonal = i == j
    masses[diagonal] += rng.uniform(*reversible) * (1 + 0.5 * np.sin(4 * middle[diagonal])) / diagonal.sum()
    return Preisach(plane, masses / plane.areas / masses.sum(), rng.uniform(-1.0, 1.0))


# --- the output lags: direct ------------------------------------------------------------------------


def lagging_plane(rng: Generator) -> Device:
    """Return a fine Preisach plane."""
    return bump_plane(rng)


def play_sum(rng: Generator) -> Device:
    """Return a Prandtl-Ishlinskii sum of plays with a reversible part, seen through a bent sensor."""
    radius, weight = _radii(rng)
    share, much = rng.uniform(0.2, 0.8), rng.uniform(-0.5, 0.5)
    return lambda u: share * _bend(u, much) + (1.0 - share) * play(u, radius) @ weight


def falling(rng: Generator) -> Device:
    """Return a lagging device whose output falls."""
    one = play_sum(rng)
    return lambda u: 2.0 - 3.0 * one(u)


# --- the output leads: clockwise ----------------------------------------------------------------------


def exchanged_plane(rng: Generator, reversible: tuple[float, float] = (0.2, 0.8)) -> Device:
    """Return a fine Preisach plane with its roles exchanged: the input is its output."""
    plant = bump_plane(rng, reversible=reversible)
    low, high = plant.saturation
    return lambda u: invert(plant, low + (high - low) * u).input


def steep_exchanged_plane(rng: Generator) -> Device:
    """Return one with hardly a reversible part: its branches are nearly vertical after a turn."""
    return exchanged_plane(rng, (0.02, 0.1))


def stop_sum(rng: Generator) -> Device:
    """Return springs beside sliding elements, as in a filled elastomer: force over stretch."""
    radius, weight = _radii(rng)
    share, much = rng.uniform(0.3, 0.8), rng.uniform(-0.4, 0.4)

    def force(u: FloatArray) -> FloatArray:
        return _bend(share * u + (1.0 - share) * (u[:, None] - play(u, radius)) @ weight, much)

    return force


def bouc_wen(rng: Generator) -> Device:
    """Return a spring beside a Bouc-Wen element, dz = (1 - |z|/Z (b sign(z du) + 1 - b)) du."""
    limit, share = rng.uniform(0.05, 0.2), rng.uniform(0.3, 0.8)
    b = rng.uniform(0.5, 0.9)

    def force(u: FloatArray) -> FloatArray:
        z, out = 0.0, np.empty(u.size)
        for n, du in enumerate(np.diff(u, prepend=u[0])):
            parts = max(1, int(np.ceil(abs(du) / (0.02 * limit))))
            for _ in range(parts):
                z += (1.0 - abs(z) / limit * (b * np.sign(z * du) + 1.0 - b)) * du / parts
            out[n] = z
        return share * u + (1.0 - share) * out

    return force


# --- the loop crosses itself ----------------------------------------------------------------------------


def butterfly_density(rng: Generator) -> Device:
    """Return a plane whose density changes sign across the line alpha + beta = const."""
    plant = bump_plane(rng)
    i, j = plant.plane.cell_indices
    x = plant.plane.thresholds
    middle = 0.5 * (x[i] + x[j])
    line = float(middle @ plant.masses) / plant.total + rng.uniform(-0.05, 0.05)
    sign = np.tanh((middle - line) / 0.1)
    return Preisach(plant.plane, sign * plant.weights, 0.0, signed=True)


def rectified(rng: Generator) -> Device:
    """Return the size of a polarisation that lags: the strain of a piezo beyond its coercive field."""
    radius = rng.uniform(0.05, 0.25) + 0.08 * np.linspace(-0.5, 0.5, 15)
    sharp, flat = rng.uniform(4.0, 8.0), rng.uniform(0.0, 0.3)

    def strain(u: FloatArray) -> FloatArray:
        polarisation = np.tanh(sharp * (play(u, radius) - 0.5)).mean(axis=1)
        return np.abs(polarisation) + flat * polarisation * (u - 0.5)

    return strain


def squared(rng: Generator) -> Device:
    """Return the square of a polarisation that lags: electrostriction. Its minor loops are not congruent."""
    plant = bump_plane(rng, 120)
    low, high = plant.saturation
    middle = low + (high - low) * rng.uniform(0.4, 0.6)
    return lambda u: ((plant(u) - middle) / (high - low)) ** 2


def mixed_plays(rng: Generator) -> Device:
    """Return narrow plays that lead beside wide plays that lag, over a steep reversible part."""
    radius, _ = _radii(rng)
    near, far = np.exp(-(((radius - 0.06) / 0.03) ** 2)), np.exp(-(((radius - 0.3) / 0.1) ** 2))
    lead, lag = rng.uniform(0.2, 0.4), rng.uniform(0.4, 0.8)

    def output(u: FloatArray) -> FloatArray:
        plays = play(u, radius)
        return u + plays @ (lag * far / far.sum() - lead * near / near.sum())

    return output


def mixed_planes(rng: Generator) -> Device:
    """Return the difference of two planes: one lags in one part of the range, one leads in another."""
    one, other = bump_plane(rng), bump_plane(rng)
    i, j = one.plane.cell_indices
    x = one.plane.thresholds
    upper = 1.0 / (1.0 + np.exp(-(0.5 * (x[i] + x[j]) - 0.5) / 0.05))
    off = i != j
    lower = rng.uniform(0.3, 0.6) * (1.0 - upper)
    weights = np.where(off, upper * one.weights - lower * other.weights, one.weights)
    return Preisach(one.plane, weights, 0.0, signed=True)


DIRECT = (lagging_plane, play_sum, falling)
CLOCKWISE = (exchanged_plane, stop_sum, bouc_wen)
BUTTERFLY = (butterfly_density, rectified)
NOT_CONGRUENT = (squared, rectified)
MIXED = (mixed_plays, mixed_planes)


def record(rng: Generator, n: int) -> FloatArray:
    """Return an input (n,) in 0..1: reversal curves, random reversals, or shrinking triangles."""
    kind = rng.integers(3)
    if kind == 0:
        return core_jobs.curves(n, count=24, swings=30, low=0.0, high=1.0)
    if kind == 1:
        u = core_jobs.random_reversals(rng, n, 80, 0.0, 1.0)
        return np.concatenate((np.linspace(0.0, 1.0, n // 20), np.linspace(1.0, 0.0, n // 20), u))[:n]
    turns = np.arange(1, 61)
    points = np.concatenate(([0.0, 1.0], 0.5 + 0.5 * (1.0 - turns / 61) * np.where(turns % 2, -1.0, 1.0)))
    up = np.concatenate((points, [0.0, 1.0, 0.0], points[::-1]))
    length = np.abs(np.diff(up)).sum()
    at = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(up)))))
    return np.interp(np.linspace(0.0, length, n), at, up)
