"""Equal minor loops: no static weights make them differ, a feedback of the output does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import congruency
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.extended import Extended, Term
from pulsetrainer.diagnosis.fitting import refit, weights_for
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.thresholds import LIMITS

DT = 1e-3
HIGH = 1.5
LOAD = library()["load-dependence"]
INPUT = excitations.diagnostic(0.0, HIGH, rate_Hz=1 / DT).value


def _operator(n_h: int, weights: np.ndarray | None = None) -> Preisach:
    """A density that is largest at small inputs, as of a solenoid: 14 N in all."""
    plane = Plane.uniform(0.0, HIGH, n_h)
    i, j = plane.cell_indices
    if weights is None:
        weights = np.exp(-(((i / n_h - 0.35) / 0.2) ** 2) - ((j / n_h - 0.22) / 0.15) ** 2) + 0.02
    total = float((weights * plane.areas).sum())
    return Preisach(plane, weights * 7.0 / total, 7.0)


def _measured(k: float, noise: float, seed: int) -> Record:
    model = Extended.of(_operator(90), [("load-dependence", (k,))] if k else [])
    y = model(INPUT, DT) + noise * np.random.default_rng(seed).standard_normal(INPUT.size)
    return Record(INPUT, y, dt_s=DT)


def _contrast(k: float, noise: float, seed: int) -> congruency.Contrast:
    problem = problem_for([_measured(k, noise, seed)], 0.0, HIGH)
    fitted = weights_for(problem, (), None)
    found = congruency.fitted_contrast(problem, fitted, LOAD, np.random.default_rng(seed))
    assert found is not None
    return found


def test_the_diagnostic_signal_has_equal_loops_from_unequal_histories():
    """Fourteen of each of four kinds, each kind at two outputs that differ; every loop closes."""
    record = _measured(0.0, 0.0, 0)
    loops = congruency.loops_of([record], 0.0, HIGH)
    for loop in loops:
        assert INPUT[loop.begin] == pytest.approx(INPUT[loop.end], abs=0.02)
        assert INPUT[loop.turn] < INPUT[loop.begin] - 0.05
    kinds = [[loop for loop in loops if loop.kind == k] for k in {loop.kind for loop in loops}]
    biased = [k for k in kinds if len(k) == 14]
    assert len(biased) == 4
    for kind in biased:
        level = [record.output[loop.begin : loop.end].mean() for loop in kind]
        assert np.ptp(level) > 0.05 * np.ptp(record.output)


@given(st.integers(0, 2**32 - 1), st.integers(4, 20))
def test_no_weights_make_equal_loops_differ(seed, n_h):
    """Congruency: the contrasts of any Preisach operator's output are zero."""
    rng = np.random.default_rng(seed)
    weights = rng.exponential(size=n_h * (n_h + 1) // 2) ** 3
    bottom, top = 0.3, 0.9
    turns = (0.0, bottom, *(top, bottom) * 4, HIGH, bottom, *(top, bottom) * 4, 0.0)
    u = excitations.through(
        np.asarray(turns), 6.0, 1 / DT
    )  # a hundred samples a stroke: loops equal to the sample
    output = _operator(n_h, weights)(u)
    loops = congruency.loops_of([Record(u, output, dt_s=DT)], 0.0, HIGH)
    assert len(loops) == 6
    counts = np.ones(u.size)
    counts[[loops[1].turn, loops[4].end - 1]] = 0.0  # a loop counts as a whole
    weighted = congruency.loops_of([Record(u, output, counts, dt_s=DT)], 0.0, HIGH)
    assert [one.begin for one in weighted] == [loops[k].begin for k in (0, 2, 3, 5)]
    assert np.ptp([output[loop.begin] for loop in loops]) > 0 or n_h < 6
    assert np.abs(congruency.contrasts(loops, [output])).max() < 1e-9 * np.ptp(output)


@pytest.mark.parametrize("k", [0.008, 0.0])
def test_seven_equal_loops_after_each_of_two_histories_are_enough(k):
    """A short record with them: the feedback within a twentieth, and none where there is none."""
    loops = (0.9, 0.3) * 7
    u = excitations.through(np.asarray((0.0, 0.3, *loops, HIGH, 0.3, *loops, 0.0)), 6.0, 500.0)
    model = Extended.of(_operator(90), [("load-dependence", (k,))] if k else [])
    rng = np.random.default_rng(1)
    record = Record(u, model(u, 2e-3) + 0.01 * rng.standard_normal(u.size), dt_s=2e-3)
    problem = problem_for([record], 0.0, HIGH)
    found = congruency.fitted_contrast(problem, weights_for(problem, (), None), LOAD, rng)
    assert found.value == pytest.approx(k, abs=0.05 * 0.008)
    assert found.error < 0.05 * 0.008
    assert found.p_value < 0.01 if k else found.p_value > 0.05
    assert not found.at_bound
    raised = replace(model, static=replace(model.static, offset=model.static.offset + 3.0))
    assert raised(u, 2e-3) == pytest.approx(model(u, 2e-3) + 3.0)  # the zero of the output is no matter


@pytest.mark.slow
@pytest.mark.parametrize("k", [0.008, -0.008])
def test_a_feedback_of_the_output_is_measured(k):
    """Found beyond doubt, its strength within three standard errors or a tenth."""
    found = _contrast(k, 0.02, 5)
    assert found.p_value < 0.002
    assert abs(found.value - k) < max(3.0 * found.error, 0.1 * abs(k))


def test_the_weights_swallow_it_on_the_whole_record():
    """Why the contrasts are needed: refitted weights leave next to nothing of it."""
    static, fed_back = (
        weights_for(problem_for([_measured(k, 0.0, 0)], 0.0, HIGH), (), None) for k in (0.0, 0.008)
    )
    span = 14.0
    rms = [np.sqrt(np.mean(f.residual**2)) / span for f in (static, fed_back)]
    difference = np.abs(_measured(0.008, 0.0, 0).output - _measured(0.0, 0.0, 0).output).max() / span
    assert difference > 0.05
    assert np.sqrt(max(rms[1] ** 2 - rms[0] ** 2, 0.0)) < 0.02 * difference


@pytest.mark.slow
def test_the_permutations_are_exact():
    """Under the null p is uniform: as many values fall below a twentieth as should, within chance."""
    rng = np.random.default_rng(20260107)
    kind = np.repeat([0, 1, 2], 6)
    slope = rng.standard_normal((18, 8))
    p = [congruency.permuted(slope, rng.standard_normal((18, 8)), kind, rng) for _ in range(100)]
    assert 1 <= np.sum(np.asarray(p) <= 0.05) <= 13
    assert 0.4 < np.median(p) < 0.6


def test_loops_need_not_be_equally_noisy(monkeypatch):
    """Where the cause moves them most they may be noisiest: p was 0.01 in one of eight."""
    monkeypatch.setattr(congruency, "LIMITS", replace(LIMITS, permutations=199))
    rng = np.random.default_rng(20261125)
    kind = np.repeat([0, 1, 2], 10)
    size = np.where(np.arange(30) % 5, 1.0, 4.0)[:, None]
    drawn = size * rng.standard_normal((2, 300, 30, 8))
    p = [congruency.permuted(slope, left, kind, rng) for slope, left in zip(*drawn, strict=True)]
    assert np.sum(np.asarray(p) <= 0.01) <= 6  # 3 are expected


@pytest.mark.slow
def test_what_another_cause_may_still_change_is_taken_off():
    """A lag in the model whose constant is known within some error must not pass for a feedback."""
    model = Extended.of(_operator(90), [("output-lag", (0.01,))])
    y = model(INPUT, DT) + 0.02 * np.random.default_rng(3).standard_normal(INPUT.size)
    problem = problem_for([Record(INPUT, y, dt_s=DT)], 0.0, HIGH)
    fitted = refit(problem, (Term(library()["output-lag"], (0.008,)),), None)
    wrong = weights_for(problem, (Term(fitted.terms[0].cause, (0.0095,)),), fitted)
    found = congruency.fitted_contrast(problem, wrong, LOAD, np.random.default_rng(3))
    assert found is not None
    assert found.p_value > 0.01


@given(st.floats(-0.02, 0.05), st.floats(0.1, 3.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_seen_input_stays_in_its_range(k, rise, x, z):
    """Both ends of the input are themselves again, whatever k; between them nothing leaves the range."""
    frame = Frame(DT, INPUT, rise, HIGH, low=0.2, ends=(1.0, 1.0 + rise))
    u = 0.2 + HIGH * np.asarray([0.0, x, 1.0])
    y = 1.0 + rise * np.asarray([0.0, z, 1.0])
    seen = LOAD.on_input(u, y, (k,), frame)
    assert seen[[0, 2]] == pytest.approx([0.2, 0.2 + HIGH])
    assert 0.2 - 1e-9 <= LOAD.on_input(u, 1.0 + rise * (u - 0.2) / HIGH, (k,), frame)[1] <= 0.2 + HIGH + 1e-9


def test_the_mean_of_each_kind_is_taken_off():
    """Also where a kind has no loop: nothing is divided by none."""
    rows = np.random.default_rng(1).normal(size=(5, 3))
    kind = np.array([0, 2, 2, 0, 3])
    expected = [row - rows[kind == own].mean(axis=0) for row, own in zip(rows, kind, strict=True)]
    with np.errstate(all="raise"):
        np.testing.assert_allclose(congruency._less_means(rows, kind), expected, atol=1e-12)
