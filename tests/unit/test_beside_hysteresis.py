"""What a calibration took for hysteresis: all that is, and a lag as far as the pace is the same."""

from __future__ import annotations

import numpy as np
import pytest

from pulsetrainer.core import excitations
from pulsetrainer.core.beside_hysteresis import LEVELS, missed
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane

PLANE = Plane.uniform(0.0, 1.5, LEVELS)
RATE_HZ = 200.0
SLOW = excitations.identification(0.0, 1.5, n_h=24, speed=0.75, rate_Hz=RATE_HZ).value


def loops(speed: float):
    """Current (n,) of loops that cross the plane."""
    return excitations.through(np.asarray([0, 1.5, 0, 1.1, 0.15, 1.4, 0.5, 1.3, 0.0]), speed, RATE_HZ)


def test_nothing_is_missed_of_an_operator():
    """One with a density of either sign, on fewer levels, and a constant: all is taken for hysteresis."""
    coarse = Plane.uniform(0.0, 1.5, LEVELS // 2)
    weights = np.random.default_rng(3).normal(size=coarse.n_q)
    effect = Preisach(coarse, weights, 0.4, signed=True)
    now = loops(1.5)
    left = missed(PLANE, SLOW, effect(SLOW)[:, None], now, effect(now)[:, None])
    assert np.abs(left).max() < 2e-3 * np.ptp(effect(now))


@pytest.mark.parametrize(("times", "share"), [(1.0, 0.0), (2.0, 0.5), (4.0, 0.75)])
def test_a_lag_is_missed_as_far_as_the_pace_is_another(times, share):
    """At the calibration's own pace it is a wider loop; at twice the pace half of it was not seen before."""
    now = loops(0.75 * times)
    then, effect = (np.gradient(u, 1.0 / RATE_HZ) for u in (SLOW, now))
    left = missed(PLANE, SLOW, then[:, None], now, effect[:, None])[:, 0]
    turned = np.flatnonzero(np.diff(np.sign(np.diff(now)))) + 1
    since = np.arange(now.size)[:, None] - turned
    cells = 2 * PLANE.high / LEVELS  # what lies on a cell that a turn cuts is another matter
    away = np.all((since < 0) | (since > cells / (0.75 * times) * RATE_HZ), axis=1)
    assert left[away] @ effect[away] / (effect[away] @ effect[away]) == pytest.approx(share, abs=1.5 / LEVELS)
