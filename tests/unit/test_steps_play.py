"""What a play would be, told before anything moves."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import report_examples
import store_examples as examples

import pulsetrainer as pt
from pulsetrainer.errors import DataError, PulsetrainerError
from pulsetrainer.report.planned import to_be_played
from pulsetrainer.report.results import inverted
from pulsetrainer.steps.own_device import check_units
from pulsetrainer.steps.play import ErrorsSoFar, plan

KEPT = Path(__file__).parents[1] / "data" / "files-0.1"


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


def test_a_small_pulse_is_told_with_the_strokes_before_it():
    """They go around the major loop: a drive of 3 N begins with the largest force of the device."""
    model = pt.load(KEPT / "model.h5")
    drive = pt.invert("normal", model, force_min=2.0, force_max=3.0)
    largest = float(model.predict(np.asarray([0.0, model.edges[-1]]), 0.001)[-1])
    planned = plan(drive, repeats=1)
    assert (planned.pulse_force_N, planned.peak_force_N) == pytest.approx((3.0, largest), rel=1e-3)
    assert f"{largest:.2f} N at most" in to_be_played(planned, 1)["force"]
    payload, _, rows = inverted(Path("drive.h5"), drive)
    assert payload["predicted_peak"] == planned.peak_force_N
    assert (
        rows["force"]
        == f"2.000 .. 3.000 N; up to {largest:.3f} N in the strokes before the pulse, by the model"
    )
    hundredfold = replace(drive, target=100.0 * drive.target, predicted=100.0 * drive.predicted)
    words = inverted(Path("drive.h5"), hundredfold)[2]["force"]
    assert words.startswith(f"200 .. 300 N; up to {100.0 * largest:.4g} N in the strokes")
    whole = pt.invert("normal", model)
    assert "before" not in inverted(Path("drive.h5"), whole)[2]["force"]


@pytest.mark.parametrize("units", [("V", "N"), ("A", "mT")])
def test_a_drive_of_another_device_is_not_played(units):
    """Nor refined: 9 mT were pressed as 9 N."""
    drive = replace(examples.waveform(400), input_unit=units[0], output_unit=units[1])
    for verb in (partial(plan, repeats=1), check_units):
        with pytest.raises(DataError, match=f"takes {units[0]} and gives {units[1]}"):
            verb(drive)


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
