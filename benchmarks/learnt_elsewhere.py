"""What refining learnt on one pulse, asked for in others: on plants drawn by a seed, which no model has.

    python benchmarks/learnt_elsewhere.py [--first 200] [--plants 18] [--pulses normal,bifid,...]

Jiles-Atherton, Duhem, friction and plays in turn, with a lag, creep, a dip and a viscous force as drawn.
Every pulse is refined: what five passes leave, over the sensor's noise. Then what was learnt is asked for in
each other pulse; errors there are of the plant itself.
"""

from __future__ import annotations

import argparse
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "unit"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "blind"))

import foreign
from foreign_plants import ForeignDevice

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.errors import DataError, PulsetrainerError
from pulsetrainer.steps.invertible import invertible

SLEW = 30.0
DT_S = 1e-3
PULSES = "normal,bifid,water-hammer,stiff,dicrotic,parvus-et-tardus"


def plant(seed: int):
    """Return the name of a plant, and what it presses in N for a current in A (n,)."""
    rng = np.random.default_rng([1818, seed])
    name = list(foreign.PLANTS)[seed % 4]
    inner = int(rng.integers(1 << 30))
    lag_s = rng.uniform(0.002, 0.010) * (rng.uniform() < 0.7)
    creep = [
        (rng.uniform(0.0, 0.05), np.exp(rng.uniform(np.log(0.05), np.log(5)))) for _ in range(rng.integers(3))
    ]
    dip_N, dip_at = rng.uniform(0.2, 0.6) * (rng.uniform() < 0.4), rng.uniform(0.3, 0.9)
    viscous = rng.uniform(-0.003, 0.003) * (rng.uniform() < 0.3)
    used = np.concatenate((np.linspace(0, 1, 300), np.linspace(1, 0, 300)))

    def press(current):
        u = np.clip(current / 1.5, 0, 1)
        y = foreign.PLANTS[name](np.concatenate((used, u)), np.random.default_rng(inner))[used.size :]
        y = 1.0 + 12.0 * ((y + 1) / 2 if name == "Jiles-Atherton" else y)
        y = y + sum(share * foreign.lagged(y, tau, DT_S) for share, tau in creep)
        y = foreign.lagged(y, lag_s, DT_S) if lag_s else y
        mean = foreign.lagged(u, 0.35, DT_S)
        return y + 12.0 * viscous * np.gradient(u, DT_S) - dip_N * np.exp(-(((mean - dip_at) / 0.2) ** 2))

    return name, press


def drives(seed: int, press, pulses):
    """For each pulse its drive by a model of the plant, and that drive refined."""
    current = excitations.identification(0.0, 1.5, n_h=48, speed=1.5, rate_Hz=1000.0).value
    played = ForeignDevice("", seed=seed + 9, press=press).play(current, 1000.0)
    run = pt.Run(time_s=DT_S * np.arange(current.size), input=current, output=played.force_N)
    model = pt.identify(run)
    low, high = invertible(model, 1000.0).reach
    ends = {"force_min": low + 0.1 * (high - low), "force_max": high - 0.1 * (high - low)}
    made = {pulse: pt.invert(pulse, model, slew=SLEW, **ends) for pulse in pulses}
    device = ForeignDevice("", seed=seed + 3, press=press)
    return {pulse: (drive, pt.refine(drive, device, slew=SLEW)) for pulse, drive in made.items()}


def left(refined) -> tuple[float, bool]:
    """Mean error of the kept pass over noise; whether a pass was worse than the last by more than noise."""
    means = [one.mean_abs_error_percent for one in refined.passes]
    noise = [one.noise_percent for one in refined.passes]
    worse = any(
        after > before + much for (before, after), much in zip(pairwise(means), noise[1:], strict=True)
    )
    return means[refined.kept - 1] / noise[refined.kept - 1], worse


def main() -> None:
    """Print a line for each plant, and the counts."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=200)
    parser.add_argument("--plants", type=int, default=18)
    parser.add_argument("--pulses", default=PULSES)
    asked = parser.parse_args()
    pairs, gains, ratios = 0, [], {}
    for seed in range(asked.first, asked.first + asked.plants):
        name, press = plant(seed)

        def error_percent(drive, press=press) -> float:
            missed = np.abs(press(drive.compensated) - drive.target)[drive.scored]
            return 100.0 * float(missed.mean()) / drive.full_force

        try:
            made = drives(seed, press, asked.pulses.split(","))
        except PulsetrainerError as refused:
            print(seed, name, refused, flush=True)
            continue
        own = [left(refined) for _, refined in made.values()]
        ratios.setdefault(name, []).extend(own)
        print(f"{seed} {name}: refined to " + ", ".join(f"{ratio:.2f}" for ratio, _ in own), flush=True)
        here = []
        for learnt, (_, refined) in made.items():
            for new, (drive, best_drive) in made.items():
                if new == learnt:
                    continue
                pairs += 1
                try:
                    after = error_percent(pt.transfer(drive, refined, slew=SLEW))
                except DataError:
                    continue
                before, best = error_percent(drive), error_percent(best_drive)
                here.append((before - after, before - best))
                if after > before:
                    print(f"{seed} {name}: {learnt} to {new}: {before:.2f} % to {after:.2f} %, worse")
        gains += here
        print(f"{seed} {name}: {len(here)} let through, {sum(g <= 0 for g, _ in here)} worse", flush=True)
    for name, own in ratios.items():
        over = np.array([ratio for ratio, _ in own])
        print(
            f"{name}: {over.size} pulses refined to {over.mean():.2f} of the noise in the mean, "
            f"{over.max():.2f} at most; {np.sum(over <= 1.2)} at most 1.2; "
            f"{sum(w for _, w in own)} with a pass worse than the last"
        )
    half = sum(gain >= 0.5 * most for gain, most in gains)
    worse = sum(gain <= 0 for gain, _ in gains)
    print(f"{len(gains)} of {pairs} let through: {half} keep half of the gain or more, {worse} are worse")


if __name__ == "__main__":
    main()
