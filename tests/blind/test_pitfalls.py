"""Pitfalls, five of a pilot and our own: the naive method fails on each, and this one must not."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import foreign
import hidden

import pulsetrainer as pt
import pulsetrainer.simulation
from pulsetrainer.core import excitations
from pulsetrainer.core.record import Record
from pulsetrainer.device.opening import open_device
from pulsetrainer.diagnosis import residual
from pulsetrainer.diagnosis.causes import fired_on, library, stick_slip
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit, weights_for
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.procedure import diagnose
from pulsetrainer.diagnosis.raw import Raw, noise_of
from pulsetrainer.diagnosis.screening import screen
from pulsetrainer.diagnosis.state import Question

pytestmark = pytest.mark.timeout(600)
TAU_S = 0.008


def _problem(settings):
    data = hidden.measure(hidden.Case(0, (), settings))
    return problem_for(data.records, 0.0, data.high)


def _diagnosed(settings):
    data = hidden.measure(hidden.Case(0, (), settings))
    return diagnose(Question(data.records, 0.0, data.high, np.random.default_rng(0)))


@pytest.fixture(scope="module")
def lagged():
    """A bench with an output lag of 8 ms, on the diagnostic signal."""
    return _problem({"output-lag": TAU_S})


@pytest.mark.slow
def test_one_rate_is_said_to_be_one_rate():
    """On a record of one rate the weights swallow a lag: the answer must say what is missing."""
    value = excitations.identification(0.0, 1.5, n_h=16, speed=1.5, rate_Hz=1000.0).value
    forces = []
    for port in ("bench:?ideal", f"bench:?ideal&output-lag={TAU_S}"):
        with open_device(port) as device:
            got = device.play(value, 1000.0)
        forces.append(got.force_N)
    record = Record(got.current_A, got.force_N, dt_s=1e-3, reference=got.reference_A)
    answer = diagnose(Question([record], 0.0, 1.5, np.random.default_rng(0)))
    assert {residual.RATES, residual.HOLDS} <= set(answer.lacks)
    named = [f for f in answer.findings if f.found]
    assert all(f.confounded_with for f in named if f.cause.family == "lag")
    # the naive reading, that what a static fit leaves is what is wrong, sees a small part of the lag
    bins = answer.problem.bins
    lag = np.sqrt(np.mean(bins.average([forces[1] - forces[0]]) ** 2))
    left = np.sqrt(max(answer.baseline.squares / bins.count - answer.floor.rms**2, 0.0))
    assert left < 0.25 * lag


@pytest.mark.slow
def test_discretisation_is_not_named_as_physics():
    """Without any noise all that is left is discretisation, and it is highly significant: still 'none'."""
    answer = _diagnosed({"noise": 0, "current-noise": 0})
    assert answer.verdict == "none"
    # the naive method names whatever is significant
    assert min(f.p_value for f in answer.findings if f.p_value is not None) <= 0.01


def test_a_joint_refit_finds_the_parameter_and_a_fit_to_the_residual_does_not(lagged):
    """Weights have swallowed part of the lag: its fit to their residual is too short."""
    base = weights_for(lagged, (), None)
    cause = library()["output-lag"]
    column = base.simulator((Term(cause, (1e-3,)),)) - base.simulated
    naive = 1e-3 * float(column @ base.residual) / float(column @ column)
    joint = refit(lagged, (Term(cause, (0.002,)),), base).terms[0].values[0]
    assert joint == pytest.approx(TAU_S, rel=0.05)
    assert naive < 0.8 * TAU_S


@pytest.mark.slow
def test_autocorrelated_noise_does_not_alarm():
    """Noise with memory: an F test for independent noise alarms, the simulated null does not."""
    problem = _problem({})
    record, high = problem.records[0], problem.plane.high
    rng = np.random.default_rng(5)
    model = weights_for(problem, (), None).simulator.full(())[0]
    shape = rng.standard_normal(record.output.size)
    wander = np.convolve(shape, np.exp(-np.arange(60) / 12.0), "same")
    y = model + 0.02 * wander / wander.std() + 0.02 * rng.standard_normal(wander.size)
    noisy = replace(record, output=y)
    again = problem_for([noisy], 0.0, high)
    base = weights_for(again, (), None)
    scores = screen(base, np.random.default_rng(0))
    independent = base.squares / again.bins.count
    best = scores.scores[0]
    assert best.gain / independent > 6.6  # the one per cent point of F(1, many)
    assert best.p_value > 0.01


@pytest.mark.slow
def test_friction_is_held_by_the_weights_and_not_named():
    """Coulomb friction with elastic presliding is a Preisach operator.

    The naive method fits F sgn(u') to what a given model leaves, and finds it.
    """
    given = weights_for(_problem({}), (), None).simulator.operator
    problem = _problem({"coulomb": 0.3})
    left = problem.measured - problem.bins.average([given(r.input) for r in problem.records])
    left -= left.mean()
    rate = residual.rates(problem)
    direction = np.sign(np.where(np.abs(rate) < 0.05, 0.0, rate))
    force = float(direction @ left) / float(direction @ direction)
    named = 1.0 - float(np.sum((left - force * direction) ** 2)) / float(left @ left)
    assert force < -0.1
    assert named > 0.3
    assert _diagnosed({"coulomb": 0.3}).verdict == "none"


@pytest.mark.slow
def test_the_wrong_lag_does_not_hide_a_resonance():
    """A delay explains most of a field lag and a resonance together; what it leaves is not its own kind."""
    settings = {"field-lag": 0.0121, "resonance": 17.2, "resonance-zeta": 0.27, "noise": 0.002}
    data = hidden.measure(hidden.Case(0, (), settings))
    problem = problem_for(data.records, 0.0, data.high)
    answer = diagnose(Question(data.records, 0.0, data.high, np.random.default_rng(0)))
    assert {f.cause.id for f in answer.findings if f.found} == {"field-lag", "resonance"}
    # naive: the best single cause first, and what it leaves is sought next to it
    alone = [
        refit(problem, (Term(library()[name], (0.012,)),), None, rebuild=True)
        for name in ("delay", "field-lag", "output-lag")
    ]
    assert min(alone, key=lambda fitted: fitted.squares).names == ("delay",)


@pytest.mark.slow
def test_a_hum_is_not_taken_for_sticking_as_well():
    """It jumps between flat runs too; but it goes on at rest, where the gate learns how large noise is."""
    device = {"seed": 4901, "noise-seed": 504, "noise": 0.00121}
    settings = device | {"periodic": 0.179, "periodic-frequency": 12.657}
    data = hidden.measure(hidden.Case(0, (), settings))
    record = data.records[0]
    assert "stick-slip" not in {f.cause for f in fired_on(Raw(record, 0.0, data.high))}
    # naive: seven standard deviations of white noise, whatever its colour
    wide = stick_slip._WIDE_LEAST * 2
    white = 7.0 * np.sqrt(2.0 / wide) * noise_of(record.output)
    resting = np.abs(np.gradient(record.input, record.step)) < 0.02 * data.high
    assert np.count_nonzero(np.abs(stick_slip._jumps(record.output, wide))[resting] > white) > 0
    answer = diagnose(Question(data.records, 0.0, data.high, np.random.default_rng(0)))
    assert [f.cause.id for f in answer.findings if f.found] == ["periodic"]


def _runs_of_plays(changed, noise=0.001):
    """Two runs at 200 Hz of eight plays, driven both ways; ``changed(u, static, t, k)`` is the output."""
    rng = np.random.default_rng(8)
    runs = []
    for number, seconds in enumerate((40.0, 20.0)):
        u = foreign.drive(200.0, rng, seconds) - 0.5
        at, static = np.full(8, -0.5), np.empty_like(u)
        widths = np.linspace(0.02, 0.3, 8)
        for k, one in enumerate(u.tolist()):
            at = np.clip(at, one - widths, one + widths)
            static[k] = at.mean()
        fine = np.arange(u.size) / (200.0 * foreign.FINER)
        y = changed(u, static, fine, number)[:: foreign.FINER]
        y += noise * rng.standard_normal(y.size)
        t = np.arange(y.size) / 200.0
        runs.append(pt.Run(time_s=t, input=150.0 * u[:: foreign.FINER], output=80.0 * y, input_unit="V"))
    return runs


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.01, -0.01])
def test_a_drift_has_either_direction(size):
    """Downwards it was a leak that is too slow to be one, and then nothing."""
    seen, unseen = _runs_of_plays(lambda u, static, t, number: static + size * t / t[-1] * (number == 0))
    model = pt.identify(seen)
    found = pt.diagnose([seen], model)
    assert (found.verdict, found.correctable) == ("offset-drift", ("offset-drift",))
    calm, _ = _runs_of_plays(lambda u, static, t, number: static)
    models = [model, pt.identify(pt.correct(seen, found)), pt.identify(calm)]
    drifting, corrected, sound = (one.shape_rms_percent for one in pt.evaluate(unseen, models).models)
    assert 1.2 * sound < drifting
    assert corrected < sound + 0.2 * (drifting - sound)


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [(0.02, 0.0, 0.02), (0.02, 0.0, -0.02), (0.02, -0.02, 0.02)])
def test_several_jumps_of_the_zero_are_found_together(sizes):
    """One alone, or a drift, took the place of all of them; the verdict was unknown."""
    moments = [share for share, size in zip((0.2, 0.5, 0.8), sizes, strict=True) if size]

    def jumped(u, static, t, number):
        jumps = [size * (t > share * t[-1]) for share, size in zip((0.2, 0.5, 0.8), sizes, strict=True)]
        return static + sum(jumps) * np.ptp(static)

    seen, _ = _runs_of_plays(jumped)
    calm, unseen = _runs_of_plays(lambda u, static, t, number: static)
    model = pt.identify(seen)
    found = pt.diagnose([seen], model)
    assert ([one.cause for one in found.found], found.correctable) == (["step"], ("step",))
    times = [one.value for one in found.found[0].parameters if one.name.startswith("time")]
    assert times == pytest.approx([share * seen.time_s[-1] for share in moments], abs=0.1)
    models = [model, pt.identify(pt.correct(seen, found)), pt.identify(calm)]
    jumping, corrected, sound = (one.rms_percent for one in pt.evaluate(unseen, models).models)
    assert 3.0 * sound < jumping
    assert corrected < sound + 0.1 * (jumping - sound)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.08, -0.08])
def test_a_gain_that_drifts_is_no_drift_of_the_zero(size):
    """Upwards it was unknown, downwards a heat that cools nothing."""
    seen, unseen = _runs_of_plays(lambda u, static, t, number: static * (1.0 + size * t / t[-1]))
    calm, unseen = _runs_of_plays(lambda u, static, t, number: static)
    model = pt.identify(seen)
    found = pt.diagnose([seen], model)
    assert ([one.cause for one in found.found], found.correctable) == (["gain-drift"], ("gain-drift",))
    known = {one.name: one.value for one in found.found[0].parameters}
    assert known["gain"] == pytest.approx(size / seen.time_s[-1], rel=0.08)  # the weights hold some of it
    models = [model, pt.identify(pt.correct(seen, found)), pt.identify(calm)]
    drifting, corrected, sound = (one.rms_percent for one in pt.evaluate(unseen, models).models)
    assert 2.0 * sound < drifting
    assert corrected < sound + 0.2 * (drifting - sound)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["late-input", "input-lag"])
def test_an_input_that_was_recorded_late_is_no_property_of_the_device(name):
    """A slow sensor of the input, or one that is read later, was a clock that runs at another rate."""
    seen, unseen = _runs_of_plays(lambda u, static, t, number: static)
    late_s, t = 0.03, seen.time_s
    if name == "late-input":
        recorded = np.interp(t - late_s, t, seen.input)
    else:
        fine = np.linspace(0.0, t[-1], 20 * t.size)
        recorded = np.interp(t, fine, foreign.lagged(np.interp(fine, t, seen.input), late_s, fine[1]))
    spoilt = replace(seen, input=recorded)
    model = pt.identify(spoilt)
    found = pt.diagnose([spoilt], model)
    assert ([one.cause for one in found.found], found.correctable) == ([name], (name,))
    assert found.found[0].parameters[0].value == pytest.approx(late_s, rel=0.05)
    models = [model, pt.identify(pt.correct(spoilt, found)), pt.identify(seen)]
    late, corrected, sound = (one.rms_percent for one in pt.evaluate(unseen, models).models)
    assert 2.0 * sound < late
    assert corrected < sound + 0.2 * (late - sound)


@pytest.mark.slow
def test_heat_of_a_device_that_is_driven_both_ways_is_no_step():
    """A current of either sign heats: cold is the middle of its range. The extension predicts another run."""

    def warm(u, static, t, number):
        return static * (1 - 0.15 * foreign.lagged((u / 0.5) ** 2, 9.0, t[1], 0.0))

    seen, unseen = _runs_of_plays(warm)
    model = pt.identify(seen)
    found = pt.diagnose([seen], model)
    assert [one.cause for one in found.found] == ["thermal-drift"]
    tau = next(p for p in found.found[0].parameters if p.name == "tau")
    assert tau.value == pytest.approx(9.0, rel=0.15)
    better = pt.extend(model, found)
    plain, extended = (one.rms_percent for one in pt.evaluate(unseen, [model, better]).models)
    assert extended < 0.5 * plain


@pytest.mark.slow
def test_a_model_is_extended_by_what_the_device_does_alone():
    """A lag of 12 ms, in a record whose zero drifts by 3 %: the extended model has the zero of its begin."""

    def late(u, static, t, number):
        drift = 0.03 * t / t[-1] if number == 0 else 0.0
        return foreign.lagged(static, 0.012, t[1]) + drift

    seen, clean = _runs_of_plays(late)
    model = pt.identify(seen)
    found = pt.diagnose([seen], model)
    assert {one.cause for one in found.found} == {"output-lag", "offset-drift"}
    assert found.correctable == ("offset-drift",)
    evaluated = pt.evaluate(clean, [model, pt.extend(model, found)]).models
    plain, extended = (one.rms_percent for one in evaluated)
    assert extended < 0.3 * plain
    assert extended < 1.5 * evaluated[1].shape_rms_percent
    assert found.extended_rms_percent < 0.3 * found.rms_percent


@pytest.mark.slow
def test_a_model_goes_on_in_the_condition_of_the_first_record():
    """A lag, and a second record with another zero and gain: a third one is of the first one's condition."""

    def late(u, static, t, number):
        return foreign.lagged(static, 0.012, t[1])

    first, clean = _runs_of_plays(late)
    model = pt.identify(first)
    found = pt.diagnose([first, replace(clean, output=1.02 * clean.output + 1.0)], model)
    assert [one.cause for one in found.found] == ["output-lag", "condition-change"]
    agrees, differs = (one for one in found.evidence if "the model as given is off" in one)
    assert ("record 1: " in agrees, "record 2: " in differs) == (True, True)
    assert "has 1.0" in agrees
    assert "has 1.02" in differs
    plain, extended = pt.evaluate(clean, [model, pt.extend(model, found)]).models
    assert extended.rms_percent < 0.3 * plain.rms_percent
    assert extended.rms_percent < 1.5 * extended.shape_rms_percent


@pytest.mark.slow
def test_one_of_two_records_that_is_turned_over_is_told():
    """A swapped lead in the second one: no other kind of device, whose force would follow the velocity."""
    first, second = _runs_of_plays(lambda u, static, t, number: static.copy())
    turned = replace(second, output=0.4 - 0.4 * second.output)
    found = pt.diagnose([first, turned], pt.identify(first))
    assert (found.verdict, [one.cause for one in found.found]) == ("condition-change", ["condition-change"])
    assert "record 2: the force falls where the model rises" in found.evidence[0]
    assert "different conditions" in found.next_experiment


@pytest.mark.slow
def test_what_only_clipped_samples_reach_stays_as_given():
    """A lag of 60 ms, in a record that a sensor clips at 65 % of its output: the top of the model is kept."""
    seen, clean = _runs_of_plays(lambda u, static, t, number: foreign.lagged(static, 0.06, t[1]))
    rail = float(np.min(seen.output) + 0.65 * np.ptp(seen.output))
    clipped = replace(seen, output=np.minimum(seen.output, rail))
    model = pt.identify(clean)
    found = pt.diagnose([clipped], model)
    assert {one.cause for one in found.found} >= {"output-lag", "saturation"}
    plain, extended = (one.rms for one in pt.evaluate(clean, [model, pt.extend(model, found)]).models)
    assert extended < plain  # twice as much with the top fitted to what is left there


def _at_one_rate(shown, speed, seed=8):
    """A run at 100 Hz through drawn turns at one rate, without a rest; ``shown(u, dt_s)`` is the output."""
    rng = np.random.default_rng(seed)
    turns = [0.0, 1.0, 0.0, *rng.uniform(0.0, 1.0, 45), 0.0]
    times = np.cumsum([0.0, *(np.abs(np.diff(turns)) / speed)])
    dt_s = 0.01 / foreign.FINER
    u = np.interp(np.arange(0.0, times[-1], dt_s), times, turns)
    y = shown(u, dt_s)[:: foreign.FINER]
    y = y + 0.003 * np.ptp(y) * rng.standard_normal(y.size)
    return pt.Run(time_s=0.01 * np.arange(y.size), input=u[:: foreign.FINER], output=y)


@pytest.mark.slow
def test_a_force_by_speed_that_one_rate_shows_holds_at_three_times_that_rate():
    """The powers of the speed fit alike there; the plainest is meant."""

    def shown(u, dt_s):
        return foreign.plays(u, np.random.default_rng(3)) + 0.012 * np.gradient(u, dt_s)

    seen, fast = _at_one_rate(shown, 0.8), _at_one_rate(shown, 2.4, seed=9)
    model = pt.identify(seen)
    found = pt.diagnose([seen], model)
    assert found.verdict == "viscous"
    plain, extended = (one.rms for one in pt.evaluate(fast, [model, pt.extend(model, found)]).models)
    assert extended < 0.5 * plain


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 6, 9])
def test_at_one_rate_no_memory_in_time_is_named_for_a_device_without(seed):
    """The loops of a Jiles-Atherton device have a shape that looks like creep there."""
    seen = _at_one_rate(lambda u, _: foreign.jiles_atherton(u, np.random.default_rng(seed)), 0.6)
    assert pt.diagnose([seen], pt.identify(seen)).verdict in ("unknown", "inconclusive")


