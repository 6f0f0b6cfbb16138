"""Correct: each fault of a measurement, put into a record by its equation, is taken out again."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import truncnorm

import pulsetrainer as pt
from pulsetrainer.artefacts import Cause, Diagnosis, Parameter, Recorded
from pulsetrainer.core import censored
from pulsetrainer.core.censored import between_steps, beyond_rails
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import base, library
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.steps.correct import _instead as instead
from wording import raises, tells

RATE_HZ = 200.0
SPAN = 10.0


def _plant(n_h: int = 40) -> Preisach:
    plane = Plane.uniform(0.0, 1.0, n_h)
    i, j = plane.cell_indices
    mass = (0.2 + np.exp(-(((i - j) / n_h - 0.2) ** 2) / 0.02)) * plane.areas
    return Preisach(plane, 0.5 * SPAN * mass / mass.sum() / plane.areas, 0.5 * SPAN)


@pytest.fixture(scope="module")
def clean() -> pt.Run:
    """Shrinking and growing loops, with a little noise."""
    tips = np.concatenate([np.linspace(1, 0.2, 12), np.linspace(0.3, 1, 12)])
    u = np.interp(
        np.arange(6000), np.linspace(0, 5999, 2 * tips.size + 1), np.append(np.stack([0 * tips, tips], 1), 0)
    )
    y = _plant()(u) + 0.002 * SPAN * np.random.default_rng(1).standard_normal(u.size)
    return pt.Run(time_s=np.arange(u.size) / RATE_HZ, input=u, output=y, input_unit="A", output_unit="N")


@pytest.fixture
def few_levels(monkeypatch):
    """As many levels of the hysteresis that tells what lies beyond a rail as the test's plant needs."""
    monkeypatch.setattr(base, "_LEVELS", 24)


def _diagnosis(
    run: pt.Run, name: str, *, polarity: int = 1, step_s: float | None = None, **values: float
) -> Diagnosis:
    """Return a diagnosis of a run that found one cause."""
    found = Cause(name, True, 0.005, 90.0, 90.0, tuple(Parameter(n, v, "1", v, v) for n, v in values.items()))
    empty = np.empty(0)
    return Diagnosis(
        name, False, *[0.0] * 6, (found,), (), "", (), *[empty] * 5,
        records=(Recorded(run.fingerprint, step_s or run.dt_s),), polarity=polarity, empty=0.0,
        correctable=(name,) * library()[name].corrects,
    )  # fmt: skip


def _added(name, y, t):
    """Output with a fault, and the parameters that say it."""
    if name == "offset-drift":
        lost = 1.0 - np.exp(-0.4 * t)  # half of it, and a quarter of the square of the length, in the middle
        bend = -2.0 * (1.0 - np.exp(-0.2 * t[-1])) ** 2 / t[-1] ** 2
        return y + lost + 0.02 * t, {"rate": 0.02 + lost[-1] / t[-1], "bend": bend, "slowing": 0.4}
    if name == "gain-drift":  # of 4 % in ten seconds, about an output of 0.5
        return y + 0.004 * t * (y - 0.5), {"rate": -0.002, "bend": 0.0, "gain": 0.004}
    if name == "step":
        return np.where(t > 12, 0.4 + 1.03 * y, y), {"offset": 0.4, "gain": 0.03, "time": 12.0}
    if name == "periodic":
        phase = 2 * np.pi * 7.3 * t
        return y + 0.2 * np.sin(phase) - 0.1 * np.cos(phase), {"sine": 0.2, "cosine": -0.1, "frequency": 7.3}
    if name == "leak":  # to 0.7 below the output of no input
        left = np.exp(-0.3 / RATE_HZ)
        moves = np.diff(y, prepend=0.0) * (1.0 - left) * RATE_HZ / 0.3
        moves[0] = y[0]
        leaking = lfilter([1.0], [1.0, -left], moves) + 0.7 * np.expm1(-0.3 * t)
        return leaking, {"rate": 0.3, "before": 0.7}
    return np.interp(t * 0.999, t, y), {"skew": -0.001}


