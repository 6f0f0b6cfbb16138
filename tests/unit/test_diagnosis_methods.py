"""How the figures of a diagnosis come about: each formula against a closed form."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from weakref import WeakKeyDictionary

import numpy as np
import pytest
from scipy import sparse, stats

from pulsetrainer.artefacts import Model, Run
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import (
    advice_wording,
    artefact,
    experiment,
    fast_causes,
    floor,
    question,
    residual,
    screening,
    velocity,
    wording,
)
from pulsetrainer.diagnosis.causes import library, stick_slip
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.dependence import Bank
from pulsetrainer.diagnosis.design import bins_of
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.extended import Term, chain
from pulsetrainer.diagnosis.finding import Finding
from pulsetrainer.diagnosis.fitting import Fitted, _moved, refit, weights_for
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.held_out import HeldOut, repeated
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.procedure import diagnose
from pulsetrainer.diagnosis.raw import Firing, evenly
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.screening import _log_tail, p_value
from pulsetrainer.diagnosis.stages import advice, first_stroke, parameters
from pulsetrainer.diagnosis.state import Question
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.errors import DataError

CAUSE = library()
RNG = np.random.default_rng(20260611)
FRAME = Frame(1e-3, np.zeros(10_000), 1.0, 1.0)


# --- the null
@pytest.mark.parametrize(("observed", "p"), [(0.5, 5 / 5), (2.0, 4 / 5), (4.0, 2 / 5), (9.0, 1 / 5)])
def test_a_p_value_counts_the_draws_that_reach_it(observed, p):
    """(1 + k) / (1 + B): never 0, and what equals it has reached it."""
    assert p_value(observed, np.asarray([1.0, 2.0, 3.0, 4.0])) == pytest.approx(p)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_the_tail_of_chi_square_is_that_of_scipy(count):
    """Where a screen looks, and far out."""
    square = np.asarray([0.0, 0.3, 4.0, 90.0, 400.0])
    np.testing.assert_allclose(
        _log_tail(square, count), stats.chi2.logsf(square, count), rtol=1e-9, atol=1e-12
    )


def _block(cause: str, values, basis, back, *, one_sided=False, as_it_is=False):
    return screening._Block(CAUSE[cause], values, np.asarray(basis), np.asarray(back), one_sided, as_it_is)


def test_the_gain_of_a_block_is_what_its_columns_can_take_away():
    """The squared part along them; none for a strength of the wrong sign; a whole column as it stands."""
    signal = np.asarray([[3.0, -3.0], [4.0, 4.0]])
    two = _block("step", ((0,), (0,)), np.eye(2), np.eye(2))
    np.testing.assert_allclose(two.gains(signal), [25.0, 25.0])
    first = np.asarray([[1.0], [0.0]])
    one = _block("output-lag", ((0.01,),), first, [[0.5]], one_sided=True)
    np.testing.assert_allclose(one.gains(signal), [9.0, 0.0])
    whole = _block("resonance", ((9.0, 0.1),), first, [[0.5]], as_it_is=True)  # a column of length 2
    np.testing.assert_allclose(whole.gains(signal), [2 * 2 * 3 - 4, -2 * 2 * 3 - 4])


@pytest.mark.parametrize(("along", "start"), [(1.0, 0.02), (0.01, 0.002), (99.0, 0.05), (-1.0, 0.002)])
def test_a_refit_starts_at_the_linearised_strength(along, start):
    """But within a fifth and five times the value that was tried."""
    block = _block("output-lag", ((0.01,),), [[1.0]], [[2.0]])
    assert screening._start(block, np.asarray([along]), FRAME) == pytest.approx((start,))


def test_a_signed_strength_stays_within_its_bounds_only():
    """A drift may be of either sign; an amplitude of creep has an upper bound."""
    drift = _block("offset-drift", ((0.01,),), [[1.0]], [[1.0]])
    assert screening._start(drift, np.asarray([-30.0]), FRAME) == pytest.approx((-0.3,))
    creep = _block("creep", ((0.03, 1.0),), [[1.0]], [[1.0]])
    assert screening._start(creep, np.asarray([99.0]), FRAME) == (0.6, 1.0)


@pytest.mark.parametrize(
    ("relevant", "least"),
    [(0.0, 2 * 4.0 + 2 * 1.2816), (1e4, 1.8 * (2 * 1.2816 + np.sqrt((2 * 1.2816) ** 2 + 1e4)))],
)
def test_the_smallest_effect_that_shows_is_tested_and_matters(relevant, least):
    """Four standard deviations of 2 and nine in ten more, or 1.8 times what falls enough."""
    sight = screening.Sight(share=0.5, noise=2.0, critical=4.0)
    assert sight.least(relevant) == pytest.approx(least / 0.5)
    assert sight.least(relevant, there=9.0) == pytest.approx((least + 3.0) / 0.5)  # it may be undone by that


def test_what_shows_of_a_cause_is_told_by_the_block_in_the_middle():
    """Of its own blocks, by the effect that shows: noise times what the test asks for, over what is left."""
    shares = (0.5, 0.1, 1.0)  # noises of 1, 2 and 3: effects of 2, 20 and 3 times what the test asks for
    blocks = [replace(_block("creep", ((1.0,),), np.ones((4, 1)), [[1.0]]), share=one) for one in shares]
    sight = screening._sights(blocks, np.diag([1.0, 4.0, 9.0]), -5.0)["creep"]
    assert (sight.share, sight.noise) == (1.0, 3.0)


@pytest.mark.parametrize("surprise", [-3.0, -9.0])
def test_the_critical_size_has_the_surprise_that_is_asked_for(surprise):
    """For one column, a one-sided one, two, a whole one and a line that was sought."""
    column = [[1.0], [0.0]]
    for block in (
        _block("viscous", ((1.0,),), column, [[1.0]]),
        _block("output-lag", ((1.0,),), column, [[1.0]], one_sided=True),
        _block("step", ((0,), (0,)), np.eye(2), np.eye(2)),
        _block("resonance", ((9.0, 0.1),), column, [[1.0]], as_it_is=True),
        screening._Block(CAUSE["periodic"], ((0,), (0,)), np.eye(2), np.eye(2), False, False, 5000.0),
    ):
        along = np.zeros((block.basis.shape[1], 1))
        along[0] = block.critical(surprise)
        assert block.surprises(along, np.eye(along.size))[0] == pytest.approx(surprise, abs=0.05)


# --- the floor
@pytest.mark.parametrize(
    ("white", "error", "span", "size"), [(1.0, 0.2, 1.0, 0.3), (1.0, 0.4, 1.0, 0.4), (0.1, 0.01, 1000.0, 0.3)]
)
def test_an_effect_must_be_larger_than_noise_levels_and_a_share_of_the_span(white, error, span, size):
    """The largest of 0.3 of the noise, the error of the levels and 0.03 % of the span."""
    one = Floor(50, span, 1.0, white, error)
    assert one.relevant == pytest.approx(50 * size**2)
    assert one.squares == pytest.approx(50 * (white**2 + error**2))
    assert one.rms == pytest.approx(np.hypot(white, error))


def test_something_is_always_reducible():
    """So that shares stay finite."""
    one = Floor(1, 1.0, 1.0, 1.0)
    assert one.reducible(SimpleNamespace(squares=3.0)) == pytest.approx(2.0)
    assert one.reducible(SimpleNamespace(squares=0.5)) == pytest.approx(5e-13)
    assert one.reducible(SimpleNamespace(squares=0.0)) == 1e-300


@pytest.mark.parametrize(("coarse", "error"), [(300.0, np.sqrt(2.0 / ((32 / 22) ** 2 - 1))), (50.0, 0.0)])
def test_the_error_of_the_levels_falls_with_the_cell(monkeypatch, coarse, error):
    """From the fall of the mean square between 22 and 32 levels."""
    monkeypatch.setattr(floor, "weights_for", lambda *_: SimpleNamespace(squares=coarse))
    fitted = SimpleNamespace(terms=(), squares=100.0)
    assert Floor(100, 1.0, 1.0, 1.0).at("coarse", fitted).discretisation == pytest.approx(error)


@pytest.mark.parametrize(("left", "noise"), [(0.2, 0.2), (0.7, 0.5)])
def test_noise_is_no_more_than_a_fit_leaves(monkeypatch, left, noise):
    """A bend between few samples looks like noise of 0.5 from sample to sample, until it is fitted."""
    monkeypatch.setattr(floor, "quiet_square", lambda *_: SimpleNamespace(square=0.01, doubtful=0.0))
    monkeypatch.setattr(floor.residual, "rates", lambda problem: np.zeros(4))
    problem = SimpleNamespace(bins=None, measured=np.zeros(4))
    fitted = SimpleNamespace(problem=problem, residual=left * np.asarray([1.0, -1.0, 1.0, -1.0]))
    heard = Floor(4, 10.0, 0.5, 0.5, single=0.5, sampled=0.25).heard(fitted)
    assert (heard.white, heard.noise, heard.quick.white, heard.quick.noise) == pytest.approx((noise,) * 4)
    assert heard.squares <= 4 * left**2 + 1e-12


@pytest.mark.parametrize("jump", [0.0, 0.4])
def test_steps_and_jumps_do_not_average_out(jump):
    """A twelfth of their squares, in the unit of the problem; the noise of single samples does."""
    u = 0.5 - 0.5 * np.cos(np.arange(2000) / 100.0)
    y = 5.0 * np.round(u, 1)
    problem = problem_for([Record(u, y / 5.0, dt_s=0.01)], 0.0, 1.0)
    fired = [Firing("stick-slip", "x", value, "{y}") for value in (0.3 * jump, jump) if jump]
    found = floor.floor_of([Record(u, y, dt_s=0.01)], [*fired, Firing("step", "x", 9.0, "{y}")], problem, 5.0)
    assert found.held == pytest.approx((0.1**2 + (jump / 5.0) ** 2) / 12.0)
    assert found.white == pytest.approx(np.sqrt(found.sampled + found.held))
    noisy = Record(u, u + 0.02 * np.random.default_rng(1).standard_normal(u.size), dt_s=0.01)
    other = problem_for([noisy], 0.0, 1.0)
    heard = floor.floor_of([noisy], [], other)
    assert heard.single == pytest.approx(0.02, rel=0.1)
    assert heard.sampled == pytest.approx(heard.single**2 * np.mean(1.0 / other.bins.sizes))
    assert (found.count, found.span) == (problem.bins.count, pytest.approx(1.0))


# --- the joint refit
def test_parameters_move_within_a_factor_of_three_and_their_bounds():
    """A signed one is bounded only by its bounds; the derivative takes two hundredths of the value."""
    lag, skew = Term(CAUSE["output-lag"], (0.01,)), Term(CAUSE["clock-skew"], (0.001,))
    for step, lags, skews in ((1.0, 0.03, 0.01), (-1.0, 0.01 / 3, -0.01), (0.005, 0.015, 0.006)):
        (one,), (other,) = (_moved([term], np.asarray([step]), FRAME) for term in (lag, skew))
        assert one.values == pytest.approx((lags,))
        assert other.values == pytest.approx((skews,))
    assert _moved([Term(CAUSE["output-lag"], (0.4,))], np.asarray([9.0]), FRAME)[0].values == (0.5,)
    for value, step in ((0.1, 0.002), (0.001, 0.0005), (0.5, -0.01)):  # at its upper bound it goes back
        term, problem = Term(CAUSE["output-lag"], (value,)), SimpleNamespace(frames=[FRAME])
        (((moved,), own),) = Fitted.moves.fget(SimpleNamespace(terms=(term,), problem=problem))
        assert own == pytest.approx(step)
        assert moved.values == (value + own,)


def _loops(rate: float = 100.0) -> np.ndarray:
    t = np.arange(1200) / rate
    return 0.75 - 0.75 * np.cos(2 * np.pi * t / 3.0) * np.minimum(1.0, 0.3 + t / 8.0)


def test_one_step_finds_a_parameter_that_enters_linearly():
    """A drift, whatever the weights had made of it; the derivative of the model with it is time itself."""
    u = _loops()
    record = Record(u, 3.0 * u + 0.05 * np.arange(u.size) / 100, dt_s=0.01)
    problem = problem_for([record], 0.0, 1.5)
    near = weights_for(problem, (), None)
    fitted = refit(problem, (Term(CAUSE["offset-drift"], (0.01, 0.0)),), near, rounds=1)
    assert fitted.terms[0].values == pytest.approx((0.05, 0.0), rel=0.02, abs=1e-5)
    assert fitted.squares < 1e-2 * near.squares
    time = problem.bins.time_s
    np.testing.assert_allclose(np.diff(fitted.slopes[:, 0]), np.diff(time), rtol=1e-6)


def test_a_drift_that_relaxes_is_told_to_its_begin():
    """With a bend alone a twentieth of it stayed there, and the begin that is fitted freely took more."""
    u = np.tile(_loops(), 10)
    t = np.arange(u.size) * 0.01
    frame = replace(FRAME, dt_s=0.01, input=u)
    for share, way in (
        (0.4, t),
        (0.1, t),
        (0.4, t[-1] - t),
    ):  # of the record, to relax in; backwards: it grows
        drift = 0.5 * (1.0 - np.exp(-way / (share * t[-1])))
        problem = problem_for([Record(u, 3.0 * u + drift, dt_s=0.01)], 0.0, 1.5)
        begun = [
            Term(cause, (0.01, 0.0, value))
            for cause, value in CAUSE["offset-drift"].finer(frame, (0.01, 0.0))
        ]
        fits = [refit(problem, (one,), None) for one in begun]
        (term,) = min(fits, key=lambda fitted: fitted.squares).terms
        left = drift - term.cause.on_output(0.0 * u, term.values, frame)
        assert np.abs(left - left.mean()).max() < 0.002 * 0.5


def test_a_residual_at_the_full_rate_averages_to_the_one_that_was_fitted():
    """It is zero where samples do not count, whatever was read there."""
    u = _loops()
    counts = (np.arange(u.size) // 100) % 4 != 2
    y = np.where(counts, 3.0 * u + 0.1 * np.sin(np.arange(u.size) / 9.0), 99.0)
    problem = problem_for([Record(u, y, 1.0 * counts, dt_s=0.01)], 0.0, 1.5)
    fitted = weights_for(problem, (), None)
    (left,) = screening.at_full_rate(fitted)
    assert np.all(left[~counts] == 0.0)
    np.testing.assert_allclose(problem.bins.average([left]), fitted.residual, atol=1e-9)


def test_a_chain_is_run_the_same_whatever_was_run_before():
    """What chains begin with is kept: each is still the chain run alone."""
    u = _loops()
    problem = problem_for([Record(u, 3.0 * u, dt_s=0.01)], 0.0, 1.5)
    fitted = weights_for(problem, (), None)
    terms = [
        Term(CAUSE[name], values)
        for name, values in (("field-lag", (0.02,)), ("output-lag", (0.03,)), ("creep", (0.1, 0.7)))
    ]
    chains = [terms[:k] for k in range(4)] + [[terms[1]], [terms[0], terms[2]], terms]
    kept = [fitted.simulator(chain) for chain in chains]
    for one, chain_of in zip(kept, chains, strict=True):
        frame = fitted.simulator.frames[0]
        alone = problem.bins.average([chain(tuple(chain_of), fitted.simulator.static, frame)])
        np.testing.assert_allclose(one, alone, rtol=0, atol=1e-10)
    for _ in range(20):  # more than are kept
        terms[2] = Term(CAUSE["creep"], (terms[2].values[0] * 1.1, 0.7))
        fitted.simulator(terms)
    np.testing.assert_array_equal(fitted.simulator(chains[1]), kept[1])


def test_a_state_is_of_the_output_at_its_place_in_the_chain():
    """Causes before it have been at work on that output, those after it have not."""
    u = _loops()
    problem = problem_for([Record(u, 3.0 * u, dt_s=0.01)], 0.0, 1.5)
    terms = tuple(
        Term(CAUSE[name], values) for name, values in (("output-lag", (0.03,)), ("creep", (0.1, 0.7)))
    )
    fitted = weights_for(problem, terms, None)
    (inner,), frame = fitted.simulator.inner(fitted.terms), fitted.simulator.frames[0]
    orders = [term.cause.order for term in terms]
    for order, before in ((min(orders), 0), (max(orders), 1), (max(orders) + 1, 2)):
        expected = inner
        for term in sorted(terms, key=lambda one: one.cause.order)[:before]:
            expected = term.cause.on_output(expected, term.values, frame)
        (found,) = Bank(fitted, HeldOut(problem), order).outputs
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_a_refit_far_from_its_goal_is_given_up():
    """Without a goal it goes on; one that it can reach stops nothing."""
    u = _loops()
    lagged = CAUSE["output-lag"].on_output(3.0 * u, (0.08,), FRAME)
    problem = problem_for([Record(u, lagged, dt_s=0.01)], 0.0, 1.5)
    near = weights_for(problem, (), None)
    begun = (Term(CAUSE["offset-drift"], (0.01, 0.0)),)  # not what it is
    free, one = refit(problem, begun, near), refit(problem, begun, near, rounds=1)
    assert refit(problem, begun, near, goal=free.squares * 1.01).squares == pytest.approx(free.squares)
    assert refit(problem, begun, near, goal=1e-9 * near.squares).squares <= one.squares


@pytest.mark.parametrize("name", ["field-lag", "output-lag", "delay"])
def test_a_strong_lag_is_fitted_as_exactly_as_a_weak_one(name):
    """A fifth of a stroke late: too much to be taken off rows that do not know it, whose fit got stuck."""
    u = np.tile(_loops(), 4)
    model = Preisach(Plane.uniform(0.0, 1.5, 16), np.ones(136), 0.0)
    dt_s, values = 0.01, (0.06,)
    frame = Frame(dt_s, u, 1.5, 1.0)
    seen = CAUSE[name].on_input(u, u, values, frame) if CAUSE[name].stage == "input" else u
    y = model(seen) if seen is not u else CAUSE[name].on_output(model(u), values, frame)
    problem = problem_for([Record(u, y / np.ptp(y), dt_s=dt_s)], 0.0, 1.5)
    before = weights_for(problem, (), None)
    found = refit(problem, (Term(CAUSE[name], (0.045,)),), before)
    assert found.terms[0].values == pytest.approx(values, rel=0.02)
    assert found.rms < 0.03 * before.rms


@pytest.mark.parametrize("name", ["output-lag", "delay"])
def test_a_lag_of_columns_is_that_of_each(name):
    """As rows are filtered: one by one, and together."""
    columns = np.random.default_rng(5).standard_normal((50, 3))
    together = CAUSE[name].on_output(columns, (0.0025,), FRAME)
    for one, column in zip(together.T, columns.T, strict=True):
        np.testing.assert_allclose(one, CAUSE[name].on_output(column, (0.0025,), FRAME), rtol=1e-12)


# --- blocks left out, intervals
def test_what_does_not_count_moves_no_block():
    """Of a record whose second half is masked, the last average lies in a block of the first half."""
    u = np.tile(_loops(), 4)
    weight = np.where(np.arange(u.size) < u.size // 2, 1.0, 0.0)
    block = HeldOut(problem_for([Record(u, 3.0 * u, weight, dt_s=0.01)], 0.0, 1.5)).block
    assert np.all(np.diff(block) >= 0)
    assert block[-1] <= LIMITS.blocks // 2


@pytest.mark.parametrize(("whole", "by_rate"), [(False, False), (True, False), (True, True)])
@pytest.mark.parametrize(
    ("name", "values"), [("field-lag", (0.02,)), ("resonance", (9.0, 0.4))], ids=["sparse", "filtered"]
)
def test_errors_of_folds_are_those_of_as_many_fits(name, values, whole, by_rate):
    """The sums over blocks against each fold fitted on its own rows, weighted one by one."""
    u = np.tile(_loops(), 4)
    u = np.concatenate((np.repeat(u, 2), u)) if by_rate else u
    rng = np.random.default_rng(3)
    y = CAUSE["output-lag"].on_output(3.0 * u, (0.03,), FRAME) + 0.01 * rng.standard_normal(u.size)
    problem = problem_for([Record(u, y, dt_s=0.01)], 0.0, 1.5)
    fitted = refit(problem, (Term(CAUSE[name], values),), None, rounds=2)
    assert sparse.issparse(fitted.design.nodes) == (name == "field-lag")
    held_out, folds = HeldOut(problem), 4
    blocks = np.arange(LIMITS.blocks)
    fold_of = (blocks * folds // LIMITS.blocks if whole else blocks % folds)[
        held_out._by_rate if by_rate else held_out.block
    ]
    design, free = fitted.design, np.flatnonzero(fitted.passive)
    rows = design.bins.settled(design.output(np.eye(design.plane.n_q)))
    columns = np.hstack((rows[:, free], design.bins.settled(fitted.slopes), design.bins.free))
    starts = design.bins.free.shape[1]
    smooth = np.zeros((columns.shape[1], columns.shape[1]))
    smooth[: free.size, : free.size] = design.smooth[np.ix_(free, free)]
    smooth[-starts:, -starts:] = LIMITS.start_kept * np.eye(starts)
    masses = np.zeros(columns.shape[1])
    masses[: free.size] = fitted.simulator.operator.masses[free]
    masses[free.size :] = 0.0
    if by_rate:
        rate = np.abs(residual.rates(problem))
        means = [np.sqrt(np.mean(rate[held_out._by_rate == k] ** 2)) for k in range(LIMITS.blocks)]
        assert means == sorted(means)
        np.testing.assert_allclose(
            held_out._squares(fitted, folds, "rates"),
            [e @ e for e, _ in held_out._left_out(fitted, folds, whole=True, block=held_out._by_rate)],
        )
    block = held_out._by_rate if by_rate else held_out.block
    for fold, (error, _) in enumerate(held_out._left_out(fitted, folds, whole=whole, block=block)):
        told = LIMITS.piece_told if whole else 0.0
        weight = np.where(fold_of == fold, told, 1.0)
        share = 1.0 - (1.0 - told) / folds
        normal = columns.T @ (weight[:, None] * columns) + share * smooth
        normal[np.diag_indices_from(normal)] *= 1.0 + LIMITS.ridge_held_out
        change = np.linalg.solve(normal, columns.T @ (weight * fitted.residual) - share * smooth @ masses)
        np.testing.assert_allclose(error, (fitted.residual - columns @ change)[fold_of == fold], atol=2e-6)


def test_a_cell_that_is_on_throughout_is_no_crash():
    """It is an offset as well: beside one its entry of the sums is rounding, of either sign."""
    u = 0.6 + 0.6 * np.tile(_loops(), 4)
    rng = np.random.default_rng(3)
    problem = problem_for([Record(u, 3.0 * u + 0.01 * rng.standard_normal(u.size), dt_s=0.01)], 0.0, 1.5)
    fitted = refit(problem, (Term(CAUSE["field-lag"], (0.02,)),), None, rounds=2)
    fitted = replace(fitted, passive=np.ones_like(fitted.passive))
    usual = HeldOut(problem).jackknife(fitted)
    assert usual is not None
    assert np.all(np.isfinite(usual))
    assert np.all(usual > 0.0)


def test_a_parameter_that_changes_nothing_stays_what_it_is():
    """Whatever is left out: it has no variance, and the others have theirs."""
    u = np.tile(_loops(), 4)
    rng = np.random.default_rng(3)
    problem = problem_for([Record(u, 3.0 * u + 0.01 * rng.standard_normal(u.size), dt_s=0.01)], 0.0, 1.5)
    fitted = refit(problem, (Term(CAUSE["field-lag"], (0.02,)),), None, rounds=2)
    more = replace(fitted)
    vars(more)["slopes"] = np.hstack((fitted.slopes, np.zeros_like(fitted.slopes)))
    (usual,) = HeldOut(problem).jackknife(fitted)
    assert HeldOut(problem).jackknife(more) == pytest.approx([usual, 0.0], rel=1e-9)


class _Fit:
    """A fit that is the same as itself only."""


def _told(folds: dict[int, list]) -> HeldOut:
    held_out = HeldOut.__new__(HeldOut)
    held_out.block, held_out._by_rate, held_out._known = None, None, WeakKeyDictionary()
    held_out._left_out = lambda fitted, number, **how: iter(folds[number])
    return held_out


def test_the_held_out_gain_is_a_share_of_what_is_reducible():
    """Both halves, each from the other; at least what is relevant is taken for reducible."""
    error = np.asarray([3.0, 4.0])
    halves = _told({2: [(error, None), (error, None)]})
    assert halves.error(_Fit()) == pytest.approx(50.0)
    assert np.isnan(_told({2: [(error, None)]}).error(_Fit()))
    before, after = _Fit(), _Fit()
    halves._known = {
        before: {(2, "in turn"): np.asarray([60.0, 50.0])},
        after: {(2, "in turn"): np.asarray([12.0, 8.0])},
    }
    assert halves.gain(before, after, Floor(10, 1.0, 1.0, 1.0)) == pytest.approx(90.0 / 100.0)
    halves._known[after][5, "pieces"] = halves._known[before][5, "pieces"] = np.full(5, 20.0)
    assert halves.gain(after, before, Floor(19, 1.0, 1.0, 1.0)) == pytest.approx(-90.0 / (19 * 0.09))


@pytest.mark.parametrize(
    ("halves", "pieces", "told"),
    [
        (60.0, 4.0, 80.0),  # of 90 that can be lowered; the halves say -20
        (60.0, 11.1, -20.0),  # less than half is predicted
        (40.0, 19.0, 20.0),  # the halves are believed
    ],
)
def test_whole_pieces_are_asked_where_halves_tell_nothing(halves, pieces, told):
    """A step of the gain between loops that each stand in one half alone: it seemed to do harm."""
    held_out, before, after = _told({}), _Fit(), _Fit()
    held_out._known = {
        before: {(2, "in turn"): np.full(2, 50.0), (5, "pieces"): np.full(5, 20.0)},
        after: {(2, "in turn"): np.full(2, halves), (5, "pieces"): np.full(5, pieces)},
    }
    assert held_out.gain_told(before, after, Floor(10, 1.0, 1.0, 1.0)) == pytest.approx(told / 90.0)
    assert held_out.gain(before, after, Floor(10, 1.0, 1.0, 1.0)) == pytest.approx(
        (100.0 - 2 * halves) / 90.0
    )


def test_what_was_left_out_once_is_not_left_out_again():
    """Halves, pieces and rates of one fit are asked for by many stages."""
    u = np.tile(_loops(), 4)
    problem = problem_for([Record(u, 3.0 * u, dt_s=0.01)], 0.0, 1.5)
    held_out, fitted, asked = HeldOut(problem), refit(problem, (), None), []
    left_out = held_out._left_out
    held_out._left_out = lambda *one, **how: (asked.append(one), left_out(*one, **how))[1]
    for _ in range(3):
        held_out.error(fitted), held_out.pieces(fitted), held_out.rates(fitted)
    assert [folds for _, folds in asked] == [2, 5, 4]


def test_the_jackknife_leaves_out_a_tenth_at_a_time():
    """(1 - 1/10) sum of squares about the mean; none where a tenth cannot be left out."""
    changes = [np.asarray([k, 2.0 * k]) for k in range(10)]
    found = _told({10: [(None, change) for change in changes]}).jackknife("a fit")
    np.testing.assert_allclose(found, 0.9 * np.asarray([82.5, 330.0]))
    assert _told({10: [(None, changes[0])] * 9}).jackknife("a fit") is None


@pytest.mark.parametrize(("jackknife", "variance"), [(None, 4e-4), (9e-4, 9e-4), (1e-4, 4e-4)])
def test_intervals_hold_noise_levels_moment_and_formula(monkeypatch, jackknife, variance):
    """2.26 standard deviations, the larger of the two, and the systematic parts beside them."""
    term = Term(CAUSE["output-lag"], (0.3,))
    column = np.asarray([[2.0], [0.0]])
    fitted = SimpleNamespace(
        terms=(term,), slopes=column, projector=lambda x: x, problem=SimpleNamespace(frames=[FRAME])
    )
    monkeypatch.setattr(parameters, "_late", lambda fitted: np.asarray([0.02, 0.0]))
    monkeypatch.setattr(parameters, "_otherwise", lambda fitted: [np.asarray([-0.04, 5.0])])
    told = SimpleNamespace(covariance=lambda columns: 0.04**2 * columns.T @ columns)  # 0.02 of the parameter
    noise = SimpleNamespace(noise=told)
    told = SimpleNamespace(jackknife=lambda fitted: None if jackknife is None else np.asarray([jackknife]))
    (one,) = parameters.estimates_of(fitted, noise, told, Floor(4, 1.0, 1.0, 1.0, 0.05))["output-lag"]
    half = np.sqrt(2.26**2 * variance + (0.2 * 0.05 * 2.0 / 2.0) ** 2 + 0.01**2 + 0.02**2)
    assert (one.value, one.lower, one.upper) == pytest.approx((0.3, 0.3 - half, 0.3 + half))


# --- where the residual is, and what the records lack
def _lacks(rates, rest_s: float, seconds: float):
    """Of a triangle at these rates (ranges a second), with a rest, so many seconds long."""
    dt = 0.01
    parts = [np.zeros(round(rest_s / dt))]
    while sum(part.size for part in parts) < seconds / dt:
        for rate in rates:
            up = np.arange(0.0, 1.0, rate * dt)
            parts += [up, up[::-1]]
    u = np.concatenate(parts)
    return set(residual.excitation_limits(problem_for([Record(u, u + 0.0, dt_s=dt)], 0.0, 1.0)))


def test_what_a_record_lacks():
    """Rates three to one, a rest of 0.8 s, twenty seconds."""
    assert _lacks((0.5, 2.0), 1.0, 24.0) == set()
    assert _lacks((0.5, 0.9), 1.0, 24.0) == {"rates"}
    assert _lacks((0.5, 2.0), 0.7, 24.0) == {"holds"}
    assert _lacks((0.5, 2.0), 1.0, 14.0) == {"length"}


def test_of_samples_without_time_it_is_time_that_lacks():
    """Nothing is said about rates and rests that nobody knows."""
    u = 1.0 - np.cos(0.06 * np.arange(2000.0)) + 0.1 * np.sin(0.31 * np.arange(2000.0))
    noise = np.random.default_rng(3).standard_normal(u.size)
    said = diagnose(Question([Record(u, u + 0.01 * noise, dt_s=None)], -0.2, 2.3, np.random.default_rng(0)))
    assert said.lacks == ("time",)
    assert [one.names for one in said.evidence if one.kind == "lacks"] == [("time",)]
    assert "the time of every sample" in advice_wording.advice(
        said.advice, advice_wording.Bench(said.scale, "A")
    )


def test_a_record_has_several_rates_by_its_way_or_by_its_time():
    """Few quick strokes run little of the time, slow ones little of the way; a sine has one rate."""
    assert "rates" not in _lacks((0.4, 1.0, 2.7, 2.7), 0.0, 24.0)  # by time, 43 % is slow, by way 17 %
    assert "rates" not in _lacks((0.5, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0), 0.0, 24.0)
    assert "rates" not in _lacks((0.3, 0.3, 0.3, 0.3, 2.0), 0.0, 60.0)  # by way 20 % is fast, by time 4 %
    dt = 0.01
    time = np.arange(4000) * dt
    for shrinks in (np.ones(4000), np.repeat(np.linspace(1.0, 0.4, 40), 100)):
        u = 0.5 + 0.5 * shrinks * np.sin(2.0 * np.pi * time)
        assert "rates" in residual.excitation_limits(problem_for([Record(u, u + 0.0, dt_s=dt)], 0.0, 1.0))


@pytest.mark.parametrize(("slower", "faster", "groups"), [(2.98, 3.02, 1), (2.0, 4.0, 2)])
def test_a_rate_on_an_edge_of_the_groups_is_one_group(slower, faster, groups):
    """Else a figure against the rate has two values at one place."""
    speed = np.repeat([slower, faster], 50)
    number, at = residual._by_speed(speed)
    assert np.unique(number).size == np.isfinite(at).sum() == groups
    np.testing.assert_allclose(at[number], speed, rtol=0.02)


def test_residuals_are_grouped():
    """Root mean square of each group; nothing where a group is empty."""
    group = residual.Group("level", "1", np.zeros(3), np.asarray([0, 0, 2]))
    np.testing.assert_allclose(
        residual.rms_by(group, np.asarray([3.0, 4.0, -2.0])), [np.sqrt(12.5), np.nan, 2.0]
    )


def test_every_average_is_in_a_group_and_all_power_in_a_band():
    """No group beyond the last one that is used; bands of a third of an octave up to half the rate."""
    u = np.tile(_loops(), 4)
    problem = problem_for([Record(u, 3.0 * u, dt_s=0.01)], 0.0, 1.5)
    left = np.random.default_rng(1).standard_normal(problem.bins.count)
    for one in residual.groups(problem):
        assert 0 <= one.number.min() <= one.number.max() < one.at.size
        if one.name == "rate":
            assert one.number.max() == one.at.size - 1
    frequency, rms = residual.spectrum(problem, left)
    np.testing.assert_allclose(np.diff(np.log2(frequency))[-6:], 1.0 / 3.0)
    assert np.sum(rms**2) == pytest.approx(np.mean(left**2), rel=0.05)


def test_averages_of_short_bins():
    """Five milliseconds; samples without weight are in none; the offset belongs to all records."""
    weight = np.ones(10_000)
    weight[2] = 0.0
    record = Record(np.arange(10_000.0), np.arange(10_000.0), weight, dt_s=1e-3)
    bins = bins_of([record, record])
    assert (bins.count, bins.width) == (4000, (5, 5))
    averaged = bins.average([record.output, record.output])
    np.testing.assert_allclose(averaged[:2], [(0 + 1 + 3 + 4) / 4, 7.0])
    np.testing.assert_allclose(bins.time_s[:2], [0.0025, 0.0075])
    np.testing.assert_allclose(bins.even(averaged, 1), averaged[2000:])
    np.testing.assert_allclose(bins.settled(np.full(4000, 7.0)), 0.0, atol=1e-12)


def test_short_and_long_records_have_as_many_averages_as_they_can():
    """A short one keeps its samples, a long one has 20 000 averages; fewer than 100 tell nothing."""

    def bins(count: int, dt: float):
        return bins_of([Record(np.arange(float(count)), np.arange(float(count)), dt_s=dt)])

    assert bins(100, 1e-3).count == 100
    assert bins(5000, 1e-3).count == 5000
    assert bins(200_000, 1e-3).width == (10,)
    with pytest.raises(DataError):
        bins(99, 1e-3)


# --- the kind of model
@pytest.mark.parametrize(
    ("preisach", "speed", "wrong"), [(0.51, 0.38, True), (0.5, 0.3, False), (0.51, 0.3826, False)]
)
def test_a_model_of_the_wrong_kind_leaves_much_and_the_velocity_less(preisach, speed, wrong):
    """More than 5 % of the span of 10, and the velocity less than three quarters of it."""
    assert velocity.Comparison(preisach, speed, 10.0).wrong is wrong


def test_a_function_of_the_velocity_is_found():
    """A damper leaves nothing by its velocity, and by the direction alone what the speed makes of it."""
    t = np.arange(4000) * 1e-2
    u = np.sin(2 * np.pi * 0.2 * t)
    record = Record(u, np.gradient(u, 1e-2), dt_s=1e-2)
    timed = velocity.compare([record], [1e-2], [record.output])
    assert timed.preisach == pytest.approx(np.sqrt(np.mean(record.output**2)))
    assert timed.velocity < 0.05 * timed.span
    untimed = velocity.compare([record], [None], [record.output])
    assert untimed.velocity == pytest.approx(np.std(np.abs(record.output)), rel=0.02)


@pytest.mark.parametrize(("spring", "kind"), [(0.0, "wrong kind"), (1.0, "wrong kind, both")])
def test_a_spring_beside_a_damper_is_told(spring, kind):
    """Of y = x + 2 dx/dt a function of the velocity leaves what follows x: it does not follow that alone."""
    t = np.arange(4000) * 1e-2
    u = np.sin(2 * np.pi * 0.2 * t) * (1 + 0.5 * np.sin(0.3 * t))
    record = Record(u, spring * u + 2.0 * np.gradient(u, 1e-2), dt_s=1e-2)
    found = velocity.compare([record], [1e-2], [record.output])
    assert found.wrong
    assert velocity.evidence(found).kind == kind
    assert ("damper and a spring" in velocity.warning(found, "x", "F")) is bool(spring)


# --- from runs to records
def _run(t, **more) -> Run:
    return Run(
        t, np.interp(t, [0, 1, 2], [0.0, 1.0, 0.0]), 2.0 * np.interp(t, [0, 1, 2], [0.0, 1.0, 0.0]), **more
    )


def _model(**more) -> Model:
    return Model(np.linspace(0, 1, 4), np.ones(6), 0.0, np.ones(6, bool), **more)


def _measured(run: Run, polarity: int = 1) -> Record:
    record, stamps = question.measured_of("a run", run, polarity, 0.0, 1.0)
    return evenly(record, stamps)


def test_a_gap_is_filled_and_does_not_count():
    """Where samples are missing for more than one and a half steps; a falling output is turned."""
    t = np.arange(200) * 0.01
    kept = np.ones(200, bool)
    kept[50:60] = False
    found = _measured(_run(t[kept]), -1)
    assert found.dt_s == pytest.approx(0.01)
    gone = set(np.flatnonzero(found.sample_weight == 0).tolist())
    assert set(range(50, 60)) <= gone <= set(range(49, 61))  # its ends are a matter of rounding
    np.testing.assert_allclose(found.output, -2.0 * found.input, atol=1e-9)


def test_samples_stay_as_they_are_until_the_gates_have_seen_them():
    """Jittered stamps: the values of the record, bit by bit. Rounded stamps are even ones."""
    t = np.arange(200) * 0.01
    jittered = _run(t + 0.003 * RNG.uniform(-1, 1, 200))
    record, stamps = question.measured_of("a run", jittered, 1, 0.0, 1.0)
    np.testing.assert_array_equal(record.output, jittered.output)
    np.testing.assert_array_equal(stamps, jittered.time_s - jittered.time_s[0])
    record, stamps = question.measured_of("a run", _run(np.round(t / 3.0, 4)), 1, 0.0, 1.0)
    assert stamps is None
    assert record.dt_s == pytest.approx(0.01 / 3.0, rel=1e-3)


def test_another_rate_is_no_gap_but_missing_samples_are():
    """A hundred samples at 10 ms and a hundred at 50 ms: all count. More gaps than samples are refused."""
    t = np.concatenate((np.arange(100) * 0.01, 1.0 + np.arange(100) * 0.05))
    found = _measured(_run(t))
    assert found.dt_s == pytest.approx(0.01)
    assert np.mean(found.sample_weight[200:]) > 0.95  # but for the moment where the rate changes
    with pytest.raises(DataError):
        _measured(_run(np.concatenate((np.arange(100) * 0.01, 50.0 + np.arange(100) * 0.01))))


def test_a_fast_record_is_averaged_down():
    """To a thousand samples a second of its own, but not below 20 000; a slower record is left alone.

    An average counts where all of its samples do.
    """
    scale = Scale(second=2.0)

    def shrunk(count: int, dt: float) -> Record:
        counts = np.arange(count) != 1007
        return scale.shrunk(Record(np.arange(float(count)), np.arange(float(count)), 1.0 * counts, dt_s=dt))

    assert shrunk(200_000, 4e-4).dt_s == pytest.approx(1e-3)
    assert shrunk(20_000, 4e-4).dt_s == pytest.approx(2e-4)
    fast = shrunk(200_000, 4e-4)
    assert fast.input.size == 40_000
    assert fast.input[100] == 502.0
    assert np.flatnonzero(fast.sample_weight != 1.0).tolist() == [201]
    assert fast.sample_weight[201] == 0.0


@pytest.mark.parametrize(("samples", "fits"), [(100, True), (99, False)])
def test_a_record_has_a_hundred_samples(samples, fits):
    """Fewer tell no causes apart."""
    run = _run(np.arange(samples) * 0.02)
    if fits:
        assert _measured(run).input.size == samples
    else:
        with pytest.raises(DataError):
            _measured(run)


def _question(run: Run, model: Model):
    return question.question_of(
        [run],
        model,
        rng=np.random.default_rng(0),
        quick=False,
        progress=lambda _: None,
        names=["run 1", "the model"],
    )


@pytest.mark.parametrize(("low", "high", "fits"), [(0.0, 1.0, True), (0.55, 1.0, False), (0.0, 0.45, False)])
def test_half_of_the_input_lies_in_the_range_of_the_model(low, high, fits):
    """Within a fiftieth; else the model is of another device."""
    run, model = _run(np.arange(200) * 0.01), _model()
    model = Model(np.linspace(low, high, 4), model.weights, 0.0, model.covered)
    if fits:
        assert _question(run, model).notes == ()
    else:
        with pytest.raises(DataError):
            _question(run, model)


def test_a_question_is_refused_where_it_makes_no_sense():
    """Other units; weights read as relays. An incomplete run is said to be one."""
    run = _run(np.arange(200) * 0.01)
    for model in (_model(input_unit="mA"), _model(output_unit="mN"), _model(reading="relay")):
        with pytest.raises(DataError):
            _question(run, model)
    assert len(_question(_run(np.arange(200) * 0.01, complete=False), _model()).notes) == 1


def test_the_evidence_of_the_wrong_kind_is_in_per_cent():
    """Of the span."""
    figures = velocity.evidence(velocity.Comparison(0.5, 0.2, 10.0)).figures
    assert figures == {"preisach": pytest.approx(5.0), "velocity": pytest.approx(2.0)}


# --- sticking
def _waves(strokes: int, periods: float, samples: int, amplitude: float = 0.3) -> list:
    said = np.linspace(0.0, periods, samples, endpoint=False)
    return [(said, amplitude * np.cos(2 * np.pi * said + k)) for k in range(strokes)]


def test_the_power_of_a_line_adds_up_over_the_strokes():
    """A cosine of amplitude A has n A^2 / 4 in each stroke of n samples; shorter strokes add none."""
    power, squares, used = (one[0] for one in stick_slip._lines(_waves(8, 10.0, 500), np.asarray([1.0])))
    more = stick_slip._lines([*_waves(8, 10.0, 500), *_waves(3, 2.0, 50)], np.asarray([1.0]))
    assert [one[0] for one in more] == pytest.approx([power, squares, used], rel=1e-12)
    assert used == 8
    assert np.sqrt(squares) == pytest.approx(0.3, rel=0.01)
    assert power == pytest.approx(8 * 500 * 0.09 / 4, rel=0.02)  # narrow bins of the output take a little


@pytest.mark.parametrize(
    ("strokes", "periods", "samples", "known"),
    [
        (5, 10.0, 500, True),
        (4, 10.0, 500, False),
        (5, 2.9, 500, False),
        (5, 10.0, 38, False),
        (5, 10.0, 41, True),
        (5, 3.1, 500, True),
    ],
)
def test_a_line_needs_strokes_periods_and_samples(strokes, periods, samples, known):
    """Five strokes of three periods, four samples a period."""
    used = stick_slip._lines(_waves(strokes, periods, samples), np.asarray([1.0]))[2][0]
    assert bool(used >= stick_slip._STROKES) is known


@pytest.mark.parametrize(
    ("name", "starts"),
    [
        ("output-lag", [(0.01,), (0.03,)]),
        ("rate-widening", [(0.01,), (0.03,)]),
        ("late-input", [(0.01,), (0.03,)]),
        ("input-lag", [(0.01,), (0.03,)]),
        ("viscous", [(0.01 * 8.0 / 0.5, steps * 0.01) for steps in (0.25, 2.0)]),
        ("creep", [(0.03, 0.1), (0.03, 0.408), (0.03, 10.0 / 6.0)]),
        ("thermal-drift", [(0.02 / 16.0, 4.3)]),
        ("accommodation", [(0.05, 28.0), (0.05, 80.0), (0.05, 240.0)]),
        ("load-dependence", [(0.01 * 4.0 / 8.0,)]),
        ("offset-drift", [(0.01 * 8.0 / 10.0, 0.0), (0.0, 4.0 * 0.01 * 8.0 / 10.0**2)]),
        ("gain-drift", [(0.008, 0.0, 0.0), (0.0, 0.0032, 0.0), (0.0, 0.0, 0.001)]),
        ("clock-skew", [(1e-5,), (1e-4,)]),
    ],
)
def test_start_values_scale_with_span_range_and_length(name, starts):
    """A span of 8, a range of 4, ten seconds in steps of 10 ms, and half a unit a second to and fro."""
    u = 0.5 * np.abs((np.arange(1000) * 0.01) % 5.0 - 2.5)
    frame = Frame(0.01, u, span=8.0, reach=4.0)
    blocks = CAUSE[name].starts([frame, Frame(0.01, 0.0 * u, 1.0, 1.0)], [])
    found = [one for block in blocks for one in block[: CAUSE[name].strengths]]
    assert np.asarray(found) == pytest.approx(np.asarray(starts), rel=0.01)
    assert np.asarray(found).shape == np.asarray(starts).shape


# --- words
def test_every_kind_of_evidence_and_advice_has_words():
    """With all its figures, and no brace left over."""
    words = {
        "input": "current",
        "output": "force",
        "y": "N",
        "in_y": " N",
        "hold_least": "1 s",
        "short": "20 s",
    }
    figures = dict.fromkeys(
        [
            "left",
            "beside",
            "white",
            "floor",
            "p",
            "explains",
            "at",
            "times",
            "preisach",
            "velocity",
            "share",
            "shift",
            "gain",
            "there",
            "here",
            "rest",
            "matters",
            "times",
            "extended",
            "given",
            "refitted",
            "left_out",
            "mains",
            "rail",
        ],
        1.25,
    )
    for kind in wording.TEXTS:
        names = ("level",) if kind == "largest" else ("holds", "x")
        said = wording.sentence(Evidence(kind, "creep" if kind == "tested" else "", figures, names), words)
        assert said.endswith(".")
        assert "{" not in said
    for kind in advice_wording.ADVICE:
        names = ("heating", "delay", "creep", "step") if kind == "tied" else ("delay", "creep", "step")
        for bench in (
            advice_wording.Bench(Scale(), "A", ours=True),
            advice_wording.Bench(Scale(), timed=False),
        ):
            said = advice_wording.advice(Evidence(kind, figures=figures, names=names), bench)
            assert "{" not in said
            assert ("delay, creep and step" in said) is (
                kind.startswith(("tied", "none, s", "none, c"))
                or kind == "in the model"
                or kind in ("inconclusive", "too noisy", "far too noisy", "correct")
                or kind in ("extend, correct", "correct, extend")
            )
            # only our own device plays our signals
            assert ("capture" in said) is (bench.ours and kind in ("tied", "lacks", "inconclusive"))


@pytest.mark.parametrize(("shown_from", "longer"), [(2.0, True), (50.0, False), (np.inf, False)])
def test_nobody_is_asked_for_a_recording_without_end(shown_from, longer):
    """Four times as long is advice; a thousand times, or for ever, is none."""
    state = SimpleNamespace(detectable={"delay": shown_from * LIMITS.matters}, blind=("delay",), lacks=())
    said = advice_wording.advice(advice._to_see_more(state), advice_wording.Bench(Scale(), "A", ours=True))
    assert ("4 times as long" in said, "less noise" in said) == (longer, True)
    assert not re.search(r"\binf\b|e\+", said)


@pytest.mark.parametrize(
    ("lacks", "shown_from", "said"),
    [
        (("length",), 1.1, "5 times as long"),  # as the slow causes ask
        (("length",), 3.0, "9 times as long"),  # as the noise asks
        (("length",), 6.0, "less noise"),
        (("length",), np.inf, "or more in all"),
        (("holds", "length"), 6.0, "or more in all"),
    ],
)
def test_a_recording_that_is_merely_short_is_asked_for_as_long_as_its_noise_needs(lacks, shown_from, said):
    """Once longer is done, the same advice would come again, for a length that the noise had asked for."""
    seen = {"delay": shown_from * LIMITS.matters}
    bins = SimpleNamespace(time_s=np.asarray([0.0, LIMITS.short_s / 4.5]))
    problem = SimpleNamespace(bins=bins)
    state = SimpleNamespace(detectable=seen, blind=("delay",), lacks=lacks, problem=problem)
    told = advice_wording.advice(advice._to_see_more(state), advice_wording.Bench(Scale(), "A"))
    assert said in told
    assert told.startswith("Use the model as it is")


@pytest.mark.parametrize("name", advice_wording.EXPERIMENTS)
def test_every_experiment_is_told_in_numbers_of_the_bench(name):
    """A piezo from 20 to 120 V whose second is 2 ms: volts, volts a second, milliseconds; never amperes."""
    bench = advice_wording.Bench(Scale(low=20.0, reach=100.0, second=0.002), "V")
    figures = {"there": 1.0, "here": 0.5}
    said = advice_wording.advice(Evidence("tied", figures=figures, names=(name, "delay", "creep")), bench)
    assert " V" in said
    assert " A" not in said
    told = {
        "nested loops": [
            "about 70 V (turning at 120, 30, 110, 40, 100, 50 and 90 V)",
            "25000 V/s",
            "400000 V/s",
            "about 34 ms in all",
        ],
        "steps and holds": ["110, 50, 90 and 30 V", "6 ms"],
        "equal minor loops": [
            "15 V wide",
            "two each up from 30, 50, 70 and 90 V",
            "50000 V/s",
            "once from 120 V",
        ],
        "equal cycles": ["between 40 V and 100 V", "75000 V/s"],
        "heating": ["60 ms at 120 V", "60 ms at 20 V", "about 140 ms in all"],
    }
    assert [words for words in told[name] if words not in said] == []
    often = "100 µs" if name in ("steps and holds", "heating") else "12 µs"
    assert f"sampled at least every {often}" in said


@pytest.mark.parametrize("kind", ["lacks", "again", "extend", "correct"])
def test_what_is_as_fast_as_the_samples_asks_for_a_faster_recording(kind):
    """Ten hours, every 10 s: creep of 25 s was followed by stops of hours. Our device has one signal only."""
    figures = {"tau": 25.0 / 7700.0, "apart": 10.0 / 7700.0, "faster": 0.6 * 7700.0 / 25.0}
    one = Evidence(kind, figures=figures, names=("holds",))
    said = advice_wording.advice(one, advice_wording.Bench(Scale(2.0, 6.0, second=7700.0), "V"))
    for words in ("about 25 s was found", "samples 10 s apart", "at 0.072 V/s, 0.22 V/s", "every 260 ms"):
        assert words in said, said
    first, slower, _ = said.partition("This recording cannot show everything")
    assert " h " not in first
    assert slower
    assert (kind in ("lacks", "again")) is said.startswith("A time of")
    assert "A time of" not in advice_wording.advice(one, advice_wording.Bench(Scale(), "A", ours=True))


@pytest.mark.parametrize(
    ("tau", "apart", "faster"),
    [(None, 0.005, 1.0), (1.0, 0.005, 1.0), (0.05, 0.005, 12.0), (0.001, 0.005, 12.5), (0.001, 0.1, 1.0)],
)
def test_no_bench_is_asked_for_samples_more_than_ten_times_as_close(tau, apart, faster):
    """A creep of 2 ms among samples 5 ms apart had asked for 7700 V/s of a bench that ran at 4 V/s."""
    assert experiment.as_fast_as(tau, apart) == pytest.approx(faster)


def _quick(name, *values, dt_s=0.01, length=3000):
    """A cause with its values, on a record with so many samples."""
    frame = Frame(dt_s, np.zeros(length), 1.0, 1.0)
    term = Term(library()[name], values)
    return fast_causes.fast_s(term, frame), fast_causes.as_late(term, frame)


@pytest.mark.parametrize(
    ("name", "values", "tau"),
    [
        ("output-lag", (0.05,), 0.05),
        ("output-lag", (0.051,), None),
        ("field-lag", (0.002,), 0.01),  # nothing shorter than a step is known
        ("delay", (0.02,), 0.02),
        ("creep", (0.3, 0.03), 0.03),
        ("creep", (0.3, 0.2), None),
        ("thermal-drift", (0.1, 0.3), 0.3),  # a hundredth of the record, the shortest that is searched
        ("thermal-drift", (0.1, 3.0), None),
        ("step", (0.1, 0.1, 0.01), None),  # a moment is no time constant
        ("resonance", (5.0, 0.1), None),
    ],
)
def test_what_is_as_fast_as_the_samples(name, values, tau):
    """At most five time steps, or at the short end of what is searched."""
    found, others = _quick(name, *values)
    assert found == tau
    named = {one.cause.id for one in others}
    if name == "creep" and tau is not None:
        assert named == {"delay", "field-lag", "output-lag"}
        assert [one.values[0] for one in others] == pytest.approx([0.3 / 1.3 * 0.03] * 3)
    elif tau is not None and name != "thermal-drift":
        (creep,) = others
        amplitude, slow = creep.values
        assert amplitude / (1.0 + amplitude) * slow == pytest.approx(max(values[0], 0.01 * 2.0 / 7.0))
    else:
        assert named == set()


def test_noise_at_the_end_of_a_range_is_no_level_to_be_set():
    """A range that ends at -0.3321 mA ends at 0 A for a person; large numbers need no exponent."""
    said = advice_wording.advice(
        Evidence("lacks", names=("rates",)), advice_wording.Bench(Scale(-0.0003321, 1.2003, second=1e-3), "A")
    )
    assert "from 0 A to 1.2 A" in said
    assert "e+" not in said


def test_no_level_is_asked_for_that_the_input_never_had():
    """A dual model may span more than what was recorded: 0 to 1 A of -0.1 to 1.2 A."""
    bench = advice_wording.Bench(Scale(-0.1, 1.3), "A", reached=(0.1 / 1.3, 1.1 / 1.3))
    one = Evidence("tied", figures={"there": 1.0, "here": 0.5}, names=("nested loops", "delay", "creep"))
    said = advice_wording.advice(one, bench)
    assert "between 0 A and 1 A" in said


def test_a_small_swing_about_a_large_value_is_told_with_more_digits():
    """Between 99.95 A and 100.05 A: three digits would make all stops the same."""
    bench = advice_wording.Bench(Scale(low=99.95, reach=0.1, second=1.0), "A")
    said = advice_wording.advice(Evidence("lacks", names=("holds",)), bench)
    assert "from 99.95 A to 100.05 A" in said
    assert "at each of 100.04, 99.98, 100.02 and 99.96 A" in said


def test_a_fault_beside_an_extension_is_not_told_as_a_step_that_is_missing():
    """`then` extends the model alone, as it was fitted without the fault."""
    said = advice_wording.advice(
        Evidence("extend, correct", names=("outliers",)), advice_wording.Bench(Scale(), "A")
    )
    assert "outliers; the extended model was fitted without that, so nothing has to be corrected" in said


@pytest.mark.parametrize("kind", ["none", "none, small", "extend", "extend, or late", "extend, correct"])
def test_what_can_be_done_now_comes_before_what_to_record(kind):
    """`next` asked for a recording, `then` to extend the model: in no order."""
    bench = advice_wording.Bench(Scale(), "A")
    now = advice_wording.advice(Evidence(kind, names=("creep",)), bench)
    both = advice_wording.advice(Evidence(kind, names=("creep", "holds")), bench)
    assert both.startswith(f"{now}\nThis recording cannot show everything (the input never rests")
    assert "record output and input again" in both


@pytest.mark.parametrize("kind", list(advice_wording.ADVICE))
@pytest.mark.parametrize("command", ["", "correct", "extend"])
def test_what_can_be_done_about_the_measurement_is_always_said(kind, command):
    """`next` sent to the bench, or to use the model as it is, and `then` to correct the recording."""
    names = (*["heating"][: kind == "tied"], "periodic", "clock-skew")
    one = Evidence(
        kind, figures={"there": 1, "here": 1, "rest": 1, "matters": 1, "times": 2, "rail": 1}, names=names
    )
    said = advice_wording.advice(one, advice_wording.Bench(Scale(), "A"), command, ["outliers", "periodic"])
    if command == "correct":
        assert "pulsetrainer correct" in said
    if kind in ("tied", "tied, no better"):
        assert ("outliers and periodic out" in said) is (command == "correct")
        assert ("pulsetrainer extend" in said) is (command == "extend")
        assert ("does not belong in a model" in said) is (command == "correct")
        of_the_device = replace(one, names=(*names[:-1], "viscous"))
        said = advice_wording.advice(of_the_device, advice_wording.Bench(Scale(), "A"), command, ["periodic"])
        assert "does not belong in a model" not in said
        at_50 = replace(one, figures={**one.figures, "mains": 50.02})
        assert "50.02 Hz" in advice_wording.advice(
            at_50, advice_wording.Bench(Scale(), "A"), command, ["periodic"]
        )


@pytest.mark.parametrize("kind", ["tied", "tied, no better"])
@pytest.mark.parametrize(
    ("names", "known"),
    [
        (("offset-drift", "accommodation"), True),
        (("creep", "accommodation"), False),
        (("offset-drift", "step"), False),
    ],
)
def test_who_knows_that_it_is_the_sensor_is_told_the_way_on(kind, names, known):
    """No recording decides between the sensor and the device as surely as a person who knows the sensor."""
    figures = {"there": 1.0, "here": 0.5}
    named = ("heating", *names) if kind == "tied" else names
    said = advice_wording.advice(
        Evidence(kind, figures=figures, names=named), advice_wording.Bench(Scale(), "A")
    )
    assert ("If you know that it is the measurement (offset-drift)" in said) is known


@pytest.mark.parametrize(("kind", "first"), [("lacks", True), ("none", False), ("extend", False)])
def test_a_recording_without_time_may_only_need_its_rate(kind, first):
    """It sent back to the bench, where `import --rate` is enough."""
    timed, untimed = (
        advice_wording.advice(Evidence(kind, names=names), advice_wording.Bench(Scale(), "A", timed=False))
        for names in (("holds",), ("time",))
    )
    assert "--rate HZ" not in timed
    assert untimed.startswith("If the samples were taken at a constant rate") is first
    assert untimed.endswith("--rate HZ.") is not first


def test_two_rates_that_count_as_one_are_not_told_as_one():
    """A recording at two clearly different rates was said to be of one: the words tell how far apart."""
    said = wording.sentence(Evidence("lacks", names=("rates",)), {})
    assert f"less than {LIMITS.one_rate:g} times apart" in said


def test_what_a_record_lacks_is_asked_for_in_numbers():
    """Rates, stops and length, for a slow bench in millimetres."""
    bench = advice_wording.Bench(Scale(low=0.0, reach=2.0, second=100.0), "mm")
    said = advice_wording.advice(Evidence("lacks", names=("rates", "holds", "length")), bench)
    for words in ("0.01 mm/s", "0.16 mm/s", "300 s", "1.8, 0.6, 1.4 and 0.2 mm", "33.3 min or more"):
        assert words in said, said
    assert "from 0 mm to 2 mm" in said
    least = f"{100.0 * LIMITS.hold_s:.0f} s"  # what counts as a hold on a bench whose second is 100 s
    evidence = wording.sentence(Evidence("lacks", names=("holds", "length")), bench.numbers())
    assert least in evidence
    assert "33.3 min" in evidence


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-1.0, 3.0), (0.3, 0.6)])
def test_the_ends_of_the_output_are_means_near_those_of_the_input(low, high):
    """Of the range, or of the record where it does not come so far; samples without weight do not count."""
    u = np.random.default_rng(1).permutation(np.linspace(0.0, 1.0, 2001))
    y = np.exp(u)
    counts = (u > 0.002) & (u < 0.998)
    record = Record(u, np.where(counts, y, 99.0), 1.0 * counts, dt_s=0.01)
    near = LIMITS.near_end * (high - low)
    bottom, top = max(low, 0.0025), min(high, 0.9975)
    (frame,) = problem_for([record], low, high).frames
    expected = y[counts & (u <= bottom + near)].mean(), y[counts & (u >= top - near)].mean()
    assert frame.ends == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "way", "seconds", "rest", "fastest"),
    [
        ("nested loops", 4 * 5.6, 5.6 / 0.5 + 5.6 / 4.0 + 5.6 / 1.5 + 5.6 / 8.0, 0.0, 8.0),
        ("steps and holds", 2.6, 15.0 + 2.6 / 8.0, 15.0, 8.0),
        ("equal minor loops", 16.0, 16.0, 0.0, 1.0),
        ("equal cycles", 2 * 24.4, 24.4 / 1.5 + 24.4 / 4.0, 0.0, 4.0),
        ("heating", 8.0, 68.0, 60.0, 1.0),
    ],
)
def test_an_experiment_is_what_it_says(name, way, seconds, rest, fastest):
    """Begun and ended at the bottom: how far it goes, how long, how long at rest, how fast at most."""
    u, steps = experiment._experiments()[name], np.diff(experiment._experiments()[name])
    assert (u[0], u[-1], u.min(), u.max() <= 1.0) == (0.0, 0.0, 0.0, True)
    assert np.abs(steps).sum() == pytest.approx(way)
    assert experiment.length_s(name) == pytest.approx(seconds, abs=0.05)
    assert np.count_nonzero(steps == 0) / LIMITS.experiment_Hz == pytest.approx(rest, abs=0.05)
    steady = np.abs(steps[1:][np.isclose(np.abs(steps[1:]), np.abs(steps[:-1]))])
    assert steady.max() * LIMITS.experiment_Hz == pytest.approx(fastest)


def test_where_an_error_is_largest_is_told_with_its_quantity():
    """A speed, a level with its unit, a direction in words, a time."""
    words = {"input": "voltage", "in_u": " V"}
    told = {
        name: wording.sentence(Evidence("largest", figures={"at": at, "times": 3.0}, names=(name,)), words)
        for name, at in {"rest": 0.0, "rate": 2.0, "level": 1.5, "direction": -1.0, "time": 40.0}.items()
    }
    assert "while the voltage rests" in told["rest"]
    assert "2 V per second" in told["rate"]
    assert "1.5 V" in told["level"]
    assert "falls" in told["direction"]
    assert "40 s" in told["time"]
    late = Evidence("largest", figures={"at": 1890.0, "times": 3.0}, names=("time",))
    assert "about 1890 s after" in wording.sentence(late, words)
    assert "creep 270." in wording.sentence(Evidence("would have shown", figures={"creep": 270.0}), words)


def test_evidence_calls_a_record_by_its_name_where_it_has_one():
    """Nobody counts files to know which one is meant; so do the notes of a stage."""
    seen = Evidence("gate", "outliers", {"count": 3.0, "limit": 0.5}, record=1)
    assert wording.sentence(seen, {"record 2": "b.h5"}).startswith("outliers: b.h5: 3 ")
    for names, called in ((("a.h5", "b.h5"), "b.h5"), ((), "record 2")):
        asked = SimpleNamespace(question=SimpleNamespace(given=SimpleNamespace(names=names)))
        assert first_stroke._called(asked, 1) == called


@pytest.mark.parametrize(
    ("form", "expected"), [("dual", (0.2, 9.5)), ("direct", (0.0, 10.0)), ("signed", (0.0, 10.0))]
)
def test_the_range_of_a_dual_model_is_where_inputs_went_within_it(monkeypatch, form, expected):
    """Its operator reaches as far as a drift took the output; other forms end where their levels do."""
    monkeypatch.setattr(question, "input_range", lambda model: (0.0, 10.0))
    model = SimpleNamespace(form=form, fit=SimpleNamespace(input=np.asarray([0.5, 9.0])))
    runs = [SimpleNamespace(input=np.asarray([0.2, np.nan, 8.0])), SimpleNamespace(input=np.asarray([9.5]))]
    assert question.range_of(model, runs) == expected
    beyond = [SimpleNamespace(input=np.asarray([-1.0, 11.0]))]
    assert question.range_of(model, beyond) == (0.0, 10.0)


def test_the_records_of_a_question_are_called_as_the_runs_were_named():
    """Parts of one run are counted behind its name; where nobody named them they have none."""
    run = _run(np.arange(200) * 0.01)
    seam = np.zeros(200, dtype=bool)
    seam[100] = True
    runs = [run, replace(run, seam=seam)]

    def names(**more):
        asked = {"rng": np.random.default_rng(0), "quick": False, "progress": lambda _: None}
        return question.question_of(runs, _model(), names=["a.h5", "b.h5", "m"], **asked, **more).given.names

    assert names(named=True) == ("a.h5", "b.h5, part 1", "b.h5, part 2")
    assert names() == ()


@pytest.mark.parametrize(
    ("kind", "quick", "found", "p", "told", "correctable"),
    [
        ("extend", True, (), None, "extend, quick", ()),
        ("extend, or late", True, (), None, "extend, quick", ()),
        ("extend", False, (), None, "extend", ()),
        ("none", False, ("periodic",), None, "none, seen", ()),
        ("none", False, ("periodic",), None, "none, correct", ("periodic",)),
        ("none", False, (), 0.5 * LIMITS.p_max, "none, small", ()),
        ("none", True, (), 0.5 * LIMITS.p_max, "none, small, quick", ()),
        ("none", False, (), 2.0 * LIMITS.p_max, "none", ()),
        ("none", True, (), 2.0 * LIMITS.p_max, "none, quick", ()),
        ("lacks", True, (), 0.5 * LIMITS.p_max, "lacks", ()),
    ],
)
def test_advice_contradicts_neither_a_quick_screen_nor_what_was_seen(
    kind, quick, found, p, told, correctable
):
    """It sent to extend a model that there was not, and said that nothing was found where something was."""
    state = SimpleNamespace(
        advice=Evidence(kind),
        correctable=correctable,
        question=SimpleNamespace(quick=quick),
        findings=[Finding(CAUSE[name], True) for name in found],
        scores=SimpleNamespace(
            scores=[] if p is None else [SimpleNamespace(p_value=p, cause=CAUSE["creep"])]
        ),
    )
    one = artefact._advice(state)
    assert one.kind == told
    if told in ("none, seen", "none, correct", "none, small", "none, small, quick"):
        assert one.names == (found or ("creep",))


def test_advice_to_record_again_says_how():
    """By us: the whole command, up to where the input went; elsewhere: the columns of the table."""
    lacks = Evidence("lacks", names=("holds",))
    ours = advice_wording.advice(
        lacks, advice_wording.Bench(Scale(0.0, 1.5), "A", ours=True, reached=(0.0, 0.6))
    )
    assert "pulsetrainer capture diagnostic --current-max 0.9 -o diagnostic-2.h5. Then diagnose" in ours
    bench = advice_wording.Bench(Scale(), "A/m", input="H", output="strain", unit_of_output="1")
    assert (
        "the columns time in s, H in A/m and strain, and read that with pulsetrainer import"
        in advice_wording.advice(lacks, bench)
    )


@pytest.mark.parametrize("name", sorted(CAUSE))
def test_every_parameter_of_every_cause_says_of_what_it_is(name):
    """Fitted ones by their quantities, what a gate tells as a size; no brace but those of three names."""
    frame = Frame(0.01, np.linspace(0.0, 1.0, 100), span=1.0, reach=1.0)
    meanings = [one.meaning for one in CAUSE[name].quantities(frame)]
    meanings += [CAUSE[name].size] if CAUSE[name].stage == "record" else []
    assert all(meanings)
    assert not any("{" in one.format(input="u", output="y", empty="y0") for one in meanings)


def test_evidence_names_its_cause_and_its_record():
    """Records are counted from one."""
    seen = Evidence("gate", "outliers", {"count": 3.0, "limit": 0.5}, record=1)
    assert wording.sentence(seen, {}).startswith("outliers: record 2: 3 ")
    assert wording.cause_text(Finding(CAUSE["outliers"], True, seen=seen), {}) == wording.text(seen)
    assert wording.cause_text(Finding(CAUSE["creep"], True), {"output": "force"}) == (
        "the force creeps on under a constant input"
    )


@pytest.mark.parametrize(
    ("pieces", "rates", "share"),
    [
        ([1.0] * 5, [1.0] * 4, 0.5),
        ([2.4, -0.9, 1.0, 1.0, 1.5], [1.0] * 4, 0.5),
        ([2.6, -1.1, 1.0, 1.0, 1.5], [1.0] * 4, 0.0),  # worse on one piece
        ([1.0] * 5, [9.0, 9.0, -0.9, 9.0], 0.5),
        ([1.0] * 5, [9.0, 9.0, -1.1, 9.0], 0.0),  # worse at some of the rates
        ([1.0] * 5, [], 0.5),  # too few blocks to sort by rates
        ([1.0] * 5, [-9.0, 9.0, 9.0, 9.0], 0.0),
        ([1.0] * 4, [1.0] * 4, 0.0),  # too short a record
    ],
)
def test_a_cause_repeats_on_pieces_of_the_time_and_at_other_rates(pieces, rates, share):
    """The gain on the pieces over that of the fit; a tenth of that it may be worse on any."""
    before, after = SimpleNamespace(squares=30.0), SimpleNamespace(squares=20.0)
    told = SimpleNamespace(
        pieces=lambda fitted: np.asarray(pieces) * (fitted is before),
        rates=lambda fitted: np.asarray(rates) * (fitted is before),
    )
    assert repeated(told, before, after) == pytest.approx(share)


def test_rates_that_only_the_smaller_model_can_be_asked_about_tell_nothing():
    """The larger one needs what would be left out: that ended in an error of its own."""
    before, after = SimpleNamespace(squares=30.0), SimpleNamespace(squares=20.0)
    told = SimpleNamespace(
        pieces=lambda fitted: np.full(5, 1.0 if fitted is before else 0.0),
        rates=lambda fitted: np.zeros(4 if fitted is before else 0),
    )
    assert repeated(told, before, after) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("tau", "late", "found"), [(0.03, 0.02, True), (0.1, 0.02, False), (0.03, 0.2, False)]
)
def test_what_is_fast_beside_a_fast_creep_may_be_what_its_formula_misses(tau, late, found):
    """Only beside a creep faster than 0.04 of the second, from which it is sought; none beside itself."""
    frame = Frame(0.01, np.zeros(3000), 1.0, 1.0)
    creep, lag = Term(CAUSE["creep"], (0.3, tau)), Term(CAUSE["output-lag"], (late,))
    assert fast_causes.beside_fast_creep(lag, (creep, lag), frame) is found
    assert not fast_causes.beside_fast_creep(creep, (creep, lag), frame)
    assert not fast_causes.beside_fast_creep(lag, (lag,), frame)
