"""Heat without a force sensor: minutes of pulses in a room that nobody told of, with and without tracking.

    python benchmarks/heat.py [--first 1] [--devices 10] [--minutes 15] [--figure heat.svg]

Each device is calibrated and diagnosed at 0 K; then it plays at 0 K as it was calibrated, and in its room,
without and with tracking. The rooms spread over -20 to 20 K: as many equal parts of it as there are devices,
one drawn from each. The true temperature is that of the simulated copper; the figure shows it beside the one
that the last device told.
"""

from __future__ import annotations

import argparse
from contextlib import suppress

import numpy as np
import scipy.signal
from matplotlib.figure import Figure

import pulsetrainer as pt
from pulsetrainer.core.rhythm import Rhythm
from pulsetrainer.errors import DeviceError
from pulsetrainer.files.pulses import read_pulse
from pulsetrainer.report.panels import temperature
from pulsetrainer.steps.programme import Programme
from pulsetrainer.steps.session import InMemory, perform
from pulsetrainer.steps.stopped import raise_if_stopped

DRIFT_PER_A2, TAU_S = 0.006, 20.0  # of the as-built bench
COPPER_PER_K = 0.0039
NAMES = ("normal", "bifid")
_ATTEMPTS = 8


def again(attempt):
    """Return what an attempt gives; one that ends because the computer was busy for seconds is made again."""
    for _ in range(_ATTEMPTS - 1):
        with suppress(DeviceError):
            return attempt()
    return attempt()


def captured(signal: str, port: str):
    """Return what a cold device gives for a signal."""
    with pt.open_device(port) as device:
        return pt.capture(signal, device)


def calibrated(port: str):
    """Return the extended model of a device, as it is at calibration."""
    model = pt.identify(again(lambda: captured("identification", port)))
    found = pt.diagnose([again(lambda: captured("diagnostic", port))], model)
    return pt.extend(model, found)


def played(model, port: str, minutes: float, *, track: bool, ambient: float):
    """Mean error in %; where heat is tracked also the temperature: time in s, told and true in K, (w,)."""
    done, sink = again(lambda: pressed(model, port, minutes, track=track))
    error = done.figures["mean_abs_error_percent"]
    if not track:
        return error, None
    time_s, _, _, current, _ = np.concatenate(sink.blocks, axis=1)
    share = -np.expm1(-1e-3 / TAU_S)
    heat = scipy.signal.lfilter([share], [1.0, share - 1.0], current**2)
    told_s, told = done.temperature_s, done.temperature_K
    own = 2 * DRIFT_PER_A2 * np.interp(told_s - 0.5, time_s, heat) / COPPER_PER_K
    return error, (told_s, told, own + ambient)


def pressed(model, port: str, minutes: float, *, track: bool):
    """Press the pulses of ``NAMES``, each for half of the time; how it went, and what was measured."""
    programme, sink = Programme(NAMES, minutes=minutes), InMemory()
    with pt.open_device(port) as device:
        done = perform(
            model,
            device,
            [read_pulse(name) for name in NAMES],
            programme,
            sink,
            rhythm=Rhythm(0.0, 0.0, 0.0, 0),
            rates=programme.rates,
            track_heat=track,
        )
    raise_if_stopped(done.fault, done.remedy, "the session")
    return done, sink


def rooms(first: int, devices: int):
    """Temperature of each device's room in K: drawn from a part of -20 to 20 K of its own, in drawn order."""
    rng = np.random.default_rng(first)
    return -20.0 + 40.0 * (rng.permutation(devices) + rng.uniform(size=devices)) / devices


def main() -> None:
    """Print a line for each device, and the worst."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--devices", type=int, default=10)
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--figure", help="file for the last device's temperature, true and told")
    asked = parser.parse_args()
    rows = []
    for seed, ambient in enumerate(rooms(asked.first, asked.devices), asked.first):
        port = f"bench:?seed={seed}"
        model = calibrated(port)
        room = f"{port}&ambient={ambient:.2f}"
        fresh, _ = played(model, port, asked.minutes, track=False, ambient=0.0)
        without, _ = played(model, room, asked.minutes, track=False, ambient=ambient)
        tracked, warmth = played(model, room, asked.minutes, track=True, ambient=ambient)
        off = float(np.abs(warmth[1] - warmth[2]).max())
        rows.append((fresh, without, tracked, off))
        terms = ", ".join(one.cause for one in model.extensions)
        print(
            f"{seed:4d} {ambient:+6.1f} K  fresh {fresh:.3f} %  without {without:.3f} %  "
            f"tracked {tracked:.3f} % ({tracked / fresh:.2f} of fresh)  within {off:.2f} K  ({terms})",
            flush=True,
        )
    if asked.figure:
        axes = (figure := Figure(figsize=(6.4, 2.6), layout="constrained")).subplots()
        temperature(axes, *warmth)
        figure.savefig(asked.figure)
    table = np.array(rows)
    ratio = table[:, 2] / table[:, 0]
    print(
        f"{len(rows)} devices: tracked at most {ratio.max():.2f} of fresh (mean {ratio.mean():.2f}), without "
        f"{(table[:, 1] / table[:, 0]).max():.1f}; temperature within {table[:, 3].max():.2f} K"
    )


if __name__ == "__main__":
    main()