@pytest.mark.parametrize("polarity", [1, -1])
def test_several_steps_are_taken_out(clean, polarity):
    """All of them, back to the output before the first; what lies beside a moment is not known."""
    y, t = polarity * clean.output, clean.time_s
    spoilt = y + (t > 5.0) * (0.4 + 0.03 * y) + (t > 12.0) * (-0.2 + 0.02 * y)
    values = (
        ("offset", 0.4),
        ("gain", 0.03),
        ("time", 5.0),
        ("offset 2", -0.2),
        ("gain 2", 0.02),
        ("time 2", 12.0),
    )
    run = replace(clean, output=polarity * spoilt)
    found = Cause("step", True, 0.005, 90.0, 90.0, tuple(Parameter(n, v, "1", v, v) for n, v in values))
    done = pt.correct(run, replace(_diagnosis(run, "step", polarity=polarity), causes=(found,)))
    kept = ~done.masked
    np.testing.assert_allclose(done.output[kept], clean.output[kept], atol=1e-9)
    assert 0.0 < done.masked.mean() < 0.01


def test_where_no_input_is_never_reached_a_leak_keeps_its_first_sample(clean):
    """There it may fall back to any output; where the input begins at zero, it falls back to that of none."""
    spoilt, values = _added("leak", clean.output, clean.time_s)
    for low, off in ((0.0, -0.7), (-0.5, 0.0), (0.03, 0.0)):
        run = replace(clean, input=clean.input + low, output=spoilt)
        done = pt.correct(run, _diagnosis(run, "leak", **values))
        np.testing.assert_allclose(done.output, clean.output + off, atol=1e-9)


@pytest.mark.parametrize("name", ["offset-drift", "gain-drift", "step", "periodic", "clock-skew", "leak"])
@pytest.mark.parametrize("polarity", [1, -1])
def test_what_was_added_is_taken_out(clean, name, polarity):
    """To the last digits where it was added, to what noise interpolates where time was stretched."""
    spoilt, values = _added(name, polarity * clean.output, clean.time_s)
    run = replace(clean, output=polarity * spoilt)
    done = pt.correct(run, _diagnosis(run, name, polarity=polarity, **values))
    kept = slice(None) if done.masked is None else ~done.masked
    assert done.corrected == (name,)
    zero = -0.7 * polarity if name == "leak" else 0.0  # what all that is held falls back to
    error = np.abs(done.output - clean.output - zero)[kept]
    assert np.median(error) < (0.02 if name == "clock-skew" else 1e-9)
    assert np.abs(run.output - clean.output).max() > 0.1
    lost = 0 if done.masked is None else int(done.masked.sum())
    assert {"step": 20, "clock-skew": 7}.get(name, 0) >= lost >= {"step": 18, "clock-skew": 4}.get(name, 0)


@pytest.mark.parametrize("polarity", [1, -1])
def test_an_input_that_was_recorded_late_is_taken_back(clean, polarity):
    """The output of each moment meets its own input again; what came before the first input is not known."""
    n, at = 8, np.arange(clean.input.size)
    run = replace(clean, input=clean.input[np.maximum(at - n, 0)], output=polarity * clean.output)
    done = pt.correct(run, _diagnosis(run, "late-input", polarity=polarity, delay=n / RATE_HZ))
    np.testing.assert_array_equal(done.input[n:], clean.input[:-n])
    np.testing.assert_allclose(done.output[n:], polarity * clean.output[:-n], atol=1e-9)
    assert done.masked.tolist() == (at < n).tolist()


@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_an_input_that_was_smoothed_is_sharp_again(clean, noise):
    """The output stays as it is; of a noisy input most of the lag is taken out."""
    tau = 6.0 / RATE_HZ
    left = np.exp(-1.0 / 6.0)
    b = np.asarray([1.0 - 6.0 * (1.0 - left), 6.0 * (1.0 - left) - left])  # straight between samples
    smooth = lfilter(b, [1.0, -left], clean.input, zi=[(1.0 - b[0]) * clean.input[0]])[0]
    smooth += noise * np.random.default_rng(5).standard_normal(smooth.size)
    run = replace(clean, input=smooth)
    done = pt.correct(run, _diagnosis(run, "input-lag", tau=tau))
    np.testing.assert_array_equal(done.output, clean.output)
    assert done.masked is None
    near, far = (float(np.std(one.input - clean.input)) for one in (done, run))
    assert near < (0.2 if noise else 0.02) * far


