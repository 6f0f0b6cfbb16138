"""Each imperfection of the simulated solenoid: absent at 0, and otherwise its own law."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from plant_harness import TICK_S, Run, Vector, call, hold, path, run, with_current

# A value at which each effect shows.
EFFECTS = {
    "noise": 0.01,
    "current-noise": 0.01,
    "delay": 0.005,
    "field-lag": 0.005,
    "rate-widening": 0.01,
    "load-dependence": 0.003,
    "accommodation": 0.1,
    "thermal-drift": 0.02,
    "ambient": 20,
    "supply-sag": 0.5,
    "coulomb": 0.2,
    "stick-slip": 0.4,
    "resonance": 40,
    "creep": 0.1,
    "viscous": 0.02,
    "output-lag": 0.005,
    "periodic": 0.2,
    "offset-drift": 0.05,
    "step": 0.3,
    "step-gain": 0.05,
    "condition-gain": 0.05,
    "condition-offset": 0.3,
    "outliers": 0.01,
    "saturation": 8,
    "quantisation": 0.1,
}
ALL_ABSENT = [f"{name}=0" for name in EFFECTS]
TEST_CURRENT = path(0, 1.5, 0.3, 1.2, 0, 1.0, rate=20)


def time_of(samples: int) -> Vector:
    """Return the time [s] at the end of each tick."""
    return np.arange(1, samples + 1, dtype=np.float64) * TICK_S


def test_the_list_above_is_complete() -> None:
    """Every effect of the device is tested here."""
    rows = [line.split("\t") for line in call("list").stdout.decode().splitlines()]
    assert {row[0] for row in rows if row[4] == "1"} == set(EFFECTS)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_shows_and_at_0_is_absent(name: str) -> None:
    """Nonzero it changes what is read; zero gives the very bits of a device that never heard of it."""
    settings = ("base=as-built", "step-time=0.1", *ALL_ABSENT)
    # a current that is imposed asks nothing of the supply
    play = partial(run, TEST_CURRENT / 1.5) if name == "supply-sag" else partial(with_current, TEST_CURRENT)
    without = play(*settings)
    shown = play(*settings, f"{name}={EFFECTS[name]}")
    back = play(*settings, f"{name}={EFFECTS[name]}", f"{name}=0")
    assert np.any(np.array(shown) != np.array(without))
    np.testing.assert_array_equal(np.array(back), np.array(without))


def test_the_ideal_device_has_noise_only() -> None:
    """`ideal` is the as-built device with every effect but the noise taken away."""
    ideal = with_current(TEST_CURRENT, "base=ideal", "noise=0", "current-noise=0")
    bare = with_current(TEST_CURRENT, "base=as-built", *ALL_ABSENT)
    np.testing.assert_array_equal(np.array(ideal), np.array(bare))


# ---- before the hysteresis


@pytest.mark.parametrize("ticks", [1, 37, 500])
def test_delay_is_an_exact_shifted_copy(ticks: int) -> None:
    """P[u(t - d)], sample for sample."""
    late = with_current(TEST_CURRENT, f"delay={ticks * TICK_S:.6f}")
    prompt = with_current(TEST_CURRENT)
    np.testing.assert_allclose(late.force[ticks:], prompt.force[:-ticks], atol=1e-9)
    assert np.all(late.field[:ticks] == 0)


def test_a_delay_between_ticks() -> None:
    """Half a tick more delays a straight line by half a tick more."""
    ramp = with_current(path(0, 1, rate=10), "delay=0.00125")
    np.testing.assert_allclose(ramp.field[20:], ramp.current[20:] - 10 * 0.00125, atol=1e-12)


def test_field_lag() -> None:
    """An exponential tail with the time constant after a stop, tau times the rate on a ramp."""
    tau, rate = 0.008, 20.0
    lagged = with_current(np.r_[path(0, 1.2, rate=rate), hold(1.2, 0.05)], f"field-lag={tau}")
    ramp = path(0, 1.2, rate=rate).size
    behind = lagged.current - lagged.field
    np.testing.assert_allclose(behind[:ramp], tau * rate * (1 - np.exp(-time_of(ramp) / tau)), atol=1e-9)
    np.testing.assert_allclose(
        behind[ramp:], behind[ramp - 1] * np.exp(-time_of(behind.size - ramp) / tau), atol=1e-9
    )


@pytest.mark.parametrize("rate", [0.5, 5.0, 50.0])
def test_rate_widening_grows_with_the_root_of_the_rate(rate: float) -> None:
    """On a ramp the field trails by k sqrt(rate), whichever way it goes."""
    k = 0.01
    run_ = with_current(path(0.0, 1.4, 0.2, rate=rate), f"rate-widening={k}")
    turn = path(0.0, 1.4, rate=rate).size
    behind = run_.current - run_.field
    assert behind[turn - 2] == pytest.approx(k * np.sqrt(rate), rel=0.01)
    assert behind[-1] == pytest.approx(-k * np.sqrt(rate), rel=0.01)


def test_rate_widening_relaxes_as_a_hyperbola() -> None:
    """At rest the excess e obeys e' = -(e/k)^2: it falls as e0 / (1 + e0 t/k^2), not as an exponential."""
    k = 0.01
    run_ = with_current(np.r_[path(0, 1, rate=50), hold(1, 0.05)], f"rate-widening={k}")
    behind = (run_.current - run_.field)[-500:]
    expected = behind[0] / (1 + behind[0] * TICK_S * np.arange(500) / k**2)
    np.testing.assert_allclose(behind, expected, rtol=1e-9)


