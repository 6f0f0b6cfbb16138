"""The artefacts themselves: what they check, and what they say of themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import demo
import numpy as np
import pytest
import report_examples
import store_examples as examples

from pulsetrainer.artefacts import Model, ModelEvaluation, Run, Waveform
from pulsetrainer.artefacts.data import LARGEST, beyond_all_quantities
from pulsetrainer.artefacts.evaluation import PUBLISHED
from pulsetrainer.artefacts.time_steps import steps_of
from pulsetrainer.core.record import Record
from pulsetrainer.errors import DataError
from pulsetrainer.files.store import read

FOLDER = Path(__file__).parents[1] / "data/files-0.1"


def _seams(*places: int) -> np.ndarray:
    return np.isin(np.arange(50), places)


def test_lost_samples_leave_the_ranges_of_a_run_known():
    """As text it says from where to where the others go."""
    run = examples.run(50)
    lost = np.where(np.arange(50) == 7, np.nan, run.output)
    assert "nan" not in str(replace(run, output=lost))
    assert "no samples" in str(replace(run, output=np.full(50, np.nan)))


def test_parts_of_a_run_lie_between_its_seams():
    """A seam is the first sample after a pause; the parts together are the run, and have no seam."""
    run = examples.run(50, seam=_seams(10, 30))
    parts = run.parts()
    assert [part.input.size for part in parts] == [10, 20, 20]
    assert [part.time_s[0] for part in parts] == pytest.approx(run.time_s[[0, 10, 30]], abs=0)
    for name in ("time_s", "input", "output", "reference"):
        whole = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(whole, getattr(run, name))
    assert all(part.seam is None for part in parts)
    assert [part.input.size for part in run.parts(11)] == [20, 20]
    assert run.parts(51) == (run,)
    assert [part.input.size for part in examples.run(50, seam=_seams(10, 11)).parts()] == [10, 1, 39]
    for whole in (examples.run(50), examples.run(50, seam=_seams())):
        assert whole.parts() == (whole,)


def test_arrays_along_time_have_one_length():
    """Which array is how long is said."""
    with pytest.raises(DataError) as caught:
        Run(np.arange(3.0), np.zeros(3), np.zeros(2))
    assert "output has 2" in str(caught.value)


def test_time_that_is_none_is_found_at_its_first_sample():
    """Not a number, and not increasing."""
    for bad, sample in ((np.nan, "sample 3"), (-1.0, "sample 3"), (2.0, "sample 3"), (1.5, "sample 3")):
        time = np.arange(8.0)
        time[[3, 5]] = bad
        with pytest.raises(DataError) as caught:
            Run(time, np.zeros(8), np.zeros(8))
        assert sample in str(caught.value)


def test_the_median_step_of_a_run():
    """Of a run with a time, and of two samples at least."""
    assert examples.run(50).dt_s == pytest.approx(1e-3)
    assert examples.run(50, time_s=None).dt_s is None
    assert examples.run(1).dt_s is None


def test_what_nobody_says_is_nothing():
    """An artefact that is made with the least of arguments has lost nothing and changed nothing."""
    assert (examples.run().dropped_samples, examples.run().complete) == (0, True)
    drive = examples.waveform()
    assert (drive.kept, drive.passes, drive.notes, drive.model) == (0, (), (), None)
    played = examples.playback()
    assert (played.dropped_samples, played.complete, played.fault) == (0, True, "")
    session = examples.session()
    assert (session.dropped_samples, session.complete, session.fault) == (0, True, "")
    assert (session.underruns, session.clipped_samples, session.notes) == (0, 0, ())
    fit = read(FOLDER / "model.h5", Model).fit  # its file has none of these
    assert (fit.masked_samples, fit.false_reversals, fit.stiffness, fit.offsets) == (0, 0, 0.0, ())
    assert (fit.spacing, fit.warning, fit.loop, fit.notes) == ("even", "", "", ())
    assert np.isnan([fit.input_noise, fit.minor_percent]).all()


@pytest.mark.parametrize(
    ("correctable", "extends", "command"),
    [
        ((), True, "extend"),
        ((), False, ""),
        (("output-lag",), True, "correct"),  # the verdict is one of the measurement
        (("periodic",), True, "extend"),
        (("periodic",), False, "correct"),
    ],
)
def test_what_to_do_about_a_diagnosis(correctable, extends, command):
    """Faults of the measurement first, where the verdict is one or nothing else helps."""
    found = replace(examples.diagnosis(), correctable=correctable)
    assert (found if extends else replace(found, extended=None)).next_command == command


def test_steps_are_even_within_two_percent_and_gaps_count_apart():
    """A step of half as much again is a gap, a bit less is an uneven step."""
    even = np.arange(100.0)
    assert steps_of(even) == (steps_of(even + 1e3)) == type(steps_of(even))(1.0, 1.0, 1.0, 0, 0.0)
    for longer, is_even in ((0.019, True), (0.021, False), (-0.019, True), (-0.021, False)):
        assert steps_of(even + np.where(even > 50, longer, 0.0)).even == is_even
    pause = even + np.where(even > 50, 0.51, 0.0) + np.where(even > 70, 0.49, 0.0)
    found = steps_of(pause)
    assert (found.gaps, found.longest_gap, found.longest) == (1, pytest.approx(1.51), pytest.approx(1.49))
    many = steps_of(np.concatenate((np.arange(300_000.0), [300_007.0, 300_010.0])))
    assert (many.gaps, many.longest_gap, many.median, many.shortest) == (2, 8.0, 1.0, 1.0)


@pytest.mark.parametrize(("form", "quantity"), [("direct", "current"), ("dual", "force")])
def test_the_levels_of_a_dual_model_are_of_its_output(form, quantity):
    """There input and output have changed places."""
    assert examples.model(form=form).edges_quantity == quantity


@pytest.mark.parametrize("name", ["models/best.h5", "C:\\models\\best.h5", "best.h5", "best"])
def test_the_short_name_of_a_model(name):
    """Without folder and ending, whatever the system."""
    assert ModelEvaluation(name, 0.0, 0.0, 0.0, 0.0, None, np.zeros(1), np.zeros(1)).short_name == "best"


def test_a_waveform_has_a_rate():
    """Of one sample nothing is known of it: two are the fewest."""
    assert examples.waveform(2).rate_Hz == pytest.approx(100.0)
    with pytest.raises(DataError):
        examples.waveform(1)


def test_errors_of_a_drive_are_of_its_scored_force():
    """In percent of the largest target, either sign; what is not scored does not count."""
    target, scored = np.array([9.0, -4.0, 2.0, 0.0]), np.array([False, True, True, True])
    time = np.arange(4) / 100.0
    predicted = np.array([12.0, -4.0, 1.5, 0.25])
    drive = Waveform(time, target, target, target, predicted, scored, *"abc", 0)
    assert drive.full_force == 4.0
    assert drive.predicted_max_error_percent == pytest.approx(12.5)
    assert drive.rate_Hz == pytest.approx(100.0)


def test_a_record_without_time_has_steps_of_one():
    """Its samples have an order only."""
    assert (Record([0.0, 1.0], [0.0, 1.0]).step, Record([0.0, 1.0], [0.0, 1.0]).timed) == (1.0, False)
    assert (Record([0.0, 1.0], [0.0, 1.0], dt_s=0.25).step) == 0.25


def test_what_is_beyond_all_quantities_is_told_from_zero():
    """NaN is not beyond them, nothing at all is not either."""
    for sound in ([], [np.nan], [-LARGEST, LARGEST]):
        assert beyond_all_quantities(np.array(sound)) == ""
    assert "from 0 to 2e+100" in beyond_all_quantities(np.array([np.nan, 0.5, 2 * LARGEST]))
    assert "from -2e+100 to 0" in beyond_all_quantities(np.array([-0.5, -2 * LARGEST]))


def test_the_band_of_a_bootstrap_is_told_by_half_its_width():
    """In the mean; without a bootstrap there is none."""
    fit = report_examples.fit(n=50)
    banded = replace(fit, predicted_lower=fit.predicted - 0.2, predicted_upper=fit.predicted + 0.4)
    assert banded.output_uncertainty == pytest.approx(0.3)
    assert replace(fit, predicted_lower=None, predicted_upper=None).output_uncertainty is None


def test_an_error_is_told_in_differences_that_a_finger_notices():
    """Seven per cent of the mean force: 3 % of 7 N beside a mean of 1.5 N are two of them."""
    session = replace(examples.session(), mean_abs_error_percent=3.0, full_force=7.0, mean_force=1.5)
    assert session.error_jnd == pytest.approx(2.0)


def test_the_published_device_is_the_same_in_a_report_and_in_the_readme():
    """Carneiro, Abreu, Restivo: what the demo's table compares with is what an evaluation compares with."""
    assert {
        pulse: {metric: row[pulse] for metric, row in demo.PUBLISHED.items()} for pulse in demo.PULSES
    } == PUBLISHED
