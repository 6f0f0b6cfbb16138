"""The units of the record itself: what a second is, and that nothing but the record decides it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pulsetrainer as pt
import wording
from pulsetrainer.core import excitations
from pulsetrainer.core.pulses import Shape
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.unlisted import STATES
from pulsetrainer.diagnosis.finding import Estimate
from pulsetrainer.diagnosis.scale import Scale, scale_of, second_of
from pulsetrainer.errors import DataError

SIGNAL = excitations.diagnostic(0.0, 1.5, rate_Hz=200.0).value
FACTORS = st.floats(-9, 6).map(lambda power: 10.0**power)


def _second(u, dt: float, low: float = 0.0, high: float = 1.5, stamps=None) -> float:
    return second_of([Record(u, u, dt_s=dt)], [stamps], low, high)


def test_a_second_of_the_diagnostic_signal_is_a_second():
    """All numbers of the diagnosis were tuned on it."""
    assert _second(SIGNAL, 1 / 200) == pytest.approx(1.0, rel=0.01)


@settings(max_examples=30, deadline=None)
@given(FACTORS, FACTORS, st.floats(-1e3, 1e3))
def test_a_second_goes_with_the_time_and_with_nothing_else(k, a, b):
    """Time t -> k t multiplies it by k; an input u -> a u + b leaves it.

    Within a thousandth: rounding in an input without noise is noise of its own.
    """
    shift = a * b
    moved = _second(a * SIGNAL + shift, k / 200, shift, 1.5 * a + shift)
    assert moved == pytest.approx(k * _second(SIGNAL, 1 / 200), rel=1e-3)


@pytest.mark.parametrize("power", [-30, -1, 1, 20])
def test_powers_of_two_change_no_digit(power):
    """Of the time and of the input: exactly the same second."""
    factor = 2.0**power
    assert _second(SIGNAL, factor / 256) == factor * _second(SIGNAL, 1 / 256)
    assert _second(factor * SIGNAL, 1 / 256, 0.0, 1.5 * factor) == _second(SIGNAL, 1 / 256)


@pytest.mark.parametrize("noise", [0.0, 0.0005, 0.003])
@pytest.mark.parametrize("faster", [1, 10])
def test_neither_noise_nor_more_samples_change_a_second(noise, faster):
    """Ten samples for one, and noise of up to 0.3 % of the range, by less than 2 %."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=200.0 * faster).value
    u = u + 1.5 * noise * np.random.default_rng(3).standard_normal(u.size)
    assert _second(u, 1 / 200 / faster) == pytest.approx(_second(SIGNAL, 1 / 200), rel=0.02)


def test_holds_do_not_count_and_uneven_stamps_do():
    """Ten minutes of rest at the end; the same path at other moments."""
    rested = np.append(SIGNAL, np.zeros(200 * 600))
    assert _second(rested, 1 / 200) == pytest.approx(_second(SIGNAL, 1 / 200), rel=0.03)
    slow = np.arange(SIGNAL.size) * 0.02
    assert _second(SIGNAL, 1 / 200, stamps=slow) == pytest.approx(4 * _second(SIGNAL, 1 / 200), rel=1e-6)


def test_a_step_and_a_hold_have_a_share_of_their_length():
    """Where the input hardly moves there is no typical rate."""
    u = np.append(np.zeros(10), np.ones(89_990))
    assert _second(u, 0.1, high=1.0) == pytest.approx(3.0, rel=1e-3)


def test_records_without_time_count_samples():
    """Their second is one sample."""
    assert second_of([Record(SIGNAL, SIGNAL)], [None], 0.0, 1.5) == 1.0


def test_every_unit_of_the_library_is_known():
    """And is what it says."""
    scale = Scale(reach=4.0, span=3.0, second=25.0)
    known = {
        "1": 1.0, "{u}": 4.0, "{y}": 3.0, "s": 25.0, "Hz": 1 / 25, "1/s": 1 / 25, "{y}/s": 3 / 25,
        "{u}/{y}": 4 / 3, "{y} s/{u}": 3 * 25 / 4, "1/({u})^2": 1 / 16, "({u})^2": 16.0, "({y})^2": 9.0,
        "{u}/s": 4 / 25, "{y}/s^2": 3 / 625, "{y}/({u})^2": 3 / 16, "({u} s)^0.5": 10.0,
    }  # fmt: skip
    of_causes = {quantity.unit for cause in library().values() for quantity in cause.parameters}
    assert of_causes | {state.unit for state in STATES} <= set(known)
    assert {unit: scale.of_unit(unit) for unit in known} == pytest.approx(known)
    assert scale.estimate(Estimate("tau", 2.0, "s", 1.0, 3.0)) == Estimate("tau", 50.0, "s", 25.0, 75.0)


