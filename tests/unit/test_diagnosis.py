"""The parts of the diagnosis: library, low-passes, extended model and its inverse, gates, null."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import experiment, fitting, raw, residual
from pulsetrainer.diagnosis.causes import cause_named, fired_on, library
from pulsetrainer.diagnosis.causes.frame import Frame, low_pass
from pulsetrainer.diagnosis.extended import Extended, Term
from pulsetrainer.diagnosis.fitting import refit, weights_for
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.procedure import FULL, QUICK, diagnose
from pulsetrainer.diagnosis.state import Question, State
from pulsetrainer.errors import ArgumentError, DataError
from wording import raises

DT = 1e-3
VOCABULARY = (
    *("delay", "output-lag", "field-lag", "rate-widening", "viscous", "creep", "thermal-drift"),
    *("offset-drift", "resonance", "periodic", "step", "saturation", "load-dependence", "stick-slip"),
    *("quantisation", "outliers", "clock-skew", "current-tracking", "condition-change", "out-of-range"),
    *("accommodation", "unlisted", "clipped-input", "leak", "frozen", "late-input", "input-lag"),
    "gain-drift",
)
# values that matter, and the values at which a cause does nothing
STRENGTHS = {
    "delay": ((0.01,), (0.0,)),
    "field-lag": ((0.01,), (0.0,)),
    "output-lag": ((0.01,), (0.0,)),
    "rate-widening": ((0.01,), (0.0,)),
    "viscous": ((0.02, 0.0), (0.0, 0.0)),
    "creep": ((0.05, 1.0), (0.0, 1.0)),
    "thermal-drift": ((0.02, 5.0), (0.0, 5.0)),
    "offset-drift": ((0.01, 0.002, 0.0005), (0.0, 0.0, 0.0)),
    "gain-drift": ((0.01, 0.002, 0.003), (0.0, 0.0, 0.0)),
    "periodic": ((0.1, 0.1, 7.0), (0.0, 0.0, 7.0)),
    "step": ((0.1, 0.02, 1.0), (0.0, 0.0, 1.0)),
    "clock-skew": ((1e-3,), (0.0,)),
    "leak": ((0.1, 0.0), (0.0, 0.0)),
    "late-input": ((0.01,), (0.0,)),
    "input-lag": ((0.01,), (0.0,)),
    "load-dependence": ((0.005,), (0.0,)),
    "accommodation": ((0.1, 10.0), (0.0, 10.0)),
}


def _operator(n_h: int = 24) -> Preisach:
    plane = Plane.uniform(0.0, 1.5, n_h)
    i, j = plane.cell_indices
    weights = 1.0 + np.exp(-(((i - j) / n_h - 0.25) ** 2) / 0.02)
    return Preisach(plane, weights * 7.0 / float((weights * plane.areas).sum()), 7.0)


def test_the_library_is_the_vocabulary():
    """All ids of the contract, no other, each described in full."""
    assert sorted(library()) == sorted(VOCABULARY)
    for cause in library().values():
        for text in (cause.title, cause.formula, cause.signature, cause.excitation, cause.source):
            assert len(text) > 2
        assert all(q.low <= q.high and q.small > 0 for q in cause.parameters)


@pytest.mark.parametrize("stages", [FULL, QUICK])
def test_what_is_done_rises_to_the_whole(stages):
    """The share that is told after each stage never falls, and ends with one."""
    done = [share for _, share in stages]
    assert done == sorted(done)
    assert 0.0 < done[0] < done[-1] == 1.0


def test_an_unknown_cause_is_refused():
    """A model of a newer version is not read as something else."""
    with raises(DataError, "no such cause", named="ghost"):
        cause_named("ghost")


def test_a_leak_follows_a_ramp_exactly():
    """It is y0 + (1 - exp(-k t)) / k, and b (exp(-k t) - 1) of what had leaked before: z' = y' - k z."""
    t, rate, zero = np.arange(500) * DT, 1.7, 0.3
    frame = Frame(DT, t, 1.0, 1.0, zero=zero)
    leaks = library()["leak"].on_output(t + zero, (rate, 0.2), frame)
    said = zero - np.expm1(-rate * t) / rate + 0.2 * np.expm1(-rate * t)
    np.testing.assert_allclose(leaks, said, atol=1e-12)


def test_the_low_pass_follows_a_ramp_exactly():
    """Tau x' + x = t from rest at 0 is t - tau + tau exp(-t/tau)."""
    t = np.arange(500) * DT
    tau = 0.037
    np.testing.assert_allclose(low_pass(t, tau, DT), t - tau + tau * np.exp(-t / tau), atol=1e-12)


