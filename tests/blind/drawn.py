"""Plants and noises of another kind than the bench's: drawn, computed, never played.

``draw`` makes a record from a kind of noise, an effect and a seed. The static part has a continuous density
on uneven levels of its own, ten times as many cells as the diagnosis fits; every effect is integrated at
four times the rate of the record; the noise is put on the measured output.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import signal

from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record

RATE_HZ, FINER = 500.0, 4
LEVELS = 110
NOISE = 0.003  # of the span
NOISES = ("white", "ar0.5", "ar0.9", "ar0.98", "level", "t3", "drift", "hum")
EFFECTS = ("output-lag", "field-lag", "delay", "creep", "thermal-drift", "viscous", "rate-widening")
MORE = ("offset-drift", "step", "periodic", "resonance", "accommodation", "filtered viscous")


@dataclass(frozen=True)
class Drawn:
    """A record, and what is hidden in it."""

    record: Record
    high: float
    effect: str
    size_percent: float  # rms of the effect, of the span
    truth: dict = field(default_factory=dict)


def static_of(rng: np.random.Generator, high: float) -> Preisach:
    """A static operator with a drawn continuous density, of span one."""
    edges = np.linspace(0.0, 1.0, LEVELS + 1)
    bent = edges + 0.2 * rng.uniform(-1, 1) * edges * (1.0 - edges)
    plane = Plane(high * bent)
    up, down = plane.cell_indices
    middle = 0.5 * (bent[1:] + bent[:-1])
    wide, place = middle[up] - middle[down], 0.5 * (middle[up] + middle[down])
    density = rng.uniform(0.2, 1.0) + rng.uniform(1, 4) * np.exp(-wide / rng.uniform(0.05, 0.2))
    for _ in range(3):
        at, broad = rng.uniform([0.0, 0.1], [0.5, 0.9]), rng.uniform(0.1, 0.35, 2)
        density = density + rng.uniform(0.5, 3) * np.exp(
            -(((wide - at[0]) / broad[0]) ** 2) - ((place - at[1]) / broad[1]) ** 2
        )
    weights = density / float((density * plane.areas).sum()) / 2.0
    return Preisach(plane, weights, 0.5)


def noise_of(kind: str, y: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Noise (n,) of rms ``NOISE`` for an output (n,) of span one."""
    white = rng.standard_normal(y.size)
    if kind.startswith("ar"):
        white = signal.lfilter([1.0], [1.0, -float(kind[2:])], white)
    elif kind == "level":
        white *= 0.1 + np.abs(y - y.min())
    elif kind == "t3":
        white = rng.standard_t(3.0, y.size)
    elif kind in ("drift", "hum"):
        if kind == "drift":
            frequency = np.fft.rfftfreq(y.size)
            frequency[0] = np.inf
            slow = np.fft.irfft(np.fft.rfft(rng.standard_normal(y.size)) / np.sqrt(frequency), y.size)
        else:
            slow = np.sin(2 * np.pi * rng.choice([50.0, 60.0, 17.3]) / RATE_HZ * np.arange(y.size) + 1.0)
        white = white + slow * np.std(white) / np.std(slow)
        return np.asarray(NOISE * white / np.sqrt(0.5 * np.mean(white**2)))
    elif kind == "none":
        return np.zeros(y.size)
    return np.asarray(NOISE * white / np.sqrt(np.mean(white**2)))


def _lag(x: np.ndarray, tau: float, dt: float) -> np.ndarray:
    a = np.exp(-dt / tau)
    return np.asarray(signal.lfilter([1 - a], [1, -a], x, zi=[a * x[0]])[0])


def _trailing(u: np.ndarray, k: float, dt: float) -> np.ndarray:
    inner, path, parts = float(u[0]), [], 8
    for one in u.tolist():
        for _ in range(parts):
            apart = one - inner
            inner += apart / (1.0 + 1.0 / max(abs(apart) * dt / parts / k**2, 1e-12)) if apart else 0.0
        path.append(inner)
    return np.asarray(path)


def _crept(y, strength, dt, more):
    parts = [s * _lag(y, more["tau"] * r, dt) for s, r in ((0.3, 0.25), (0.4, 1.0), (0.3, 4.0))]
    return (y + strength * sum(parts)) / (1 + strength)


def _rung(y, strength, dt, more):
    w = 2 * np.pi / strength
    system = signal.cont2discrete(([w**2], [1.0, 2 * more["damping"] * w, w**2]), dt, method="foh")
    b, a = system[0].ravel(), system[1]
    return np.asarray(signal.lfilter(b, a, y, zi=signal.lfilter_zi(b, a) * y[0])[0])


