"""Two records of one input: what is left in both is the device's, what differs comes from elsewhere."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.diagnosis import equal_inputs
from pulsetrainer.diagnosis.equal_inputs import _aligned, common

RATE_HZ, RADII = 100.0, np.linspace(0.02, 0.4, 6)
AGAIN, DIFFERS = "is the same", "differs"


@given(st.integers(0, 1000), st.floats(0.0, 1.0))
def test_the_common_share_of_two_residuals_is_found_beneath_noise(seed, share):
    """Of powers: ``share`` of what is more than noise is in both."""
    rng = np.random.default_rng(seed)
    both, one, other = rng.standard_normal((3, 4000))
    first, second = (np.sqrt(share) * both + np.sqrt(1 - share) * own for own in (one, other))
    noise = 0.5 * rng.standard_normal((2, 4000))
    assert common(first + noise[0] + 3.0, second + noise[1] - 2.0, 0.5) == pytest.approx(share, abs=0.12)


@given(st.integers(0, 1000), st.integers(-40, 40))
def test_records_that_begin_at_other_times_are_laid_over_each_other(seed, late):
    """To the sample, with nothing left over."""
    u = np.cumsum(np.random.default_rng(seed).standard_normal(400))
    first, second = (u[late:], u) if late >= 0 else (u, u[-late:])
    one, other = _aligned(first, second)
    np.testing.assert_array_equal(first[one], second[other])
    assert first[one].size == min(first.size, second.size)


def _plays(u: np.ndarray) -> np.ndarray:
    at, found = np.zeros(RADII.size), []
    for value in u.tolist():
        at = np.clip(at, value - RADII, value + RADII)
        found.append(at.mean())
    return np.asarray(found)


def _recorded(u: np.ndarray, seed: int, gain: np.ndarray | float = 1.0, *, branches: bool = False) -> pt.Run:
    """Return a run of plays, or of branches without any memory of their own, with a gain that changes."""
    slow = np.convolve(np.sign(np.gradient(u)), np.ones(15) / 15, "same")
    y = gain * (np.tanh(4.0 * (u - 0.5 - 0.1 * slow)) if branches else _plays(u))
    noise = np.random.default_rng(seed).standard_normal(u.size)
    return pt.Run(np.arange(u.size) / RATE_HZ, u, y + 0.002 * np.ptp(y) * noise)


@pytest.mark.slow
@pytest.mark.parametrize(("branches", "said"), [(True, AGAIN), (False, DIFFERS)])
def test_a_device_that_does_the_same_again_is_told_from_one_on_which_something_acts(branches, said):
    """Loops that no Preisach model has, the same twice; a gain that a hidden temperature changes."""
    u = excitations.diagnostic(0.0, 1.0, rate_Hz=RATE_HZ).value[:6000]
    rng = np.random.default_rng(7)
    courses = [
        1.0
        if branches
        else 1.0 + 0.05 * np.interp(np.arange(u.size), np.arange(0, 6600, 300), rng.normal(0, 1, 22))
        for _ in range(2)
    ]
    runs = [_recorded(u, k, gain, branches=branches) for k, gain in enumerate(courses)]
    found = pt.diagnose(runs, pt.identify(runs[0]))
    told = [one for one in found.evidence if "In two of these recordings" in one]
    assert found.verdict == "unknown"
    assert len(told) == 1
    assert said in told[0].split("what is left ")[1]
    alone = pt.diagnose(runs[0], pt.identify(runs[0]))
    assert not any("In two of these recordings" in one for one in alone.evidence)


def test_what_a_doubtful_cause_would_explain_is_left_too(monkeypatch):
    """A zero that wandered was a step in doubt, and the advice was to record the same again, for ever."""
    rng = np.random.default_rng(2)
    shared = {
        "problem": SimpleNamespace(records=(1, 2)),
        "question": SimpleNamespace(quick=False),
        "floor": SimpleNamespace(quick=SimpleNamespace(white=0.0)),
    }
    believed = SimpleNamespace(**shared, unexplained=True, left=rng.standard_normal((2, 400)))
    state = SimpleNamespace(**shared, unexplained=False, left=np.zeros((2, 400)), believed=believed)
    monkeypatch.setattr(equal_inputs, "_pairs", lambda asked: [(0.0, *asked.left)])
    assert [one.kind for one in equal_inputs.told(state)] == [equal_inputs.DIFFERS]
