"""What is hidden: effects drawn by seed, put into the bench, and given to the judge only afterwards.

``draw`` makes a case from a seed; ``measure`` plays it on the real firmware and returns nothing but what a
device reports. The judge sees the case when the verdict is in.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pulsetrainer.core import signals
from pulsetrainer.diagnosis.design import Measured
from pulsetrainer.link.device import open_device

RATE_HZ = 1000.0
HIGH_A = 1.5
DT_S = 1.0 / RATE_HZ


def _log(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# for each cause: bench parameters, and the truth of the diagnosis's own parameters
LIBRARY = {
    "output-lag": lambda r: ({"output-lag": (v := _log(r, 0.003, 0.02))}, {"tau": v}),
    "field-lag": lambda r: ({"field-lag": (v := _log(r, 0.003, 0.02))}, {"tau": v - FILTER_S}),
    "delay": lambda r: ({"delay": (v := _log(r, 0.003, 0.015))}, {"delay": v - FILTER_S}),
    "rate-widening": lambda r: ({"rate-widening": (v := _log(r, 0.006, 0.03))}, {"coefficient": v}),
    "viscous": lambda r: ({"viscous": (v := _log(r, 0.015, 0.05))}, {"coefficient": v}),
    "creep": lambda r: (
        {"creep": (v := _log(r, 0.02, 0.1)), "creep-tau": (t := _log(r, 0.5, 2.0))},
        {"amplitude": v, "tau": t},
    ),
    "thermal-drift": lambda r: (
        {"thermal-drift": (v := _log(r, 0.008, 0.04)), "thermal-tau": (t := _log(r, 10, 30))},
        {"coefficient": v, "tau": t},
    ),
    "offset-drift": lambda r: (
        {"offset-drift": (v := r.choice([-1, 1]) * _log(r, 0.002, 0.01))},
        {"rate": v},
    ),
    "resonance": lambda r: (
        {"resonance": (f := _log(r, 6, 30)), "resonance-zeta": (z := _log(r, 0.05, 0.3))},
        {"frequency": f, "damping": z},
    ),
    "periodic": lambda r: (
        {"periodic": _log(r, 0.07, 0.4), "periodic-frequency": (f := _log(r, 2, 60))},
        {"frequency": f},
    ),
    "step": lambda r: (
        {"step": (v := r.choice([-1, 1]) * _log(r, 0.1, 0.5)), "step-time": r.uniform(25, 75)},
        {"offset": v},
    ),
    "load-dependence": lambda r: (
        {"load-dependence": (v := r.choice([-1, 1]) * _log(r, 0.004, 0.01))},
        {"coefficient": v},
    ),
    "accommodation": lambda r: (
        {"accommodation": (v := _log(r, 0.08, 0.3)), "accommodation-path": (p := _log(r, 15, 60))},
        {"amplitude": v, "path": p},
    ),
    "stick-slip": lambda r: ({"stick-slip": _log(r, 0.15, 0.6)}, {}),
    "saturation": lambda r: ({"saturation": (v := r.uniform(10.5, 12.5))}, {"size": v}),
    "quantisation": lambda r: ({"quantisation": (v := _log(r, 0.1, 0.5))}, {"size": v}),
    "outliers": lambda r: ({"outliers": _log(r, 0.001, 0.01), "outlier-size": _log(r, 2, 6)}, {}),
}
# the firmware's current filter makes the measured current late: lags before the hysteresis look shorter
FILTER_S = 0.0002
# what the library does not hold, put on the measured output
OUTSIDE = ("gain wander", "hidden load", "bursts")
FAMILIES = (
    {"delay", "field-lag", "output-lag", "rate-widening", "viscous"},
    {"offset-drift", "step"},
    {"creep", "accommodation"},
)


@dataclass(frozen=True)
class Case:
    """A hidden truth."""

    seed: int
    causes: tuple[str, ...]  # empty: a control
    settings: dict = field(default_factory=dict)
    truth: dict = field(default_factory=dict)  # cause: parameters
    outside: str = ""

    @property
    def port(self) -> str:
        """The bench that hides it."""
        words = [f"{name}={value}" for name, value in self.settings.items()]
        return "bench:?" + "&".join(["ideal", *words])


def draw(kind: str, seed: int) -> Case:
    """Draw a case: ``control``, ``single``, ``single:NAME``, ``pair`` or ``unknown``."""
    rng = np.random.default_rng([seed, *kind.encode()])
    settings = {
        "seed": int(rng.integers(1, 10_000)),
        "noise-seed": int(rng.integers(1, 1000)),
        "noise": round(_log(rng, 0.001, 0.004), 5),
    }
    if kind == "unknown":
        return Case(seed, (), settings, {}, OUTSIDE[int(rng.integers(len(OUTSIDE)))])
    count = {"control": 0, "pair": 2}.get(kind, 1)
    names = [kind.partition(":")[2]] if ":" in kind else _names(rng, count)
    truth = {}
    for name in names:
        more, truth[name] = LIBRARY[name](rng)
        settings |= more
    return Case(seed, tuple(names), settings, truth)


def _names(rng, count):
    """Causes of different families: two of one family are one cause to any eye."""
    names: list[str] = []
    for name in rng.permutation(list(LIBRARY)).tolist():
        if len(names) < count and not any(name in f and set(names) & f for f in FAMILIES):
            names.append(name)
    return names


def measure(case: Case) -> tuple[Measured, float]:
    """Play the diagnostic signal on the bench; return what the device reports and the range played.

    A device that trips its force limit, as a ringing one may, is played at less.
    """
    for high in (HIGH_A, 1.2, 0.9):
        value = signals.diagnostic(0.0, high, rate_Hz=RATE_HZ).value
        with open_device(case.port) as device:
            lead = signals.conditioning(0.0, high, speed=3.0, rate_Hz=RATE_HZ, rest_s=0.2)
            if device.play(lead, RATE_HZ).fault:
                continue
            got = device.play(value, RATE_HZ)
        if not got.fault:
            y = got.force_N
            if case.outside:
                y = _spoil(case, got.time_s, y)
            return Measured(DT_S, got.current_A, y, np.ones(y.size), got.reference_A), high
    raise RuntimeError(f"{case.port} cannot be played: {got.fault}")


def _spoil(case, t, y):
    rng = np.random.default_rng([case.seed, 77])
    if case.outside == "gain wander":
        return y * (1.0 + 0.02 * np.sin(2 * np.pi * t / rng.uniform(7, 13) + rng.uniform(0, 6)))
    if case.outside == "hidden load":  # somebody leans on the device now and then
        edges = np.sort(rng.uniform(0, t[-1], 24)).reshape(-1, 2)
        return y + 0.35 * np.any([(t > a) & (t < b) for a, b in edges], axis=0)
    burst = np.sin(2 * np.pi * 11 * t + 3 * np.sin(2 * np.pi * 0.7 * t)) * (np.sin(2 * np.pi * t / 17) > 0.3)
    return y + 0.25 * burst * np.sin(2 * np.pi * t / 3.1)
