"""Invert: the rate of a drive, and what is said of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import form_devices as devices
import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.artefacts import Extension, Parameter, Seen
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.pulses import Shape
from pulsetrainer.errors import DataError
from pulsetrainer.report.results import inverted
from wording import raises, tells

ROWS = 1200


def _model(*, captured: bool = False, lag_s: float = 0.0) -> pt.Model:
    edges = np.linspace(0.0, 1.5, 25)
    lag = (Extension("output-lag", (Parameter("tau", lag_s, "s", lag_s, lag_s),)),) if lag_s else ()
    return pt.Model(edges, np.ones(300), 7.0, np.ones(300, bool), captured=captured, extensions=lag)


def _pulse(period_s: float) -> Shape:
    share = np.arange(ROWS) / ROWS
    return Shape("mine", period_s * share, np.sin(np.pi * share) ** 2 + 0.2 * np.sin(3 * np.pi * share) ** 2)


@pytest.mark.parametrize("period_s", [6e-4, 6 * 3600.0])
def test_a_pulse_of_another_time_scale_is_followed_like_one_of_a_second(period_s):
    """A drive of another device has the samples of the pulse, and the values of the usual time scale."""
    drive, usual = (
        pt.invert(_pulse(length), _model(lag_s=0.01 * length)) for length in (period_s, 0.001 * ROWS)
    )
    assert drive.rate_Hz == pytest.approx(ROWS / period_s)
    assert usual.rate_Hz == pytest.approx(1000.0)
    np.testing.assert_allclose(drive.compensated, usual.compensated, atol=1e-6)
    assert drive.predicted_max_error_percent < 1.0
    assert len(drive.notes) == len(usual.notes) + 1


def test_what_a_cause_adds_to_a_drive_is_slow():
    """Beside the inverse without it little lies above 30 Hz, although the pulse has edges."""
    share = np.arange(ROWS) / ROWS
    edged = Shape("edged", 1.2 * share, np.sin(np.pi * share) ** 2 + 0.5 * ((share > 0.3) & (share < 0.6)))
    drive, without = (pt.invert(edged, _model(lag_s=lag)).compensated for lag in (0.012, 0.0))
    power = np.abs(np.fft.rfft((drive - without) * np.hanning(drive.size))) ** 2
    fast = np.fft.rfftfreq(drive.size, 1e-3) > 45.0
    assert power[fast].sum() < 0.1 * power.sum()


@pytest.mark.parametrize(("period_s", "captured"), [(0.06, False), (1.0, False), (99.0, False), (0.03, True)])
def test_usual_pulses_and_our_own_device_keep_their_rate(period_s, captured):
    """A thousand samples a second, wherever they serve, and always on our own device."""
    shape, model = _pulse(period_s), _model(captured=captured)
    drive = pt.invert(shape, model, periods=1)
    assert drive.rate_Hz == pytest.approx(1000.0)
    np.testing.assert_array_equal(
        drive.compensated, pt.invert(shape, model, periods=1, rate_Hz=1000.0).compensated
    )


def test_our_own_device_refuses_what_it_cannot_follow():
    """Its drives have a thousand samples a second, and no more."""
    with raises(DataError, "too short a pulse", pulse="mine", period="600 µs", rate=1000):
        pt.invert(_pulse(6e-4), _model(captured=True))


def test_a_pulse_too_fast_for_the_device_is_told_to_be_slower():
    """Where the lag leaves no output that every beat reaches, a faster pulse would be worse."""
    with raises(DataError, "no output in reach", other="slower"):
        pt.invert(_pulse(0.2), _model(lag_s=5.0))


@pytest.mark.parametrize(("periods", "polarity"), [(3, 1), (1, -1)])
def test_a_drive_is_a_loop_a_ramp_the_beats_and_a_ramp_back(periods, polarity):
    """The scaled drive is the target between the currents of the other one; beats after the first count."""
    drive = pt.invert(_pulse(1.0), replace(_model(), polarity=polarity), periods=periods)
    counted = np.flatnonzero(drive.scored)
    assert np.all(np.diff(counted) == 1)
    end, begin = counted[-1] + 1, counted[0] - (1000 if periods > 1 else 0)
    assert end - begin == 1000 * periods
    before, beats, after = slice(begin - 400), slice(begin, end), slice(end + 401, None)
    share = (drive.target - drive.target[beats].min()) / np.ptp(drive.target[beats])
    low, high = drive.compensated[beats].min(), drive.compensated[beats].max()
    straight = low + (high - low) * (share if polarity > 0 else 1.0 - share)
    np.testing.assert_allclose(drive.scaled[beats], straight[beats], atol=1e-9)
    for part in (before, after):
        np.testing.assert_array_equal(drive.scaled[part], drive.compensated[part])
    assert (drive.scaled[before].min(), drive.scaled[before].max()) == (0.0, 1.5)
    for values in (drive.scaled, drive.target):
        up, down = np.append(values[begin - 400 : begin], values[begin]), values[end : end + 401]
        assert up[0] == pytest.approx(values[begin - 401]) == pytest.approx(down[-1])
        assert up[-1] == pytest.approx(down[0], abs=1e-3)
        for ramp in (up, down):
            np.testing.assert_allclose(ramp, np.linspace(ramp[0], ramp[-1], 401), atol=1e-9)


@pytest.mark.parametrize("unit", [1.0, 1e-4, 1e4])
def test_forces_that_are_proposed_are_within_reach(unit):
    """In whatever unit: they can be asked for as they are said."""
    plane = Plane.uniform(0.0, 1.0, 8)
    model = pt.Model(plane.edges, np.full(plane.n_q, 7.0 * unit), 7.2345 * unit, np.ones(plane.n_q, bool))
    with pytest.raises(DataError) as refused:
        pt.invert("normal", model, force_min=-100.0 * unit, force_max=100.0 * unit)
    words = refused.value.hint.split()
    low, high = (float(words[words.index(name) + 1]) for name in ("`force_min`", "`force_max`"))
    assert high - low > 0.95 * 7.0 * unit
    assert pt.invert("normal", model, force_min=low, force_max=high).clipped_samples == 0


@pytest.mark.parametrize(("top_N", "matters"), [(13.0, False), (13.7, True)])
def test_targets_beyond_the_range_are_told_with_what_they_cost(top_N, matters):
    """A few clipped samples at the foot cost nothing that is seen; at the top they do."""
    model = pt.load("tests/data/files-0.1/model-extended.h5")
    drive = pt.invert("normal", model, periods=2, force_max=top_N)
    assert drive.clipped_samples > 0
    assert (drive.predicted_max_error_percent > 1.0) is matters
    (said,) = (note for note in drive.notes if f"{drive.clipped_samples} samples" in note)
    assert ("does not matter" in said, "force_max" in said) == (not matters, matters)
    assert f"{drive.predicted_max_error_percent:.2g} %" in said


@pytest.mark.parametrize("seed", [0, 2])
def test_a_drive_stays_within_the_record_also_where_the_ends_of_a_dual_model_lie_beyond(seed):
    """Its ends follow from the weights, an eighth of the range too far here; nobody knows what is there."""
    rng = np.random.default_rng(seed)
    device, u = devices.bouc_wen(rng), devices.record(rng, 3000)
    y = device(u)
    y = y + 0.003 * np.ptp(y) * rng.normal(size=y.size)
    run = pt.Run(time_s=np.arange(u.size) / 100, input=u, output=y, input_unit="mm", output_unit="N")
    model = pt.identify(run, levels=16, form="dual")
    drive = pt.invert("normal", model, despite_warning=True)
    slack = 1e-9 * np.ptp(u)
    assert u.min() - slack <= drive.compensated.min() < drive.compensated.max() <= u.max() + slack
    assert drive.predicted_max_error_percent < 0.01
    assert drive.clipped_samples == 0


def test_a_model_of_one_loop_says_that_turns_within_it_are_a_guess():
    """The error that it expects of its own drive is none, whatever the device does there."""
    u = np.concatenate((np.linspace(0, 1, 300), np.linspace(1, 0, 300)))
    y = np.concatenate((u[:300] ** 2, np.sqrt(u[300:])))
    alone = pt.identify(pt.Run(time_s=np.arange(600) / 100, input=u, output=y), levels=12)
    several = replace(alone, fit=replace(alone.fit, minor_percent=60.0))
    said, silent = (" ".join(pt.invert("normal", one).notes) for one in (alone, several))
    tells(said, "no minor loops")
    with pytest.raises(AssertionError):
        tells(silent, "no minor loops")


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_ends_in_the_noise_of_the_input_are_told(noise):
    """An amplifier of 0 to 100 V does not go to -0.07 V."""
    u = 100.0 * np.abs((np.arange(6000) / 1000 + 1.0) % 2.0 - 1.0)
    u += noise * np.random.default_rng(3).standard_normal(u.size)
    record = pt.Run(time_s=np.arange(u.size) / 500, input=u, output=0.1 * u, input_unit="V", output_unit="um")
    drive = pt.invert("normal", pt.identify(record, levels=8))
    assert any("include its noise of 0.02 V" in note for note in drive.notes) is bool(noise)


@pytest.mark.parametrize(("ends_off", "said"), [(0.0, False), (0.01, False), (0.3, True)])
def test_a_pulse_that_does_not_lead_back_to_its_beginning_is_told(ends_off, said):
    """Shares of its height; one period follows another, with a jump between them."""
    pulse = _pulse(1.2)
    slope = ends_off * np.ptp(pulse.value) * np.arange(ROWS) / (ROWS - 1)
    notes = pt.invert(replace(pulse, value=pulse.value + slope), _model()).notes
    assert any("each period begins with a jump" in note for note in notes) is said


def _damper(noise: float = 0.003) -> tuple[pt.Run, pt.Model]:
    """Return a record of a device whose force leads its stretch, and its dual model."""
    rng = np.random.default_rng(0)
    device, u = devices.bouc_wen(rng), devices.record(rng, 3000)
    y = device(u)
    y = y + noise * np.ptp(y) * rng.normal(size=y.size)
    run = pt.Run(time_s=np.arange(u.size) / 100, input=u, output=y, input_unit="mm", output_unit="N")
    return run, pt.identify(run, levels=16, form="dual")


def test_an_extended_dual_model_keeps_to_the_range_of_its_record():
    """It has no fit, and the ends of its weights lie beyond what anybody has seen."""
    run, model = _damper()
    tau, share = (
        Parameter(name, value, unit, value, value)
        for name, value, unit in (("tau", 0.5, "s"), ("amplitude", 0.1, "1"))
    )
    extended = replace(model, fit=None, as_measured=True, extensions=(Extension("creep", (share, tau)),))
    low, high = float(run.input.min()), float(run.input.max())
    slack = 1e-9 * (high - low)
    drive = pt.invert("normal", extended, despite_warning=True)
    assert drive.inversion == "extended"
    assert low - slack <= drive.compensated.min() < drive.compensated.max() <= high + slack
    unknown = pt.invert("normal", replace(extended, seen=None))
    assert unknown.compensated.max() > high + 0.01 * (high - low)
    said, silent = (
        sum("does not say what was recorded" in note for note in one.notes) for one in (unknown, drive)
    )
    assert (said, silent) == (1, 0)


@pytest.mark.parametrize("most", [1.0, 0.9])
def test_more_than_was_recorded_is_told(most):
    """The strokes before the pulse go to the ends of the model, whatever was asked for."""
    low, high = (float(end) for end in _model().predict([0.0, 1.5]))
    seen = Seen(0.5, 2.0, 0.0, 1.5, low, low + most * (high - low))
    model = replace(_model(), seen=seen)
    drives = pt.invert("normal", model, force_min=low, force_max=low + 0.1), pt.invert("normal", model)
    small, whole = ([note for note in drive.notes if "was never seen" in note] for drive in drives)
    assert len(small) == len(whole) == (most < 1.0)
    for note in small:
        assert f"over {low:.4g} .. {high:.4g} N in the strokes before" in note
        assert f"its record holds {low:.4g} .. {seen.output_high:.4g} N" in note
    assert not any("strokes" in note for note in whole)


def test_what_the_model_missed_stands_beside_the_expected_error():
    """A drive that the model follows exactly is on the device as wrong as the model."""
    run, model = _damper()
    drive = pt.invert("normal", model, despite_warning=True)
    payload, _, rows = inverted(Path("drive.h5"), drive)
    assert (payload["fit_rms_percent"], payload["fit_max_percent"]) == (
        model.fit.rms_percent,
        model.fit.max_percent,
    )
    missed = f"{model.fit.rms_percent:.3f} % rms, {model.fit.max_percent:.2f} % max, of the span"
    assert rows["the model itself"] == f"missed its record by {missed}"
    assert drive.predicted_max_error_percent < 0.1 * model.fit.max_percent
    assert (model.seen.input_low, model.seen.output_high) == (run.input.min(), run.output.max())
    of_none = inverted(Path("drive.h5"), pt.invert("normal", _model()))
    assert "the model itself" not in of_none[2]
    assert np.isnan(of_none[0]["fit_rms_percent"])


def test_the_warning_of_a_model_goes_on_into_its_drive():
    """Whoever inverts it all the same is told again what he does."""
    _, model = _damper()
    warned = replace(model, fit=replace(model.fit, warning="It depends on the weather."))
    drive = pt.invert("normal", warned, despite_warning=True, name="model.h5")
    assert drive.warnings == (
        "model.h5 does not describe the record it was identified on. It depends on the weather.",
    )


@pytest.mark.parametrize(("heading", "said"), [("strain_um", True), ("force_N", False), ("p", False)])
@pytest.mark.parametrize("ends", [{}, {"force_min": 6.0, "force_max": 8.0}])
def test_a_pulse_in_another_unit_is_only_a_shape(tmp_path, heading, said, ends):
    """Also where the forces are given, since nobody compares them with the table then."""
    table = tmp_path / "wish.csv"
    rows = (f"{0.005 * k:.3f},{200 + 800 * np.sin(np.pi * k / 200) ** 2:.3f}" for k in range(200))
    table.write_text("\n".join((f"t_s,{heading}", *rows)))
    notes = " ".join(pt.invert(table, _model(), **ends).notes)
    assert ("is a pulse in µm" in notes or "is a pulse in um" in notes) is said
    assert ("only its shape is used" in notes) is said
    assert ("stretched to" in notes) is not bool(ends)
