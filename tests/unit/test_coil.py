"""The coil as its driver sees it: found again from duty and current, gains by rule, margins of the loop."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.core.coil import (
    DIODE_V,
    Coil,
    Hold,
    LoopGains,
    delay_s,
    identify_coil,
    margins,
    simulated,
    tuned_gains,
)
from pulsetrainer.device.codes import PARAMETERS
from pulsetrainer.device.gains import DELIVERED, Gains
from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.steps.loop_gains import from_wire, to_wire

DT_S = 1e-4


def coil_of(ohm: float, henry: float, volts: float, sag_ohm: float = 0.0) -> Coil:
    """As its driver sees it."""
    return Coil((volts + DIODE_V) / ohm, DIODE_V / ohm, henry / ohm, sag=sag_ohm / ohm)


MOST = Gains.of({p.name: p.maximum for p in PARAMETERS})
COILS = st.builds(coil_of, st.floats(2, 10), st.floats(0.005, 0.1), st.floats(9, 24))


def holds(coil: Coil, seed: int = 1) -> list[Hold]:
    """Four holds as the converter reads them: 0.3 mA of noise in steps of 0.49 mA."""
    rng = np.random.default_rng(seed)
    found = []
    for current in (0.15, 0.35, 0.6, 0.9):
        duty = np.concatenate((np.zeros(10), np.full(1600, coil.duty_at(current))))
        read = simulated(coil, duty, DT_S) + 3e-4 * rng.standard_normal(duty.size)
        found.append(Hold(duty, np.rint(np.clip(read, 0, 2) * 4095 / 2) * 2 / 4095))
    return found


@pytest.mark.parametrize(
    ("ohm", "henry", "volts"), [(5, 0.012, 12), (2, 0.1, 9), (10, 0.005, 24), (2, 0.005, 24), (10, 0.1, 24)]
)
def test_resistance_and_inductance_are_found_again(ohm, henry, volts):
    """Within a part in a thousand and two, over the corners of the range; the supply too."""
    found = identify_coil(holds(coil_of(ohm, henry, volts)), DT_S)
    assert found.resistance_ohm == pytest.approx(ohm, rel=1e-3)
    assert found.inductance_H == pytest.approx(henry, rel=2e-3)
    assert found.supply_V == pytest.approx(volts, rel=1e-3)
    assert found.scaled_to(volts) == pytest.approx((ohm, henry), rel=2e-3)
    assert found.sag == 0.0


def test_a_supply_that_sags_is_told_from_another_resistance():
    """Three ohm in the supply: by a steady one the resistance would be far off."""
    found = identify_coil(holds(coil_of(5, 0.012, 12, sag_ohm=3.0)), DT_S)
    assert found.resistance_ohm == pytest.approx(5, rel=0.01)
    assert found.sag == pytest.approx(0.6, rel=0.05)


def test_lost_samples_are_passed_over():
    """A tenth of the samples gone, in blocks: the same coil."""
    whole = holds(coil_of(5, 0.012, 12))
    for hold in whole:
        for start in range(100, hold.duty.size, 300):
            hold.duty[start : start + 30] = hold.current_A[start : start + 30] = np.nan
    found = identify_coil(whole, DT_S)
    assert (found.resistance_ohm, found.inductance_H) == pytest.approx((5, 0.012), rel=3e-3)


def test_no_current_is_no_coil():
    """Nothing to fit."""
    with pytest.raises(DataError):
        identify_coil([Hold(np.full(100, 0.5), np.zeros(100))], DT_S)


def test_the_held_duty_holds():
    """The duty solves gain d - sag d^2 i = i + diode; beyond the supply it is infinite."""
    coil = coil_of(5, 0.012, 12, sag_ohm=2.0)
    duty = coil.duty_at(1.2)
    assert duty * 12.6 - DIODE_V - 2.0 * duty**2 * 1.2 == pytest.approx(5 * 1.2)
    assert coil_of(5, 0.012, 12, sag_ohm=5.0).duty_at(2.2) == math.inf


def test_the_feed_is_that_of_full_duty_where_the_supply_ends():
    """A supply that sags so far that no duty holds the whole range has gains all the same."""
    coil = coil_of(5, 0.012, 12, sag_ohm=5.0)
    assert coil.duty_at(coil.most_A) == pytest.approx(1.0)
    gains = tuned_gains(coil, DT_S, top_A=2.2)
    assert gains.feed_offset + gains.feed_resistance * coil.most_A == pytest.approx(1.0)
    assert to_wire(gains, DT_S).feed_resistance > 0


@given(COILS)
def test_the_rule_keeps_its_margins_on_every_coil(coil):
    """Internal-model control with lambda = theta: gain margin above pi, phase margin above 61 degrees."""
    found = margins(coil, tuned_gains(coil, DT_S), DT_S)
    assert found.stable
    assert found.gain > math.pi
    assert 61 < found.phase_deg < 90


@given(COILS)
def test_the_controllers_zero_cancels_the_pole_and_the_feed_is_the_coil(coil):
    """kp/ki = L/R; kp = tau / (gain 2 theta); feed-forward holds and moves any current."""
    gains = tuned_gains(coil, DT_S)
    assert gains.proportional / gains.integral == pytest.approx(coil.tau_s)
    assert gains.proportional * coil.gain_A * 2 * delay_s(DT_S) == pytest.approx(coil.tau_s)
    assert gains.feed_offset + gains.feed_resistance * 0.7 == pytest.approx(coil.duty_at(0.7))
    assert gains.feed_inductance * coil.gain_A == pytest.approx(coil.tau_s)


def test_margins_say_what_happens():
    """A closed loop in the time domain: just below the gain margin it settles, just above it swings."""
    coil = coil_of(5, 0.012, 12)
    gains = tuned_gains(coil, DT_S)
    edge = margins(coil, gains, DT_S).gain
    for factor, settles in ((0.95, True), (1.05, False)):
        stronger = LoopGains(gains.proportional * edge * factor, gains.integral * edge * factor, 0, 0, 0)
        assert margins(coil, stronger, DT_S).stable is settles
        assert (_swing(coil, stronger) < 1e-3) is settles


def _swing(coil: Coil, gains: LoopGains) -> float:
    """What a loop without limits has left of a step after half a second, of the step."""
    numerator, denominator = scipy.signal.butter(5, 2500, fs=1 / DT_S)
    state, now, integral, errors = np.zeros(5), 0.0, 0.0, []
    for _ in range(5000):
        read, state = scipy.signal.lfilter(numerator, denominator, [now], zi=state)
        errors.append(1.0 - float(read[0]))
        duty = gains.proportional * errors[-1] + integral
        integral += gains.integral * DT_S * errors[-1]
        now -= math.expm1(-DT_S / coil.tau_s) * (coil.gain_A * duty - now)
    return max(map(abs, errors[-100:]))


def test_the_best_that_any_gains_can_do():
    """Within what drives the coil it is the reference; beyond, the current rises and falls as it can."""
    slow = coil_of(2, 0.1, 9)
    gentle = np.linspace(0, 1.2, 3000)
    np.testing.assert_allclose(slow.best_possible(gentle, DT_S), gentle, atol=1e-12)
    falling = np.concatenate((np.full(5000, 1.0), np.zeros(2000)))
    decay = (1.0 + slow.diode_A) * np.exp(-DT_S * np.arange(1, 2001) / slow.tau_s) - slow.diode_A
    np.testing.assert_allclose(slow.best_possible(falling, DT_S)[5000:], np.maximum(decay, 0), atol=1e-9)


@given(COILS)
def test_gains_survive_the_wire(coil):
    """Counts and back: to a part in a hundred of the smallest."""
    gains = tuned_gains(coil, DT_S, most_proportional=from_wire(MOST, DT_S).proportional)
    back = from_wire(to_wire(gains, DT_S), DT_S)
    for name in LoopGains.__slots__:
        assert getattr(back, name) == pytest.approx(getattr(gains, name), rel=0.01)


def test_the_delivered_gains_feed_the_coil_that_they_are_for():
    """5 ohm and 20 mH at 12 V: the compiled feed-forward is the rule's, to its rounding."""
    wire = to_wire(tuned_gains(coil_of(5, 0.02, 12), DT_S), DT_S)
    for name in ("feed_resistance", "feed_inductance", "feed_offset"):
        assert wire.values()[name] == pytest.approx(DELIVERED.values()[name], rel=1e-3)


@pytest.mark.parametrize(
    "values", [{"pid_kp": 40_000}, {"pid_ki": -1}, {"feed_offset": 3.5}, {"pid_kp": True}]
)
def test_gains_that_no_device_takes_are_refused(values):
    """Out of range, or no whole number."""
    with pytest.raises(ArgumentError):
        Gains.of(DELIVERED.values() | values)


def test_a_missing_gain_is_refused():
    """Half a set of gains is none."""
    with pytest.raises(ArgumentError):
        Gains.of({"pid_kp": 100})
