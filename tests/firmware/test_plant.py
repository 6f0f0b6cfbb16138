"""The simulated solenoid without imperfections: parameters, static hysteresis, coil and electronics."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from plant_harness import ROOT, TICK_S, call, harness, hold, path, run, with_current
from scipy import signal

DEVICES = [f"seed={seed}" for seed in range(1, 16)]


def parameters() -> dict[str, tuple[float, float, bool]]:
    """Name: low, high, and whether 0 means absent, as the device itself lists them."""
    rows = [line.split("\t") for line in call("list").stdout.decode().splitlines()]
    return {name: (float(low), float(high), kind == "1") for name, _, low, high, kind, _ in rows}


# ---- parameters and reproducibility


def test_every_parameter_refuses_what_is_outside_its_range() -> None:
    """The ends of the range are taken, beyond them and NaN are refused with -2."""
    for name, (low, high, effect) in parameters().items():
        for value in (low, high, *([0.0] if effect else [])):
            assert call(f"{name}={value:.9g}").returncode == 0, (name, value)
        above, below = 1e-3 * max(1.0, abs(high)), 1e-3 * abs(low) if low else 1e-3
        for value in (math.nan, high + above, low - below):
            refused = call(f"{name}={value:.9g}")
            assert refused.returncode == 2, (name, value)
            assert refused.stderr.decode().strip() == f"{name}: -2"


def test_an_unknown_parameter_is_refused() -> None:
    """A name must match whole: neither a beginning nor a continuation of one will do."""
    for name in ("cree", "creeps", ""):
        refused = call(f"{name}=0")
        assert (refused.returncode, refused.stderr.decode().strip()) == (2, f"{name}: -1")


def test_the_bits_depend_on_nothing_but_parameters_and_input() -> None:
    """Two runs, two levels of optimisation: one result to the last bit."""
    duty = 0.3 + 0.3 * np.sin(np.arange(20_000) * 1e-3)
    arguments = ("base=as-built", "seed=5", "resonance=60", "rate-widening=0.003", "periodic=0.1")
    first = run(duty, *arguments)
    for program in (harness("-O2"), harness("-O0")):
        np.testing.assert_array_equal(np.array(run(duty, *arguments, program=program)), np.array(first))


def test_single_precision_is_the_same_device() -> None:
    """Built for a small target the plant stays within a conversion step of itself."""
    duty = 0.3 + 0.3 * np.sin(np.arange(20_000) * 1e-3)
    quiet = ("base=as-built", "noise=0", "current-noise=0")
    small = run(duty, *quiet, program=harness("-O2", "float"))
    np.testing.assert_allclose(small.force, run(duty, *quiet).force, atol=1e-3)


def test_a_noise_seed_draws_other_noise_on_the_same_device() -> None:
    """The device stays, its noise does not."""
    one, two = (run(hold(0.3, 0.5), "base=as-built", f"noise-seed={k}") for k in (0, 1))
    np.testing.assert_array_equal(one.force, two.force)
    assert abs(np.corrcoef(one.adc_force[2000:], two.adc_force[2000:])[0, 1]) < 0.1


def test_each_seed_is_another_device_of_the_same_kind() -> None:
    """Full force stays within 13 to 14.5 N, no two loops are alike."""
    up_down = path(0, 1.5, 0)
    loops = np.array([with_current(up_down, seed).force for seed in DEVICES])
    assert np.all((loops.max(axis=1) > 13.0) & (loops.max(axis=1) < 14.5))
    apart = np.abs(loops[:, None] - loops[None]).max(axis=2)[np.triu_indices(len(DEVICES), 1)]
    assert apart.min() > 0.05
    assert np.abs(loops - with_current(up_down).force).max(axis=1).max() < 2.5  # and still the same kind


@pytest.mark.parametrize("seed", ["seed=0", *DEVICES[:5]])
def test_noise_never_reaches_the_force_limit(seed: str) -> None:
    """At full current every sample stays below 14.6 N, clear of the 15 N at which the firmware trips."""
    full = with_current(np.r_[path(0, 1.5), hold(1.5, 3)], "base=as-built", seed)
    assert full.adc_force.max() / 4095 * 18 - 1 < 14.6


# ---- static hysteresis


def test_force_range_and_remanence() -> None:
    """Demagnetised 0 N at 0 A, 14 N at 1.5 A, a small remanence, a wide loop."""
    loop = with_current(path(0, 1.5, 0, 1.5)).force
    n = loop.size // 3
    assert abs(with_current([0.0]).force[0]) < 1e-12
    assert loop[n - 1] == pytest.approx(14.0, abs=0.01)
    assert 0.1 < loop[2 * n - 1] < 0.6
    rising, falling = loop[2 * n :], loop[n : 2 * n][::-1]
    assert np.all(falling[10:-10] - rising[10:-10] > 0)
    assert 5.0 < np.max(falling[1:] - rising[:-1]) < 7.0


def test_rate_independence() -> None:
    """Stretched in time tenfold, the input gives the same force at the same place."""
    slow = path(0, 1.5, 0.2, 1.1, 0.5, 0.9, 0, rate=1.0)
    fast = slow[9::10]
    np.testing.assert_allclose(with_current(fast).force, with_current(slow).force[9::10], atol=1e-9)


def test_wiping_out() -> None:
    """Inner loops leave no trace once the input has passed them."""
    plain = with_current(path(0, 1.2, 0.3, 1.3, 0)).force
    visited = with_current(path(0, 1.2, 0.3, 0.9, 0.5, 0.8, 0.4, 1.1, 0.6, 1.3, 0)).force
    tail = path(1.2, 1.3, 0).size
    np.testing.assert_allclose(visited[-tail:], plain[-tail:], atol=1e-9)


def test_a_minor_loop_closes() -> None:
    """Return-point memory: back at the turning point the force is what it was."""
    around = with_current(path(0, 1.2, 0.5, 1.2)).force
    start = path(0, 1.2).size - 1
    assert around[-1] == pytest.approx(around[start], abs=1e-12)


def test_congruency() -> None:
    """Minor loops between the same fields have the same shape, wherever they hang."""
    cycle = path(0.4, 0.8, 0.4).size
    shapes = []
    for history in ((0.0, 0.4), (0.0, 1.5, 0.4), (0.0, 1.0, 0.2, 0.9, 0.4)):
        force = with_current(path(*history, 0.8, 0.4, 0.8, 0.4)).force[-cycle:]
        shapes.append(force - force[-1])
    np.testing.assert_allclose(shapes[1], shapes[0], atol=1e-9)
    np.testing.assert_allclose(shapes[2], shapes[0], atol=1e-9)


def test_first_order_curves_predict_every_history() -> None:
    """A signed sum of the drops measured on first-order reversals gives a path of many reversals."""

    def drop(top: float, low: float) -> float:
        """Force lost from `top` down to `low`, measured after saturation and a rise to `top`."""
        force = with_current(path(0, 1.5, 0, top, low)).force
        return float(force[path(0, 1.5, 0, top).size - 1] - force[-1])

    corners = (0.0, 1.5, 0.21, 1.13, 0.47, 0.99, 0.52, 0.85)
    force = with_current(path(*corners)).force
    expected = force[path(*corners[:2]).size - 1]
    for number, (a, b) in enumerate(itertools.pairwise(corners[1:])):
        expected += -drop(a, b) if number % 2 == 0 else drop(b, a)
    assert force[-1] == pytest.approx(expected, abs=1e-9)


def test_the_density_is_nowhere_negative_and_smooth() -> None:
    """Mixed differences of first-order reversal curves are the Preisach density: a single smooth hill."""
    nodes = np.linspace(0.05, 1.45, 29)
    table = np.full((29, 29), np.nan)
    for i, low in enumerate(nodes):
        rise = with_current(path(0, 1.5, low, 1.5)).force[-path(low, 1.5).size :]
        table[i, i:] = np.interp(nodes[i:], path(low, 1.5), rise)
    density = -np.diff(np.diff(table, axis=0), axis=1)
    density = density[np.isfinite(density)]
    assert density.min() > -1e-6
    assert density.max() < 0.2  # N per cell of 50 mA: no cell stands out


def test_more_turning_points_than_the_memory_holds() -> None:
    """The force stays near the truth, and the rest is forgotten once the outermost loop is wiped out."""
    lows, tops = np.linspace(0.3, 0.7, 300), np.linspace(1.2, 0.8, 300)
    spiral = np.stack((lows, tops), axis=1).ravel()
    current = path(0, 1.4, *spiral, 1.5, 0, rate=10)
    force = with_current(current).force
    assert np.abs(np.diff(force)).max() < 0.2
    tail = path(1.4, 1.5, 0, rate=10).size
    plain = with_current(path(0, 1.5, 0, rate=10)).force
    np.testing.assert_allclose(force[-tail:], plain[-tail:], atol=1e-9)


# ---- coil


def test_coil_step_response() -> None:
    """Current approaches (duty V - (1 - duty) diode) / R with tau = L/R, and the diode stops it at 0."""
    settings = ("supply=12", "resistance=6", "inductance=0.03")
    current = run(np.r_[hold(0.5, 0.1), hold(0.0, 0.1)], *settings).current
    final, tau = (0.5 * 12 - 0.5 * 0.6) / 6, 0.03 / 6
    time = TICK_S * np.arange(1, 1001)
    np.testing.assert_allclose(current[:1000], final * (1 - np.exp(-time / tau)), rtol=1e-9)
    falling = np.maximum(0.0, (current[999] + 0.1) * np.exp(-time / tau) - 0.1)
    np.testing.assert_allclose(current[1000:], falling, atol=1e-9)
    assert current[-1] == 0.0


# ---- electronics


def butterworth_gain(frequency_hz: float) -> float:
    """Gain of the current channel for a sine of 0.9 A, by regression on its conversions."""
    phase = 2 * np.pi * frequency_hz * TICK_S * np.arange(20_000)
    read = with_current(1 + 0.9 * np.sin(phase)).adc_current[200:] / 4095 * 2
    basis = np.stack((np.sin(phase), np.cos(phase), np.ones_like(phase)))[:, 200:]
    return float(np.hypot(*np.linalg.lstsq(basis.T, read, rcond=None)[0][:2]) / 0.9)


def test_butterworth_gain() -> None:
    """Flat below, -3 dB at 2.5 kHz, fifth order above: (tan ratio)^5 of the bilinear transform."""
    assert butterworth_gain(101.0) == pytest.approx(1.0, abs=2e-3)
    assert 20 * math.log10(butterworth_gain(2499.9)) == pytest.approx(-3.01, abs=0.03)
    for frequency_hz in (3303.0, 3907.0):
        warped = math.tan(math.pi * frequency_hz * TICK_S)
        assert butterworth_gain(frequency_hz) == pytest.approx(1 / math.sqrt(1 + warped**10), rel=0.03)


def test_butterworth_in_time() -> None:
    """The whole filter agrees with scipy's, to the conversion step."""
    current = np.r_[hold(0, 0.01), hold(1.2, 0.01), path(1.2, 0.3, rate=50), hold(0.3, 0.01)]
    taps = signal.butter(5, 2500, fs=1e4, output="sos")
    expected = np.clip(np.floor(signal.sosfilt(taps, current) / 2 * 4095 + 0.5), 0, 4095)
    assert np.abs(with_current(current).adc_current - expected).max() <= 1


