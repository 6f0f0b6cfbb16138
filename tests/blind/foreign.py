"""Plants of other kinds, on the path of a user: CSV, import, identify, diagnose, extend or correct, evaluate.

None of these plants is a Preisach operator of the bench: Jiles-Atherton, Duhem, friction, plays under an
envelope. Signal, range, units, rate, digits and noise are drawn by the seed, and so is what is hidden. All is
computed at four times the rate of the record. What is asked: is the hidden cause named, what is named
besides, and is the extended model worse than the plain one on a record that it never saw.

    python tests/blind/foreign.py --first 9000 --count 24 -o build/foreign.jsonl
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import signal

FINER = 4
HARM = 1.05  # times the error of the plain model: more is harm
EFFECTS = ("output-lag", "field-lag", "creep", "thermal-drift", "viscous", "offset-drift", "step", "periodic")


def jiles_atherton(u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """dM/dH = (1 - c) (Man - M)/(k sgn H' - a (Man - M)) + c dMan/dH, input 0 to 1 (Jiles, Atherton 1986)."""
    shape, pinning, coupling, c = rng.uniform(0.15, 0.3), rng.uniform(0.08, 0.2), rng.uniform(0, 0.05), 0.15
    field = 2.0 * u - 1.0
    m, out = -0.8, np.empty_like(u)
    for k, dh in enumerate(np.diff(field, prepend=field[0]).tolist()):
        x = (field[k] + coupling * m) / shape
        man = 1.0 / np.tanh(x) - 1.0 / x if abs(x) > 1e-4 else x / 3.0
        slope = (1.0 / x**2 - 1.0 / np.sinh(x) ** 2 if abs(x) > 1e-2 else 1.0 / 3.0) / shape
        apart = man - m
        along = 1.0 if dh > 0 else -1.0
        moved = apart / (along * pinning - coupling * apart) if apart * along > 0 else 0.0
        m += ((1.0 - c) * moved + c * slope) * dh
        out[k] = m
    return out


def duhem(u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """dy/dt = a |u'| (f(u) - y) + g u' (Coleman, Hodgdon 1986)."""
    a, rise, g = rng.uniform(2, 6), rng.uniform(0.8, 1.5), rng.uniform(0.3, 0.9)
    y, out = 0.0, np.empty_like(u)
    wanted = rise * u + 0.2 * np.sin(2.5 * u)
    for k, du in enumerate(np.diff(u, prepend=u[0]).tolist()):
        y += a * abs(du) * (wanted[k] - y) + g * du
        out[k] = y
    return out


def friction(u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A spring, bent, and Dahl friction: dz = du (1 - z sgn du) / s (Dahl 1968)."""
    slide, share, bend = rng.uniform(0.04, 0.15), rng.uniform(0.08, 0.2), rng.uniform(-0.3, 0.5)
    z, out = -1.0, np.empty_like(u)
    for k, du in enumerate(np.diff(u, prepend=u[0]).tolist()):
        z += du * (1.0 - z * (1.0 if du > 0 else -1.0)) / slide
        out[k] = z
    return u + bend * u**2 + share * out


def plays(u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Prandtl-Ishlinskii: plays of twelve widths, bent by an envelope."""
    out = np.zeros_like(u)
    for width, weight in zip(np.linspace(0.01, 0.4, 12), rng.uniform(0.2, 1.0, 12), strict=True):
        at = 0.0
        for k, one in enumerate(u.tolist()):
            at = min(max(at, one - width), one + width)
            out[k] += weight * at
    return np.tanh(rng.uniform(0.6, 1.6) * out / out.max())


PLANTS: dict[str, Callable[[np.ndarray, np.random.Generator], np.ndarray]] = {
    "Jiles-Atherton": jiles_atherton,
    "Duhem": duhem,
    "friction": friction,
    "plays": plays,
}


@dataclass(frozen=True)
class Bench:
    """What a laboratory uses: range, units, rate, digits, noise."""

    low: float
    high: float
    scale: float
    zero: float
    names: tuple[str, str]
    rate_Hz: float
    digits: int
    noise: float  # of the span
    coloured: float  # coefficient of AR(1)
    noisy_input: float  # of the range

    @property
    def middle(self) -> float:
        """Where no input is, as a share of the range of a device that is driven both ways; else 0."""
        return max(-self.low, 0.0) / (self.high - self.low)


def bench_of(rng: np.random.Generator) -> Bench:
    """Draw a laboratory."""
    low, high = [(0.0, 1.5), (-3.0, 3.0), (0.0, 150.0), (20.0, 80.0)][rng.integers(4)]
    scale, zero = [(12.0, 0.0), (-0.4, 1.0), (300.0, 50.0), (2e-3, 0.0)][rng.integers(4)]
    names = [("current_A", "force_N"), ("voltage_V", "displacement_um"), ("pressure_kPa", "stroke_mm")]
    return Bench(
        low,
        high,
        scale,
        zero,
        names[rng.integers(3)],
        float(rng.choice([200.0, 500.0, 1000.0])),
        int(rng.integers(5, 9)),
        float(rng.uniform(0.001, 0.004)),
        float(rng.choice([0.0, 0.0, 0.6, 0.9])),
        float(rng.choice([0.0, 0.0002, 0.001])),
    )


def drive(rate_Hz: float, rng: np.random.Generator, seconds: float) -> np.ndarray:
    """Input 0 to 1 (n,): swings that shrink, and pieces with drawn turns, at rates that change 12 to 1."""
    turns, times = [0.0], [0.0]
    speeds = np.exp(np.linspace(np.log(0.4), np.log(5.0), 4))
    while times[-1] < seconds:
        speed = float(speeds[rng.integers(4)])
        if rng.uniform() < 0.5:
            ends = [0.5 + 0.5 * s * size for size in np.linspace(1, 0.1, rng.integers(4, 9)) for s in (1, -1)]
        else:
            ends = [1.0, 0.0, *rng.uniform(0, 1, rng.integers(4, 12)).tolist(), 1.0, 0.0]
        for end in ends:
            if abs(end - turns[-1]) > 1e-3:
                times.append(times[-1] + abs(end - turns[-1]) / speed)
                turns.append(end)
        if rng.uniform() < 0.4:
            times.append(times[-1] + rng.uniform(0.5, 3.0))
            turns.append(turns[-1])
    t = np.arange(round(seconds * rate_Hz * FINER)) / rate_Hz / FINER
    return np.interp(t, times, turns)


def lagged(x: np.ndarray, tau_s: float, dt_s: float, begin: float | None = None) -> np.ndarray:
    """First-order lag from rest at the first value, or at ``begin``."""
    a = np.exp(-dt_s / tau_s)
    return np.asarray(signal.lfilter([1 - a], [1, -a], x, zi=[a * (x[0] if begin is None else begin)])[0])


def put(
    effect: str,
    plant: Callable[[np.ndarray], np.ndarray],
    u: np.ndarray,
    dt_s: float,
    strength: float,
    tau: float,
    middle: float = 0.0,
) -> np.ndarray:
    """Output (n,) of a plant with an effect; ``tau`` in (0, 1) draws its time; ``middle`` is no input."""
    t = np.arange(u.size) * dt_s
    y = plant(lagged(u, strength, dt_s) if effect == "field-lag" else u)
    shown = {
        "output-lag": lambda: lagged(y, strength, dt_s),
        "creep": lambda: y + strength * lagged(y, 0.4 + 2 * tau, dt_s),
        "thermal-drift": lambda: (
            y - strength * lagged((u - middle) ** 2, 8 + 15 * tau, dt_s, 0.0) * (y - middle * y.max())
        ),
        "viscous": lambda: y + strength * np.gradient(u, dt_s),
        "offset-drift": lambda: y + strength * t / t[-1],
        "step": lambda: y + strength * (t > (0.3 + 0.4 * tau) * t[-1]),
        "periodic": lambda: y + strength * np.sin(2 * np.pi * (2 + 30 * tau) * t),
    }
    return shown.get(effect, lambda: y)()


_FIRST = {"output-lag": 0.005, "field-lag": 0.005, "creep": 0.05, "thermal-drift": 0.05, "viscous": 0.002}


def records_of(seed: int) -> tuple[dict, Bench, list[np.ndarray]]:
    """Draw a case: what is hidden, the laboratory, and two tables (n, 3) of time, input and output."""
    rng = np.random.default_rng([77, seed])
    name = list(PLANTS)[seed % len(PLANTS)]
    effect = "" if rng.uniform() < 0.4 else str(rng.choice(EFFECTS))
    percent, tau, seconds = float(rng.uniform(0.7, 2.5)), float(rng.uniform()), float(rng.uniform(50, 90))
    bench = bench_of(rng)
    inner = int(rng.integers(1 << 30))

    def plant(u: np.ndarray) -> np.ndarray:
        return PLANTS[name](u, np.random.default_rng(inner))

    dt = 1 / bench.rate_Hz / FINER
    inputs = [drive(bench.rate_Hz, rng, seconds), drive(bench.rate_Hz, rng, 0.4 * seconds)]
    still = plant(inputs[0])
    strength = _FIRST.get(effect, 0.02) if effect else 0.0
    for _ in range(3 if effect else 0):
        apart = put(effect, plant, inputs[0], dt, strength, tau, bench.middle) - still
        strength *= percent / float(100 * np.std(apart) / np.ptp(still))
    tables = []
    for fine in inputs:
        y = put(effect, plant, fine, dt, strength, tau, bench.middle)
        u, y = fine[::FINER], (y[::FINER] - still.min()) / np.ptp(still)
        noise = signal.lfilter([1.0], [1.0, -bench.coloured], rng.standard_normal(y.size))
        y = y + bench.noise * noise / np.std(noise)
        told = bench.low + (bench.high - bench.low) * (u + bench.noisy_input * rng.standard_normal(u.size))
        t = np.arange(u.size) / bench.rate_Hz
        tables.append(np.column_stack((t, told, bench.zero + bench.scale * y)))
    return {"seed": seed, "plant": name, "effect": effect, "percent": percent}, bench, tables


def judged(seed: int, folder: Path) -> dict:
    """Lead one case along the path of a user."""
    case, bench, tables = records_of(seed)
    for file, table in zip(("seen", "unseen"), tables, strict=True):
        np.savetxt(
            folder / f"{file}.csv",
            table,
            delimiter=",",
            fmt=["%.6f", *(2 * [f"%.{bench.digits}g"])],
            header=f"time_s,{bench.names[0]},{bench.names[1]}",
            comments="",
        )

    def run(*words: str) -> dict:
        done = subprocess.run(
            [sys.executable, "-m", "pulsetrainer", *words, "--json"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        if done.returncode != 0:
            return {"failed": words[0], "code": done.returncode, "said": done.stderr[-300:]}
        return json.loads(done.stdout)

    for file in ("seen", "unseen"):
        run(
            "import", f"{file}.csv", "--input", bench.names[0], "--output", bench.names[1], "-o", f"{file}.h5"
        )
    identified = run("identify", "seen.h5", "-o", "model.h5")
    said = run("diagnose", "seen.h5", "--model", "model.h5", "-o", "diagnosis.h5")
    extended = run("extend", "diagnosis.h5", "--model", "model.h5", "-o", "extended.h5")
    row = {**case, "noise": bench.noise, "coloured": bench.coloured, "rate": bench.rate_Hz}
    row["failed"] = [one for one in (identified, said) if "failed" in one]
    row["verdict"] = said.get("verdict")
    row["found"] = [one["id"] for one in said.get("causes", []) if one["found"]]
    row["left"] = said.get("left")
    row["extended"] = "failed" not in extended
    if row["extended"]:
        words = ("evaluate", "unseen.h5", "--model")
        row["errors"] = [run(*words, model) for model in ("model.h5", "extended.h5")]
    row["said"] = said
    return row


def main() -> None:
    """Judge cases one after another; a row of JSON each."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--first", type=int, default=9000)
    options.add_argument("--count", type=int, default=24)
    options.add_argument("-o", "--out", type=Path, required=True)
    asked = options.parse_args()
    for seed in range(asked.first, asked.first + asked.count):
        with tempfile.TemporaryDirectory() as folder:
            row = judged(seed, Path(folder))
        with asked.out.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(seed, row["plant"], row["effect"] or "-", row["verdict"], row["found"], flush=True)


if __name__ == "__main__":
    main()