def test_a_hum_sought_in_averages_keeps_its_phase(clean):
    """The first average of eight samples lies three and a half samples after the first sample."""
    wide = 8 / RATE_HZ
    since = clean.time_s - 3.5 / RATE_HZ
    run = replace(clean, output=clean.output + 0.3 * np.sin(2 * np.pi * 9.0 * since))
    done = pt.correct(run, _diagnosis(run, "periodic", step_s=wide, sine=0.3, cosine=0.0, frequency=9.0))
    np.testing.assert_allclose(done.output, clean.output, atol=1e-9)


def test_wild_and_clipped_samples_are_masked_and_no_fit_counts_them(clean, few_levels):
    """Every one of them, and the model of the corrected run does not depend on what they were."""
    bad = np.arange(50, 6000, 97)
    wild = clean.output.copy()
    wild[bad] += 4.0
    run = replace(clean, output=wild)
    done = pt.correct(run, _diagnosis(run, "outliers", size=4.0))
    assert done.masked is not None
    assert np.array_equal(np.flatnonzero(done.masked), bad)
    assert np.abs(done.output - clean.output).max() < 0.5
    other = replace(done, output=np.where(done.masked, done.output + 1.0, done.output))
    np.testing.assert_array_equal(pt.identify(done, levels=12).weights, pt.identify(other, levels=12).weights)

    rail = 0.75 * SPAN
    cut = replace(clean, output=np.minimum(clean.output, rail))
    done = pt.correct(cut, _diagnosis(cut, "saturation", size=rail))
    _assert_told_or_masked(done, clean, rail)
    seen = replace(clean, output=_plant()(clean.input), masked=clean.output >= rail)
    models = [pt.identify(one, levels=24, form="direct") for one in (cut, done, clean)]
    before, after, least = (one.rms for one in pt.evaluate(seen, models).models)
    assert before - after > 0.9 * (before - least)


def _assert_told_or_masked(done: pt.Run, clean: pt.Run, rail: float) -> None:
    """What lies far beyond the rail is masked; what is told just beyond it is right within the noise."""
    true, noise = _plant()(clean.input), 0.002 * SPAN
    assert done.masked is not None
    assert np.all(done.masked[true > rail + 5.0 * noise])
    assert not np.any(done.masked[true < rail])
    told = (clean.output >= rail) & ~done.masked
    assert np.any(told)
    assert np.abs(done.output - true)[told].max() < 4.0 * noise


def test_an_output_cut_off_at_both_ends(clean, few_levels):
    """The model is as good as that of the record without the fault, where the record tells."""
    polarity = -1
    ends = np.quantile(clean.output, (0.1, 0.85))
    cut = replace(clean, output=polarity * np.clip(clean.output, *ends))
    rail = polarity * float(ends[1])
    done = pt.correct(cut, _diagnosis(cut, "saturation", polarity=polarity, size=rail))
    true = _plant()(clean.input)
    seen = replace(clean, output=polarity * true, masked=(true < ends[0]) | (true > ends[1]))
    known = replace(clean, output=polarity * clean.output)
    models = [pt.identify(one, levels=24, form="direct") for one in (cut, done, known)]
    before, after, least = (one.rms for one in pt.evaluate(seen, models).models)
    assert before - after > 0.9 * (before - least)


