"""Each cause alone: its formula against a closed form, its gate at both sides of each threshold."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import accumulate, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate

from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import causes, wording
from pulsetrainer.diagnosis.causes import condition_change, fired_on, library, outliers, rate_widening
from pulsetrainer.diagnosis.causes.frame import Frame, Past, low_pass, settled
from pulsetrainer.diagnosis.causes.step import _split
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.finding import Estimate, may_be_nothing
from pulsetrainer.diagnosis.procedure import diagnose
from pulsetrainer.diagnosis.raw import Raw, coarse_step, noise_beside_hum, noise_of, spacing_of
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.state import Question

CAUSE = library()
DT = 0.01
T = np.arange(400) * DT
RNG = np.random.default_rng(20260301)


def _frame(u=T, **more) -> Frame:
    return Frame(DT, np.asarray(u), span=2.0, reach=4.0, **more)


def _shown(name: str, y, *values: float, u=T, **more):
    return CAUSE[name].on_output(np.asarray(y, float), values, _frame(u, **more))


def _lagged(tau: float):
    """What a low-pass makes of t."""
    return T - tau + tau * np.exp(-T / tau)


# --- formulas
def test_lags_follow_a_ramp():
    """After the hysteresis and before it; without a time constant nothing is changed."""
    np.testing.assert_allclose(_shown("output-lag", T, 0.3), _lagged(0.3), atol=1e-12)
    np.testing.assert_allclose(CAUSE["field-lag"].on_input(T, T, (0.3,), _frame()), _lagged(0.3), atol=1e-12)
    assert low_pass(T, 1e-9, DT) is T
    assert low_pass(T, 2e-9, DT) is not T


@pytest.mark.parametrize(("between", "seen"), [(1.0, 1), (-1.0, 0)])
@pytest.mark.parametrize("name", ["output-lag", "field-lag"])
def test_a_lag_may_see_the_later_or_the_earlier_sample(name, between, seen):
    """Against many small steps through an input that stands still between two samples; parts go on."""
    u, tau, fine = RNG.standard_normal(40).cumsum(), 3 * DT, 4000
    slow = [u[0]]
    for pair in pairwise(u):
        y = slow[-1]
        for _ in range(fine):
            y += DT / fine / tau * (pair[seen] - y)
        slow.append(y)

    def behind(x: np.ndarray, past: Past) -> np.ndarray:
        frame = replace(_frame(x), past=past)
        cause = CAUSE[name]
        through = cause.on_output if cause.stage == "output" else partial(cause.on_input, x)
        return through(x, (tau, between), frame)

    first, rest = behind(u[:17], past := Past()), behind(u[17:], past.next())
    np.testing.assert_allclose([*first, *rest], slow, atol=1e-3)
    np.testing.assert_allclose(behind(u, Past()), slow, atol=1e-3)
    straight = behind(u, Past()) - low_pass(u, tau, DT)
    assert np.abs(straight).max() > 0.05  # it matters


def test_a_lag_keeps_what_it_sees_between_samples():
    """A model keeps one value or two; a long lag, or an averaged record, has no finer formula."""
    for name in ("output-lag", "field-lag"):
        plain, frame = CAUSE[name], _frame()
        (later, up), (earlier, down) = plain.finer(frame, (3 * DT,))
        assert up > 0 > down
        for fine in (later, earlier):
            assert fine.finer(frame, (3 * DT, up)) == []
            assert fine.coarser().quantities(frame) == plain.quantities(frame)
            assert [one.name for one in fine.quantities(frame)] == ["tau", "between"]
        assert plain.finer(frame, (60 * DT,)) == []
        assert plain.finer(replace(frame, averaged=4), (3 * DT,)) == []
        for values in [(0.3,), (0.3, -1.0)]:
            again, kept = plain.restored(values)
            assert (len(again.quantities(frame)), kept) == (len(values), values)


def test_an_end_of_what_lies_between_two_samples_is_an_answer():
    """Other ends of what was searched are told."""
    fine, _ = CAUSE["output-lag"].restored((0.3, 1.0))
    assert Term(fine, (0.3, 1.0)).at_bounds(_frame()) == [False, False]
    assert Term(fine, (0.5, 1.0)).at_bounds(_frame()) == [True, False]


def test_a_gain_drifts_evenly_about_empty_memory():
    """Beside a drift of the zero; what is left of the gain is never below a tenth."""
    y, zero = np.sin(T), 0.25
    shown = _shown("gain-drift", y, 2.0, -3.0, 0.5, zero=zero)
    np.testing.assert_allclose(shown, y + 2.0 * T - 3.0 * T * (T - T[-1]) + 0.5 * T * (y - zero), atol=1e-12)
    gain = CAUSE["gain-drift"].quantities(_frame())[-1]
    assert (gain.low, gain.high) == pytest.approx((-0.9 / 4.0, 0.9 / 4.0))


def test_a_formula_that_holds_another_is_nothing_without_its_own_part():
    """A drift of the gain holds one of the zero, in its kinds too; kinds of one cause hold no other."""
    gain, zero = CAUSE["gain-drift"], CAUSE["offset-drift"]
    assert gain.holds == zero.id == zero.relaxing.id
    assert (zero.holds, zero.relaxing.holds) == ("", "")  # one kind of a cause holds no other cause
    known = [Estimate(name, 0.1, "", 0.05, 0.2) for name in ("rate", "bend", "gain")]
    assert not may_be_nothing(gain.strengths_of(known))
    assert may_be_nothing(gain.strengths_of([*known[:2], replace(known[2], lower=-0.1)]))


def test_creep_is_the_mean_of_three_lags():
    """A third each of tau / 4, tau and 4 tau; the other formula has half in the middle."""
    a, tau = 0.2, 0.4
    slow = (_lagged(tau / 4) + _lagged(tau) + _lagged(4 * tau)) / 3
    np.testing.assert_allclose(_shown("creep", T, a, tau), (T + a * slow) / (1 + a), atol=1e-12)
    (other,) = CAUSE["creep"].variants(T, (a, tau), _frame())
    slow = _lagged(tau / 4) / 4 + _lagged(tau) / 2 + _lagged(4 * tau) / 4
    np.testing.assert_allclose(other, (T + a * slow) / (1 + a), atol=1e-12)


def test_creep_of_one_time_constant_or_of_five():
    """Tried beside the bank of three; the constant goes into the model and comes back."""
    a, tau = 0.3, 0.4
    bank, alone, wide = CAUSE["creep"].kinds()
    found = alone.on_output(T, (a, tau), _frame())
    np.testing.assert_allclose(found, (T + a * _lagged(tau)) / (1 + a), atol=1e-12)
    kept = tuple(value for _, value, _ in alone.constants())
    again, values = CAUSE["creep"].restored((*kept, a, tau))
    assert values == (a, tau)
    np.testing.assert_array_equal(again.on_output(T, values, _frame()), found)
    assert bank.constants() == ()
    assert CAUSE["creep"].kinds()[1] is alone
    (other,) = alone.variants(T, (a, tau), _frame())
    slow = 0.75 * _lagged(tau) + 0.125 * (_lagged(0.25 * tau) + _lagged(4 * tau))
    np.testing.assert_allclose(other, (T + a * slow) / (1 + a), atol=1e-12)
    five = [0.1 * tau, tau / 10**0.5, tau, tau * 10**0.5, 10.0 * tau]
    slow = sum(_lagged(one) for one in five) / 5
    np.testing.assert_allclose(wide.on_output(T, (a, tau), _frame()), (T + a * slow) / (1 + a), atol=1e-12)
    assert CAUSE["creep"].restored((wide.constants()[0][1], a, tau))[0].kind == wide.kind


@pytest.mark.parametrize("second", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("faster", "kinds"), [(1.0, 1), (1.4, 1), (1.6, 3), (10.0, 3)])
def test_powers_of_the_speed_are_tried_where_there_are_several_speeds(second, faster, kinds):
    """Rests are no speed: at one speed the powers differ at turns alone, and only the first is tried."""
    turns = np.cumsum([0.0, *np.repeat([1.0, 1.0 / faster], 6)])
    turns[7:] += 0.3
    times, held = np.insert(turns, 7, turns[6] + 0.3), np.insert(np.arange(13) % 2, 7, 0)
    t = np.arange(0.0, times[-1], 2e-3)
    frame = Frame(2e-3 * second, 40.0 * np.interp(t, times, held), 1.0, 40.0)
    assert len(CAUSE["viscous"].kinds([frame])) == kinds
    assert len(CAUSE["viscous"].kinds()) == 3


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_a_force_follows_the_speed_its_root_or_its_square(power):
    """Down as strongly as up, the same in other units, and kept in a model."""
    c, u = 0.3, np.where(T < 1.0, 3.0 * T, 3.0 - 5.0 * (T - 1.0))
    (kind,) = [one for one in CAUSE["viscous"].kinds() if one.kind == power]
    frame = Frame(float(T[1]), u, 1.0, 1.0)
    shown = kind.on_output(np.zeros_like(u), (c, 0.0), frame)
    at = {1.0: (T > 0) & (T < 1.0), -1.0: 1.0 + 2 * T[1] < T}
    for sign, speed in ((1.0, 3.0), (-1.0, 5.0)):
        np.testing.assert_allclose(shown[at[sign]], sign * c * speed**power, rtol=1e-9)
    kept = tuple(value for _, value, _ in kind.constants())
    again, values = CAUSE["viscous"].restored((*kept, c, 0.0))
    assert (again.kind, values) == (power, (c, 0.0))
    reach, span, second = 7.0, 1.3, 0.2
    unit = kind.quantities(frame)[0].unit
    larger = Scale(0.0, reach, 0.0, span, second).of_unit(unit) * c
    other = Frame(second * frame.dt_s, reach * u, span, reach)
    np.testing.assert_allclose(
        kind.on_output(np.zeros_like(u), (larger, 0.0), other), span * shown, rtol=1e-9
    )


def test_a_number_that_a_model_keeps_says_what_it_is():
    """`extend` printed `middle 1`."""
    assert {one.id for one in CAUSE.values() if one.number} == {one.id for one in CAUSE.values() if one.meant}
    assert CAUSE["creep"].number == "middle"


@pytest.mark.parametrize("cold", [True, False])
def test_a_coil_heats_with_the_square_of_the_input(cold):
    """From rest to 3 above the low end at once: h rises, then relaxes to 9; or it begins at a twentieth.

    What falls is the output above that of empty memory.
    """
    k, tau, begin = 0.02, 0.7, 0.0 if cold else 0.05 * 9.0
    first = 9.0 - (9.0 - begin) * tau / DT * (1.0 - np.exp(-DT / tau))
    heat = 9.0 - (9.0 - first) * np.exp(-T / tau)
    y, frame = 2.0 + T, _frame(np.full(T.size, 4.0), low=1.0, zero=0.5)
    cause = CAUSE["thermal-drift"]
    found = cause.on_output(y, (k, tau), frame) if cold else cause.variants(y, (k, tau), frame)[0]
    np.testing.assert_allclose(found, y - k * heat * (y - 0.5), atol=1e-12)


def test_a_coil_that_is_driven_both_ways_is_cold_in_the_middle():
    """At 1 of -1 to 3, of outputs from -3 to 5 about 1; the constant goes into the model and comes back."""
    one_way, both_ways = CAUSE["thermal-drift"].kinds()
    frame = _frame(np.full(T.size, 3.0), low=-1.0, ends=(-3.0, 5.0), zero=-3.0)
    y, k, tau = 2.0 + T, 0.02, 0.7
    heat = 4.0 * (1.0 - tau / DT * (1.0 - np.exp(-DT / tau)) * np.exp(-T / tau))
    found = both_ways.on_output(y, (k, tau), frame)
    np.testing.assert_allclose(found, y - k * heat * (y - 1.0), atol=1e-12)
    kept = tuple(value for _, value, _ in both_ways.constants())
    again, values = CAUSE["thermal-drift"].restored((*kept, k, tau))
    assert values == (k, tau)
    np.testing.assert_array_equal(again.on_output(y, values, frame), found)
    assert one_way.constants() == ()
    assert both_ways.quantities(frame)[0].high == 4.0 * one_way.quantities(frame)[0].high
    assert CAUSE["thermal-drift"].kinds()[1] is both_ways  # of two refits the terms are the same


def test_heat_may_move_the_zero():
    """By a shift beside the loss of gain; the model then keeps where it is cold, and comes back."""
    frame = _frame(np.full(T.size, 3.0), low=-1.0, ends=(-3.0, 5.0), zero=-3.0)
    y, k, tau, shift = 2.0 + T, 0.02, 0.7, -0.3
    for plain in CAUSE["thermal-drift"].kinds():
        ((moving, none),) = plain.finer(frame, ())
        still = plain.on_output(y, (k, tau), frame)
        np.testing.assert_array_equal(moving.on_output(y, (k, tau, none), frame), still)
        heat = (y - still) / (k * (y - (1.0 if plain.kind else -3.0)))
        shown = moving.on_output(y, (k, tau, shift), frame)
        np.testing.assert_allclose(shown, still + shift * heat, atol=1e-12)
        kept = tuple(value for _, value, _ in moving.constants())
        again, values = CAUSE["thermal-drift"].restored((*kept, k, tau, shift))
        np.testing.assert_array_equal(again.on_output(y, values, frame), shown)
        assert moving.finer(frame, ()) == []
        assert len(moving.quantities(frame)) == len(plain.quantities(frame)) + 1


def test_a_widening_trails_by_the_root_of_the_rate():
    """On a steady ramp u - v = k sqrt(u'), falling as rising; a vanishing coefficient changes nothing."""
    cause, k, frame = CAUSE["rate-widening"], 0.05, _frame()
    for sign in (1.0, -1.0):
        u = sign * 4.0 * T
        assert (u - cause.on_input(u, u, (k,), _frame(u)))[-1] == pytest.approx(sign * k * 2.0, rel=0.01)
    assert cause.on_input(frame.input, T, (5e-9,), frame) is frame.input
    assert cause.on_input(T, T, (7e-9,), _frame()) is not T


def test_a_force_may_follow_the_speed_after_a_sample_or_around_it():
    """A recorder, or a simulation by central differences, has it so; a model keeps it beside the power."""
    u, y = RNG.standard_normal(T.size).cumsum(), np.sin(T)
    for kind in CAUSE["viscous"].kinds():
        ((fine, half),) = kind.finer(_frame(), (0.3, 0.0))
        assert fine.finer(_frame(), (0.3, 0.0, half)) == []
        assert fine.coarser().kind == fine.kind == kind.kind
        slope = {0.0: np.diff(u, prepend=u[0]), 0.5: np.gradient(u), 1.0: np.diff(u, append=u[-1])}
        for between, speed in slope.items():
            shown = fine.on_output(y, (0.3, 0.0, between), _frame(u))
            expected = y + 0.3 * np.sign(speed) * np.abs(speed / DT) ** kind.kind
            np.testing.assert_allclose(shown[1:-1], expected[1:-1], rtol=1e-9)
        kept = tuple(value for _, value, _ in fine.constants())
        again, values = CAUSE["viscous"].restored((*kept, 0.3, 0.1, half))
        assert (again.kind, values, len(again.quantities(_frame()))) == (kind.kind, (0.3, 0.1, half), 3)
        assert kind.finer(_frame(), (0.3, 60 * DT)) == []
        assert kind.finer(replace(_frame(), averaged=2), (0.3, 0.0)) == []


@pytest.mark.parametrize(
    ("faster", "at", "changes"), [(3.0, 2.0, True), (1.2, 2.0, False), (3.0, 1.5, False)]
)
def test_a_change_of_rate_is_at_a_moment_or_elsewhere(faster, at, changes):
    """Rests between strokes are no rate; the moment is known to a fiftieth of the record."""
    t = np.arange(0.0, 4.0, DT / 5)
    way = np.where(t < 2.0, t, 2.0 + faster * (t - 2.0))
    u = np.abs((way * 12.0) % 2.0 - 1.0)
    u[t % 0.4 < 0.1] = 0.3
    frame = Frame(DT / 5, u, 1.0, 1.0)
    assert frame.changes_rate(at) is changes


def test_simple_formulas():
    """Delay, viscous force, drift, sine, skew, change of condition: each as it is written."""
    y = np.sin(T)
    late = _shown("delay", y, 0.03)
    np.testing.assert_allclose(late[3:], y[:-3], atol=1e-12)
    ahead = _shown("late-input", y, 2.5 * DT)
    np.testing.assert_allclose(ahead[:-3], 0.5 * (y[2:-1] + y[3:]), atol=1e-12)
    assert set(ahead[-2:]) == {y[-1]}  # what comes after the end is not known
    np.testing.assert_allclose(
        _shown("viscous", y, 0.5, 0.0, u=3.0 * T) - y, np.where(T > 0, 1.5, 0.0), atol=1e-12
    )
    trailing = _shown("viscous", y, 0.5, 0.3, u=3.0 * T) - y
    np.testing.assert_allclose(trailing[1:], 1.5 * (1 - np.exp(-T[:-1] / 0.3)), atol=1.5 * DT / 0.3)
    bent = y + 0.2 * T + 0.1 * T * (T - T[-1])
    np.testing.assert_allclose(_shown("offset-drift", y, 0.2, 0.1), bent)  # as it was once kept
    last = T[-1]
    for slowing, gone in ((1.3, T), (-1.3, last - T)):  # an exponential below the chord of its ends
        chord = np.interp(gone, [0.0, last], [1.0, np.exp(-1.3 * last)])
        middle = np.exp(-1.3 * last / 2) - 0.5 * (1.0 + np.exp(-1.3 * last))
        relaxing = y + 0.2 * T - 0.1 * last**2 / 4 * (np.exp(-1.3 * gone) - chord) / middle
        np.testing.assert_allclose(_shown("offset-drift", y, 0.2, 0.1, slowing), relaxing, atol=1e-12)
    wave = 0.3 * np.sin(2 * np.pi * 7 * T) + 0.1 * np.cos(2 * np.pi * 7 * T)
    np.testing.assert_allclose(_shown("periodic", y, 0.3, 0.1, 7.0), y + wave, atol=1e-12)
    np.testing.assert_allclose(_shown("clock-skew", T, 0.01)[:300], 1.01 * T[:300], atol=1e-12)
    np.testing.assert_allclose(_shown("condition-change", y, 0.4, 0.1, record=0), y)
    np.testing.assert_allclose(_shown("condition-change", y, 0.4, 0.1, record=1), 1.1 * y + 0.4)
    np.testing.assert_allclose(_shown("condition-change", y, 9.0, 9.0, 0.4, 0.1, record=2), 1.1 * y + 0.4)


def _triangles(tau: float) -> tuple[np.ndarray, np.ndarray]:
    """To and fro by 3 a second, with a rest, and what a slow recorder makes of it."""
    u = 3.0 * np.interp(T, [0.1, 0.73, 1.0, 1.4, 1.7, 2.46], [0.0, 0.63, 0.36, 0.76, 0.76, 0.0])
    fine = np.arange(T.size * 100) * DT / 100
    return u, low_pass(np.interp(fine, T, u), tau, DT / 100)[::100]


@pytest.mark.parametrize("steps", [4.0, 10.0])
def test_a_digital_filter_of_the_input_is_half_a_time_step_shorter(steps):
    """It goes from sample to sample; which of both a recorder has is not known, and intervals hold both."""
    u, _ = _triangles(DT)
    keeps = np.exp(-1.0 / steps)
    recorded = np.asarray(list(accumulate(u, lambda last, x: keeps * last + (1.0 - keeps) * x)))
    plain = CAUSE["input-lag"]
    (other,) = plain.alternatives()
    off = {
        one: np.abs(one.on_input(recorded, recorded, (steps * DT,), _frame(recorded)) - u).mean()
        for one in (plain, other)
    }
    assert off[other] < 0.4 * off[plain]
    assert other.quantities(_frame()) == plain.quantities(_frame())


@pytest.mark.parametrize("steps", [1.5, 4.0, 30.0])
def test_a_slow_recorder_is_undone_and_turns_stay_sharp(steps):
    """Mean slopes alone round each turn by half of what the input moves in a time step."""
    u, recorded = _triangles(steps * DT)
    found = CAUSE["input-lag"].on_input(recorded, recorded, (steps * DT,), _frame(recorded))
    off = np.abs(found - u)
    assert off.max() < 0.3 * 3.0 * DT
    assert np.median(off) < 0.002 * 3.0 * DT


def test_the_slope_of_a_noisy_input_is_taken_over_half_of_its_lag():
    """From one sample to the next noise would be twenty times as large; what is missing is less than half."""
    u, recorded = _triangles(30 * DT)
    noisy = recorded + 0.002 * np.random.default_rng(3).standard_normal(T.size)
    found = CAUSE["input-lag"].on_input(noisy, noisy, (30 * DT,), _frame(noisy))
    near, naive = np.std(found - u), np.std(noisy + 30 * DT * np.gradient(noisy, DT) - u)
    assert near < 0.4 * np.std(recorded - u)
    assert near < 0.5 * naive


@pytest.mark.parametrize(("averaged", "told"), [(1, False), (4, True)])
def test_columns_of_one_table_may_be_read_half_a_sample_apart(averaged, told):
    """Of the samples as they were recorded, not of their averages."""
    frame = _frame(averaged=averaged)
    for name in ("late-input", "input-lag"):
        assert CAUSE[name].can_be_told((0.2 * DT,), [frame]) is told


@pytest.mark.parametrize(("share", "told"), [(0.09, False), (0.11, True)])
def test_a_leak_slower_than_any_that_is_tried_is_a_drift(share, told):
    """Of what is held a tenth must be gone at the end of the longest record."""
    frames = [_frame(T), _frame(T[:40])]
    assert CAUSE["leak"].can_be_told((share / frames[0].length_s, 5.0), frames) is told


def test_each_later_record_has_a_condition_of_its_own():
    """One offset and gain for all of them made a step of what the third differed from the second by."""
    cause, frames = CAUSE["condition-change"], [_frame(record=k, records=3) for k in range(3)]
    assert [one.name for one in cause.quantities(frames[0])] == ["offset", "gain", "offset 3", "gain 3"]
    assert [one.name for one in cause.quantities(_frame(records=2))] == ["offset", "gain"]
    assert cause.sign("offset 3", -1) == cause.sign("offset", -1) == -1
    assert cause.sign("gain 3", -1) == cause.sign("gain", -1) == 1
    (block,) = cause.starts(frames, [])
    moved = np.asarray([[np.ptp(cause.on_output(T, one, frame) - T) for frame in frames] for one in block])
    changed = np.asarray([[cause.on_output(T, one, frame)[-1] != T[-1] for frame in frames] for one in block])
    assert changed.tolist() == [[False, True, False]] * 2 + [[False, False, True]] * 2
    assert (moved > 1e-9).tolist() == [[False] * 3, [False, True, False], [False] * 3, [False, False, True]]
    known = [Estimate("", at, "", at - 1.0, at + 1.0) for at in (0.0, 0.0, 0.0, 2.0)]
    assert not may_be_nothing(cause.strengths_of(known))  # only the gain of the third differs


@pytest.mark.parametrize(("per", "frequency"), [(1, 40.0), (3, 50.0), (4, 120.0), (3, 0.0)])
def test_hum_has_its_own_amplitude_where_samples_were_averaged(per, frequency):
    """On the means of ``per`` samples the cause adds the mean of the sine, not the sine at their middle."""
    fine_s = 0.001
    t = np.arange(3000) * fine_s
    values = (0.3, 0.1, frequency)
    phase = 2.0 * np.pi * frequency * (t - 0.5 * (per - 1) * fine_s)  # the first mean lies at time 0
    wave = 0.3 * np.sin(phase) + 0.1 * np.cos(phase)
    means = wave.reshape(-1, per).mean(axis=1)
    frame = replace(_frame(np.zeros(means.size)), dt_s=per * fine_s, averaged=per)
    added = CAUSE["periodic"].on_output(np.zeros(means.size), values, frame)
    np.testing.assert_allclose(added, means, atol=1e-12)


def test_a_step_is_shared_out_over_twenty_samples():
    """Half of it at its moment, none ten samples before, all ten samples after."""
    change = _shown("step", np.full(T.size, 2.0), 0.5, 0.1, 2.0) - 2.0
    np.testing.assert_allclose(
        change[[189, 190, 195, 200, 205, 210, 211]] / 0.7, [0, 0, 0.25, 0.5, 0.75, 1, 1], atol=1e-9
    )


def test_steps_at_several_moments_add_up():
    """Each is shared out as if it were alone, of the output before all of them; named by their numbers."""
    step, y = CAUSE["step"], np.sin(T) + 2.0
    twice = step.several(2)
    shown = twice.on_output(y, (0.5, 0.1, 1.0, -0.2, 0.05, 2.0), _frame())
    alone = [step.on_output(y, one, _frame()) - y for one in ((0.5, 0.1, 1.0), (-0.2, 0.05, 2.0))]
    np.testing.assert_allclose(shown, y + sum(alone), atol=1e-12)
    names = [one.name for one in twice.quantities(_frame())]
    assert names == ["offset", "gain", "time", "offset 2", "gain 2", "time 2"]
    known = [Estimate(name, 1.0, "", 0.5, 2.0) for name in names]
    assert [one.name for one in twice.strengths_of(known)] == ["offset", "gain", "offset 2", "gain 2"]
    assert (step.sudden, step.by_pieces, twice.sudden, twice.by_pieces) == (True, False, False, True)


@pytest.mark.parametrize("scale", [1.0, 500.0])
def test_accommodation_is_a_low_pass_along_the_path(scale):
    """Against the recurrence, a sample at a time; also where the path is hundreds of decay lengths."""
    u = scale * np.cumsum(RNG.standard_normal(T.size))
    y, a, length = np.sin(3 * T) + 2.0, 0.3, 5.0
    frame = _frame(u)
    share = np.diff(frame.path / length, prepend=0.0)
    slow = [y[0]]
    for now, step in zip(y[1:], share[1:], strict=True):
        slow.append(now + (slow[-1] - now) * np.exp(-step))
    expected = (y + a * np.asarray(slow)) / (1 + a)
    np.testing.assert_allclose(CAUSE["accommodation"].on_output(y, (a, length), frame), expected, rtol=1e-9)


def test_wiggles_are_no_path():
    """A point dragged with play: only what goes beyond it moves it."""
    np.testing.assert_allclose(
        settled(np.asarray([0.0, 0.9, -0.9, 2.0, 1.5, -3.0]), 1.0), [0, 0, 0, 1, 1, -2]
    )
    path = _frame([0.0, 0.01, -0.01, 1.0, 0.0]).path
    np.testing.assert_allclose(path, [0, 0, 0, 1.0 - 0.016, 1.0 - 0.016 + 1.0 - 0.032])


def test_a_feedback_is_brought_back_to_the_range():
    """(u - low + k (y - y-)) / (1 + k (y+ - y-) / reach) above low; never less than a fifth of the range."""
    frame = _frame(low=1.0, ends=(2.0, 6.0))
    cause, u, y = CAUSE["load-dependence"], np.asarray([2.0]), np.asarray([3.0])
    assert cause.on_input(u, y, (0.5,), frame) == pytest.approx(1.0 + (1.0 + 0.5) / 1.5)
    assert cause.on_input(u, y, (-2.0,), frame) == pytest.approx(1.0 + (1.0 - 2.0) / 0.2)


def test_start_values_are_inside_the_bounds_and_scale_with_the_device():
    """Every block of every cause; strengths in proportion to span and reach."""
    u = 2.0 + 2.0 * np.sin(6.0 * T)
    residual = [np.sin(2 * np.pi * 5 * T) + (T > 2.0)]
    frames = [_frame(u), _frame(u)]
    for cause in CAUSE.values():
        if cause.stage != "record" and cause.id != "unlisted":  # it has a stage of its own
            blocks = cause.starts(frames, residual)
            assert blocks, cause.id
            for values in (values for block in blocks for values in block):
                pairs = zip(cause.quantities(frames[0]), values, strict=True)
                assert all(q.low <= value <= q.high for q, value in pairs), cause.id
    assert CAUSE["condition-change"].starts(frames[:1], residual) == []
    ((sine, cosine),) = CAUSE["periodic"].starts(frames, residual)
    assert sine == pytest.approx((0.006, 0.0, 5.0), abs=0.02)
    assert cosine[2] == sine[2]
    nearest = min(
        (block[0] for block in CAUSE["step"].starts(frames, residual)), key=lambda v: abs(v[2] - 2.0)
    )
    assert nearest[2] == pytest.approx(2.0, abs=0.03)


# --- gates
def _raw(y, u=None, *, reference=None, weight=1.0, dt=1e-3) -> Raw:
    y = np.asarray(y, float)
    u = np.linspace(0.0, 1.0, y.size) if u is None else u
    return Raw(
        Record(np.asarray(u, float), y, np.full(y.size, weight), dt_s=dt, reference=reference), 0.0, 1.0
    )


def _fires(name: str, *args, **more) -> bool:
    return CAUSE[name].gate(_raw(*args, **more)) is not None


def test_noise_and_steps_of_a_record():
    """White noise by third differences; the step of a converter, and where it is coarse."""
    noise = np.random.default_rng(1).standard_normal(40_000)
    assert noise_of(0.3 * noise) == pytest.approx(0.3, rel=0.03)
    assert noise_of(noise[:7]) == 0.0
    assert noise_of(noise[:8]) > 0.0
    assert spacing_of(np.asarray([0.0, 0.5, 0.5, 1.0])) == 0.5
    assert spacing_of(np.ones(9)) == 0.0
    assert spacing_of(np.append(np.arange(50.0), [9.9e37, 9.9e37])) == 1.0  # an overload is no step
    assert coarse_step(np.repeat(np.arange(50.0), 9)) == 1.0
    assert coarse_step(np.round(noise)) == 0.0


def test_a_hum_is_no_noise_of_single_samples():
    """A line at three tenths of the sample rate, ten times the noise; of a few samples nothing is told."""
    noise = 0.1 * np.random.default_rng(1).standard_normal(20_000)
    hum = np.sin(2 * np.pi * 0.309 * np.arange(noise.size))
    assert noise_of(noise + hum) > 0.5
    assert noise_beside_hum(noise + hum, np.ones(noise.size)) == pytest.approx(0.1, rel=0.2)
    assert noise_beside_hum(noise, np.ones(noise.size)) == noise_of(noise)
    assert noise_beside_hum(hum[:900], np.ones(900)) == noise_of(hum[:900])


def _piled(at: int, inside: int, values: int = 9) -> np.ndarray:
    """Noise far below, and so many samples at a rail and at a few values just inside it."""
    low = np.round(5.0 * np.random.default_rng(2).random(3000), 2)
    return np.concatenate((low, np.full(at, 10.0), 10.0 - 0.01 * (1 + np.arange(inside) % values)))


@pytest.mark.parametrize(
    ("at", "inside", "values", "fires"),
    [
        (21, 0, 9, True),
        (20, 0, 9, False),
        (40, 33, 1, True),
        (40, 34, 1, False),
        (40, 90, 9, False),
        (41, 90, 9, True),
    ],
)
def test_a_cut_off_output_piles_up_at_its_end(at, inside, values, fires):
    """More than twenty samples, more than 1.2 times as many as just inside, or 4 times any value there."""
    y = np.random.default_rng(3).permutation(_piled(at, inside, values))
    assert _fires("saturation", y) is fires


def test_what_is_next_to_the_rail_is_left_out_too():
    """Three samples on each side in time; a flat top without noise is no cut."""
    y = np.concatenate(
        (np.round(5.0 * np.random.default_rng(2).random(3000), 2), np.full(30, 10.0), np.full(50, 2.5))
    )
    firing = CAUSE["saturation"].gate(_raw(y))
    assert np.flatnonzero(firing.mask[2990:3040]).tolist() == list(range(7, 43))
    assert (firing.value, firing.figures["count"]) == (10.0, 30.0)
    smooth = np.minimum(np.round(np.sin(np.arange(9000) / 3000) * 12, 2), 10.0)
    assert not _fires("saturation", smooth)


def _without_noise(device: str):
    """Input (n,) in shrinking swings, and the output of a device that has no noise."""
    u = np.clip(1.0 - np.arange(20_000) / 22_000, 0.1, 1.0) * np.sin(np.arange(20_000) / 100)
    at, slides = 0.0, []
    for step in np.diff(u, prepend=0.0).tolist():
        at = min(max(at + step, -0.3), 0.3)
        slides.append(at)
    stop = np.asarray(slides)
    return u, {"stop": stop, "spring": u + stop, "saturates": np.tanh(3.0 * u) + 0.1 * stop}[device]


@pytest.mark.parametrize("digits", [2, 3, 15])
@pytest.mark.parametrize(
    ("device", "cut"),
    [("stop", 9.0), ("spring", 9.0), ("spring", 1.1), ("saturates", 9.0), ("saturates", 0.95)],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rail_without_noise_stops_the_output_at_once(device, cut, digits, sign):
    """Sliding friction is as flat, but lets go where the input turns; what saturates slows down first."""
    u, y = _without_noise(device)
    shown = np.round(np.minimum(y, cut), digits)
    fired = CAUSE["saturation"].gate(replace(_raw(sign * shown, sign * u), low=-1.0, high=1.0))
    assert (fired is not None) is (cut < 9.0)
    if fired is not None:
        assert fired.value == sign * cut
        assert np.all(fired.mask[y > cut])


def test_a_rest_at_the_top_of_coarse_steps_is_no_cut():
    """Steps that come at uneven times look like noise of two thirds of a step."""
    rise = np.tile(np.concatenate((np.arange(150), np.arange(150)[::-1])) / 1.7, 10)
    y = np.round(np.concatenate((rise, np.full(200, 88.0))))
    assert noise_of(y) > 0.5
    assert not _fires("saturation", y)


def _wild(size: float, number: int) -> np.ndarray:
    y = np.tile([0.0, 1.0, 0.0, -1.0], 500) * 1e-3 + 0.0
    y[100 : 100 + 150 * number : 150] += size
    return y


@pytest.mark.parametrize(("number", "fires"), [(3, True), (2, False)])
def test_three_wild_samples_are_a_fault(number, fires):
    """Fewer are no fault of a device."""
    y = _wild(1.0, number)
    assert _fires("outliers", y) is fires
    if fires:
        firing = CAUSE["outliers"].gate(_raw(y + 5.0))
        np.testing.assert_array_equal(np.flatnonzero(firing.mask), [100, 250, 400])
        assert firing.value == pytest.approx(1.0, abs=2e-3)  # from those around it


@pytest.mark.parametrize(("over", "fires"), [(1.02, True), (0.98, False)])
def test_wild_is_eight_sigmas_or_four_fast_steps(over, fires):
    """Whatever is more: of noise, of the steps near by, of the converter."""
    y = np.random.default_rng(4).standard_normal(20_000)
    y[1000:19_000:3000] = 0.0
    near = np.arange(1000, 19_000, 3000)[:, None] + np.arange(-6, 7)
    y[near] = 0.0
    y[near[:, 6]] = over * 8.0 * np.sqrt(2.0) * noise_of(y)
    assert _fires("outliers", y) is fires
    ramp = 0.1 * np.concatenate((np.arange(3000), np.arange(3000)[::-1]))
    ramp[500:5500:1000] -= over * 0.4 + 0.1  # the median of those around lies one step lower
    assert _fires("outliers", ramp) is fires


def test_what_is_fast_elsewhere_hides_no_wild_samples():
    """Those on the slow loops of a record stand out from the steps near them; the fast loops have none."""
    slow, fast = np.sin(np.arange(2000) / 150.0), np.sin(np.arange(2000) / 4.0)
    y = np.concatenate((slow, fast)) + 1e-3 * np.random.default_rng(6).standard_normal(4000)
    assert not _fires("outliers", y)
    wild = np.arange(100, 1900, 300)
    y[wild] += 0.3  # four usual steps of the whole record are 0.9
    np.testing.assert_array_equal(np.flatnonzero(CAUSE["outliers"].gate(_raw(y)).mask), wild)


@pytest.mark.parametrize("samples", [3, 40])
def test_where_the_input_turns_within_a_few_samples_none_is_wild(samples):
    """A stiff device follows: its tips are as sharp; wild ones elsewhere are still seen."""
    slow = np.interp(np.arange(3000), np.arange(7) * 500, [0, 1, 0, 1, 0, 1, 0])
    fast = np.interp(np.arange(samples * 8), np.arange(9) * samples, [0, 1, 0.3, 1, 0, 0.7, 0.1, 1, 0])
    u = np.concatenate((slow, fast, slow))
    y = np.tanh(3.0 * u) + 1e-4 * np.random.default_rng(5).standard_normal(u.size)
    assert not _fires("outliers", y, u)
    wild = [200, 1200, 2200, 5000]
    y[wild] += 0.7
    np.testing.assert_array_equal(np.flatnonzero(CAUSE["outliers"].gate(_raw(y, u)).mask), wild)


def test_where_three_in_a_hundred_are_wild_those_beside_turns_are_too():
    """What one is left over would be what no cause explains."""
    rng = np.random.default_rng(8)
    u = np.interp(np.arange(4000), np.linspace(0, 3999, 54), [0.5, *rng.uniform(0.0, 1.0, 53)])
    y = np.tanh(2.0 * u) + 1e-3 * rng.standard_normal(u.size)
    wild = rng.random(u.size) < 0.03
    y[wild] += rng.choice([-1.0, 1.0], wild.sum()) * rng.uniform(0.3, 3.0, wild.sum())
    found = CAUSE["outliers"].gate(_raw(y, u)).mask
    assert not np.any(found & ~wild)
    assert np.count_nonzero(wild & ~found) <= 1


def _frozen(u, y, stretches=((500, 560), (1700, 1760), (2600, 2700))):
    y = y.copy()
    for begin, end in stretches:
        y[begin:end] = y[begin]
    return y


SWINGS = np.sin(np.arange(4000) / 160.0) / 2 + 0.5
NOISY = np.tanh(2.0 * SWINGS) + 2e-3 * np.random.default_rng(9).standard_normal(4000)


@pytest.mark.parametrize("step", [0.0, 1e-3])
def test_a_recorder_that_repeats_a_value_is_frozen(step):
    """All but the first sample of each stretch is left out; neither a single stretch nor none is a fault."""
    y = np.round(NOISY / step) * step if step else NOISY
    firing = CAUSE["frozen"].gate(_raw(_frozen(SWINGS, y), SWINGS))
    told = np.flatnonzero(firing.mask)
    assert set(range(501, 560)) <= set(told.tolist())
    assert abs(told.size - (59 + 59 + 99)) <= 3  # a neighbour may be equal by chance
    assert (firing.figures["stretches"], firing.figures["count"]) == (3.0, told.size)
    assert not _fires("frozen", y, SWINGS)
    assert not _fires("frozen", _frozen(SWINGS, y, [(500, 560)]), SWINGS)


def _repeated(y, share, seed=11):
    """The same output of a recorder that gives a share of its values twice or more."""
    again = np.random.default_rng(seed).random(y.size) < share
    again[0] = False
    return y[np.maximum.accumulate(np.where(again, 0, np.arange(y.size)))], again


@pytest.mark.parametrize("step", [0.0, 1e-5])
@pytest.mark.parametrize(("share", "fires"), [(0.015, False), (0.25, True), (0.4, True), (0.6, True)])
def test_values_that_are_repeated_here_and_there_are_frozen(step, share, fires):
    """All repeats are masked but those at the ends of the output; a record as read has none."""
    y, again = _repeated(np.round(NOISY / step) * step if step else NOISY, share)
    firing = CAUSE["frozen"].gate(_raw(y, SWINGS))
    assert (firing is not None) is fires
    if firing is not None:
        inside = (y != y.min()) & (y != y.max())
        assert np.all(firing.mask[inside & again])
        assert np.count_nonzero(firing.mask & ~again) <= 0.002 * y.size  # equal by chance
        assert firing.value > 0.0


def test_a_slow_recorder_or_coarse_steps_are_not_frozen():
    """A table twice as fast as the recorder has each value twice; steps repeat values where noise is low."""
    for times in (2, 3):
        held = np.repeat(NOISY[::times], times)[: NOISY.size]
        assert not _fires("frozen", held, SWINGS)
    quiet = np.where(SWINGS > 0.0, NOISY, np.round(SWINGS / 0.02) * 0.02)
    assert not _fires("frozen", quiet, SWINGS)
    assert not _fires("frozen", np.round(NOISY / 0.01) * 0.01, SWINGS)


@pytest.mark.parametrize("step", [1e-4, 2e-4, 6e-4, 1.2e-3])
def test_steps_of_a_converter_beside_something_smooth_are_not_frozen(step):
    """What is added later, here and there, hides them: equal neighbours are equal by chance all the same."""
    rng = np.random.default_rng(12)
    bursts = 0.05 * rng.standard_normal(4000) * (np.sin(np.arange(4000) / 200.0) > 0.6)
    assert not _fires("frozen", np.round(NOISY / step) * step + bursts, SWINGS)


def test_what_may_repeat_a_value_is_not_frozen():
    """A rest, a rail, hardly any noise, noise that is none near zero, coarse steps, a jump of the input."""
    resting = np.where(np.arange(4000) // 100 % 5 == 0, 0.3, SWINGS)
    assert not _fires("frozen", np.where(resting == 0.3, 0.25, NOISY), resting)
    assert not _fires("frozen", np.minimum(NOISY, 0.8), SWINGS)
    assert not _fires("frozen", _frozen(SWINGS, np.tanh(2.0 * SWINGS)), SWINGS)
    above = np.maximum(SWINGS - 0.5, 0.0)
    assert not _fires("frozen", above * (1.0 + 0.01 * np.random.default_rng(3).standard_normal(4000)), SWINGS)
    assert not _fires("frozen", _frozen(SWINGS, np.round(NOISY / 0.02) * 0.02), SWINGS)
    y = _frozen(SWINGS, NOISY)
    jumps = SWINGS.copy()
    for end in (560, 1760, 2700):
        jumps[end:] += 0.3
    assert not _fires("frozen", y, jumps)


def test_the_first_and_the_last_stroke_are_no_step():
    """One range and a half on either side, or a quarter of what the input went."""
    u = np.interp(np.linspace(0.0, 10.0, 1000), np.arange(11), np.arange(11) % 2)
    for strokes, sides in ((10, (1.5, 8.5)), (4, (1.0, 3.0))):
        frame = Frame(0.01, u[: 100 * strokes], 1.0, 1.0)
        times = [block[0][2] for block in CAUSE["step"].starts([frame], [])]
        assert (times[0], times[-1]) == pytest.approx(sides, abs=0.03)


@pytest.mark.parametrize(
    ("loops", "frequency", "told"),
    [
        (np.sin, 2.0, True),  # twice that of the loops
        (np.sin, 2.09, True),  # a tenth is what ten seconds tell apart
        (np.sin, 2.11, False),
        (np.sin, 0.5, False),
        (lambda at: 3.0 + np.sin(at), 2.0, True),  # about any level
        (lambda at: np.exp(-0.03 * at) * np.sin(at), 7.0, True),
        (lambda at: np.sin(at) + np.sin(1.7 * at), 2.0, False),  # no one frequency
        (np.zeros_like, 2.0, False),
    ],
)
def test_a_hum_at_a_multiple_of_the_frequency_of_the_loops_is_in_step(loops, frequency, told):
    """The device itself does what is in step with its input."""
    frame = Frame(0.01, loops(2.0 * np.pi * 0.01 * np.arange(1000)), 1.0, 2.0)
    assert CAUSE["periodic"].in_step((1.0, 0.0, frequency), [frame]) is told
    assert not CAUSE["offset-drift"].in_step((1.0, 0.0), [frame])


def test_clocks_that_part_by_less_than_a_sample_are_not_told():
    """On average they part by half of it; one converter after the other does as much."""
    frames = [Frame(0.01, np.zeros(n), 1.0, 1.0) for n in (100, 10_000)]
    skew = CAUSE["clock-skew"]
    assert skew.can_be_told((-1.01e-4,), frames)
    assert not skew.can_be_told((0.99e-4,), frames)


def test_a_step_has_loops_on_both_sides():
    """A twentieth of the record at least, wherever the residual jumps."""
    frame = Frame(0.01, np.zeros(10_000), 1.0, 1.0)
    step = CAUSE["step"]
    starts = [block[0] for block in step.starts([frame], [])]
    assert (starts[0][2], starts[-1][2]) == pytest.approx((5.0, 95.0))
    for at in (100, 9900):
        left = np.where(np.arange(10_000) < at, 1.0, 0.0)
        for start in (starts[0], starts[-1]):
            assert 5.0 <= step.sharpened(start, [frame], [left])[2] <= 95.0


@pytest.mark.parametrize(("periods", "told"), [(2.9, False), (3.1, True)])
def test_what_is_not_left_alone_for_three_periods_is_no_resonance(periods, told):
    """Strokes of two seconds, and a rest of one at a turn; in any of the records."""
    up = np.linspace(0.0, 4.0, 201)
    strokes = np.concatenate([up, np.full(100, 4.0), up[::-1], up])
    frames = [_frame(strokes), _frame(np.tile([0.0, 4.0], 50))]
    assert CAUSE["resonance"].can_be_told((periods / 3.0, 0.1), frames) is told
    assert not CAUSE["resonance"].can_be_told((periods / 3.0, 0.1), frames[1:])


@pytest.mark.parametrize(("values", "times", "fires"), [(250, 2, True), (252, 2, False), (200, 1, False)])
def test_coarse_steps_are_a_two_hundred_and_fiftieth_and_come_again(values, times, fires):
    """0.4 % of the span; each value twice on average, or a short record would seem to have steps."""
    y = np.tile(np.arange(values) * 0.1, times)
    assert _fires("quantisation", y) is fires
    if fires:
        firing = CAUSE["quantisation"].gate(_raw(y))
        assert (firing.value, firing.figures["percent"]) == pytest.approx((0.1, 10.0 / 24.9))
        assert firing.spread == pytest.approx(0.0, abs=1e-9)


def test_steps_that_only_rounding_tells_apart_are_one():
    """As after a conversion of units that went through several sums."""
    y = np.tile(np.arange(100) * 0.1, 20)
    firing = CAUSE["quantisation"].gate(_raw(y + 1e-12 * np.random.default_rng(0).standard_normal(y.size)))
    assert firing is not None
    assert (firing.value, firing.spread) == pytest.approx((0.1, 0.0), abs=1e-9)


@pytest.mark.parametrize("scale", [1.0, 1e-12])
def test_a_changed_condition_is_told_in_any_unit(scale):
    """Gain and offset of forces of an atomic force microscope are those of newtons."""
    said = 5.0 + 5.0 * np.sin(np.arange(50_000) / 50.0)
    changed = condition_change.against_model(scale * (1.3 * said - 2.0), scale * said, 0.0, 0.0)
    assert changed is not None
    assert (changed.gain, changed.offset / scale) == pytest.approx((0.3, -2.0))


def test_the_sign_of_a_hum_is_that_of_the_output_in_every_record():
    """Sine and cosine turn over with it, those of later records too."""
    names = [q.name for q in CAUSE["periodic"].quantities(_frame(records=2))]
    assert [CAUSE["periodic"].sign(name, -1) for name in names] == [-1, -1, -1, -1, 1]


@pytest.mark.parametrize(
    ("error", "share", "fires"), [(0.021, 0.02, True), (0.019, 0.02, False), (0.5, 0.005, False)]
)
def test_a_driver_that_lags_by_a_fiftieth_of_the_range(error, share, fires):
    """In one sample of a hundred."""
    u = np.linspace(0.0, 1.0, 2000)
    off = np.where(np.arange(2000) < 2000 * share, error, 0.0)
    assert _fires("current-tracking", u, u, reference=u + off) is fires
    assert not _fires("current-tracking", u, u)
    if fires:
        firing = CAUSE["current-tracking"].gate(_raw(u, u, reference=u + off))
        assert firing.value == pytest.approx(error)


@pytest.mark.parametrize(
    ("top", "bottom", "fires"), [(1.011, 0, True), (1.009, 0, False), (1, -0.011, True), (1, -0.009, False)]
)
def test_an_input_a_hundredth_outside(top, bottom, fires):
    """Of the range, at either end."""
    u = np.concatenate((np.linspace(0, top, 200), np.linspace(top, bottom, 200), np.linspace(bottom, 1, 200)))
    assert _fires("out-of-range", u, u) is fires
    if fires:
        firing = CAUSE["out-of-range"].gate(_raw(u, u))
        assert firing.value == pytest.approx(max(top - 1, -bottom))


@pytest.mark.parametrize(("back", "lasting"), [(300, True), (100, False)])
def test_a_mask_that_takes_too_much_is_made_smaller(back, lasting):
    """Where less than a quarter of the record would stay, only what is outside is left out."""
    u = np.concatenate(
        (np.linspace(0, 1, 100), np.full(10, 1.5), np.full(600, 0.5), np.linspace(0, 1, back)[: back - 5])
    )
    mask = CAUSE["out-of-range"].gate(_raw(u, u)).mask
    assert mask[400] == lasting
    assert mask[105]


def _stairs(
    number: int, rate: float, jump: float = 0.2, noise: float = 1e-3
) -> tuple[np.ndarray, np.ndarray]:
    """A slow ramp whose output stands still and jumps so many times."""
    n = 4000
    u = rate * np.arange(n) * 1e-3
    steps = (np.arange(1, number + 1) * n / (number + 1)).astype(int)
    y = jump * np.searchsorted(steps, np.arange(n), side="right")
    return y + noise * np.random.default_rng(5).standard_normal(n), u


@pytest.mark.parametrize(
    ("number", "rate", "fires"),
    [
        (15, 0.5, True),
        (14, 0.5, False),
        (20, 0.11, True),
        (20, 0.09, False),
        (20, 2.9, True),
        (20, 3.1, False),
    ],
)
def test_jumps_in_slow_motion(number, rate, fires):
    """Fifteen of them, at a tenth to three ranges a second."""
    y, u = _stairs(number, rate)
    assert _fires("stick-slip", y, u) is fires
    if fires:
        firing = CAUSE["stick-slip"].gate(_raw(y, u))
        assert firing.figures["count"] == number
        assert firing.value == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("rest", [40, 200])
def test_short_ramps_between_rests_are_no_jumps(rest):
    """All of a ramp of twelve samples is a jump beside the rests, which are as even before it as after it."""
    levels = np.tile(np.concatenate((np.arange(20), np.arange(20)[::-1])) / 20.0, 2)
    at = np.arange(levels.size) * (rest + 12)
    u = np.interp(np.arange(at[-1] + rest), np.ravel((at, at + rest), "F"), np.repeat(levels, 2))
    y = u**2 + 1e-3 * np.random.default_rng(5).standard_normal(u.size)
    assert not _fires("stick-slip", y, u, dt=0.02)


def test_jumps_below_the_noise_and_short_records_show_nothing():
    """Seven standard deviations of the difference of two means of six samples; twenty such means."""
    deviation = 7.0 * np.sqrt(2.0 / 6.0) * 0.01
    assert _fires("stick-slip", *_stairs(30, 0.5, 1.2 * deviation, 0.01))
    assert not _fires("stick-slip", *_stairs(30, 0.5, 0.8 * deviation, 0.01))
    y, u = _stairs(30, 0.5)
    assert not _fires("stick-slip", y[:119], u[:119])


@pytest.mark.parametrize(("deviations", "fires"), [(5.0, False), (9.0, True)])
def test_slow_noise_at_rest_tells_how_large_jumps_must_be(deviations, fires):
    """Eight ramps with rests: there two means of six samples differ by noise that single samples hide."""
    n = np.arange(500)
    u = np.concatenate([0.25 * k + np.append(5e-4 * n, np.full(500, 0.25)) for k in range(8)])
    noise = np.convolve(np.random.default_rng(5).standard_normal(u.size + 39), np.full(40, 1 / 40), "valid")
    mean = np.convolve(noise, np.full(6, 1 / 6), "valid")
    jumps = np.ravel([1000 * k + np.arange(100, 401, 75) for k in range(8)])
    y = deviations * np.std(mean[6:] - mean[:-6]) * np.searchsorted(jumps, np.arange(u.size), side="right")
    assert _fires("stick-slip", y + noise, u) is fires


def test_gates_do_not_see_what_blinds_them():
    """Wild samples are filled in for the others; where the output is cut off no jumps are sought."""
    y, u = _stairs(30, 0.5)
    y[100::300] += 50.0
    fired = {one.cause: one for one in fired_on(Raw(_raw(y, u).record, 0.0, 3.0))}
    assert set(fired) == {"outliers", "stick-slip"}
    assert fired["stick-slip"].figures["count"] == 30
    piled = np.concatenate((y, np.random.default_rng(3).permutation(_piled(60, 0)) + 100.0))
    u = np.concatenate((u, np.full(3060, 2.0)))
    names = [one.cause for one in fired_on(Raw(_raw(piled, u).record, 0.0, 3.0))]
    assert "saturation" in names
    assert "stick-slip" not in names


@pytest.mark.parametrize(
    ("corrected", "fired"),
    [
        ((), True),
        (("outliers", "of a later version"), True),
        (("quantisation",), False),
        (("stick-slip",), False),
    ],
)
def test_gates_are_not_asked_about_what_was_taken_out(corrected, fired):
    """Nor about what is left of coarse steps: flat runs and jumps."""
    y, u = _stairs(30, 0.5)
    found = fired_on(Raw(_raw(y, u).record, 0.0, 3.0), corrected)
    assert ("stick-slip" in [one.cause for one in found]) is fired


def test_every_text_of_a_gate_has_its_figures():
    """The words of each firing, with numbers in them."""
    y, u = _stairs(30, 0.5)
    for firing in (
        CAUSE["stick-slip"].gate(_raw(y, u)),
        CAUSE["outliers"].gate(_raw(_wild(1.0, 3))),
        CAUSE["quantisation"].gate(_raw(np.tile(np.arange(50) * 0.1, 3))),
        CAUSE["out-of-range"].gate(_raw(u, u)),
        CAUSE["saturation"].gate(_raw(_piled(30, 0))),
        CAUSE["current-tracking"].gate(_raw(u, u, reference=u + 0.5)),
    ):
        said = wording.text(firing.evidence)
        assert any(sign.isdigit() for sign in said), said
        assert "{" not in said


# --- a new cause is one file
TOY = '''
"""A force that no other cause has: y + a sin(270 (t/L)^2)."""

import numpy as np

from pulsetrainer.diagnosis.causes.base import Cause, Quantity


class Toy(Cause):
    """A chirp."""

    id = "toy"
    title = "a chirp"
    formula = "y + a sin(270 (t/L)^2)"
    signature = "it whistles"
    excitation = "any"
    source = "made up"
    stage = "output"
    order = 65
    family = "toy"
    parameters = (Quantity("amplitude", "{y}", -9.0, 9.0, 1e-3),)

    def starts(self, frames, residual):
        """One."""
        return [[(0.05,)]]

    def on_output(self, y, values, frame):
        """Add it."""
        return y + values[0] * np.sin(270.0 * (frame.time_s / frame.length_s) ** 2)
'''


def test_a_new_cause_is_one_file(tmp_path, monkeypatch):
    """Put into the folder of the causes it is in the library, and is diagnosed with its strength."""
    (tmp_path / "toy_cause.py").write_text(TOY)
    monkeypatch.setattr(causes, "__path__", [*causes.__path__, str(tmp_path)])
    before = library()
    library.cache_clear()
    try:
        plane = Plane.uniform(0.0, 1.5, 24)
        i, j = plane.cell_indices
        weights = 1.0 + np.exp(-(((i - j) / 24 - 0.25) ** 2) / 0.02)
        operator = Preisach(plane, weights * 7.0 / float((weights * plane.areas).sum()), 7.0)
        u = excitations.diagnostic(0.0, 1.5, rate_Hz=100.0).value[:3000]
        time = np.arange(u.size) / 100
        y = (
            operator(u)
            + 0.3 * np.sin(270.0 * (time / 30.0) ** 2)
            + 0.01 * np.random.default_rng(6).standard_normal(u.size)
        )
        found = diagnose(Question([Record(u, y, dt_s=0.01)], 0.0, 1.5, np.random.default_rng(0)))
        assert found.verdict == "toy"
        assert found.findings[0].parameters[0].value == pytest.approx(0.3, rel=0.02)
    finally:
        library().clear()
        library().update(before)  # the very causes that other tests hold


def test_an_output_that_jumps_with_its_input_is_no_fault():
    """Reversal curves with the way back left out: neither wild samples nor sticking; wild ones are seen."""
    curve = np.linspace(0.0, 1.0, 40)
    u = np.concatenate([low + (1.0 - low) * curve for low in np.linspace(0.0, 0.5, 40)])
    y = 2.0 * u + 0.001 * RNG.standard_normal(u.size)
    assert not _fires("stick-slip", y, u, dt=0.02)
    assert not _fires("outliers", y, u)
    wild = y.copy()
    wild[[20, 300, 900]] += 0.7
    assert _fires("outliers", wild, u)


def test_a_gap_in_time_hides_no_wild_sample_elsewhere():
    """Beside it neighbours are none; away from it they are."""
    y = np.sin(np.linspace(0.0, 9.0, 900)) + 0.001 * RNG.standard_normal(900)
    stamps = np.arange(900.0)
    stamps[450:] += 100.0
    at_gap, elsewhere = y.copy(), y.copy()
    at_gap[[449, 450, 451]] += [0.5, -0.5, 0.5]
    elsewhere[[100, 200, 700]] += 0.5
    for values, fires in ((at_gap, False), (elsewhere, True)):
        raw = replace(_raw(values, dt=1.0), stamps=stamps)
        assert (CAUSE["outliers"].gate(raw) is not None) is fires


@given(seed=st.integers(0, 10**6), k=st.floats(0.01, 0.3), begin=st.floats(-1.0, 1.0), rest=st.booleans())
def test_a_widening_solves_its_equation(seed, k, begin, rest):
    """The trailing v' = sgn(u - v) ((u - v)/k)^2, integrated in small steps on straight lines."""
    u = np.cumsum(np.random.default_rng(seed).normal(0.0, 0.03, 12))
    if rest:
        u[4:7] = u[4]
    seen = [begin]
    for a, b in pairwise(u):
        slope, e = (b - a) / DT, seen[-1]
        found = integrate.solve_ivp(
            lambda _, e, slope=slope: slope - np.sign(e) * (e / k) ** 2, (0.0, DT), [e], rtol=1e-9, atol=1e-12
        )
        seen.append(found.y[0, -1])
    np.testing.assert_allclose(rate_widening._excess(u, begin, k, DT), seen[1:], atol=1e-7)


@pytest.mark.parametrize("at", [70, 120, 220])
@pytest.mark.parametrize("size", [0.3, -2.0])
def test_a_window_is_split_where_the_means_on_both_sides_differ_most(at, size):
    """Up or down; what lies before and after the window does not count."""
    residual = np.where(np.arange(400) < at, 0.0, size)
    residual[:50], residual[250:] = 99.0, -99.0
    assert _split(residual, 50, 250) == at


def test_an_input_hurries_as_far_from_a_jump_as_five_samples():
    """On both sides of a short ramp between rests; a steady one does not hurry."""
    u = np.repeat([0.0, 1.0], 100)
    assert np.flatnonzero(outliers._hurries(u)).tolist() == list(range(95, 106))
    assert not outliers._hurries(np.arange(200.0)).any()