def _plays(u, radii):
    """Outputs (n, k) of plays of these radii, from rest at zero."""
    y = np.empty((u.size, radii.size))
    now = np.zeros(radii.size)
    for k, value in enumerate(u):
        now = np.clip(now, value - radii, value + radii)
        y[k] = now
    return y


def _ramps(levels, step):
    """A path through levels, in steps of this size."""
    pieces = [np.arange(a, b, step if b > a else -step) for a, b in pairwise(levels)]
    return np.concatenate(pieces)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.005, 0.001])
def test_the_square_of_what_lags_does_not_stick(noise):
    """No form follows it: what a model leaves comes again on every stroke, but nothing jumps."""
    rng = np.random.default_rng(33)
    back = [x for low in (-2, -1.5, -1.2, -1, -0.8, -0.5) for x in (2, low)]
    up = [x for high in (0.5, 0.8, 1.0, 1.2, 1.5, 2) for x in (-2, high)]
    u = _ramps([0, 2, -2, *back, 2, *up, -2, 0], 0.025)
    radii = np.linspace(0.2, 1.2, 21)
    weights = np.exp(-(((radii - 0.8) / 0.25) ** 2))
    lags = 0.35 * np.tanh(_plays(u, radii) / 0.35) @ weights / weights.sum() + 0.02 * u
    y = 2.2 * lags**2
    y = y + rng.normal(0.0, noise * np.ptp(y), y.size)
    run = pt.Run(time_s=0.05 * np.arange(u.size), input=u + rng.normal(0.0, 0.002, u.size), output=y)
    found = pt.diagnose(run, pt.identify(run))
    assert found.verdict == "unknown"
    assert not found.found
    assert found.advice[0].startswith("No model of this program follows this device much further")


