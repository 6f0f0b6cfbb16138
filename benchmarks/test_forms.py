"""What the choice of the form costs: identify with `--form auto` against `--form direct`, in turns."""

from __future__ import annotations

import form_devices as devices
import measuring
import numpy as np
import pytest

import pulsetrainer as pt

SEEDS = (1000, 1001, 1002)  # a plane, a sum of plays, a falling loop
MOST = 1.6


def record(seed: int, samples: int) -> pt.Run:
    """Return the record of a direct device, with noise of 0.3 % of the span."""
    rng = np.random.default_rng(seed)
    device = devices.DIRECT[seed % len(devices.DIRECT)](rng)
    u = devices.record(rng, samples)
    y = device(u)
    y = y + rng.normal(0.0, 0.003 * float(np.ptp(y)), u.size)
    return pt.Run(time_s=np.arange(u.size) / 1000.0, input=u, output=y)


@pytest.mark.parametrize("samples", [3000, 20_000])
def test_auto_costs_little(table, samples):
    """At most 1.6 times the time of the direct form, on direct devices."""
    ratios, own, plain = [], [], []
    for seed in SEEDS:
        run = record(seed, samples)
        times = measuring.taking_turns(
            lambda run=run: pt.identify(run, form="direct"), lambda run=run: pt.identify(run), rounds=3
        )
        ratios.append(times.ratio)
        own.append(times.baseline)
        plain.append(times.ours)
    table.add(
        f"identify, form auto, {samples} samples",
        ours=f"{np.mean(own):.2f} s",
        baseline=f"{np.mean(plain):.2f} s, form direct",
        figure=f"worst {max(ratios):.2f} times",
        bar=f"{MOST} times",
    )
    assert max(ratios) <= MOST
