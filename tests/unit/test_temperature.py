"""The coil's temperature from the duty: from records that are made by the equation itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pulsetrainer.core.temperature import COPPER_PER_K, CoilRecord, Thermal, Thermometer, Windows, record_of

DT_S = 1e-3
COLD = CoilRecord(0.397, 0.0476, 0.0016, 0.012, 1e-4, 20.0)
TERM = Thermal(0.006, 20.0)


def telemetry(seconds: float, ambient_K: float = 0.0, seed: int = 0, rise: float = COLD.rise_per_A2):
    """Time, reference, current and duty of strokes through a coil in a warmer room, with the loop's noise."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(round(seconds / DT_S)) * DT_S
    top = np.interp(time_s, np.linspace(0, seconds, 30), rng.uniform(0.4, 1.5, 30))
    current = top * (0.5 - 0.5 * np.cos(2 * np.pi * 0.7 * time_s))
    heat = np.empty(time_s.size)
    now = 0.0
    for k, square in enumerate(current**2):
        now += DT_S / COLD.rise_tau_s * (square - now)
        heat[k] = now
    warm = (1 + COPPER_PER_K * ambient_K) * (1 + rise * heat)
    slope = np.gradient(current, DT_S)
    duty = COLD.duty_offset + COLD.duty_per_A * warm * current + COLD.duty_s_per_A * slope
    noisy = duty + 6e-4 * rng.standard_normal(duty.size)
    return time_s, current, current + 4e-4 * rng.standard_normal(duty.size), noisy, warm - 1.0, heat


def test_a_capture_tells_the_coil_and_how_it_warms():
    """Within a thousandth of the resistance and a tenth of the rise; where nothing warms it says so."""
    windows = Windows()
    windows.add(*telemetry(90.0)[:4])
    found = record_of(windows)
    assert found.duty_per_A == pytest.approx(COLD.duty_per_A, rel=1e-3)
    assert found.duty_offset == pytest.approx(COLD.duty_offset, abs=2e-4)
    assert found.duty_s_per_A == pytest.approx(COLD.duty_s_per_A, rel=0.05)
    assert found.rise_per_A2 == pytest.approx(COLD.rise_per_A2, rel=0.1)
    assert found.rise_tau_s == pytest.approx(20.0, rel=0.3)
    windows.begin_part()
    rest_s = 90.0 + DT_S * np.arange(5000)
    windows.add(rest_s, *np.zeros((3, rest_s.size)))
    assert record_of(windows) == found  # what the coil does without current tells nothing of it
    cold = Windows()
    cold.add(*telemetry(90.0, rise=0.0)[:4])
    assert record_of(cold).rise_per_A2 < 0.1 * COLD.rise_per_A2


def test_the_error_of_the_rise_is_what_repeats_scatter():
    """Six calibrations of one coil: they lie as far from the truth as they say."""
    off = []
    for seed in range(6):
        windows = Windows()
        windows.add(*telemetry(60.0, seed=seed)[:4])
        found = record_of(windows)
        off.append((found.rise_per_A2 - COLD.rise_per_A2) / found.rise_error_per_A2)
    assert 0.2 < np.sqrt(np.mean(np.square(off))) < 3.0


def test_too_short_a_record_tells_nothing():
    """A few seconds are no calibration."""
    windows = Windows()
    windows.add(*telemetry(5.0)[:4])
    assert record_of(windows) is None
    assert record_of(Windows()) is None


@pytest.mark.parametrize("pieces", [1, 7, 400])
def test_windows_do_not_depend_on_how_telemetry_comes(pieces):
    """In one go or in blocks: the same bits."""
    columns = telemetry(20.0)[:4]
    whole, cut = Windows(), Windows()
    whole.add(*columns)
    for piece in zip(*(np.array_split(column, pieces) for column in columns), strict=True):
        cut.add(*piece)
    np.testing.assert_array_equal(np.array(whole.rows), np.array(cut.rows))


@pytest.mark.parametrize("ambient_K", [-20.0, 0.0, 13.0, 20.0])
def test_temperature_and_the_force_it_costs(ambient_K):
    """Within half a kelvin; what the model does not know is the room's share, 0.195 % a kelvin."""
    meter = Thermometer(COLD, TERM)
    time_s, reference, current, duty, _, heat = telemetry(40.0, ambient_K, seed=3)
    for start in range(0, time_s.size, 250):
        piece = slice(start, start + 250)
        meter.add(time_s[piece], reference[piece], current[piece], duty[piece])
    own = COLD.rise_per_A2 * heat[-500] / COPPER_PER_K
    assert meter.known
    assert meter.share == pytest.approx(0.5)
    assert meter.temperature_K == pytest.approx(ambient_K + own, abs=0.5)
    assert meter.extra == pytest.approx(0.00195 * ambient_K, abs=0.002)