def test_the_resonance_rings_at_its_frequency_and_settles_at_its_input():
    """Step response: overshoot exp(-pi zeta / sqrt(1 - zeta^2)), final value 1."""
    y = np.concatenate((np.zeros(100), np.ones(3000)))
    frame = Frame(DT, y, 1.0, 1.0)
    out = library()["resonance"].on_output(y, (6.0, 0.2), frame)
    assert out[-1] == pytest.approx(1.0, abs=1e-4)
    assert out.max() - 1.0 == pytest.approx(np.exp(-np.pi * 0.2 / np.sqrt(1 - 0.04)), rel=0.01)


@pytest.mark.parametrize("name", sorted(STRENGTHS))
def test_a_cause_without_strength_does_nothing(name):
    """At zero strength the extended model is the static one; with strength it is not."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=1 / DT).value[:8000]
    operator = _operator()
    strong, none = STRENGTHS[name]
    np.testing.assert_allclose(Extended.of(operator, [(name, none)])(u, DT), operator(u), atol=1e-9)
    assert np.abs(Extended.of(operator, [(name, strong)])(u, DT) - operator(u)).max() > 1e-3


@pytest.mark.parametrize(
    "extensions",
    [
        [("output-lag", (0.008,))],
        [("field-lag", (0.01,))],
        [("delay", (0.01,))],
        [("creep", (0.07, 1.0))],
        [("creep", (1.0, 0.07, 1.0))],  # of one time constant
        [("thermal-drift", (0.02, 10.0))],
        [("thermal-drift", (0.5, 0.06, 10.0))],  # driven both ways
        [("thermal-drift", (0.0, 0.02, 10.0, 0.05))],  # of which the zero moves
        [("field-lag", (0.003,)), ("creep", (0.03, 1.0)), ("thermal-drift", (0.006, 20.0))],
    ],
)
@pytest.mark.parametrize("polarity", [1, -1])
def test_the_one_inverse_compensates_every_extension(extensions, polarity):
    """Five times less tracking error than the static inverse, whatever the extension and the polarity."""
    upright = _operator()
    static = Preisach(upright.plane, upright.weights, upright.offset, polarity=polarity)
    model = Extended.of(static, extensions)
    t = np.arange(3000) * DT
    target = 7.0 + 4.0 * np.sin(2 * np.pi * t) + 1.0 * np.sin(6 * np.pi * t)
    lead = excitations.conditioning(0.0, 1.5, speed=3.0, rate_Hz=1 / DT, rest_s=0.2)
    rest = model(lead, DT)[-1]
    target = rest + (target - rest) * np.minimum(t / 0.5, 1.0)
    found = model.invert(target, DT, lead=lead, band_Hz=30.0)
    assert found.rms < 0.2 * found.rms_static
    np.testing.assert_allclose(
        polarity * model(np.concatenate((lead, found.input)), DT)[lead.size :], found.predicted
    )


@pytest.mark.parametrize("polarity", [1, -1])
def test_a_long_delay_is_undone_by_playing_earlier(polarity):
    """A delay of a part of the beat, beside a lag: the error is a hundredth of the static inverse's."""
    upright = _operator()
    static = Preisach(upright.plane, upright.weights, upright.offset, polarity=polarity)
    model = Extended.of(static, [("delay", (0.0613,)), ("output-lag", (0.005,))])
    t = np.arange(4000) * DT
    rest = model(np.zeros(1), DT)[-1]
    target = rest + np.sin(np.pi * np.minimum(t / 2, 1) / 2) ** 4 * (6.0 - 4.0 * np.cos(6 * np.pi * t) - rest)
    found = model.invert(target, DT, lead=np.zeros(1), band_Hz=30.0)
    assert found.steps > 0
    assert found.rms < 0.01 * found.rms_static
    np.testing.assert_allclose(
        polarity * model(np.append(0.0, found.input), DT)[1:], found.predicted, atol=1e-12
    )


