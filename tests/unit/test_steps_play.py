"""What a play would be, told before anything moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import store_examples as examples

from pulsetrainer.errors import PulsetrainerError
from pulsetrainer.steps.play import plan


def test_the_plan_of_a_play():
    """Both drives take turns: twice the repeats; the largest and the rms current are of both."""
    time = np.arange(400) / 1000.0
    compensated, scaled = 0.3 + 0.2 * np.sin(20.0 * time), np.linspace(0.0, 0.8, 400)
    drive = replace(
        examples.waveform(400), time_s=time, compensated=compensated, scaled=scaled, clipped_samples=0
    )
    planned = plan(drive, repeats=3)
    assert (planned.samples, planned.rate_Hz) == (400, pytest.approx(1000.0))
    assert planned.seconds == pytest.approx(0.4 * 3 * 2)
    assert planned.peak_current_A == pytest.approx(0.8)
    both = np.concatenate((compensated, scaled))
    assert planned.rms_current_A == pytest.approx(np.sqrt(np.mean(both**2)))


def test_no_repeat_is_no_play():
    """Refused before a device is opened."""
    with pytest.raises(PulsetrainerError) as caught:
        plan(examples.waveform(400), repeats=0)
    assert caught.value.exit_code == 3
