"""`check` on devices of which the zero, the gain and the room moved, and on others that nobody touched.

    python benchmarks/shifted_devices.py [--first 21] [--devices 20] [--unchanged 40]

Each device is calibrated as it is; a fresh calibration after all three moved is what `--update` is held
against: mean errors of the compensated pulses normal and bifid, % of full force.
"""

from __future__ import annotations

import argparse

import numpy as np

import pulsetrainer as pt
from pulsetrainer.errors import DataError
from pulsetrainer.steps.check import updated

MOVED = {
    "zero": "&condition-offset=0.3",
    "gain": "&condition-gain=0.05",
    "room": "&ambient=20",
    "all": "&condition-offset=-0.3&condition-gain=-0.05&ambient=-20",
}


def calibrated(port: str):
    """Return the model of a device."""
    with pt.open_device(port) as device:
        return pt.identify(pt.capture("identification", device))


def error_percent(model, port: str) -> float:
    """Mean error of the compensated pulses."""
    with pt.open_device(port) as device:
        played = [pt.play(pt.invert(name, model), device, repeats=2) for name in ("normal", "bifid")]
    return float(
        np.mean([pt.evaluate(one).waveforms[0].compensated.mean_abs_error_percent for one in played])
    )


def main() -> None:
    """Print a line for each device, and the counts."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=21)
    parser.add_argument("--devices", type=int, default=20)
    parser.add_argument("--unchanged", type=int, default=40)
    asked = parser.parse_args()
    right = dict.fromkeys(MOVED, 0)
    calm = refused = 0
    ratios = []
    for number in range(asked.unchanged):
        port = f"bench:?seed={asked.first + number}"
        model = calibrated(port)
        with pt.open_device(f"{port}&noise-seed=7") as device:
            found = pt.check(model, device)
        calm += found.verdict == "true"
        line = [f"{asked.first + number:4d} unchanged {found.verdict}"]
        if number < asked.devices:
            for kind, moved in MOVED.items():
                with pt.open_device(f"{port}&noise-seed=7{moved}") as device:
                    found = pt.check(model, device)
                right[kind] += found.verdict == "shifted"
                line.append(f"{kind} {found.verdict}")
            there = f"{port}&noise-seed=9{MOVED['all']}"
            pair = error_percent(updated(model, found), there), error_percent(calibrated(there), there)
            ratios.append(pair[0] / pair[1])
            line.append(f"updated {pair[0]:.3f} % fresh {pair[1]:.3f} %")
            inside = f"seed={asked.first + number + 1000}&serial={asked.first + number}"
            with pt.open_device(f"bench:?{inside}") as device:
                other = pt.check(model, device)
            try:
                updated(model, other)
            except DataError:
                refused += 1
            line.append(f"another density {other.verdict} ({other.shape_percent.value:.1f} %)")
        print(", ".join(line), flush=True)
    print(
        f"unchanged: {calm} of {asked.unchanged} true; shifted of {asked.devices}: {right}; "
        f"another density refused: {refused}; updated at most {max(ratios):.2f} of fresh, "
        f"in the mean {np.mean(ratios):.2f}"
    )


if __name__ == "__main__":
    main()