def test_the_diagnostic_signal_has_what_the_causes_need():
    """Ninety seconds, in range, every cell switched, four rates over ten to one, holds, a rest."""
    from pulsetrainer.core.coverage import coverage

    signal = excitations.diagnostic(0.2, 1.4, rate_Hz=1000.0)
    u = signal.value
    assert 85 < signal.time_s[-1] < 95
    assert u.min() == pytest.approx(0.2)
    assert u.max() == pytest.approx(1.4)
    assert u[0] == u[-1] == pytest.approx(0.2)
    assert coverage(Plane.uniform(0.2, 1.4, 48), [u]).all()
    speed = np.abs(np.diff(u)) * 1000.0 / 1.2
    counts, edges = np.histogram(speed[speed > 0.1], bins=np.geomspace(0.5, 12.0, 40))
    peaks = edges[:-1][counts > 1000]
    assert peaks.max() / peaks.min() > 10
    assert np.sum(speed < 1e-9) > 15_000
    with raises(ArgumentError, "an empty range"):
        excitations.diagnostic(1.0, 1.0, rate_Hz=1000.0)


def _record(y: np.ndarray, u: np.ndarray | None = None, reference: np.ndarray | None = None) -> Record:
    return Record(np.linspace(0, 1.5, y.size) if u is None else u, y, dt_s=DT, reference=reference)


def _fired(record: Record) -> dict:
    return {f.cause: f for f in fired_on(raw.Raw(record, 0.0, 1.5))}


def test_gates_fire_on_what_they_are_for_and_not_otherwise():
    """Each fault alone in a noisy record."""
    rng = np.random.default_rng(1)
    t = np.arange(20_000) * DT
    u = 0.75 - 0.75 * np.cos(2 * np.pi * 0.5 * t)
    clean = np.round(6 * u + 0.03 * rng.standard_normal(t.size), 3)
    assert _fired(_record(clean, u)) == {}
    assert set(_fired(_record(np.minimum(clean, 8.0), u))) == {"saturation"}
    low = _fired(_record(np.maximum(clean, 1.0), u))
    assert (set(low), low["saturation"].value, low["saturation"].kind) == ({"saturation"}, 1.0, "gate")
    both = _fired(_record(np.clip(clean, 1.0, 8.0), u))["saturation"]
    assert (both.kind, both.figures["rail"], both.figures["other"]) == ("both", 8.0, 1.0)
    assert both.mask[(clean <= 1.0) | (clean >= 8.0)].all()
    wild = clean.copy()
    wild[rng.choice(t.size, 20, replace=False)] += 3.0
    fired = _fired(_record(wild, u))
    assert set(fired) == {"outliers"}
    assert 15 <= np.count_nonzero(fired["outliers"].mask) <= 20
    assert set(_fired(_record(np.round(clean / 0.2) * 0.2, u))) == {"quantisation"}
    assert "quantisation" not in _fired(_record(np.round(clean / 4.0) * 4.0, u))  # a device of a few states
    assert set(_fired(_record(clean, u, u - 0.1 * (u > 1)))) == {"current-tracking"}
    assert set(_fired(_record(clean, 1.1 * u))) == {"out-of-range"}
    held, stuck = [], 0.0
    for wanted in (6 * u).tolist():
        if abs(wanted - stuck) > 1.0:
            stuck = wanted - 0.2 * np.sign(wanted - stuck)
        held.append(stuck)
    assert set(_fired(_record(np.asarray(held) + 0.02 * rng.standard_normal(t.size), u))) == {"stick-slip"}


def test_wild_samples_side_by_side_are_found():
    """Two in a row stand out from those around them, though not from each other."""
    rng = np.random.default_rng(4)
    t = np.arange(20_000) * DT
    u = 0.75 - 0.75 * np.cos(2 * np.pi * 0.5 * t)
    y = np.round(6 * u + 0.03 * rng.standard_normal(t.size), 3)
    at = np.concatenate([k + np.arange(2) for k in range(500, 20_000, 1500)])
    y[at] += 3.0
    np.testing.assert_array_equal(np.flatnonzero(_fired(_record(y, u))["outliers"].mask), at)