def test_conversions() -> None:
    """12 bits, 0..2 A and -1..17 N, clipped at their ends."""
    level = with_current(np.r_[path(0, 1.0), hold(1.0, 0.1)])
    assert level.adc_current[-1] == pytest.approx(1.0 / 2 * 4095, abs=0.5)
    assert level.adc_force[-1] == pytest.approx((level.force[-1] + 1) / 18 * 4095, abs=0.5 + 1e-9)
    assert with_current(hold(2.5, 0.1)).adc_current.max() == 4095
    assert with_current(hold(0, 0.1), "condition-offset=-3").adc_force.max() == 0
    assert with_current(path(0, 1.5), "condition-offset=5").adc_force.max() == 4095


def test_sensor_noise() -> None:
    """White, bell-shaped, of the stated strength, and independent between the channels."""
    noisy = with_current(hold(1.0, 10), "base=ideal", "noise=0.01", "current-noise=0.005")
    force = (noisy.adc_force / 4095 * 18 - 1)[1000:] - noisy.force[-1]
    current = (noisy.adc_current / 4095 * 2)[1000:] - 1.0
    assert force.std() == pytest.approx(0.01 * 15, rel=0.02)
    assert current.std() == pytest.approx(0.005, rel=0.02)
    for channel in (force, current):
        assert abs(channel.mean()) < 4 * channel.std() / math.sqrt(channel.size)
        assert abs(np.corrcoef(channel[1:], channel[:-1])[0, 1]) < 0.015
        assert np.mean(channel**4) / np.mean(channel**2) ** 2 == pytest.approx(3.0, abs=0.25)
    assert abs(np.corrcoef(force, current)[0, 1]) < 0.015


# ---- the device as built


@pytest.mark.parametrize(("pulse", "mean_percent"), [("normal", (10, 14)), ("bifid", (5, 9))])
def test_the_scaled_drive_errs_as_published(pulse: str, mean_percent: tuple[float, float]) -> None:
    """A current proportional to the wanted force misses by 25 to 32 % of full force at worst."""
    table = np.genfromtxt(ROOT / "waveforms" / f"{pulse}.csv", delimiter=",", comments="#", skip_header=1)
    table = table[np.isfinite(table).all(axis=1)]
    period = round((table[-1, 0] + table[1, 0] - table[0, 0]) / TICK_S)
    shape = np.interp(np.arange(period) * TICK_S, table[:, 0], table[:, 1])
    before = path(0, 1.5, 0)
    force = with_current(np.r_[before, np.tile(1.5 * shape, 4)], "base=as-built").force
    low, high = force[before.size - 1], force[: before.size].max()
    error = (force[-period:] - (low + shape * (high - low))) / high * 100
    assert 25 < np.abs(error).max() < 32
    assert mean_percent[0] < np.abs(error).mean() < mean_percent[1]