def test_load_dependence() -> None:
    """The field is u + k y with y one tick old, and equal minor loops are no longer congruent."""
    k = 0.005
    loaded = with_current(TEST_CURRENT, f"load-dependence={k}")
    np.testing.assert_allclose(loaded.field[1:], loaded.current[1:] + k * loaded.force[:-1], atol=1e-12)

    def height(history: tuple[float, ...], *effect: str) -> float:
        force = with_current(path(*history, 0.4, 0.8, 0.4), *effect).force
        return float(force[-1 - path(0.8, 0.4).size] - force[-1])

    low, high = (0.0,), (0.0, 1.5)
    assert abs(height(low) - height(high)) < 1e-9
    assert abs(height(low, f"load-dependence={k}") - height(high, f"load-dependence={k}")) > 0.02


def accommodation_state(ticks: Run, path_A: float) -> Vector:
    """Low-pass of the magnetic force in the path length of the current, integrated plainly."""
    state, out = 0.0, np.empty_like(ticks.current)
    steps = np.abs(np.diff(ticks.current, prepend=0.0))
    for index, (force, step) in enumerate(zip(ticks.magnetic, steps, strict=True)):
        state += (force - state) * -np.expm1(-step / path_A)
        out[index] = state
    return out


def test_accommodation_follows_the_path_not_the_clock() -> None:
    """(y + c z)/(1 + c), z trailing y by a path of current; the same at half the speed; still at rest."""
    c = 0.2
    cycles = path(0, *([1.2, 0.2] * 12), rate=20)
    settings = (f"accommodation={c}", "accommodation-path=5")
    moved = with_current(cycles, *settings)
    expected = (moved.magnetic + c * accommodation_state(moved, 5.0)) / (1 + c)
    np.testing.assert_allclose(moved.force, expected, atol=0.02)
    slow = with_current(np.repeat(cycles, 2), *settings)
    np.testing.assert_allclose(slow.force[1::2], moved.force, atol=1e-9)
    resting = with_current(np.r_[cycles, hold(cycles[-1], 0.5)], *settings).force
    assert np.ptp(resting[cycles.size :]) == 0


# ---- between magnetic force and finger


def test_thermal_drift_of_the_force() -> None:
    """Y (1 - k theta) with theta = u^2 (1 - exp(-t/tau)) under a constant current, and back when cool."""
    k, tau = 0.02, 0.5
    warm = with_current(
        np.r_[hold(1.2, 2), hold(0.0, 4), hold(1.2, 0.01)], f"thermal-drift={k}", f"thermal-tau={tau}"
    )
    loss = 1 - warm.force[:20_000] / warm.magnetic[:20_000]
    np.testing.assert_allclose(loss, k * 1.2**2 * (1 - np.exp(-time_of(20_000) / tau)), atol=1e-9)
    assert warm.force[-50] / warm.magnetic[-50] > 1 - 0.05 * k * 1.2**2


def test_thermal_drift_of_the_coil() -> None:
    """The copper warms with it: at a constant duty the current falls as the resistance rises by 2 k theta."""
    k = 0.05
    current = run(hold(0.6, 3), f"thermal-drift={k}", "thermal-tau=0.2").current
    cold = (0.6 * 12 - 0.4 * 0.6) / 5
    assert current.max() == pytest.approx(cold, rel=0.02)
    assert current[-1] * (1 + 2 * k * current[-1] ** 2) == pytest.approx(cold, rel=1e-3)