def test_the_tip_of_a_stroke_that_ends_with_a_jump_is_not_wild():
    """A viscous force jumps when the input turns: a stroke's last sample is alone there, but on its line."""
    rng = np.random.default_rng(5)
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=1 / DT).value[:30_000]
    rate = np.diff(u, prepend=u[0]) / DT
    y = np.round(8 * u + 0.04 * rate + 0.03 * rng.standard_normal(u.size), 3)
    apart = np.abs(y - ndimage.median_filter(y, 7))  # the naive rule alone would name some of these
    assert apart.max() > 4.0 * np.quantile(np.abs(np.diff(y)), 0.95)
    assert "outliers" not in _fired(_record(y, u))
    wild = np.arange(500, 30_000, 2500)
    y[wild] += 4.0
    np.testing.assert_array_equal(np.flatnonzero(_fired(_record(y, u))["outliers"].mask), wild)


def test_a_delay_keeps_the_tips_that_the_memory_remembers():
    """Whole samples late it is a copy; in between it errs far less than an interpolated input would."""
    fine = excitations.diagnostic(0.0, 1.5, rate_Hz=10_000.0).value[:80_000]
    operator = _operator()
    truth, u = operator(fine), fine[::10]
    late = Extended.of(operator, [("delay", (0.005,))])(u, DT)
    np.testing.assert_allclose(late[5:], operator(u)[:-5], atol=1e-12)
    late = Extended.of(operator, [("delay", (0.0035,))])(u, DT)
    t = np.arange(u.size) * DT
    naive = operator(np.interp(t - 0.0035, t, u))
    exact = np.interp(t - 0.0035, np.arange(fine.size) * 1e-4, truth)
    ours = np.sqrt(np.mean((late - exact) ** 2))
    assert ours < 0.25 * np.sqrt(np.mean((naive - exact) ** 2))


def test_what_an_input_out_of_range_leaves_in_the_memory_is_left_out():
    """Until the other end is reached the output depends on extremes that the plane does not hold."""
    u = np.concatenate(
        [np.linspace(a, b, 200) for a, b in ((0, 1), (1, 1.8), (1.8, 0.5), (0.5, 0), (0, 1.2))]
    )
    mask = _fired(_record(5 * u, u))["out-of-range"].mask
    assert not mask[:300].any()
    assert mask[400:600].all()
    assert mask[700]
    assert not mask[800:].any()


def test_the_noise_is_that_of_the_samples_with_weight():
    """Filled-in samples have none."""
    rng = np.random.default_rng(6)
    y = np.sin(np.arange(9000) / 300) + 0.05 * rng.standard_normal(9000)
    weight = np.ones(9000)
    weight[1000:7000] = 0.0
    y[1000:7000] = 1.0
    assert raw.noise_of(y, weight) == pytest.approx(0.05, rel=0.06)
    assert raw.noise_of(y) < 0.01


