"""Heat that lowers the gain, and moves the zero as well: told apart by the noise alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

import pulsetrainer as pt

STEP_S, TAU_S, LOST, MOVED = 0.02, 14.0, 0.10, 0.08


def _record(rng: np.random.Generator, moved: float) -> pt.Run:
    """Twelve plays, driven from -1 to 1 at three rates with rests; cold at 0, where it begins."""
    turns, u = [0.0, *rng.uniform(-1, 1, 140)], [0.0]
    turns[1::7] = [(-1.0) ** k for k in range(len(turns[1::7]))]
    for one, other in pairwise(turns):
        count = max(2, int(abs(other - one) / rng.choice([0.4, 1.5, 5.0]) / STEP_S))
        u += [
            *np.linspace(one, other, count + 1)[1:],
            *[other] * (int(rng.integers(50, 250)) * (rng.random() < 0.1)),
        ]
    u = np.asarray(u)
    radii, y = np.linspace(0.02, 0.6, 12), 0.5 * u
    shares = np.random.default_rng(1).uniform(0.3, 1.0, 12)  # the same device
    for radius, share in zip(radii, shares / shares.sum(), strict=True):
        at = 0.0
        play = [at := min(max(at, x - radius), x + radius) for x in u.tolist()]
        y = y + share * np.asarray(play)
    keep = np.exp(-STEP_S / TAU_S)
    heat = signal.lfilter([1.0 - keep], [1.0, -keep], u**2)
    y = y * (1.0 - LOST * heat) + moved * heat
    noisy = y + 0.002 * np.ptp(y) * rng.standard_normal(u.size)
    return pt.Run(time_s=STEP_S * np.arange(u.size), input=u, output=noisy)


@pytest.mark.slow
@pytest.mark.parametrize("moved", [0.0, MOVED])
def test_a_zero_that_heat_moves_is_found_only_where_it_moves(moved):
    """The loss, the time constant and the shift lie within their intervals, or there is no shift."""
    run = _record(np.random.default_rng(3), moved)
    model = pt.identify(run)
    found = pt.diagnose(run, model)
    assert found.verdict == "thermal-drift", found
    told = {p.name: p for p in found.found[0].parameters}
    truth = {"coefficient": LOST, "tau": TAU_S} | ({"shift": moved} if moved else {})
    assert {name for name in told if name != "cold"} == set(truth)
    for name, value in truth.items():
        assert told[name].lower <= value <= told[name].upper, (name, told[name])
    assert found.extended is not None
    unseen = _record(np.random.default_rng(4), moved)
    plain, extended = pt.evaluate(unseen, [model, found.extended]).models
    assert plain.rms_percent > 0.25
    assert extended.rms_percent < 0.21  # the noise is 0.2 %