def test_a_warmer_room_takes_force_and_adds_resistance() -> None:
    """Y (1 - 0.00195 K), R (1 + 0.0039 K), colder the other way round; with heat of its own they add up."""
    k, tau = 0.02, 0.5
    for ambient in (20.0, -15.0):
        room = with_current(hold(1.2, 2), f"ambient={ambient}", f"thermal-drift={k}", f"thermal-tau={tau}")
        own = k * 1.2**2 * (1 - np.exp(-time_of(20_000) / tau))
        np.testing.assert_allclose(1 - room.force / room.magnetic, own + 0.00195 * ambient, atol=1e-9)
        current = run(hold(0.5, 0.2), f"ambient={ambient}").current[-1]
        assert current == pytest.approx((0.5 * 12 - 0.5 * 0.6) / (5 * (1 + 0.0039 * ambient)), rel=1e-6)


def test_a_supply_that_sags() -> None:
    """The supply gives d i in the mean: i R = d (V - R_s d i) - (1 - d) 0.6 V."""
    current = run(hold(0.75, 0.2), "supply-sag=0.5").current[-1]
    assert 5 * current == pytest.approx(0.75 * (12 - 0.5 * 0.75 * current) - 0.25 * 0.6, rel=1e-6)


def test_another_coil_is_drawn_over_the_whole_range() -> None:
    """By free decay: L/R between 0.5 and 50 ms, none like another, and the device around it is the same."""
    drive = np.r_[hold(0.3, 0.3), hold(0.0, 0.01)]
    currents = {seed: run(drive, f"coil={seed}").current for seed in range(1, 41)}
    ends = np.array([current[2999] for current in currents.values()])
    lowest, highest = (0.3 * 9 - 0.42) / 10, (0.3 * 24 - 0.42) / 2
    assert lowest < ends.min() < 0.5
    assert 2.0 < ends.max() < highest
    assert np.unique(ends).size == 40
    imposed = path(0, 1.5, 0)
    np.testing.assert_array_equal(with_current(imposed, "coil=7").force, with_current(imposed).force)


def test_coulomb_friction() -> None:
    """The finger lags the magnetic force by F_c either way, holds at a reversal, and knows no rate."""
    friction = 0.3
    loop = with_current(path(0, 1.5, 0.2), f"coulomb={friction}")
    turn = path(0, 1.5).size
    assert loop.magnetic[turn - 1] - loop.force[turn - 1] == pytest.approx(friction, abs=1e-9)
    assert loop.magnetic[-1] - loop.force[-1] == pytest.approx(-friction, abs=1e-9)
    fallen = loop.magnetic[turn - 1] - loop.magnetic[turn:]
    first = loop.force[turn - 1] - loop.force[turn:]
    assert np.all(first[fallen < 0.2 * friction * 0.99] == 0)  # stuck
    assert np.all(np.diff(loop.force[turn:]) <= 0)
    slow = with_current(np.repeat(path(0, 1.5, 0.2), 7), f"coulomb={friction}")
    np.testing.assert_array_equal(slow.force[6::7], loop.force)


def test_stick_slip() -> None:
    """Flat runs, then jumps: stuck until the imbalance passes F_s, then at 0.4 F_s."""
    limit = 0.5
    slow = with_current(path(0, 1.5, 0, rate=1.0), f"stick-slip={limit}")
    jumps = np.diff(slow.force)
    assert np.mean(jumps == 0) > 0.99
    size = np.abs(jumps[jumps != 0])
    assert np.all((size > 0.6 * limit) & (size < 0.62 * limit))
    assert np.abs(slow.magnetic - slow.force).max() <= limit


def test_resonance() -> None:
    """After a step the force rings at the damped frequency, shrinks by the logarithmic decrement, settles."""
    natural, zeta = 45.0, 0.1
    rung = with_current(
        np.r_[hold(0.8, 0.01), hold(0.9, 0.5)], f"resonance={natural}", f"resonance-zeta={zeta}"
    )
    ringing = (rung.force - rung.magnetic)[100:]
    time = TICK_S * np.arange(ringing.size)
    damped = natural * np.sqrt(1 - zeta**2)
    crossings = np.flatnonzero(np.diff(np.sign(ringing)) != 0)[:10]
    at = time[crossings] + TICK_S * ringing[crossings] / (ringing[crossings] - ringing[crossings + 1])
    assert np.diff(at).mean() == pytest.approx(0.5 / damped, rel=1e-3)
    period = round(1 / damped / TICK_S)
    peaks = [np.abs(ringing[k * period : (k + 1) * period]).max() for k in (1, 2, 3, 4)]
    decrement = np.mean(np.diff(np.log(peaks)))
    assert decrement == pytest.approx(-2 * np.pi * zeta / np.sqrt(1 - zeta**2), rel=0.02)
    assert abs(ringing[-1]) < 1e-4


