"""A fast sample of the blind grid: what is hidden is compared only after the verdict is in."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import judge

pytestmark = pytest.mark.timeout(600)


@pytest.mark.parametrize("name", ["output-lag", "creep", "periodic", "saturation"])
def test_a_single_hidden_cause_is_named(name):
    """The name, its main parameter within a tenth, and a gain on held-out blocks."""
    verdict = judge.judge(f"single:{name}", 4242)
    assert verdict.verdict == name, verdict
    assert all(error < 0.12 for error in verdict.errors.values()), verdict
    if name != "saturation":
        assert verdict.held_out > 80


def test_controls_do_not_alarm():
    """Nothing hidden, nothing named."""
    for seed in (4242, 4243):
        verdict = judge.judge("control", seed)
        assert verdict.verdict == "none", verdict
        assert verdict.found == ()


def test_what_the_library_does_not_hold_is_unknown():
    """No confident wrong name."""
    verdict = judge.judge("unknown", 4242)
    assert verdict.verdict == "unknown", verdict
