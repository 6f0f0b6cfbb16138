"""A drift told by the model as given, where refitted weights hide it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pulsetrainer as pt
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.diagnosis import given_drift, wording
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.offset_drift import OffsetDrift
from pulsetrainer.diagnosis.given_drift import drift_in

STEP_S = 0.02
N = 6000
LENGTH_S = N * STEP_S
FRAME = Frame(STEP_S, np.zeros(N), 1.0, 1.0)


def _average(signals):
    return np.concatenate([one.reshape(-1, 10).mean(axis=1) for one in signals])


@given(
    st.floats(-1.0, 1.0), st.floats(0.2, 2.0), st.floats(2.0, 100.0), st.booleans(), st.integers(0, 2**32 - 1)
)
def test_a_drift_that_relaxes_or_grows_is_told_with_a_shift_beside_it(shift, size, times, grows, seed):
    """The curve to a hundredth of its size, from the first sample on; noise is a hundredth as well."""
    t = np.arange(N) * STEP_S
    relaxed = size * -np.expm1(-times * (t[::-1] if grows else t) / LENGTH_S)
    truth = relaxed - relaxed[0]
    noise = 0.01 * size * np.random.default_rng(seed).standard_normal(N)
    found = drift_in(_average([shift + truth + noise]), [FRAME], _average)
    told = found.cause.on_output(np.zeros(N), found.values, FRAME)
    assert len(found.values) == len(found.errors) == 3
    assert np.abs(told - truth)[10:-10].max() < 0.03 * size
    assert np.median(np.abs(told - truth)) < 0.01 * size


def test_a_straight_drift_does_not_relax():
    """What noise could make of it is not told."""
    t = np.arange(N) * STEP_S
    noise = 0.05 * np.random.default_rng(3).standard_normal(N)
    found = drift_in(_average([0.002 * t + noise]), [FRAME], _average)
    assert len(found.values) == 2
    rate, bend = found.values
    assert abs(rate - 0.002) < 3.0 * found.errors[0]
    assert abs(bend) < 3.0 * found.errors[1]


@pytest.fixture(scope="module")
def calibrated() -> tuple[pt.Run, pt.Model]:
    """Reversal curves of a steep density, and the model identified on them."""
    plane = Plane.uniform(0.0, 1.0, 64)
    i, j = plane.cell_indices
    mass = np.exp(-(((i / 64 - 0.6) / 0.15) ** 2) - ((j / 64 - 0.4) / 0.15) ** 2)
    plant = Preisach(plane, 0.5 * mass / mass.sum() / plane.areas, 0.5)
    tips = np.stack((np.ones(16), np.linspace(0.9, 0.0, 16)), axis=1).ravel()
    u = np.interp(np.arange(N), np.linspace(0, N - 1, tips.size + 1), np.append(0.0, tips))
    y = plant(u) + 0.001 * np.random.default_rng(5).standard_normal(N)
    run = pt.Run(time_s=np.arange(N) * STEP_S, input=u, output=y, input_unit="A", output_unit="N")
    return run, pt.identify(run)


@pytest.mark.parametrize("polarity", [1, -1])
def test_a_drift_that_is_over_soon_is_no_change_of_the_device(calibrated, polarity):
    """It was called a change of condition, and what was taken out left three quarters of it."""
    run, model = calibrated
    if polarity < 0:
        run = replace(run, output=-run.output)
        model = pt.identify(run)
    drift = 0.05 * -np.expm1(-run.time_s / 8.0)
    faulty = replace(run, output=run.output + drift)
    found = pt.diagnose(faulty, model, seed=1)
    assert found.verdict == "offset-drift"
    assert [one.cause for one in found.found] == ["offset-drift"]
    done = pt.correct(faulty, found)
    assert np.abs(done.output - run.output).max() < 0.05 * drift.max()


def test_a_shifted_zero_stays_a_change_of_the_device(calibrated):
    """It does not move in the record."""
    run, model = calibrated
    found = pt.diagnose(replace(run, output=run.output + 0.05), model, seed=1)
    assert found.verdict == "condition-change"
    assert "shifted by 0.05" in " ".join(found.evidence)


def test_the_curve_is_that_of_the_cause():
    """A parabola and an exponential of no slowing are one."""
    y = np.zeros(N)
    plain = OffsetDrift()
    tiny = plain.relaxing.on_output(y, (0.1, 0.02, 2e-5 / LENGTH_S), FRAME)
    np.testing.assert_allclose(tiny, plain.on_output(y, (0.1, 0.02), FRAME), atol=1e-3)


def _told(monkeypatch, judged):
    """Ask about a drift that brings the given model near, on one record, with nothing else in the model."""
    judged.is_near = lambda _: True
    monkeypatch.setattr(given_drift, "weights_for", lambda *_: "weights")
    state = SimpleNamespace(
        question=SimpleNamespace(timed=True, quick=False), findings=(), current=SimpleNamespace(terms=()),
        problem=SimpleNamespace(frames=[FRAME], bins=SimpleNamespace(count=N)),
        scale=SimpleNamespace(estimate=lambda one: one),
    )  # fmt: skip
    return given_drift.told(state, judged, 1.0)


@pytest.mark.parametrize(("error", "is_told"), [(0.004, True), (0.006, False)])
def test_a_drift_that_may_be_nothing_is_not_told(monkeypatch, error, is_told):
    """Of a solenoid with nothing hidden one was, and what was taken out made its model worse by a third."""
    cause = OffsetDrift()
    drift = given_drift.Drifted(cause, (0.01, 0.0), (error, 0.001))
    said = np.zeros(N)
    monkeypatch.setattr(given_drift, "_with_drift", lambda *_: (drift, said, said))
    judged = SimpleNamespace(measured=said, predicted=said + 1.0, polarity=1)
    judged.left_by = lambda predicted: 0.1 if predicted is said else 1.0
    told = _told(monkeypatch, judged)
    assert (told is not None) is is_told


@pytest.mark.parametrize(("left", "is_told"), [(0.70, True), (0.71, False)])
def test_a_drift_that_takes_less_than_half_of_the_squares_is_not_told(monkeypatch, left, is_told):
    """What a model of another kind of device leaves has a slow part as well."""
    drift, said = given_drift.Drifted(OffsetDrift(), (0.01, 0.0), (0.001, 0.001)), np.zeros(N)
    monkeypatch.setattr(given_drift, "_with_drift", lambda *_: (drift, said, said))
    judged = SimpleNamespace(measured=said, predicted=said + 1.0, polarity=1)
    judged.left_by = lambda predicted: left if predicted is said else 1.0
    assert (_told(monkeypatch, judged) is not None) is is_told


@given(
    st.floats(-1.0, 1.0), st.floats(0.1, 2.0), st.floats(0.12, 0.88), st.booleans(), st.integers(0, 2**32 - 1)
)
def test_a_step_is_told_with_a_shift_beside_it(shift, size, moment, has_gain, seed):
    """Its moment and its size within their intervals, widened by half; the gain where there is one."""
    rng = np.random.default_rng(seed)
    unmoved = np.sin(0.11 * np.arange(N))
    after = np.arange(N) >= moment * N
    gain = 0.2 * size if has_gain else 0.0
    noise = 0.05 * size * rng.standard_normal(N)
    left = shift + after * (size + gain * unmoved) + noise
    problem = SimpleNamespace(
        bins=SimpleNamespace(average=_average),
        frames=[FRAME],
        time_s=_average([np.arange(N) * STEP_S]),
    )
    found = given_drift.step_in(_average([left]), [unmoved], problem)
    offset, share, at = found.values
    errors = np.maximum(1.5 * 2.26 * np.asarray(found.errors), 1e-12)
    assert abs(offset - size) < errors[0] + 0.01 * size
    assert abs(share - gain) < errors[1] + 0.01 * size
    assert has_gain is (share != 0.0) or abs(share) < 0.02 * size
    assert abs(at - moment * N * STEP_S) <= errors[2] + 20 * STEP_S


@pytest.mark.parametrize(("left", "said"), [(0.1, "leaves 0.1 (rms)"), (0.0, "leaves no more than noise")])
def test_what_a_drift_leaves_is_told_as_noise_where_it_is_no_more(monkeypatch, left, said):
    """It was told as 0 um."""
    drift, zeros = given_drift.Drifted(OffsetDrift(), (0.01, 0.0), (0.001, 0.001)), np.zeros(N)
    monkeypatch.setattr(given_drift, "_with_drift", lambda *_: (drift, zeros, zeros + 0.9))
    judged = SimpleNamespace(measured=zeros, predicted=zeros + 1.0, polarity=1)
    judged.left_by = lambda predicted: left if predicted is zeros else 1.0
    finding, _ = _told(monkeypatch, judged)
    assert said in wording.cause_text(finding, wording.PLAIN)


def _strained(noise: np.random.Generator) -> tuple[pt.Run, float]:
    """A ferroelectric, whose strain goes with the square of its polarisation: no Preisach operator."""
    tips = [
        0.0,
        *[
            s * a
            for a in (2, 2, 1.8, 1.5, 1.5, 1.2, 1, 0.8, 0.6, 2, 2, 1.9, 1.6, 1.3, 1.1, 0.7, 2)
            for s in (1, -1)
        ],
        0.0,
    ]
    n = 8000
    u = np.interp(np.arange(n), np.linspace(0.0, n - 1, len(tips)), tips)
    width = np.linspace(0.2, 1.6, 40)
    share = np.exp(-(((width - 0.85) / 0.18) ** 2))
    play = np.zeros((n, width.size))
    for k in range(1, n):
        play[k] = np.clip(play[k - 1], u[k] - width, u[k] + width)
    polarised = np.tanh(play / 0.22) @ (share / share.sum())
    y = polarised**2 + 0.05 * polarised * u
    span = float(np.ptp(y))
    y = y + 0.003 * span * noise.standard_normal(n)
    return pt.Run(time_s=np.arange(n) * 0.01, input=u, output=y, input_unit="kV/mm", output_unit="mm/m"), span


def test_a_step_that_one_tenth_of_the_time_holds_may_be_nothing():
    """Without that tenth nothing is known of it."""
    left = (np.arange(N) >= 0.95 * N) + 0.01 * np.random.default_rng(1).standard_normal(N)
    bins = SimpleNamespace(average=_average)
    problem = SimpleNamespace(bins=bins, frames=[FRAME], time_s=_average([np.arange(N) * STEP_S]))
    found = given_drift.step_in(_average([left]), [np.zeros(N)], problem)
    assert abs(found.values[0] - 1.0) < 0.01
    assert 2.26 * found.errors[0] > found.values[0]


def test_a_step_that_weights_of_either_sign_absorb_is_told_by_the_model_as_given():
    """A jump by 3.1 % of the span, to be seen with the naked eye, was too small to matter."""
    sound, span = _strained(np.random.default_rng(1))
    other, _ = _strained(np.random.default_rng(2))
    model = pt.identify(sound)
    assert model.form == "signed"
    after = np.arange(8000) >= 3800
    found = pt.diagnose(replace(other, output=other.output + 0.031 * span * after), model, seed=1)
    assert found.verdict == "step"
    assert abs(found.found[0].parameters[0].value / span - 0.031) < 0.002
    assert abs(found.found[0].parameters[2].value - 38.0) < 0.2
    assert pt.diagnose(other, model, seed=1).verdict in ("none", "inconclusive")