@pytest.mark.parametrize("polarity", [1, -1])
def test_a_model_says_how_far_an_output_is_known_that_was_cut_off(clean, polarity):
    """It claims more, which is a guess; so is a drive that is to go there, and no other."""
    rail = 0.75 * SPAN
    hidden = clean.output >= rail
    cut = replace(
        clean, output=polarity * np.minimum(clean.output, rail), masked=hidden, corrected=("saturation",)
    )
    model = pt.identify(cut, levels=24, form="direct")
    fit, last = model.fit, polarity * float(clean.output[~hidden].max())
    tells(fit.notes[-1], "known up to" if polarity > 0 else "known from")
    ((way, told),) = re.findall(r"(up to|from) (\S+) ", fit.notes[-1])  # one end, and no other
    assert way == ("up to" if polarity > 0 else "from")
    assert float(told) == pytest.approx(last, abs=0.01 * SPAN)
    for beyond in (-0.05 * SPAN, 0.05 * SPAN):
        ends = sorted((polarity * 0.2 * SPAN, last + beyond * polarity))
        drive = pt.invert("normal", model, force_min=ends[0], force_max=ends[1], periods=1)
        told = [note for note in drive.notes if "its record holds" in note]
        assert any("in the strokes before" not in note for note in told) == (beyond > 0)
    for whole in (replace(cut, corrected=()), replace(clean, corrected=("saturation",))):
        fit = pt.identify(whole, levels=24, form="direct").fit
        assert not any("cut" in note for note in fit.notes)


def test_where_no_hysteresis_describes_the_record_nothing_is_told_beyond_a_rail(clean, few_levels):
    """All samples at the rail are masked, and those near it: there only low noise is left."""
    wanders = clean.output + 0.05 * SPAN * np.sin(0.01 * np.arange(clean.input.size))
    rail = float(np.quantile(wanders, 0.85))
    cut = replace(clean, output=np.minimum(wanders, rail))
    done = pt.correct(cut, _diagnosis(cut, "saturation", size=rail))
    assert done.masked is not None
    assert np.all(done.masked[wanders >= rail])
    np.testing.assert_array_equal(done.output[~done.masked], cut.output[~done.masked])


def test_a_delay_that_is_known_needs_no_diagnosis(clean):
    """The recorder's: taken out of two parts, each of whose ends is lost; nothing else is touched."""
    late = 7
    seam = np.arange(clean.input.size) == 3000
    moved = np.concatenate(
        [np.concatenate((part[:1].repeat(late), part[:-late])) for part in np.split(clean.output, [3000])]
    )
    done = pt.correct(replace(clean, output=moved, seam=seam), delay_s=late / RATE_HZ)
    lost = np.isin(np.arange(moved.size), [*range(3000 - late, 3000), *range(moved.size - late, moved.size)])
    np.testing.assert_array_equal(done.masked, lost)
    np.testing.assert_allclose(done.output[~lost], clean.output[~lost], atol=1e-9)
    assert done.corrected == ("delay",)
    assert pt.correct(done, delay_s=0.01).corrected == ("delay",)


def test_neither_a_diagnosis_nor_a_delay_takes_nothing_out(clean):
    """Nobody says what is wrong with the run."""
    with raises(UsageError, "nothing to take out"):
        pt.correct(clean)
    with raises(DataError, "delay too long", length="", given="1e+09"):
        pt.correct(clean, delay_s=1e9)


def test_without_noise_no_fit_tells_what_lies_beyond_a_rail(clean):
    """Every fit leaves more than nothing; a division by the noise warned of it."""
    record, up = Record(clean.input, clean.output, np.ones(clean.input.size)), clean.output > 0.75 * SPAN
    plane = Plane.uniform(float(clean.input.min()), float(clean.input.max()), 8)
    with warnings.catch_warnings(action="error"):
        assert beyond_rails(record, plane, up, ~up & False, 0.0) is None


def test_clipped_samples_are_masked_where_wild_ones_lie_beyond_them(clean, few_levels):
    """A wild sample above the rail does not hide it."""
    rail, bad = 0.75 * SPAN, np.arange(50, 6000, 97)
    output = np.round(np.minimum(clean.output, rail), 3)
    output[bad] = 1.5 * SPAN
    run = replace(clean, output=output)
    found = [_diagnosis(run, name, size=rail) for name in ("saturation", "outliers")]
    both = replace(
        found[0],
        causes=found[0].causes + found[1].causes,
        correctable=("saturation", "outliers"),
    )
    done = pt.correct(run, both)
    ordinary = np.ones(6000, dtype=bool)
    ordinary[bad] = False
    assert done.masked is not None
    assert np.all(done.masked[bad])
    _assert_told_or_masked(_picked(done, ordinary), _picked(clean, ordinary), rail)


