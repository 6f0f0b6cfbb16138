"""A pinched loop, such as that of a memristor, is no loop of a Preisach operator, and is said not to be."""

from __future__ import annotations

import numpy as np
import pytest
from form_devices import play

import pulsetrainer as pt
from pulsetrainer.diagnosis.pinched import crosses, pinched_at


def _sines(rate_Hz: float = 100.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and sines, -1 to 1, at three rates one after another (4000,)."""
    time = np.arange(4000) / rate_Hz
    rate = np.choose((3 * time / 40.0).astype(int), [0.3, 0.9, 1.8])
    return time, np.sin(2 * np.pi * np.cumsum(rate) / rate_Hz)


def _memristor(u: np.ndarray, dt_s: float, speed: float = 4.0) -> np.ndarray:
    """Current i = u / (w + 8 (1 - w)), w' = speed i (1 - (w - [i < 0])^2): linear drift, Biolek's window."""
    w, out = 0.3, np.empty_like(u)
    for k, one in enumerate(u.tolist()):
        current = one / (w + 8.0 * (1.0 - w))
        w = min(max(w + dt_s * speed * current * (1.0 - (w - (current < 0)) ** 2), 0.0), 1.0)
        out[k] = current
    return out


@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_the_point_is_found_wherever_it_is(offset):
    """At no input: in the middle of an even range, beside it where the input is not even."""
    time, u = _sines()
    y = _memristor(u + offset, float(time[1]))
    level = (u + 1.0) / 2.0
    assert pinched_at(level, y, 0.0) == pytest.approx((1.0 - offset) / 2.0, abs=0.02)


@pytest.mark.parametrize("device", ["plays", "a line", "noise", "saturated"])
def test_other_loops_are_not_pinched(device):
    """A Preisach loop is wide within; one that closes at its ends, or nowhere opens, is not pinched."""
    _, u = _sines()
    noise = 1e-3 * np.random.default_rng(0).standard_normal(u.size)
    y = {
        "plays": lambda: play(u, np.array([0.1, 0.3])).sum(axis=1),
        "a line": lambda: u + u**3,
        "noise": lambda: u + 10 * noise,
        "saturated": lambda: np.tanh(6 * play(u, np.array([0.1]))[:, 0]),
    }[device]()
    assert pinched_at((u + 1.0) / 2.0, y + noise, 1e-3) is None


@pytest.mark.parametrize(
    ("at", "inside"), [(0.03, False), (0.09, False), (0.11, True), (0.89, True), (0.97, False)]
)
def test_the_tip_of_a_loop_is_no_such_point(at, inside):
    """Every loop closes there: a device that wandered was told to be a memristor at 3 % of its range."""
    level = np.tile(np.concatenate([np.linspace(0.0, 1.0, 2000), np.linspace(1.0, 0.0, 2000)]), 3)
    branch = np.sign(np.gradient(level))
    found = pinched_at(level, level + 0.05 * branch * (np.abs(level - at) > 0.012), 0.0)
    assert found == (pytest.approx(at, abs=0.01) if inside else None)


def test_a_butterfly_crosses_itself():
    """A strain that goes with the square of what lags: it was called a memristor."""
    time, u = _sines()
    level = (u + 1.0) / 2.0
    strain, current = play(u, np.array([0.3]))[:, 0] ** 2, _memristor(u, float(time[1]))
    assert pinched_at(level, strain, 0.0) == pytest.approx(0.5, abs=0.02)
    assert crosses(level, strain, 0.5)
    assert not crosses(level, current, 0.5)
    assert not crosses(level, strain, None)


@pytest.mark.slow
def test_a_memristor_is_not_described_by_any_cause():
    """A cause that happens to explain half of it was the verdict; now it is said what the loop is."""
    time, u = _sines()
    noise = 1e-3 * np.random.default_rng(1).standard_normal(u.size)
    run = pt.Run(time_s=time, input=u, output=_memristor(u, 0.01) + noise, input_unit="V", output_unit="A")
    found = pt.diagnose(run, pt.identify(run))
    assert found.verdict == "unknown"
    assert not found.whole
    assert any("pass through one point" in one for one in found.evidence)
