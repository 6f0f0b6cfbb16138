"""`tune` on drawn coils: how many follow the demo's drives, with the delivered gains and with those it sets.

    python benchmarks/drawn_coils.py DRIVE.h5... [--first 1] [--coils 100]

The drives are those of `invert normal` and `invert bifid`. Coils that no gains could make follow them are
left out of the count; what `tune` says of them is counted apart.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

import pulsetrainer as pt
from pulsetrainer.core.coil import DIODE_V, Coil
from pulsetrainer.errors import DeviceError

WITHIN = 0.01  # of the range
RANGE_A = 1.5
MASK = (1 << 64) - 1


@dataclass(frozen=True)
class Drawn:
    """A coil and its adapter, as `bench:?coil=SEED` has them."""

    ohm: float
    henry: float
    volts: float

    @classmethod
    def of(cls, seed: int) -> Drawn:
        """Draw as `draw_coil` in firmware/plant/solenoid.c: splitmix64 into xorshift64*."""
        z = ((4 << 32 | seed) + 0x9E3779B97F4A7C15) & MASK
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        state = (z ^ (z >> 31)) | 1
        draws = []
        for _ in range(3):
            state ^= state >> 12
            state = (state ^ (state << 25)) & MASK
            state ^= state >> 27
            draws.append((((state * 0x2545F4914F6CDD1D) & MASK) >> 40) / 16777216.0)
        return cls(2.0 + 8.0 * draws[0], 0.005 + 0.095 * draws[1], 9.0 + 15.0 * draws[2])

    @property
    def coil(self) -> Coil:
        """As its driver sees it."""
        return Coil((self.volts + DIODE_V) / self.ohm, DIODE_V / self.ohm, self.henry / self.ohm)

    def follows(self, drives: list[np.ndarray]) -> bool:
        """Whether any gains could: R i + L di/dt within the supply and the diode."""
        worst = 0.0
        for drive in drives:
            fine = np.interp(np.arange(10 * drive.size) / 10, np.arange(drive.size), drive)
            worst = max(worst, float(np.abs(fine - self.coil.best_possible(fine, 1e-4)).max()))
        return worst <= WITHIN * RANGE_A


def tracking(device, drives) -> float:
    """Largest error of the current over the drives, of the range; infinite where the device stopped."""
    worst = 0.0
    for drive in drives:
        trace = device.play(drive, 1000.0)
        if trace.fault:
            return float("inf")
        worst = max(worst, float(np.abs(trace.current_A - trace.reference_A).max()) / RANGE_A)
    return worst


def main() -> None:
    """Print a line for each coil, and the counts."""
    parser = argparse.ArgumentParser()
    parser.add_argument("drives", nargs="+")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--coils", type=int, default=100)
    asked = parser.parse_args()
    loaded = [pt.load(path) for path in asked.drives]
    drives = [drive.compensated for drive in loaded]
    able = delivered = tuned_ones = named = wrongly_named = excluded = 0
    errors = []
    seed = asked.first - 1
    while able < asked.coils:
        seed += 1
        drawn = Drawn.of(seed)
        can = drawn.follows(drives)
        able += can
        excluded += not can
        port = f"bench:?coil={seed}"
        before = after = float("nan")
        said = ""
        with pt.open_device(port) as device:
            try:
                found = pt.tune(device, pulses=loaded)
            except DeviceError as error:
                said = error.message
            else:
                errors.append((found.resistance_ohm / drawn.ohm - 1, found.inductance_H / drawn.henry - 1))
                after = tracking(device, drives)
        if can:
            with pt.open_device(port) as device:
                before = tracking(device, drives)
        delivered += can and before < WITHIN
        tuned_ones += can and after < WITHIN
        named += not can and bool(said)
        wrongly_named += can and bool(said)
        print(
            f"{seed:4d} {drawn.ohm:5.2f} ohm {1e3 * drawn.henry:5.1f} mH {drawn.volts:4.1f} V "
            f"{'can' if can else 'cannot':6} before {100 * before:7.2f} % after {100 * after:5.2f} % {said}",
            flush=True,
        )
    ohm, henry = 100 * np.abs(np.array(errors)).T
    print(
        f"{able} coils that can follow: {delivered} with the delivered gains, {tuned_ones} tuned, "
        f"{wrongly_named} refused; {excluded} that cannot: {named} named\n"
        f"resistance within {ohm.max():.2f} %, inductance within {henry.max():.2f} % (of {ohm.size} coils)"
    )


if __name__ == "__main__":
    main()