def _lagging(n_h: int = 24, rate_Hz: float = 200.0, **causes: tuple[float, ...]) -> Record:
    """A short diagnostic record of a device with some causes."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=rate_Hz).value[: round(40 * rate_Hz)]
    named = [(name.replace("_", "-"), values) for name, values in causes.items()]
    y = Extended.of(_operator(n_h), named)(u, 1 / rate_Hz)
    noise = 0.01 * np.random.default_rng(8).standard_normal(u.size)
    return Record(u, y + noise, dt_s=1 / rate_Hz)


def test_what_happened_before_a_record_does_not_bend_the_creep():
    """A finger that was pressed before goes on relaxing: it is fitted freely, and the constants are right."""
    record = _lagging(creep=(0.08, 0.7))
    t = np.arange(record.input.size) * record.step
    before = 0.4 * np.exp(-t / 0.7) + 0.3 * np.exp(-t / 2.8)
    record = replace(record, output=record.output + before)
    problem = problem_for([record], 0.0, 1.5)
    fitted = refit(problem, (Term(library()["creep"], (0.03, 1.0)),), weights_for(problem, (), None))
    assert fitted.terms[0].values == pytest.approx((0.08, 0.7), rel=0.1)


def test_a_strong_resonance_converges():
    """It filters the rows: subtracted from the output it would not."""
    record = _lagging(resonance=(8.0, 0.1))
    problem = problem_for([record], 0.0, 1.5)
    base = weights_for(problem, (), None)
    fitted = refit(problem, (Term(library()["resonance"], (8.6, 0.2)),), base)
    assert fitted.terms[0].values == pytest.approx((8.0, 0.1), rel=0.03)
    assert fitted.squares < 0.01 * base.squares


@pytest.mark.slow
def test_the_best_experiment_tells_lags_apart_better_than_one_rate_does():
    """On a record of one rate a lag before and one after the hysteresis are one; elsewhere they are not."""
    u = excitations.identification(0.0, 1.5, n_h=12, speed=1.5, rate_Hz=200.0).value
    y = Extended.of(_operator(), [("output-lag", (0.02,))])(u, 0.005)
    y += 0.01 * np.random.default_rng(9).standard_normal(u.size)
    answer = diagnose(Question([Record(u, y, dt_s=0.005)], 0.0, 1.5, np.random.default_rng(0)))
    best = experiment.best_experiment(answer, ("output-lag", "delay"))
    assert best.distance > 3.0 * best.distance_here


def test_a_step_is_found_where_it_is():
    """The moment within a sample or two, the size within a few per cent."""
    record = _lagging()
    y = record.output + 0.15 * (np.arange(record.input.size) * record.step > 17.3)
    answer = diagnose(Question([replace(record, output=y)], 0.0, 1.5, np.random.default_rng(0)))
    assert answer.verdict == "step"
    values = {e.name: e for e in answer.findings[0].parameters}
    assert values["time"].value == pytest.approx(17.3, abs=0.02)
    assert values["offset"].value + values["gain"].value * 6 == pytest.approx(0.15, rel=0.2)


def _two(first: np.ndarray, second: np.ndarray) -> State:
    """Diagnose two records of one device, with something added to the output of each."""
    record = _lagging()
    half = record.input.size // 2
    parts = [
        replace(record, input=record.input[k], output=record.output[k] + more, sample_weight=np.ones(half))
        for k, more in ((slice(half), first), (slice(half, 2 * half), second))
    ]
    return diagnose(Question(parts, 0.0, 1.5, np.random.default_rng(0)))


@pytest.mark.slow
def test_a_hum_has_a_phase_of_its_own_in_every_record():
    """No clock runs through both: one frequency, two phases."""
    t = np.arange(4000) / 200
    answer = _two(0.1 * np.sin(2 * np.pi * 17.3 * t), 0.1 * np.sin(2 * np.pi * 17.3 * t + 2.0))
    assert (answer.verdict, [f.cause.id for f in answer.findings if f.found]) == ("periodic", ["periodic"])
    values = {e.name: e.value for e in answer.findings[0].parameters}
    assert values["frequency"] == pytest.approx(17.3, abs=0.01)
    assert np.hypot(values["sine 2"], values["cosine 2"]) == pytest.approx(0.1, rel=0.1)


@pytest.mark.slow
def test_a_step_in_the_second_record_is_found_there():
    """Its moment is told on one clock, as if the records had been made one after another."""
    t = np.arange(4000) / 200
    answer = _two(np.zeros(4000), 0.15 * (t > 6.4))
    assert (answer.verdict, [f.cause.id for f in answer.findings if f.found]) == ("step", ["step"])
    values = {e.name: e.value for e in answer.findings[0].parameters}
    assert values["time"] == pytest.approx(20.0 + 6.4, abs=0.05)


@pytest.mark.parametrize("counts", [0, 1])
def test_a_record_of_which_hardly_a_sample_counts_is_passed_over(counts):
    """Where its sensor was lost, for instance: neither a filter of rows nor a spectrum needs it."""
    record = _lagging()
    lost = replace(record, sample_weight=1.0 * (np.arange(record.input.size) < counts))
    both, one = (problem_for(some, 0.0, 1.5) for some in ([lost, record], [record]))
    left = one.measured - one.measured.mean()
    also = np.append(np.zeros(counts), left)
    np.testing.assert_array_equal(residual.spectrum(both, also), residual.spectrum(one, left))
    columns, steps = also[:, None], [r.step for r in both.records]
    np.testing.assert_array_equal(both.bins.filtered(columns, lambda x, _k, _dt: x, steps), columns)


@pytest.mark.parametrize(
    ("name", "values", "short"),
    [
        ("delay", (0.0023,), True), ("delay", (0.05,), True), ("delay", (0.9,), False),
        ("output-lag", (0.004,), True), ("output-lag", (0.2,), False), ("resonance", (20.0, 0.2), False),
        ("late-input", (0.0023,), True), ("late-input", (0.05,), True), ("late-input", (0.9,), False),
    ],
)  # fmt: skip
def test_a_filter_that_forgets_soon_is_a_matrix(name, values, short):
    """It leaves rows sparse, and is the filter itself, from the first average of each record to the last."""
    record = _lagging()
    problem = problem_for([record, replace(record, output=record.output[::-1])], 0.0, 1.5)
    bins, steps = problem.bins, [record.step, record.step]

    def through(columns, k, dt_s):
        return library()[name].on_output(columns, values, replace(problem.frames[k], dt_s=dt_s))

    matrix = bins.short(through, steps)
    assert (matrix is not None) is short
    if matrix is not None:
        columns = np.random.default_rng(5).normal(1.0, 1.0, (bins.count, 3))
        np.testing.assert_allclose(matrix @ columns, bins.filtered(columns, through, steps), atol=1e-10)
        holes = replace(record, sample_weight=1.0 * (np.arange(record.input.size) % 1000 > 300))
        assert problem_for([holes], 0.0, 1.5).bins.short(through, steps[:1]) is None


def test_passes_that_drift_apart_end_with_the_best_of_them(monkeypatch):
    """Rows of less than half of what the weights do make each pass overshoot the last one."""
    problem = replace(problem_for([_lagging()], 0.0, 1.5), signed=True)
    design = weights_for(problem, (), None).design
    short = replace(design, nodes=0.4 * design.nodes)
    monkeypatch.setattr(fitting, "_rows", lambda *_: short)
    made, kind = [], fitting.Fitted
    monkeypatch.setattr(fitting, "Fitted", lambda *told: made.append(kind(*told)) or made[-1])
    found = weights_for(problem, (), None)
    squares = [one.squares for one in made]
    assert found.squares == min(squares) < squares[-1]


def test_a_filter_begins_at_rest_where_a_masked_lead_ends():
    """The rows after a first stroke that is left out stay sparse."""
    record = _lagging()
    led = replace(record, sample_weight=1.0 * (np.arange(record.input.size) >= 1000))
    problem = problem_for([led], 0.0, 1.5)
    bins, steps = problem.bins, [record.step]

    def through(columns, k, dt_s):
        return library()["output-lag"].on_output(columns, (0.004,), replace(problem.frames[k], dt_s=dt_s))

    columns = np.random.default_rng(5).normal(1.0, 1.0, (bins.count, 3))
    matrix = bins.short(through, steps)
    assert matrix is not None
    np.testing.assert_allclose(matrix @ columns, bins.filtered(columns, through, steps), atol=1e-10)


def test_a_quick_look_counts_with_what_was_found_only():
    """The steps of a converter are found on the raw data: no cause that was screened takes anything away."""
    record = _lagging()
    steps = replace(record, output=np.round(record.output, 1))
    answer = diagnose(Question([steps], 0.0, 1.5, np.random.default_rng(0), quick=True))
    assert [one.cause.id for one in answer.findings if one.found] == ["quantisation"]
    assert answer.left_rms == answer.current.rms


def test_noise_is_measured_without_a_model():
    """Third differences see the noise on any smooth course."""
    rng = np.random.default_rng(2)
    y = 5 * np.sin(np.arange(20_000) / 300) + 0.04 * rng.standard_normal(20_000)
    assert raw.noise_of(y) == pytest.approx(0.04, rel=0.03)


@pytest.mark.parametrize("constant", ["input", "output"])
def test_what_does_not_vary_is_refused(constant):
    """A clear error, not a verdict."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=200.0).value
    y = _operator()(u)
    record = Record(
        np.full_like(u, 0.7) if constant == "input" else u,
        np.full_like(y, 3.0) if constant == "output" else y,
        dt_s=0.005,
    )
    with raises(DataError, "does not vary", constant=constant):
        diagnose(Question([record], 0.0, 1.5, np.random.default_rng(0)))