def _accommodated(y, u, strength, more):
    share = np.abs(np.diff(u, prepend=u[0])) / np.ptp(u) / more["path"]
    slow, at = [], float(y[0])
    for value, one in zip(y.tolist(), (-np.expm1(-share)).tolist(), strict=True):
        at += one * (value - at)
        slow.append(at)
    return (y + strength * np.asarray(slow)) / (1 + strength)


def _put(effect, static, u, dt, strength, more):
    """Output (n,) with an effect of some strength; zero is none."""
    t, reach = np.arange(u.size) * dt, float(np.ptp(u))
    if strength == 0 or not effect:
        return static(u)
    seen = {
        "field-lag": lambda: _lag(u, strength, dt),
        "rate-widening": lambda: _trailing(u, strength * reach**0.5, dt),
    }.get(effect, lambda: u)()
    y = static(seen)
    rate = np.gradient(u, dt) / reach
    shown = {
        "output-lag": lambda: _lag(y, strength, dt),
        "delay": lambda: np.interp(t - strength, t, y),
        "creep": lambda: _crept(y, strength, dt, more),
        "thermal-drift": lambda: (
            y * (1 - strength * _lag(np.append(0.0, (u / reach) ** 2), more["tau"], dt)[1:])
        ),
        "viscous": lambda: y + strength * rate,
        "filtered viscous": lambda: y + strength * _lag(rate, 0.003, dt),
        "offset-drift": lambda: y + strength * t / t[-1],
        "step": lambda: y + strength * (t > more["time"]),
        "periodic": lambda: y + strength * np.sin(2 * np.pi * more["frequency"] * t + 0.7),
        "resonance": lambda: _rung(y, strength, dt, more),
        "accommodation": lambda: _accommodated(y, u, strength, more),
    }
    return shown.get(effect, lambda: y)()


_USUAL = {
    **dict.fromkeys(("output-lag", "field-lag", "delay"), 0.006),
    "rate-widening": 0.01,
    "creep": 0.05,
    "thermal-drift": 0.02,
    "viscous": 0.003,
    "step": 0.02,
    "offset-drift": 0.02,
    "periodic": 0.01,
    "resonance": 0.04,
    "accommodation": 0.05,
    "filtered viscous": 0.003,
}


def draw(
    noise: str, effect: str, seed: int, percent: float | None = None, seconds: float | None = None
) -> Drawn:
    """Draw a plant with an effect of ``percent`` of its span (rms), None: one per cent, under a noise."""
    rng = np.random.default_rng([seed, *f"{noise} {effect}".encode()])
    high = float(rng.choice([1.5, 0.8, 40.0]))
    u = excitations.diagnostic(0.0, high, rate_Hz=RATE_HZ * FINER).value
    u = u if seconds is None else u[: round(seconds * RATE_HZ * FINER)]
    static, dt = static_of(rng, high), 1 / RATE_HZ / FINER
    healthy = static(u)
    more = {
        "tau": rng.uniform(0.5, 2.0) if effect == "creep" else rng.uniform(10, 30),
        "time": rng.uniform(0.25, 0.8) * u.size * dt,
        "frequency": float(np.exp(rng.uniform(np.log(2), np.log(60)))),
        "damping": rng.uniform(0.1, 0.4),
        "path": rng.uniform(15, 60),
    }
    y, strength, size = healthy, 0.0, 0.0
    if effect and percent != 0.0:
        strength, wanted = _USUAL[effect], 1.0 if percent is None else percent
        for _ in range(3):  # nearly linear: a few proportional corrections reach the size
            y = _put(effect, static, u, dt, strength, more)
            size = float(100 * np.std(y - healthy) / np.ptp(healthy))
            strength *= (wanted / size) ** (0.5 if effect == "resonance" else 1.0)
        y = _put(effect, static, u, dt, strength, more)
        size = float(100 * np.std(y - healthy) / np.ptp(healthy))
    u, y = u[::FINER], y[::FINER]
    y = (y - y.min()) / np.ptp(healthy)
    span = float(rng.choice([14.0, 3e-3, 250.0]))
    y = np.round(span * (y + noise_of(noise, y, rng)), 7 - int(np.log10(span)))
    return Drawn(Record(u, y, dt_s=1 / RATE_HZ), high, effect, size, {"strength": strength, **more})
