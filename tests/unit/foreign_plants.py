"""Devices that are no Preisach operator: each a current in A and what it presses in N, by its own equation.

None of these equations is in the package. They stand in a device's place, with noise on the force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from scipy import signal

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.device.trace import Trace

TICK_HZ = 10_000.0
RATE_HZ = 1000.0


def coleman_hodgdon(u: FloatArray) -> FloatArray:
    """Duhem: dy/dt = a |du/dt| (f(u) - y) + du/dt g(u) (Coleman, Hodgdon 1986), and a lag of 8 ms."""
    y, out = 0.0, np.empty_like(u)
    steps = np.diff(u, prepend=u[0])
    for k, (now, du) in enumerate(zip(u, steps, strict=True)):
        y += 3.0 * abs(du) * (9.0 * now - 1.5 - y) + 6.5 * du
        out[k] = y
    return _lagged(out, 0.008)


def bouc_wen(u: FloatArray) -> FloatArray:
    """Friction: dz = du (1 - |z|^2 (sign(du z) + 1) / 2), and a dip where the mean current is 0.7 A."""
    z, out = 0.0, np.empty_like(u)
    steps = np.diff(u, prepend=u[0]) / 0.15
    for k, (now, du) in enumerate(zip(u, steps, strict=True)):
        z += du * (1.0 - z * z * (0.5 * np.sign(du * z) + 0.5))
        out[k] = 8.0 * now + 1.2 * z + 1.2
    mean = _lagged(u, 0.35)
    return out - 0.5 * np.exp(-(((mean - 0.7) / 0.2) ** 2))


def play_stack(u: FloatArray) -> FloatArray:
    """Prandtl-Ishlinskii under an envelope: plays, bent by a tanh, then creep of three time constants."""
    out = np.zeros_like(u)
    for radius, weight in zip(np.linspace(0.02, 0.5, 12), np.linspace(1.0, 0.2, 12), strict=True):
        p = radius  # it has been used before
        for k, now in enumerate(u):
            p = min(max(p, now - radius), now + radius)
            out[k] += weight * p
    bent = 12.0 * np.tanh(out / 9.0)
    return bent + 0.02 * sum(_lagged(bent, tau) for tau in (0.1, 0.8, 5.0))


def jiles_atherton(u: FloatArray) -> FloatArray:
    """Magnetisation: dM/dH = 0.85 (Man - M) / (k sgn - a (Man - M)) + 0.15 dMan/dH (Jiles, Atherton 1986)."""
    m, out = 0.0, np.empty_like(u)
    for k, (now, du) in enumerate(zip(u, np.diff(u, prepend=u[0]), strict=True)):
        x = (now + 0.02 * m) / 0.35
        apart = (x / 3.0 if abs(x) < 1e-3 else 1.0 / np.tanh(x) - 1.0 / x) - m
        free = (1.0 / 3.0 if abs(x) < 1e-2 else 1.0 / x**2 - 1.0 / np.sinh(x) ** 2) / 0.35
        way = 1.0 if du > 0 else -1.0
        bound = apart / (0.18 * way - 0.02 * apart) if apart * way > 0 else 0.0
        m += du * (0.85 * max(bound, 0.0) + 0.15 * free)
        out[k] = m
    return _lagged(2.0 + 10.0 * out, 0.004)


PLANTS = {"Coleman-Hodgdon": coleman_hodgdon, "Bouc-Wen": bouc_wen, "Prandtl-Ishlinskii": play_stack}
# Its small loops do not close: what a Preisach model misses of one pulse it does not miss of another
UNLIKE = {"Jiles-Atherton": jiles_atherton}


def _lagged(x: FloatArray, tau_s: float) -> FloatArray:
    share = 1.0 - np.exp(-1.0 / (RATE_HZ * tau_s))
    return np.asarray(signal.lfilter([share], [1.0, share - 1.0], x))


@dataclass
class ForeignDevice:
    """What a step asks of a device, with a plant of the name behind it."""

    plant: str
    seed: int = 1
    noise_N: float = 0.04
    plays: int = 0
    press: Callable[[FloatArray], FloatArray] | None = None  # in the plant's place
    shift_N: Callable[[int], float] = lambda play: 0.0  # of the zero, by the number of the play

    info = SimpleNamespace(
        tick_rate_Hz=TICK_HZ, serial="foreign", firmware="none", current_limit_A=np.inf, force_limit_N=np.inf
    )

    def play(self, current: FloatArray, rate_Hz: float, *, decimation: int = 10, on_block=None) -> Trace:
        """Press a current (n,) from rest; nobody watches it."""
        assert abs(rate_Hz - RATE_HZ) < 1e-6
        assert decimation == 10
        self.plays += 1
        rng = np.random.default_rng([self.seed, self.plays])
        force = (self.press or {**PLANTS, **UNLIKE}[self.plant])(np.asarray(current))
        force = force + self.shift_N(self.plays) + self.noise_N * rng.standard_normal(current.size)
        tick = np.arange(current.size, dtype=np.int64) * decimation
        duty = np.zeros(current.size)
        return Trace(
            tick, current, current, force, duty, TICK_HZ, 0, complete=True, fault="", samples=current.size
        )