@pytest.mark.slow
def test_the_error_of_even_levels_is_no_slow_noise():
    """A soil gives up its water over decades of suction: there the levels of its model crowd."""
    rng = np.random.default_rng(61)
    inner = (2.9, 0.8, 2.6, 1.1, 2.3, 1.4, 2.0, 0.3, 2.9, 1.8, 2.9, 1.3, 2.9, 0.8, 2.9)
    turns = [0.3, 2.9, 0.3, *inner, 0.3, 1.2, 0.3, 1.6, 0.3, 2.0, 0.3, 2.4, 0.3, 2.9, 0.3]
    decades = _ramps(turns, 0.01)
    radii = np.linspace(0.02, 0.45, 12)
    weights = np.exp(-(((radii - 0.2) / 0.12) ** 2))
    suction = 10.0 ** (_plays(decades, radii) @ weights / weights.sum())
    water = 4.0 + 38.0 * (1.0 + (0.02 * suction) ** 1.9) ** (1.0 / 1.9 - 1.0)
    water += rng.normal(0.0, 0.003 * np.ptp(water), water.size)
    measured = 10.0**decades * (1.0 + rng.normal(0.0, 0.005, water.size))
    run = pt.Run(time_s=600.0 * np.arange(water.size), input=measured, output=water)
    model = pt.identify(run)
    assert "levels lie closer" in " ".join(model.fit.notes)
    found = pt.diagnose(run, model)
    assert not found.found
    assert "taken for noise here is slow" not in " ".join(found.evidence)