def test_creep() -> None:
    """Under a constant current the force rises from 1/(1 + c) of its final value by three exponentials."""
    c, tau = 0.2, 0.1
    held = with_current(hold(1.2, 4), f"creep={c}", f"creep-tau={tau}")
    final = held.magnetic[-1]
    time = time_of(held.force.size)
    slow = sum(
        share * (1 - np.exp(-time / (tau * ratio))) for share, ratio in ((0.3, 0.25), (0.4, 1.0), (0.3, 4.0))
    )
    np.testing.assert_allclose(held.force, final * (1 + c * slow) / (1 + c), rtol=1e-9)
    assert held.force[-1] == pytest.approx(final, rel=1e-4)


@pytest.mark.parametrize("c", [0.02, -0.02])
def test_viscous(c: float) -> None:
    """A jump of c times the change of rate, without a tail."""
    bent = with_current(np.r_[path(0, 0.6, rate=5), path(0.6, 1.2, rate=25)], f"viscous={c}")
    extra = bent.force - bent.magnetic
    bend = path(0, 0.6, rate=5).size
    np.testing.assert_allclose(extra[:bend], c * 5, atol=1e-9)
    np.testing.assert_allclose(extra[bend:], c * 25, atol=1e-9)


def test_output_lag() -> None:
    """Tau y' + y = P[u]: after a step of the magnetic force an exponential, no change of the field."""
    tau = 0.02
    late = with_current(hold(1.0, 0.2), f"output-lag={tau}")
    left = 1 - late.force / late.magnetic
    np.testing.assert_allclose(left[1:], left[0] * np.exp(-time_of(1999) / tau), atol=1e-9)
    np.testing.assert_array_equal(late.field, late.current)


# ---- between finger and amplifier


def test_periodic() -> None:
    """One line at its frequency with its amplitude, present at rest."""
    hum = with_current(hold(0.0, 10), "periodic=0.25", "periodic-frequency=12.3").sensed
    np.testing.assert_allclose(hum, 0.25 * np.sin(2 * np.pi * 12.3 * time_of(hum.size)), atol=1e-6)


def test_offset_drift() -> None:
    """A straight line in time, on the sensor alone."""
    drifting = with_current(hold(0.8, 2), "offset-drift=0.05")
    np.testing.assert_allclose(drifting.sensed - drifting.force, 0.05 * time_of(20_000), atol=1e-12)


def test_step_of_offset_and_gain() -> None:
    """Nothing before its time, gain and offset at once from then on."""
    stepped = with_current(hold(0.9, 1), "step=0.4", "step-gain=0.1", "step-time=0.5")
    np.testing.assert_array_equal(stepped.sensed[:4999], stepped.force[:4999])
    np.testing.assert_allclose(stepped.sensed[5000:], 1.1 * stepped.force[5000:] + 0.4, atol=1e-12)


def test_condition() -> None:
    """Gain and zero of this record, from power-on."""
    other = with_current(hold(0.9, 0.1), "condition-gain=-0.05", "condition-offset=0.2")
    np.testing.assert_allclose(other.sensed, 0.95 * other.force + 0.2, atol=1e-12)


def test_outliers() -> None:
    """About the stated share of isolated samples, each wrong by half to all of the stated size."""
    wild = with_current(hold(0.9, 5), "outliers=0.02", "outlier-size=3")
    error = wild.adc_force / 4095 * 18 - 1 - wild.sensed
    wrong = np.abs(error) > 0.01
    assert wrong.mean() == pytest.approx(0.02, rel=0.15)
    assert np.all((np.abs(error[wrong]) > 1.49) & (np.abs(error[wrong]) < 3.01))
    assert 0.4 < np.mean(error[wrong] > 0) < 0.6


def test_saturation_repeats_its_maximum() -> None:
    """Cut at the rail after the noise: the largest code comes again and again, and nothing else changes."""
    settings = ("base=ideal", "noise=0.003")
    free, cut = (
        with_current(path(0, 1.5, 0), *settings, *rail).adc_force for rail in ((), ("saturation=8",))
    )
    np.testing.assert_array_equal(cut, np.minimum(free, cut.max()))
    assert cut.max() == np.floor((8 + 1) / 18 * 4095 + 0.5)
    assert np.sum(cut == cut.max()) > 500


def test_quantisation() -> None:
    """Readings sit on multiples of the step, half a step from the truth at most."""
    coarse = with_current(path(0, 1.5, 0), "quantisation=0.25")
    read = coarse.adc_force / 4095 * 18 - 1
    assert np.abs(read / 0.25 - np.round(read / 0.25)).max() < 0.01
    assert np.abs(read - coarse.sensed).max() <= 0.125 + 18 / 4095
