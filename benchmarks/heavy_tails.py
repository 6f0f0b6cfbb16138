"""Noise with heavy tails: the error on clean data never seen, over that with Gaussian noise of the same rms.

    python benchmarks/heavy_tails.py [--first 3100] [--count 12]

The noise is of Student's t with three degrees of freedom, 0.3 % or 1 % of the span; devices are those of
``wild_samples``, of each form in turn. Single ratios scatter, since the two noises are other draws too.
"""

from __future__ import annotations

import argparse

import numpy as np
from wild_samples import FORMS, SAMPLES, Case

NOISES = (0.003, 0.01)


def main() -> None:
    """Print a line for each device, and the ratios in short."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=3100)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--levels", type=int, default=24)
    asked = parser.parse_args()
    for form in FORMS:
        ratios = []
        for seed in range(asked.first, asked.first + asked.count):
            case = Case(form, seed, asked.levels)
            clean = case.device(case.input)
            rng = np.random.default_rng(seed + 20_000)
            size = NOISES[seed % 2] * float(np.ptp(clean))
            drawn = rng.standard_normal(SAMPLES), rng.standard_t(3, SAMPLES)
            noises = (size * one / np.sqrt(np.mean(one**2)) for one in drawn)
            usual, heavy = (case.error(case.model(case.input, clean + noise)) for noise in noises)
            ratios.append(heavy / usual)
            print(f"{seed} {form}: {usual:.3f} % and {heavy:.3f} %: {ratios[-1]:.2f}", flush=True)
        print(
            f"{form}: {np.mean(ratios):.2f} in the mean, {np.median(ratios):.2f} in the median, "
            f"{max(ratios):.2f} at most; {sum(r <= 1.15 for r in ratios)} of {len(ratios)} at most 1.15"
        )


if __name__ == "__main__":
    main()
