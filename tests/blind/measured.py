"""Known faults and effects put into measured records, on the path of a user: table, identify, diagnose.

    python tests/blind/measured.py --seed 1 --percent 2

The hysteresis and the noise are those of real devices (``tests/data``): a tool on cables, each record at one
rate or all three together, and reversal curves of a sediment. What is put in follows formulas of its own, at
the times as they were stamped. In equal cycles at one rate what takes time is another loop, which the weights
hold: there ``none`` or ``inconclusive`` is right as well. A line a case, and how often the name is among
those that were found or could equally be.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import pulsetrainer as pt

DATA = Path(__file__).parents[1] / "data"
RATES = ("0p1", "0p3", "0p5")
RECORDS = {
    "tool, 0.1 Hz": ["davinci_f0p1_torque40"],
    "tool, 0.3 Hz": ["davinci_f0p3_torque10"],
    "tool, 0.5 Hz": ["davinci_f0p5_torque40"],
    "tool, three rates": [f"davinci_f{rate}_torque10" for rate in RATES],
    "tool with a load, three rates": [f"davinci_f{rate}_torque40" for rate in RATES],
    "reversal curves": ["forc_sediment_msm33"],
}
Draw = np.random.Generator


def late(x: np.ndarray, t: np.ndarray, tau: float) -> np.ndarray:
    """First-order average of ``x`` (n,) over ``tau``, from rest."""
    out, at = np.empty_like(x), x[0]
    for k, (value, step) in enumerate(zip(x.tolist(), np.diff(t, prepend=t[0]).tolist(), strict=True)):
        at += (1.0 - np.exp(-step / tau)) * (value - at)
        out[k] = at
    return out


def wild(y: np.ndarray, size: float, rng: Draw) -> np.ndarray:
    """One sample in 200, off by five to fifteen times ``size``."""
    found, at = y.copy(), rng.choice(y.size, y.size // 200, replace=False)
    found[at] += rng.choice([-1.0, 1.0], at.size) * rng.uniform(5.0, 15.0, at.size) * size
    return found


def heated(t: np.ndarray, u: np.ndarray, y: np.ndarray, tau: float) -> np.ndarray:
    """A gain about the lowest output that falls with the averaged square of the input, from its lowest."""
    heat = late((u - u.min()) ** 2, t, tau)
    return (y.min() - y) * (heat - heat[0])


# What is added to the output, of any size: t, u, y, the share of the whole time, a period, and a draw
ADDED: dict[str, Callable[..., np.ndarray]] = {
    "offset-drift": lambda t, u, y, w, T, r: (t - t[0]) ** r.uniform(0.7, 1.3),
    "step": lambda t, u, y, w, T, r: 1.0 * (w > r.uniform(0.4, 0.6)),
    "periodic": lambda t, u, y, w, T, r: np.sin(2 * np.pi * t * r.uniform(7, 23) / T),
    "creep": lambda t, u, y, w, T, r: late(y, t, r.uniform(0.3, 2.0) * T),
    "viscous": lambda t, u, y, w, T, r: late(np.gradient(u, t), t, 3 * np.median(np.diff(t))),
    "thermal-drift": lambda t, u, y, w, T, r: heated(t, u, y, r.uniform(0.5, 3.0) * T),
}
# What becomes of the output: t, y, a size, the lag by which a sine of that period is off as much, and a draw
CHANGED: dict[str, Callable[..., np.ndarray]] = {
    "none": lambda t, y, s, lag, r: y,
    "output-lag": lambda t, y, s, lag, r: late(y, t, lag),
    "delay": lambda t, y, s, lag, r: np.interp(np.abs(t - t[0] - lag) + t[0], t, y),  # as if it came back
    "quantisation": lambda t, y, s, lag, r: np.round(y / s) * s,
    "outliers": lambda t, y, s, lag, r: wild(y, s, r),
    "saturation": lambda t, y, s, lag, r: np.minimum(y, y.max() - r.uniform(2.0, 5.0) * s),
}
EFFECTS = (*ADDED, *CHANGED)
HELD = {"output-lag", "delay", "creep", "thermal-drift"}  # at one rate


def shown(tables: list[np.ndarray], effect: str, percent: float, rng: Draw) -> list[np.ndarray]:
    """Outputs of records (t, u, y) of one device, with an effect of one strength in all of them."""
    size = 0.01 * percent * np.ptp(np.concatenate([y for *_, y in tables]))
    t, u, _ = tables[-1]
    ranges = np.abs(np.diff(np.round(u / np.ptp(u), 1))).sum()  # of the input's path, two in a period
    period = 2.0 * np.ptp(t) / ranges
    state, found = rng.bit_generator.state, []
    for k, (t, u, y) in enumerate(tables):
        rng.bit_generator.state = state  # the same device each time
        if effect in CHANGED:
            found.append(CHANGED[effect](t, y, size, 0.01 * percent * period * np.sqrt(2.0) / np.pi, rng))
        else:
            share = (k + (t - t[0]) / np.ptp(t)) / len(tables)
            found.append(ADDED[effect](t, u, y, share, period, rng))
    if effect in CHANGED:
        return found
    rms = np.sqrt(np.mean([np.var(one) for one in found])) if effect != "step" else 0.5
    return [y + one * (size / rms) for (*_, y), one in zip(tables, found, strict=True)]


def judged(where: str, effect: str, percent: float, rng: Draw) -> tuple[bool, str]:
    """Whether the answer is right, and what it was."""
    tables = [np.loadtxt(DATA / f"{name}.csv", delimiter=",", skiprows=1).T for name in RECORDS[where]]
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        for k, ((t, u, _), y) in enumerate(zip(tables, shown(tables, effect, percent, rng), strict=True)):
            table = Path(folder, f"{k}.csv")
            np.savetxt(table, np.c_[t, u, y], "%.7g", ",", header="t,u,y", comments="")
            runs.append(pt.read_table(table, input="u", output="y", time="t"))
    found = pt.diagnose(runs, pt.identify(runs))
    named = {name for one in found.found for name in (one.cause, *one.confounded_with)} - {"condition-change"}
    held = effect in HELD and where.endswith("Hz") and found.verdict in ("none", "inconclusive")
    right = held or (effect in named if effect != "none" else not named)
    return right, f"{found.verdict}, {sorted(named)}"


def main() -> None:
    """Print a line a case, and the count."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--percent", type=float, default=2.0, help="of the span, rms")
    options.add_argument("--only", nargs="+", choices=RECORDS, default=list(RECORDS))
    asked = options.parse_args()
    answers = []
    for where in asked.only:
        for effect in EFFECTS:
            rng = np.random.default_rng([asked.seed, *where.encode(), *effect.encode()])
            right, answer = judged(where, effect, asked.percent, rng)
            answers.append(right)
            print(f"{where}: {effect}: {'right' if right else 'WRONG'}: {answer}", flush=True)
    print(f"{sum(answers)} of {len(answers)} right")


if __name__ == "__main__":
    main()