def _picked(run: pt.Run, kept: np.ndarray) -> pt.Run:
    """Some samples of a run, without their time."""
    masked = None if run.masked is None else run.masked[kept]
    n = np.count_nonzero(kept)
    return pt.Run(
        time_s=np.arange(n) / RATE_HZ, input=run.input[kept], output=run.output[kept], masked=masked
    )


def test_a_masked_sample_is_no_error(clean):
    """Evaluate counts what was measured only."""
    model = pt.identify(clean, levels=12)
    spoilt = replace(clean, output=np.where(np.arange(6000) % 50 == 3, 99.0, clean.output))
    told = replace(spoilt, masked=np.arange(6000) % 50 == 3)
    whole, masked = (pt.evaluate(one, [model]).models[0].rms for one in (clean, told))
    assert masked == pytest.approx(whole, rel=0.02)
    assert pt.evaluate(spoilt, [model]).models[0].rms > 5 * whole


def test_between_coarse_steps_lies_what_the_hysteresis_says(clean):
    """The error of the steps falls to a third, within each step; noise beyond the step is left alone."""
    true, q = _plant()(clean.input), 0.04 * SPAN
    coarse = q * np.round(true / q)
    plane = Plane.uniform(0.0, 1.0, 24)
    done = between_steps(Record(clean.input, coarse), plane, q)
    assert np.abs(done - coarse).max() <= 0.5 * q * (1 + 1e-9)
    assert np.std(done - true) < 0.33 * np.std(coarse - true)
    apart, least = np.linspace(-2.9, 2.9, 25), censored._LEAST_COUNT
    for low, high in ((apart - 0.5, apart + 0.5), (apart, np.inf + apart), (apart - np.inf, apart)):
        mean, count = censored._left_possible(2.0 * low, 2.0 * high)
        left = truncnorm(2.0 * low, 2.0 * high)
        np.testing.assert_allclose(mean, left.mean(), rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(count, np.clip(1.0 - left.var(), least, 1.0), rtol=1e-6)
    noisy = q * np.round((true + q * np.random.default_rng(0).standard_normal(true.size)) / q)
    assert between_steps(Record(clean.input, noisy), plane, q) is noisy
    wanders = true + 1.5 * q * np.sin(0.01 * np.arange(true.size))  # which no hysteresis follows
    other = q * np.round(wanders / q)
    assert between_steps(Record(clean.input, other), plane, q) is other


def test_a_recorders_delay_is_taken_out_only_when_told(clean):
    """The output on the clock of the input; its last samples are not known."""
    late = replace(clean, output=np.interp(clean.time_s - 0.1, clean.time_s, clean.output))
    nothing = _diagnosis(late, "creep", amplitude=0.1, tau=1.0)
    done = pt.correct(late, nothing, delay_s=0.1)
    assert done.corrected == ("delay",)
    assert done.masked is not None
    assert done.masked.sum() in (20, 21)
    np.testing.assert_allclose(done.output[~done.masked], clean.output[~done.masked], atol=1e-9)
    with pytest.raises(DataError):
        pt.correct(late, nothing)


def test_where_a_fault_may_be_a_cause_of_the_device_the_advice_says_what_to_record(clean):
    """Not to use the run as it is: the diagnosis said how to tell the two apart."""
    found = _diagnosis(clean, "offset-drift", rate=0.1)
    tied = replace(found.causes[0], confounded_with=("accommodation",))
    said = "Record twenty cycles."
    tied_diagnosis = replace(found, causes=(tied,), correctable=(), next_experiment=said)
    assert said in instead(tied_diagnosis)
    with pytest.raises(DataError, match="nothing to correct"):
        pt.correct(clean, tied_diagnosis)


@pytest.mark.parametrize("delay_s", [float("nan"), float("inf"), -0.1])
def test_a_delay_that_is_no_time_is_refused(clean, delay_s):
    """NaN compares with nothing, and would be let through to the fit."""
    found = _diagnosis(clean, "offset-drift", rate=0.1)
    with pytest.raises(UsageError, match="`delay` must be a finite number, 0 or more"):
        pt.correct(clean, found, delay_s=delay_s)


def test_a_delay_longer_than_the_record_is_refused(clean):
    """Nothing of the output would be left."""
    found = _diagnosis(clean, "offset-drift", rate=0.1)
    length_s = float(clean.time_s[-1] - clean.time_s[0])
    for delay_s in (1.001 * length_s, 1e5):
        with raises(DataError, "delay too long", given=f"{delay_s:g} s", length=f"{length_s:g} s"):
            pt.correct(clean, found, delay_s=delay_s)


def test_a_diagnosis_of_another_run_is_refused(clean):
    """One sample that differs is another run; a corrected run is another one too."""
    found = _diagnosis(clean, "offset-drift", rate=0.1)
    other = replace(clean, output=np.append(clean.output[:-1], 0.0))
    with raises(DataError, "another run"):
        pt.correct(other, found)
    with pytest.raises(DataError):
        pt.correct(pt.correct(clean, found), found)


def test_a_part_that_was_not_diagnosed_stays_as_it_is(clean):
    """Parts too short to be diagnosed are kept; each of the others is corrected from its own first sample."""
    seam = np.zeros(6000, dtype=bool)
    seam[[3000, 5950]] = True
    run = replace(clean, seam=seam)
    first, second, short = (run.cut(part) for part in run.slices)
    found = _diagnosis(first, "offset-drift", rate=0.1)
    found = replace(found, records=(*found.records, Recorded(second.fingerprint, 1 / RATE_HZ)))
    done = pt.correct(run, found)
    added = clean.output - done.output
    np.testing.assert_allclose(added[:3000], 0.1 * np.arange(3000) / RATE_HZ, atol=1e-9)
    np.testing.assert_allclose(added[3000:5950], 0.1 * np.arange(2950) / RATE_HZ, atol=1e-9)
    assert not added[5950:].any()
    assert short.input.size == 50


@pytest.mark.parametrize(("verdict", "goes_on"), [("unknown", True), ("inconclusive", True), ("none", False)])
def test_what_cannot_be_corrected_is_not_called_sound(verdict, goes_on):
    """Where something is wrong that has no name, the diagnosis says what to do."""
    known = {"extended": None, "quick": False, "advice": ["Record again.", "Longer."], "found": ()}
    found = SimpleNamespace(verdict=verdict, **known)
    told = instead(found)
    assert ("Record again." in told) is goes_on
    assert "Longer." not in told
    assert ("as it is" in told) is not goes_on


def test_what_is_told_of_a_step_is_enough_to_compute_it():
    """The offset is that at one output, which is told: of a gain alone it was read as a shift of the zero."""
    tips = np.concatenate([np.linspace(1, 0.2, 8), np.linspace(0.3, 1, 8)])
    u = np.interp(
        np.arange(1600), np.linspace(0, 1599, 2 * tips.size + 1), np.append(np.stack([0 * tips, tips], 1), 0)
    )
    noise = 0.002 * SPAN * np.random.default_rng(1).standard_normal((2, u.size))
    before, y = -_plant(12)(u) - 5.0 + noise
    t = np.arange(u.size) / 50.0
    runs = [
        pt.Run(time_s=t, input=u, output=one, input_unit="A", output_unit="N")
        for one in (before, np.where(t > 18.2, 1.1 * y, y))
    ]
    found = pt.diagnose(runs, pt.identify(runs[0], levels=12), names=["a.h5", "b.h5", "m.h5"])
    assert found.verdict == "step"
    told = {one.name: one for one in found.found[0].parameters}
    assert told["offset"].meaning.startswith("by which the force is higher from that time on, where it was ")
    middle = float(told["offset"].meaning.split()[-2])
    assert middle < -4.0
    assert f"away from {middle:g} N, this share of the distance comes on top" in told["gain"].meaning
    assert told["offset"].value - told["gain"].value * middle == pytest.approx(0.0, abs=0.05)  # 1.1 y
    at, unit, *where = told["time"].meaning.rpartition(", ")[2].split()
    assert (unit, *where) == ("s", "into", "b.h5")
    assert float(at) == pytest.approx(18.2, abs=0.5)
