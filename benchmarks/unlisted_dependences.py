"""Dependences that are in no list: whether they are found, their time constants, and the gain.

Devices of their own kind (a Preisach density on 97 levels; every state integrated at four times the sample
rate by Euler's rule) get a dependence that no cause of the library has. Each is identified, diagnosed and
extended on one record, and judged on another: which share of the error that the true dependence would take
away does the learned one take away? Then a pulse is inverted with each model and played on the device, which
is integrated by its own rule: what error is left of the plain model's, what of the extended one's?

    python benchmarks/unlisted_dependences.py --first 41 --devices 1 --percent 1
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np
from scipy import signal

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane

RATE_HZ, FINER, LEVELS, HIGH = 250.0, 4, 97, 1.5
# kind of dependence: time constants from, to
KINDS = {
    "dip of mean input": (0.2, 1.2),
    "saturating mean input": (0.3, 3.0),
    "dip of mean output": (0.2, 1.5),
    "heat": (1.0, 10.0),
    "mean square output": (0.5, 5.0),
    "speed": (0.3, 3.0),
    "rest": (0.3, 1.5),
    "last turn": (0.1, 0.5),
    "two": (0.2, 1.0),
    "gain by mean input": (0.2, 1.2),
    "gain by speed": (0.3, 3.0),
    "gain by last turn": (0.1, 0.5),
    "none": (1.0, 2.0),
}


@dataclass(frozen=True)
class Device:
    """A static part and a dependence."""

    kind: str
    static: Preisach
    span: float
    tau_s: float
    place: float  # of a dip, share of the range
    sign: float

    def __call__(self, u: np.ndarray, strength: float) -> np.ndarray:
        """Output (n,) for an input (n,) at the sample rate."""
        fine = np.interp(np.arange((u.size - 1) * FINER + 1) / FINER, np.arange(u.size), u)
        y = self.static(fine)
        if strength:
            own = (y - (self.static.offset - self.static.total)) / self.span
            y = y + self.sign * strength * self.span * self.shape(fine, own, 1.0 / RATE_HZ / FINER)
        return np.asarray(y[::FINER])

    def shape(self, u: np.ndarray, y: np.ndarray, h: float) -> np.ndarray:
        """Dependence (n,), about one in size."""
        tau = self.tau_s

        def mean(x: np.ndarray, times: float = 1.0) -> np.ndarray:
            share = h / (tau * times)
            return signal.lfilter([share], [1.0, share - 1.0], x - x[0]) + x[0]

        def dip(x: np.ndarray, at: float, width: float) -> np.ndarray:
            return -np.exp(-0.5 * ((x - at) / width) ** 2)

        def rise(x: np.ndarray, at: float, width: float) -> np.ndarray:
            return 1.0 / (1.0 + np.exp(-(x - at) / width))

        return {
            "dip of mean input": lambda: dip(mean(u), HIGH * self.place, 0.12),
            "saturating mean input": lambda: np.tanh((mean(u) - 0.5) / 0.25),
            "dip of mean output": lambda: dip(mean(y), self.place, 0.1),
            "heat": lambda: rise(mean(u**2), 0.8, 0.15),
            "mean square output": lambda: 3.0 * np.minimum(mean(y**2), 0.35),
            # it rests before a record begins
            "speed": lambda: np.sqrt(mean(np.abs(np.diff(u, prepend=u[0])) / h) + 0.05),
            "rest": lambda: np.log1p(_rested(u) * h / tau),
            "last turn": lambda: -dip(mean(_turns(u)), 0.4 + 0.7 * self.place, 0.2),
            # the gain is about an output of the device's own
            "gain by mean input": lambda: dip(mean(u), HIGH * self.place, 0.15) * (y - self.place + 0.35),
            "gain by speed": lambda: np.log1p(mean(np.abs(np.diff(u, prepend=u[0])) / h)) * y,
            "gain by last turn": lambda: -dip(mean(_turns(u)), 0.4 + 0.7 * self.place, 0.2) * y,
            "two": lambda: dip(mean(u), HIGH * self.place, 0.12) + rise(mean(u**2, 12.0), 0.8, 0.2),
            "none": lambda: np.zeros(u.size),
        }[self.kind]()


def _turns(u: np.ndarray, band: float = 0.03) -> np.ndarray:
    # before a record it came down from the top, as after the stroke that conditions it
    turn, extreme, way, found = HIGH, u[0], -1.0, []
    for value in u.tolist():
        if (extreme - value) * way > band:
            turn, extreme, way = extreme, value, -way
        elif (value - extreme) * way > 0:
            extreme = value
        found.append(turn)
    return np.asarray(found)


def _rested(u: np.ndarray, band: float = 0.006) -> np.ndarray:
    at, since, found = u[0], 0, []
    for k, value in enumerate(u.tolist()):
        if abs(value - at) > band:
            at, since = value, k
        found.append(k - since)
    return np.asarray(found)


def drawn(kind: str, seed: int) -> tuple[Device, np.random.Generator]:
    """Draw a device of a kind."""
    rng = np.random.default_rng([seed, *kind.encode()])
    plane = Plane.uniform(0.0, HIGH, LEVELS)
    up, down = plane.cell_indices
    wide, middle = (up - down) / LEVELS, (up + down) / (2 * LEVELS)
    broad = rng.uniform([0.06, 0.2], [0.2, 0.5])
    at = rng.uniform([0.08, 0.35], [0.3, 0.65])
    density = rng.uniform(0.05, 0.5) + np.exp(
        -(((wide - at[0]) / broad[0]) ** 2) - ((middle - at[1]) / broad[1]) ** 2
    )
    density += rng.uniform(0.5, 3.0) * (wide < 1.5 / LEVELS) * (0.4 + middle)
    span = rng.uniform(8.0, 16.0)
    weights = 0.5 * span * density / float((density * plane.areas).sum())
    tau = float(np.exp(rng.uniform(*np.log(KINDS[kind]))))
    static = Preisach(plane, weights, 0.5 * span)
    device = Device(kind, static, span, tau, rng.uniform(0.35, 0.65), float(rng.choice([-1.0, 1.0])))
    return device, rng


def run_of(u: np.ndarray, y: np.ndarray) -> pt.Run:
    """Return a record in amperes and newtons."""
    return pt.Run(time_s=np.arange(u.size) / RATE_HZ, input=u, output=y, input_unit="A", output_unit="N")


def judged(kind: str, seed: int, percent: float) -> str:
    """One row: what was found of one device, and what it gained."""
    device, rng = drawn(kind, seed)
    noise = float(np.exp(rng.uniform(np.log(5e-4), np.log(2e-3)))) * device.span
    u = excitations.diagnostic(0.0, HIGH, rate_Hz=RATE_HZ).value
    other = np.concatenate(
        (
            excitations.identification(
                0.0, HIGH, n_h=12, speed=rng.uniform(3.0, 10.0), rate_Hz=RATE_HZ
            ).value,
            np.full(int(3 * RATE_HZ), 0.6),
            excitations.identification(0.0, HIGH, n_h=10, speed=1.5, rate_Hz=RATE_HZ).value,
        )
    )
    static, one = device(u, 0.0), device(u, 1.0)
    size = float(np.std(one - static))
    strength = 0.01 * percent * device.span / size if size else 0.0
    y = device(u, strength) + noise * rng.standard_normal(u.size)
    run, unseen = run_of(u, y), run_of(other, device(other, strength))
    model = pt.identify(run, form="direct")
    begun = time.process_time()
    found = pt.diagnose([run], model, seed=0)
    took = time.process_time() - begun
    names = ", ".join(one.cause for one in found.causes if one.found) or "none"
    plain = 100.0 * pt.evaluate(unseen, model).models[0].rms / device.span
    row = f"| {kind} | {seed} | {device.tau_s:.3g} | {names} |"
    if found.extended is None:
        return f"{row} | {plain:.2f} | | | | | {took:.0f} |"
    learned = pt.evaluate(unseen, pt.extend(model, found)).models[0].rms * 100.0 / device.span
    known = pt.identify(run_of(u, y - (device(u, strength) - static)), form="direct")
    best = known.predict(other, dt_s=1.0 / RATE_HZ) - device(other, 0.0)
    least = 100.0 * float(np.sqrt(np.mean(best**2))) / device.span
    times = ", ".join(f"{one.tau_s:.3g}" for one in found.dependences)
    gain = (plain - learned) / (plain - least)
    before, after = (played(device, strength, one) for one in (model, pt.extend(model, found)))
    cells = f"{times} | {plain:.2f} | {learned:.3f} | {gain:.2f} | {before:.2f} | {after:.2f}"
    return f"{row} {cells} | {took:.0f} |"


def played(device: Device, strength: float, model: pt.Model) -> float:
    """Rms error of the normal pulse, per cent of the span, when a model's inverse is played on the device."""
    drive = pt.invert("normal", model, periods=8, rate_Hz=RATE_HZ)
    error = (device(drive.compensated, strength) - drive.target)[drive.scored]
    return 100.0 * float(np.sqrt(np.mean(error**2))) / device.span


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--first", type=int, default=41, help="first seed")
    options.add_argument("--devices", type=int, default=1, help="of each kind")
    options.add_argument("--percent", type=float, default=1.0, help="rms of the dependence, of the span")
    options.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    chosen = options.parse_args()
    print(
        "| depends on | seed | tau, s | found | its tau, s | plain, % | extended, % | of the gain "
        "| pulse plain, % | pulse extended, % | took, s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for seed in range(chosen.first, chosen.first + chosen.devices):
        for kind in chosen.kinds:
            print(judged(kind, seed, chosen.percent), flush=True)


if __name__ == "__main__":
    main()
