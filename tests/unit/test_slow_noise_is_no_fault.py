"""A drift or step of the measurement no larger than slow noise beside it is told, and is no verdict."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.diagnosis.causes.base import Frame
from pulsetrainer.diagnosis.causes.offset_drift import OffsetDrift
from pulsetrainer.diagnosis.causes.step import Step
from pulsetrainer.diagnosis.causes.thermal_drift import ThermalDrift
from pulsetrainer.diagnosis.floor import Floor

DT, COUNT = 0.01, 4000
LOOPS = 0.5 - 0.5 * np.cos(2.0 * np.pi * DT * np.arange(COUNT))
FRAME = Frame(DT, LOOPS, span=3.0, reach=1.0, ends=(-1.0, 2.0), zero=0.5)


def _floor(quick: float, slow: float) -> Floor:
    """Noise of two kinds, rms."""
    return Floor(COUNT, 3.0, quick, float(np.hypot(quick, slow)), sampled=quick**2)


@given(st.floats(1e-3, 10.0), st.floats(1e-3, 10.0), st.sampled_from([0.99, 1.01]))
def test_the_rms_of_what_moved_decides(quick, size, times):
    """A ramp of size b has rms b / sqrt 12 about its mean, a step in the middle b / 2."""
    end = DT * (COUNT - 1)
    drift, step = (size / end, 0.0), (size, 0.0, end / 2.0)
    for cause, values, rms in ((OffsetDrift(), drift, size / 12**0.5), (Step(1.0), step, size / 2.0)):
        floor = _floor(quick, times * rms)
        assert cause.is_background(values, floor, [FRAME]) is (times > 1.0)


def test_a_change_of_the_gain_moves_the_output_about_its_zero():
    """Half of the time 10 % more of an output that swings from -1 to 2 about 0.5, as a sine does."""
    rms = 0.1 * 1.5 / 2.0**0.5 / 2.0**0.5
    for times in (0.99, 1.01):
        values = (0.0, 0.1, 0.5 * DT * COUNT)
        assert Step(1.0).is_background(values, _floor(0.01, times * rms), [FRAME]) is (times > 1.0)


def test_white_noise_hides_no_fault_and_the_device_is_never_noise():
    """Nothing is background where noise is quick, however small; heat is a property of the device."""
    assert not OffsetDrift().is_background((1e-9, 0.0), _floor(1.0, 0.0), [FRAME])
    assert not ThermalDrift().is_background((1e-9, 1.0), _floor(1.0, 1.0), [FRAME])


@pytest.mark.parametrize("cause", [OffsetDrift(), Step()])
def test_it_is_told_in_words(cause):
    """What stands in the account of a verdict."""
    assert "no larger than the slow noise" in cause.texts["background"]
