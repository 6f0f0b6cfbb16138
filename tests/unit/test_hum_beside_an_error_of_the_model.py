"""A hum in a device that no Preisach operator describes: a line, though more is left than it explains."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.design import bins_of

RATE_HZ, HUM_HZ, HUM = 1000.0, 50.0, 0.05


def _strain(u: np.ndarray) -> np.ndarray:
    """A butterfly by Duhem's rule: strain (n,) of a polarisation that follows a field (n,)."""
    p, found = -0.3, []
    for before, now in pairwise(u):
        way = np.sign(now - before)
        rest = max(0.0, way * (0.3 * np.tanh((now - 0.8 * way) / 0.35) - p)) * way
        p += abs(now - before) * 3.2 * rest + 0.02 * (now - before)
        found.append(30.0 * p**2)
    return np.asarray([found[0], *found])


def _run(hum: float) -> pt.Run:
    legs = [(3.0, 0.0), (1.0, 1.0), (1.0, 0.0), (1.0, 1.0)]  # seconds, share of the range
    legs += [leg for k in range(1, 21) for leg in ((k / 20, 1 - k / 20), (k / 20, 1.0))]
    legs += [(1.0, 0.0)]
    legs += [
        (way / r, to) for r in (1, 4, 0.25, 2, 0.5) for way, to in ((0.6, 0.6), (0.3, 0.3), (0.7, 1), (1, 0))
    ]
    legs += [leg for level in (0.3, 0.7, 1, 0.6, 0.2, 0) for leg in ((0.5, level), (3.0, level))]
    times = np.cumsum([0.0, *(seconds for seconds, _ in legs)])
    t = np.arange(0.0, times[-1], 1.0 / RATE_HZ)
    u = -2.0 + 4.0 * np.interp(t, times, [0.0, *(share for _, share in legs)])
    noise = np.random.default_rng(5).standard_normal(t.size)
    y = _strain(u) + 0.012 * noise + hum * np.sin(2 * np.pi * HUM_HZ * t + 0.4)
    return pt.Run(time_s=t, input=u, output=y, input_unit="kV/mm", output_unit="1")


@pytest.mark.parametrize(("hum", "finer"), [(0.0, False), (HUM, True)])
def test_averages_do_not_hide_a_hum(hum, finer):
    """Long averages would hold whole periods of it; of the same record without a hum they may be long."""
    t = np.arange(40_000) / 2000.0
    u = np.abs(t % 2.0 - 1.0)
    y = u + 0.01 * np.random.default_rng(1).standard_normal(t.size) + hum * np.sin(2 * np.pi * 300.0 * t)
    bins = bins_of([Record(u, y, dt_s=1.0 / 2000.0)])
    assert (bins.count > 0.3 * t.size) is finer


@pytest.mark.slow
def test_a_hum_is_named_with_its_size_beside_a_larger_error_of_the_model():
    """It is no sticking, and nothing else is as good; without it nothing of the kind is found."""
    found = {}
    for hum in (0.0, HUM):
        run = _run(hum)
        diagnosis = pt.diagnose(run, pt.identify(run))
        found[hum] = {one.cause: one for one in diagnosis.causes if one.found}
    assert not {"periodic", "stick-slip"} & set(found[0.0])
    periodic = found[HUM]["periodic"]
    values = {one.name: one.value for one in periodic.parameters}
    assert values["frequency"] == pytest.approx(HUM_HZ, abs=0.05)
    assert np.hypot(values["sine"], values["cosine"]) == pytest.approx(HUM, rel=0.1)
    assert not periodic.confounded_with
    assert "stick-slip" not in found[HUM]
