"""What a play would be, told before anything moves."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import report_examples
import store_examples as examples

from pulsetrainer.errors import PulsetrainerError
from pulsetrainer.steps.play import ErrorsSoFar, plan


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


@pytest.mark.parametrize("pieces", [1, 3, 40])
def test_errors_so_far_are_those_of_all_that_was_played(pieces):
    """Drive by drive, of the scored samples that came, in any pieces; beyond the drive nothing counts."""
    drive = report_examples.waveform()
    rng = np.random.default_rng(pieces)
    place = np.arange(drive.time_s.size + 20)
    so_far, expected = ErrorsSoFar(drive), []
    for name, size in (("one", 0.3), ("other", 2.0)):
        force = np.append(drive.target, np.full(20, 99.0)) + size * rng.standard_normal(place.size)
        force[::7] = np.nan
        for part in np.array_split(place, pieces):
            so_far.add(name, part, force[part])
        error = 100.0 * np.abs(force[: drive.time_s.size] - drive.target)[drive.scored] / drive.full_force
        expected += [np.nanmean(error), np.nanmax(error)]
    told = [float(number) for number in re.findall(r"([0-9.]+) %", str(so_far))]
    np.testing.assert_allclose(told, expected, atol=0.051)