@pytest.mark.parametrize("polarity", [1, -1])
def test_the_model_as_given_begins_where_evaluate_says(polarity):
    """Inside its range a record leaves open what came before: from rest it told 4.6 %, of half a per cent."""
    rng, operator = np.random.default_rng(4), _operator()
    whole = excitations.diagnostic(0.0, 1.5, rate_Hz=100.0).value
    inside = 0.75 + 0.5 * np.sin(np.arange(6000) / 60) * (1 - np.arange(6000) / 8000)
    demagnetised = np.concatenate(
        (0.75 + 0.75 * np.cos(np.arange(4000) / 10) * np.linspace(1, 0, 4000), inside)
    )
    run, other = (
        pt.Run(
            np.arange(u.size) / 100.0,
            u,
            polarity * (operator(v)[-u.size :] + 0.03 * rng.standard_normal(u.size)),
        )
        for u, v in ((whole, whole), (inside, demagnetised))
    )
    model = pt.identify(run, levels=24, smoothing=0.0)
    told = pt.diagnose(other, model, quick=True)
    assert told.rms_percent == pytest.approx(pt.evaluate(other, model).models[0].rms_percent, rel=0.02)


def test_figures_of_a_diagnosis_are_in_percent_of_the_span_as_measured():
    """Noise as it was added; error, series and cause in the units of the run, whatever they are."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=100.0).value
    clean = _operator()(u)
    noise = 0.2 * np.random.default_rng(5).standard_normal(u.size)
    span = float(np.ptp(clean + noise))
    for unit, polarity in ((1.0, 1), (1e-3, -1)):
        run = pt.Run(np.arange(u.size) / 100.0, u, 7.0 * unit + polarity * unit * (clean + noise))
        model = pt.identify(run, levels=24, smoothing=0.02)
        found = pt.diagnose(run, replace(model, offset=model.offset + 0.3 * unit), quick=True)
        assert found.noise_percent == pytest.approx(100.0 * 0.2 / span, rel=0.1)
        assert found.rms == pytest.approx(np.hypot(0.3, 0.2) * unit, rel=0.01)
        assert found.rms_percent == pytest.approx(100.0 * found.rms / (unit * span), rel=1e-6)
        assert found.output.min() >= run.output.min()
        assert np.ptp(found.output) == pytest.approx(unit * span, rel=0.05)
        assert np.corrcoef(found.output, np.interp(found.time_s, run.time_s, run.output))[0, 1] > 0.99
        for fitted in (found.before, found.after):
            assert np.std(found.output - fitted) < 0.2 * unit
        assert found.floor_percent <= 100.0 * 0.2 / span * 1.1
        assert 0.0 < found.extended_percent <= found.static_percent * (1.0 + 1e-9) < 200.0 * 0.2 / span
        assert (found.input.min(), found.input.max()) == pytest.approx((0.0, 1.5), abs=0.02)


def test_no_more_is_told_as_noise_than_the_causes_found_leave():
    """A hum near half the rate of the samples was counted as noise: eight times what was left without it."""
    rng, operator = np.random.default_rng(3), _operator()
    turns = np.append(0.0, np.ravel([(rng.uniform(0.6, 1.5), rng.uniform(0.0, 0.6)) for _ in range(26)]))
    turns[1:3] = 1.5, 0.0
    lasts = np.cumsum(np.append(0.0, np.resize((4.0, 1.0, 1.0, 0.3, 0.1), turns.size - 1)))
    u = np.interp(np.arange(9000), lasts / lasts[-1] * 8999.0, turns)
    static, time_s = operator(u), 0.01 * np.arange(u.size)
    crept = static + 0.04 * low_pass(static, 2.0, 0.01)
    span = float(np.ptp(crept))
    first, second = (crept + 5e-4 * span * rng.standard_normal(u.size) for _ in range(2))
    model = pt.identify(pt.Run(time_s, u, first))
    hums = pt.Run(time_s, u, second + 0.008 * span * np.sin(2.0 * np.pi * 49.97 * time_s))
    found = pt.diagnose(hums, model, seed=1)
    assert {one.cause for one in found.found} == {"creep", "periodic"}
    assert found.noise_percent <= found.extended_rms_percent < 0.5 * found.rms_percent
