"""Which form drawn devices are given, and how well what is held out is predicted.

    python benchmarks/forms_named.py [--first 9000] [--direct 200] [--others 12]

Direct devices with noise of 0.1 to 1 % of the span, then clockwise, butterfly and mixed ones with 0.3 %; the
steep ones are clockwise with nearly vertical branches. Of the others each line has the form and the error on
a signal never seen, with noise, over that noise.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "unit"))

import form_devices as devices

import pulsetrainer as pt
from pulsetrainer.core.forms import try_all

KINDS = {
    "clockwise": (devices.exchanged_plane, devices.stop_sum),
    "steep": (devices.steep_exchanged_plane,),
    "Bouc-Wen": (devices.bouc_wen,),
    "butterfly": (devices.butterfly_density,),
    "mixed": devices.MIXED,
    "not congruent": devices.NOT_CONGRUENT,
}


def measured(draws, seed: int, noise: float, samples: int = 3000):
    """A device, its input and noisy output, the size of the noise, and the generator of what follows."""
    rng = np.random.default_rng(seed)
    device = draws[seed % len(draws)](rng)
    u = devices.record(rng, samples)
    clean = device(u)
    size = noise * float(np.ptp(clean))
    return device, u, clean + rng.normal(0.0, size, u.size), size, rng


def main() -> None:
    """Print how often each form was named, and the errors."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=9000)
    parser.add_argument("--direct", type=int, default=200)
    parser.add_argument("--others", type=int, default=12)
    asked = parser.parse_args()
    named: Counter[str] = Counter()
    for seed in range(asked.first, asked.first + asked.direct):
        noise = float(np.exp(np.random.default_rng(seed).uniform(np.log(0.001), np.log(0.01))))
        _, u, y, _, _ = measured(devices.DIRECT, seed, noise)
        named[try_all([(u, y)], u.min(), u.max()).form] += 1
    print(f"direct: {dict(named)}", flush=True)
    for kind, draws in KINDS.items():
        forms, errors, warned = Counter(), [], 0
        for seed in range(asked.first, asked.first + asked.others):
            device, u, y, size, rng = measured(draws, seed, 0.003)
            model = pt.identify(pt.Run(time_s=np.arange(u.size) / 100.0, input=u, output=y))
            turns = np.concatenate(([0.0, 1.0, 0.0], rng.uniform(0.0, 1.0, 60)))
            unseen = np.interp(np.linspace(0, 62, 3000), np.arange(63), turns)
            wrong = model.predict(unseen) - device(unseen) + rng.normal(0.0, size, unseen.size)
            errors.append(float(np.sqrt(np.mean(wrong**2))) / size)
            forms[model.form] += 1
            warned += bool(model.fit.warning)
        print(
            f"{kind}: {dict(forms)}, {warned} warned of; error {np.median(errors):.2f} of the noise in the "
            f"median, {max(errors):.2f} at most",
            flush=True,
        )


if __name__ == "__main__":
    main()