def test_there_and_back():
    """A record in its own units and again in those it was measured in."""
    t = np.arange(500) * 0.1
    record = Record(3.0 + np.sin(t), 1e3 + 5.0 * np.cos(t), dt_s=0.1, reference=3.0 + np.sin(t))
    scale = scale_of([record], 2.0, 4.0, 7.0)
    own = scale.shrunk(record)
    assert own.dt_s == pytest.approx(0.1 / 7.0)
    assert (own.input.min(), own.input.max()) == pytest.approx((0.0, 1.0), abs=1e-3)
    assert np.ptp(own.output) == pytest.approx(1.0, abs=0.01)
    assert np.mean(own.output) == pytest.approx(0.0, abs=1e-9)
    back = scale.restored(own)
    np.testing.assert_allclose(back.input, record.input)
    np.testing.assert_allclose(back.output, record.output)
    np.testing.assert_allclose(back.reference, record.reference)
    assert back.dt_s == pytest.approx(0.1)
    np.testing.assert_allclose(scale.places(np.asarray([0.0, 1.0]), "{u}"), [2.0, 4.0])
    np.testing.assert_allclose(scale.places(np.asarray([7.0]), "1/s"), [1.0])


@pytest.mark.parametrize(
    ("hum", "frequency", "per"), [(0.0, 50.0, 12), (0.01, 50.0, 8), (0.01, 120.0, 3), (0.01, 20.0, 12)]
)
def test_averages_do_not_fold_a_hum(hum, frequency, per):
    """Means of twelve samples would show 50 Hz as 33.3: where a hum stands out there are fewer in each."""
    t = np.arange(240_000) / 1000.0
    u = 0.5 - 0.5 * np.cos(2.0 * np.pi * t / 20.0)
    y = u**2 + hum * np.sin(2.0 * np.pi * frequency * t)
    y = y + 0.003 * np.random.default_rng(4).standard_normal(t.size)
    record = Record(u, y, dt_s=1e-3)
    second = second_of([record], [None], 0.0, 1.0)
    assert scale_of([record], 0.0, 1.0, second).shrunk(record).averaged == per


@pytest.mark.parametrize("unit", [1.0, 1e-12])
def test_a_pulse_that_is_stretched_is_said_to_be_in_any_unit(unit):
    """One that goes from a quarter of the reach to three quarters, not one that goes over all of it."""
    u = np.concatenate((np.linspace(0, 1, 200), np.linspace(1, 0, 200)))
    model = pt.identify(pt.Run(time_s=np.arange(400) / 100, input=u, output=100 * unit * u), levels=8)
    level = unit * (25.0 + 50.0 * np.sin(np.linspace(0.0, np.pi, 100, endpoint=False)))
    pulse = Shape("tall", np.arange(100) / 100, level)
    whole = Shape("whole", pulse.time_s, 100 * unit * pulse.normalised)
    assert [len(pt.invert(one, model).notes) for one in (pulse, whole)] == [1, 0]


def test_a_pulse_that_is_over_within_a_few_samples_is_refused():
    """Of 19 ms at the 1 kHz of our own device; twenty samples are taken, and 19 ms of a faster driver."""
    u = np.concatenate((np.linspace(0, 1, 200), np.linspace(1, 0, 200)))
    model = pt.identify(pt.Run(time_s=np.arange(400) / 100, input=u, output=2.0 * u), levels=8)
    model = replace(model, captured=True)
    level = np.sin(np.linspace(0.0, np.pi, 100, endpoint=False))
    short, enough = (Shape("quick", seconds * np.arange(100) / 100, level) for seconds in (0.019, 0.0201))
    with wording.raises(DataError, "too short a pulse", pulse="quick", period="19 ms", rate="1000 samples"):
        pt.invert(short, model)
    assert pt.invert(enough, model).period_s == pytest.approx(0.0201)
    assert pt.invert(short, model, rate_Hz=1060.0).period_s == pytest.approx(0.019)


@pytest.mark.parametrize("unit", [1.0, 1e-9])
def test_a_diagnosis_over_another_range_extends_no_model_in_any_unit(unit):
    """Twice the range of the model."""
    model, found = (pt.load(f"tests/data/files-0.1/{name}.h5") for name in ("model", "diagnosis"))
    mine = replace(model, edges=unit * model.edges)
    others = replace(found, model="", extended=replace(mine, edges=2.0 * mine.edges))
    with pytest.raises(DataError):
        pt.extend(mine, others)
    assert pt.extend(mine, replace(others, extended=mine)).edges is mine.edges