def test_a_drive_by_itself_begins_with_the_heat_that_is_there():
    """After a restart the model is cold again and all of the loss is beyond it."""
    meter = Thermometer(COLD, TERM)
    meter.add(*telemetry(60.0, 10.0)[:4])
    loss = meter.loss
    assert meter.extra < loss
    meter.restart()
    assert meter.extra == loss


def test_lost_samples_and_no_current_tell_nothing_false():
    """NaN is left out, and a coil without current keeps its last reading."""
    meter = Thermometer(COLD, TERM)
    time_s, reference, current, duty, _, _ = telemetry(20.0, 15.0)
    gone = duty.copy()
    gone[3000:3400] = np.nan
    meter.add(time_s, reference, current, gone)
    before = meter.temperature_K
    assert before == pytest.approx(15.0, abs=3.0)
    rest = time_s[-1] + DT_S * np.arange(1, 5000)
    meter.add(rest[:2500], *np.zeros((3, 2500)))  # ends the window that was under way
    assert not meter.add(rest[2500:], *np.zeros((3, 2499)))
    assert meter.temperature_K == pytest.approx(before, abs=0.5)


def test_a_window_at_the_foot_of_a_pulse_hardly_moves_what_is_known():
    """There a thousandth of the duty looks like six kelvin; the first window is believed all the same."""
    meter, alone = Thermometer(COLD, TERM), Thermometer(COLD, TERM)
    meter.add(*telemetry(20.0, 5.0)[:4])
    before_K = meter.temperature_K
    time_s, foot = 20.0 + DT_S * np.arange(1002), np.full(1002, 0.13)
    duty = COLD.duty_offset - 1e-3 + COLD.duty_per_A * foot
    assert meter.add(time_s, foot, foot, duty)
    assert abs(meter.temperature_K - before_K) < 0.5
    assert alone.add(time_s, foot, foot, duty)
    assert alone.temperature_K == pytest.approx(-5.0, abs=0.5)


def test_a_window_of_one_steep_fall_tells_nothing():
    """There e counts for kelvins, and it is known to a quarter: the reading before it stays."""
    meter = Thermometer(replace(COLD, duty_s_per_A=0.75 * COLD.duty_s_per_A), TERM)
    time_s, reference, current, duty, _, _ = telemetry(20.0, 15.0)
    meter.add(time_s, reference, current, duty)
    meter.begin_part()
    before = meter.temperature_K
    fall = np.interp(np.arange(2000) * DT_S, [0.0, 0.1], [1.2, 0.0])
    needed = COLD.duty_offset + COLD.duty_per_A * 1.07 * fall + COLD.duty_s_per_A * np.gradient(fall, DT_S)
    assert not meter.add(time_s[-1] + DT_S * np.arange(1, 2001), fall, fall, needed)
    assert meter.temperature_K == before == pytest.approx(15.0, abs=3.0)


def test_without_a_clear_rise_half_is_taken():
    """The share of the force comes from model and record only where both are sure."""
    vague = CoilRecord(0.397, 0.0476, 0.0016, 0.012, 0.004, 20.0)
    assert Thermometer(vague, TERM).share == 0.5
    assert Thermometer(COLD, Thermal(0.0072, 20.0)).share == pytest.approx(0.6)
    without = Thermometer(COLD)
    without.add(*telemetry(10.0, 10.0)[:4])
    assert without.share == 0.5
    assert without.extra == without.loss == pytest.approx(0.5 * COPPER_PER_K * without.temperature_K)


def test_no_window_goes_across_two_parts():
    """The device was off between them: each window has samples of one part only, and none is lost within."""
    windows = Windows()
    time_s = np.arange(0.0, 4.8, 0.001)
    first = time_s < 2.4
    for part, current in ((time_s[first], 0.5), (time_s[~first], 1.0)):
        windows.begin_part()
        level = np.full(part.size, current)
        windows.add(part, level, level, np.full(part.size, 0.3))
    rows = np.array(windows.rows)
    np.testing.assert_allclose(rows[:, 3], [0.5, 0.5, 1.0, 1.0])
    np.testing.assert_allclose(rows[:, 1], 1000, atol=1)
