"""What wild samples cost: the error on clean data, with them over without them.

    python benchmarks/wild_samples.py --first 700 --count 10 [--share 0.01] [--levels 24]

Each seed draws a device of every form, an input and noise of 0.3 % of the span; a share of the samples of
the input, or of the output, lies anywhere within three times the range. The record is identified with and
without them, and both models predict a clean signal that neither has seen. Printed for each: the ratio of the
two errors, and how many samples were left out.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pulsetrainer as pt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "unit"))

import form_devices as devices

SAMPLES, NOISE = 3000, 0.003
FORMS = {
    "direct": devices.DIRECT,
    "dual": (devices.exchanged_plane, devices.stop_sum),  # Bouc-Wen has no form: decision 070
    "signed": (devices.butterfly_density, devices.mixed_plays, devices.mixed_planes),
}
NOISES = {
    "normal": lambda rng, n: rng.normal(size=n),
    "exponential": lambda rng, n: rng.laplace(size=n) / np.sqrt(2.0),
    "coloured": lambda rng, n: np.convolve(rng.normal(size=n), np.ones(5) / np.sqrt(5.0), "same"),
}
FloatArray = NDArray[np.float64]


def spoilt(
    values: FloatArray, share: float, rng: np.random.Generator
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Values (n,) with a share of wild ones, and which these are."""
    at = rng.random(values.size) < share
    middle = 0.5 * (values.min() + values.max())
    return np.where(at, middle + rng.uniform(-1.5, 1.5, values.size) * np.ptp(values), values), at


class Case:
    """A drawn device, its record, and the model of that record."""

    def __init__(self, form: str, seed: int, levels: int) -> None:
        rng = np.random.default_rng(seed)
        draws = FORMS[form]
        self.device, self.levels, self.rng = draws[seed % len(draws)](rng), levels, rng
        self.noise = list(NOISES)[seed // 3 % len(NOISES)]
        self.input = devices.record(rng, SAMPLES)
        clean = self.device(self.input)
        self.output = clean + NOISE * np.ptp(clean) * NOISES[self.noise](rng, SAMPLES)
        turns = rng.uniform(0.0, 1.0, 60)
        points = np.concatenate(([0.0, 1.0, 0.0], turns))
        self.unseen = np.interp(np.linspace(0, 62, 3000), np.arange(63), points)
        self.truth = self.device(self.unseen)

    def model(self, u: FloatArray, y: FloatArray) -> pt.Model:
        """Identify a record."""
        run = pt.Run(time_s=np.arange(SAMPLES) / 100.0, input=u, output=y)
        return pt.identify(run, levels=self.levels)

    def error(self, model: pt.Model) -> float:
        """Error on the unseen clean signal, % of the span."""
        wrong = model.predict(self.unseen) - self.truth
        return 100.0 * float(np.sqrt(np.mean(wrong**2)) / np.ptp(self.truth))


def main() -> None:
    """Print a line for each device, and the ratios in short."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=700)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--share", type=float, default=0.01)
    parser.add_argument("--levels", type=int, default=24)
    parser.add_argument("--forms", nargs="*", default=list(FORMS))
    asked = parser.parse_args()
    ratios: dict[str, list[float]] = {form: [] for form in asked.forms}
    lost = size = 0
    for seed in range(asked.first, asked.first + asked.count):
        for form in asked.forms:
            case = Case(form, seed, asked.levels)
            without = case.model(case.input, case.output)
            least = case.error(without)
            lost, size = lost + without.fit.masked_samples, size + SAMPLES
            out = without.fit.masked_samples
            line = f"{seed} {form} {case.noise}: {least:.3f} % ({without.form}, {out} out)"
            for where in ("input", "output"):
                values = case.input if where == "input" else case.output
                bad, at = spoilt(values, asked.share, np.random.default_rng(seed + 10_000))
                model = case.model(*((bad, case.output) if where == "input" else (case.input, bad)))
                ratios[form].append(case.error(model) / least)
                out = model.fit.masked_samples
                line += f"; {where} {ratios[form][-1]:.2f} ({model.form}, {out} of {at.sum()})"
            print(line, flush=True)
    for form, found in ratios.items():
        print(
            f"{form}: {np.mean(found):.3f} in the mean, {np.quantile(found, 0.9):.2f} in nine of ten, "
            f"{max(found):.2f} at worst; {sum(r <= 1.1 for r in found)} of {len(found)} at most 1.1"
        )
    print(f"of records without wild samples {lost} of {size} samples were left out")


if __name__ == "__main__":
    main()
