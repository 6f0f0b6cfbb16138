"""How much of a model's error ``correct`` takes away, for each fault of a measurement.

A drawn static plant (``tests/blind/drawn.py``) is recorded with noise of 0.3 % and one fault. Models are
identified of the faulty record (e_f), of the corrected one (e_c) and of the same record without the fault
(e_0). Each predicts another signal of the same plant, without noise. The share of the possible gain is
(e_f - e_c)/(e_f - e_0); it is not told where the fault costs less than a tenth of e_0. What lies above a
cut-off no record shows: for that fault the errors below it are told as well.

    python benchmarks/corrected_records.py --first 1 --count 3
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "blind"))

import drawn

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.errors import DataError

RATE_HZ, HIGH, NOISE = 500.0, 1.5, 0.003
MATTERS = 0.1  # of e_0: what a fault must cost

Fault = Callable[[np.ndarray, np.ndarray, np.random.Generator], np.ndarray]


def _drift(y: np.ndarray, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return y + rng.choice([-1, 1]) * rng.uniform(0.015, 0.05) * t / t[-1]


def _step(y: np.ndarray, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return y + rng.choice([-1, 1]) * rng.uniform(0.015, 0.05) * (t > rng.uniform(0.2, 0.8) * t[-1])


def _hum(y: np.ndarray, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return y + rng.uniform(0.01, 0.03) * np.sin(2 * np.pi * rng.uniform(2, 60) * t + rng.uniform(0, 6))


def _skew(y: np.ndarray, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.interp(t / (1.0 + rng.choice([-1, 1]) * rng.uniform(3e-4, 1.5e-3)), t, y)


def _wild(y: np.ndarray, _t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    bad = rng.uniform(size=y.size) < rng.uniform(0.003, 0.01)
    return np.where(bad, y + rng.normal(0, 0.5, y.size), y)


def _coarse(y: np.ndarray, _t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    step = rng.uniform(0.01, 0.05)
    return np.floor(y / step) * step


def _cut_off(y: np.ndarray, _t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.minimum(y, np.quantile(y, rng.uniform(0.85, 0.95)))


FAULTS: dict[str, Fault] = {
    "drift": _drift,
    "step": _step,
    "hum": _hum,
    "clock skew": _skew,
    "wild samples": _wild,
    "coarse steps": _coarse,
    "cut-off": _cut_off,
    "cut-off, below it": _cut_off,
}


def share(name: str, seed: int) -> tuple[float, float, float, float, str]:
    """Share of the possible gain, the errors e_0, e_f and e_c, and the verdict."""
    rng = np.random.default_rng([seed, *name.partition(",")[0].encode()])
    static = drawn.static_of(rng, HIGH)
    u = excitations.diagnostic(0.0, HIGH, rate_Hz=RATE_HZ).value
    t = np.arange(u.size) / RATE_HZ
    y = static(u)
    noise = NOISE * np.ptp(y) * rng.standard_normal(u.size)

    def run(output: np.ndarray) -> pt.Run:
        return pt.Run(time_s=t, input=u, output=output)

    clean, faulty = run(y + noise), run(FAULTS[name](y + noise, t, rng))
    other = excitations.identification(0.0, HIGH, n_h=24, speed=1.0, rate_Hz=RATE_HZ).value
    truth = static(other)

    judged = truth <= faulty.output.max() if "below" in name else np.full(truth.size, True)

    def error(model: pt.Model) -> float:
        return float(np.std((truth - operator_of(model)(other))[judged]) / np.ptp(truth))

    begun = pt.identify(faulty)
    found = pt.diagnose(faulty, begun)
    try:
        corrected = pt.identify(pt.correct(faulty, found))
    except DataError as why:
        return 0.0, error(pt.identify(clean)), error(begun), error(begun), f"{found.verdict}: {why}"
    best, before, after = error(pt.identify(clean)), error(begun), error(corrected)
    told = (before - after) / (before - best) if before - best > MATTERS * best else float("nan")
    return told, best, before, after, found.verdict


def main() -> None:
    """Print a line a record, and the median of each fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=3)
    parser.add_argument("--only", choices=FAULTS, action="append")
    asked = parser.parse_args()
    for name in asked.only or FAULTS:
        shares = []
        for seed in range(asked.first, asked.first + asked.count):
            told, best, before, after, verdict = share(name, seed)
            shares.append(told)
            errors = f"{100 * best:.3f} {100 * before:.3f} {100 * after:.3f} %"
            print(f"{name:17} seed {seed}: share {told:.2f}, errors {errors}, {verdict}", flush=True)
        known = [one for one in shares if np.isfinite(one)]
        middle = f"{np.median(known):.2f}" if known else "none told"
        print(f"{name:17} median {middle} of {len(known)}", flush=True)


if __name__ == "__main__":
    main()
