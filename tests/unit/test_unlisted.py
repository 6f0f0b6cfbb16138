"""Dependences that are in no list: found, put into words, extended; and what does not repeat is not added."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pulsetrainer as pt
from pulsetrainer.artefacts import Extension, Parameter
from pulsetrainer.artefacts.diagnosis import Recorded
from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import dependence, learned
from pulsetrainer.diagnosis.causes.frame import Frame, Past
from pulsetrainer.diagnosis.causes.unlisted import KNOTS, STATES, Part, Unlisted
from pulsetrainer.diagnosis.finding import Estimate, may_be_nothing
from pulsetrainer.diagnosis.fitting import weights_for
from pulsetrainer.diagnosis.held_out import HeldOut, repeated
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.errors import DataError
from wording import raises

RATE_HZ = 100.0
DT_S = 1.0 / RATE_HZ
SPAN = 10.0
NAMES = {state.name: k for k, state in enumerate(STATES)}


def _static(u):
    plane = Plane.uniform(0.0, 1.5, 40)
    i, j = plane.cell_indices
    mass = (0.3 + np.exp(-(((i - j) / 40 - 0.2) ** 2) / 0.02)) * plane.areas
    return Preisach(plane, 0.5 * SPAN * mass / mass.sum() / plane.areas, 0.5 * SPAN)(u)


def _average(u, tau_s, dt_s):
    """A first-order average, by Euler's rule in tenths of a sample."""
    fine = np.interp(np.arange(10 * u.size) / 10, np.arange(u.size), u)
    for k in range(1, fine.size):
        fine[k] = fine[k - 1] + (fine[k] - fine[k - 1]) * 0.1 * dt_s / tau_s
    return fine[::10]


def _run(u, y):
    y = y + 0.001 * SPAN * np.random.default_rng(u.size).standard_normal(u.size)
    return pt.Run(time_s=np.arange(u.size) * DT_S, input=u, output=y)


def _dip(u, dt_s=DT_S, tau_s=0.4):
    """A force that is lower by 0.5 N while the average current is near 0.7 A."""
    return _static(u) - 0.5 * np.exp(-0.5 * ((_average(u, tau_s, dt_s) - 0.7) / 0.15) ** 2)


def _missed(device, model):
    """How far a device driven by the inverse of a model stays from a sine, rms."""
    t = np.arange(1200) * DT_S
    drive = pt.invert((t, 4.0 + 2.0 * np.sin(2 * np.pi * 0.5 * t)), model, periods=1)
    return np.std((device(drive.compensated, drive.time_s[1]) - drive.target)[drive.scored])


# --- states -----------------------------------------------------------------------------------------------
U = np.concatenate(
    [np.linspace(0, 1, 50), np.full(100, 1.0), np.linspace(1, 0.4, 30), np.linspace(0.4, 0.9, 20)]
)


@pytest.mark.parametrize(
    ("name", "at", "expected"),
    [
        ("input", [149], [1.0]),
        ("output", [149], [2.0]),
        ("input squared", [149], [1.0]),
        ("turn", [40, 170, 199], [0.0, 1.0, 0.4]),
        ("way", [149, 179, 199], [1.0, 0.54, 0.45]),
        ("input change", [49, 149], [None, 0.0]),
        ("output change", [149], [0.0]),
        ("input rate", [149, 178], [0.0, 0.6 / 29 / DT_S]),
        ("output rate", [149, 178], [0.0, 1.2 / 29 / DT_S]),
        ("output squared", [149], [4.0]),
    ],
)
def test_what_a_state_is(name, at, expected):
    """Told by a ramp, a rest and a turn, with a time constant far below them."""
    frame = Frame(DT_S, U - 2.0, 1.0, 1.0, low=-2.0, ends=(3.0, 5.0), zero=3.0)
    z = STATES[NAMES[name]].at(3.0 + 2.0 * U, 0.02, frame, "x")
    for k, value in zip(at, expected, strict=True):
        if value is not None:
            assert z[k] == pytest.approx(value, abs=0.02), k


def test_rest_and_time_since_a_turn_are_times():
    """Both as the share 1 - exp(-time / tau)."""
    frame = Frame(DT_S, U, 1.0, 1.0)
    for name, begun, end in (("rest", 49, 149), ("since turn", 151, 175)):
        z = STATES[NAMES[name]].at(U, 0.5, frame, "x")
        assert -0.5 * np.log1p(-z[end]) == pytest.approx((end - begun) * DT_S, abs=3 * DT_S)


def test_a_reversal_is_where_the_input_moves_the_other_way():
    """However little, after whatever rest; also where the pieces of a record meet."""
    u = np.concatenate([np.linspace(0.0, 1.0, 101), np.full(50, 1.0), np.linspace(0.999, 0.9, 100), [0.9001]])
    kind = STATES[NAMES["since reversal"]]

    def since(pieces):
        past, found = Past(), []
        for piece in pieces:
            frame = Frame(DT_S, piece, 1.0, 1.0, past=past)
            with np.errstate(divide="ignore"):  # before the first one it never reversed
                found.append(-np.log1p(-kind.at(piece, 1.0, frame, "x")))
            past = past.next()
        return np.concatenate(found)

    whole = since([u])
    np.testing.assert_allclose(whole[1:151], DT_S * np.arange(150), atol=1e-9)  # it began to move
    np.testing.assert_allclose(whole[151:], [*DT_S * np.arange(100), 0.0], atol=1e-9)
    for cut in (1, 60, 120, 151, 152, 251):
        np.testing.assert_allclose(since([u[:cut], u[cut:]])[1:], whole[1:], atol=1e-9)


def test_the_curve_of_a_gain_goes_with_the_output():
    """About the output of empty memory."""
    y, z = np.asarray([3.0, 4.0, 7.0]), np.asarray([0.0, 0.4, 1.0])
    part = Part(0, 0.0, 1.0)
    gain = replace(part, gain=True).added(y, z, 3.0)
    np.testing.assert_allclose(gain, part.added(y, z, 3.0) * np.asarray([[0.0], [1.0], [4.0]]))
    points = np.random.default_rng(1).standard_normal(KNOTS - 1)
    for one in (part, replace(part, gain=True)):  # the quick way of a curve is that of its points
        np.testing.assert_allclose(one.shown(y, z, 3.0, points), one.added(y, z, 3.0) @ points, atol=1e-12)
    frame = Frame(DT_S, z, 4.0, 1.0, zero=3.0)
    units = [one.unit for one in Unlisted([replace(part, gain=True), part]).quantities(frame)]
    assert units == ["s", *["1"] * (KNOTS - 1), "s", *["{y}"] * (KNOTS - 1)]


def test_a_curve_goes_through_its_knots_and_stays_level_beyond_them():
    """The first value is 0."""
    part, values = Part(0, 1.0, 2.0), np.arange(1.0, KNOTS)
    z = np.linspace(1.0, 2.0, KNOTS)
    np.testing.assert_allclose(part.columns(z) @ values, [0.0, *values], atol=1e-12)
    np.testing.assert_allclose(part.columns(np.asarray([-5.0, 9.0])) @ values, [0.0, values[-1]], atol=1e-12)


def test_what_a_model_keeps_of_it_brings_it_back():
    """States, ends, constants and curves of several."""
    cause = Unlisted([Part(0, 0.0, 1.5, gain=True), Part(4, 0.2, 3.0)])
    values = tuple(float(k) for k in range(2 * KNOTS))
    kept = (*(value for _, value, _ in cause.constants()), *values)
    again, same = Unlisted().restored(kept)
    assert isinstance(again, Unlisted)
    assert (again.parts, same) == (cause.parts, values)


def test_a_curve_each_point_of_which_may_be_zero_is_not_nothing():
    """Weights and offset hold what its points have in common: a wide interval of each says nothing."""
    cause = Unlisted([Part(NAMES["input"], 0.0, 1.5, gain=True)])
    points = [Estimate(f"g{k}", 0.01 * k, "1", -0.1, 0.1) for k in range(2, KNOTS + 1)]
    parameters = [Estimate("tau", 0.4, "s", 0.3, 0.5), *points]
    assert not may_be_nothing(cause.strengths_of(parameters))


# --- the whole --------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def dipping():
    """A device with a dip, its model and its diagnosis."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    run = _run(u, _dip(u))
    model = pt.identify(run, levels=20, form="direct")
    return model, pt.diagnose(run, model)


def test_a_dip_over_the_average_current_is_found_and_said(dipping):
    """Its state, its time constant within 20 %, its depth, its place and its way, in words and as a curve."""
    _, found = dipping
    assert found.verdict == "unlisted"
    (cause,) = found.found
    tau = next(one for one in cause.parameters if one.name == "tau")
    assert tau.value == pytest.approx(0.4, rel=0.2)
    for words in (
        "not in the list of causes",
        "lower by 0.",
        " N ",
        "average current of the last",
        "near 0.",
    ):
        assert words in cause.text
    (curve,) = found.dependences
    assert curve.at[np.argmin(curve.value)] == pytest.approx(0.7, abs=0.1)
    assert np.ptp(curve.value) == pytest.approx(0.5, rel=0.25)
    assert np.all(curve.half > 0)
    assert (curve.unit, curve.output_unit) == ("A", "N")


@pytest.mark.slow
def test_a_gain_that_depends_on_the_speed_is_found_and_said():
    """In words and per cent, and as a part of a model that predicts another run; the inverse undoes it."""

    def device(u, dt_s=DT_S):
        speed = _average(np.abs(np.diff(u, prepend=u[0])) / dt_s, 0.5, dt_s)
        return _static(u) * (1.0 - 0.03 * np.log1p(speed))

    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    run = _run(u, device(u))
    model = pt.identify(run, levels=20, form="direct")
    found = pt.diagnose(run, model)
    assert [one.cause for one in found.found] == ["unlisted"]
    (curve,) = found.dependences
    assert "its gain is lower by " in curve.text
    assert " % when the average speed of the current" in curve.text
    assert (curve.output_unit, curve.tau_s) == ("%", pytest.approx(0.5, rel=0.2))
    at = np.linspace(curve.at[0], curve.at[-1], 9)
    change = np.interp(at, curve.at, curve.value)
    truth = -3.0 * np.log1p(at)
    assert change - change.mean() == pytest.approx(truth - truth.mean(), abs=0.3)
    better = pt.extend(model, found)
    other = excitations.identification(0.0, 1.5, n_h=10, speed=4.0, rate_Hz=RATE_HZ).value
    assert pt.evaluate(_run(other, device(other)), [model, better]).models[1].gain_percent > 60
    assert _missed(device, better) < 0.5 * _missed(device, model)


def test_what_is_left_is_the_error_of_its_models(dipping):
    """By definition, over single samples, in percent of the span: as given, and extended."""
    model, found = dipping
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    y = _run(u, _dip(u)).output
    for one, percent in ((model, found.rms_percent), (found.extended, found.extended_rms_percent)):
        left = one.predict(u, dt_s=DT_S) - y
        assert percent == pytest.approx(100.0 * np.sqrt(np.mean(left**2)) / np.ptp(y))
    assert found.rms == pytest.approx(0.01 * found.rms_percent * np.ptp(y))
    assert found.extended_rms_percent < 0.5 * found.rms_percent
    (record,) = found.records
    assert (record.step_s, record.begin_s) == (pytest.approx(DT_S), 0.0)
    np.testing.assert_allclose(found.time_s, DT_S * (np.arange(u.size) + 0.5))
    np.testing.assert_allclose(found.input, u, atol=1e-12)
    np.testing.assert_allclose(found.output, y, atol=1e-9)


def test_it_is_a_term_of_the_model_like_any_other(dipping, tmp_path):
    """Stored and read back, it predicts a run never fitted, and the inverse undoes it."""
    model, found = dipping
    pt.save(pt.extend(model, found), tmp_path / "extended.h5")
    extended = pt.load(tmp_path / "extended.h5")
    u = excitations.identification(0.0, 1.5, n_h=10, speed=4.0, rate_Hz=RATE_HZ).value
    fresh = _run(u, _dip(u))
    assert pt.evaluate(fresh, [model, extended]).models[1].gain_percent > 60
    assert _missed(_dip, extended) < 0.5 * _missed(_dip, model)


def test_a_run_of_its_own_decides(dipping):
    """With the same dip the cause is added; a device without it says that it does not repeat."""
    model, found = dipping
    u = excitations.identification(0.0, 1.5, n_h=10, speed=4.0, rate_Hz=RATE_HZ).value
    assert pt.extend(model, found, verify=_run(u, _dip(u))).extensions[0].cause == "unlisted"
    with raises(DataError, "does not repeat"):
        pt.extend(model, found, verify=_run(u, _static(u)))
    with raises(DataError, "has no time"):
        pt.extend(model, found, verify=replace(_run(u, _dip(u)), time_s=None))
    with raises(DataError, "of another device", run="is in V and um", model="is in A and N"):
        pt.extend(model, found, verify=replace(_run(u, _dip(u)), input_unit="V", output_unit="um"))
    with raises(DataError, "of another device", run="is of BENCH-3", model="is of BENCH-0"):
        pt.extend(replace(model, serial="BENCH-0"), found, verify=replace(_run(u, _dip(u)), serial="BENCH-3"))


def test_a_run_that_was_diagnosed_verifies_nothing(dipping):
    """Told by its samples; also where it is one part of several."""
    model, found = dipping
    u = excitations.identification(0.0, 1.5, n_h=10, speed=4.0, rate_Hz=RATE_HZ).value
    run = _run(u, _dip(u))
    known = replace(found, records=(Recorded(run.fingerprint, DT_S),))
    seam = np.zeros(2 * u.size, dtype=bool)
    seam[u.size] = True
    part = run.time_s + run.time_s[-1] + 1.0
    both = replace(
        run, time_s=np.append(run.time_s, part), input=np.tile(u, 2), output=np.tile(run.output, 2), seam=seam
    )
    for verify in (run, both):
        with raises(DataError, "a run that was diagnosed", file="d.h5"):
            pt.extend(model, known, verify=verify, names=("m.h5", "d.h5"))


@pytest.mark.parametrize(
    ("verdict", "quick", "advised"),
    [("none", False, "use the model as it is"), ("unknown", False, "Repeat it."), ("creep", True, "`quick`")],
)
def test_what_to_do_where_there_is_nothing_to_extend_by(dipping, verdict, quick, advised):
    """The diagnosis knows: it says what to do next."""
    model, found = dipping
    empty = replace(
        found, extended=None, correctable=(), verdict=verdict, quick=quick, next_experiment="Repeat it."
    )
    said = "only screened" if quick else verdict
    with raises(DataError, "nothing to extend by", next=advised, file="d.h5", verdict=said):
        pt.extend(model, empty, names=("m.h5", "d.h5"))


def test_of_two_causes_the_one_that_harms_is_left_out(dipping):
    """The other stays."""
    model, found = dipping
    assert found.extended is not None
    lag = Extension("output-lag", (Parameter("tau", 0.2, "s", 0.1, 0.3),))
    both = replace(found.extended, extensions=(lag, *found.extended.extensions))
    u = excitations.identification(0.0, 1.5, n_h=10, speed=4.0, rate_Hz=RATE_HZ).value
    kept = pt.extend(model, replace(found, extended=both), verify=_run(u, _dip(u)))
    assert [one.cause for one in kept.extensions] == ["unlisted"]
    # what it misses of the records that were diagnosed is not known with one cause fewer, their range is
    assert (np.isnan(kept.seen.rms_percent), kept.seen.input_high) == (True, found.extended.seen.input_high)


def test_another_model_is_refused(dipping):
    """Of the same range and the same units, but not the one that was diagnosed."""
    model, found = dipping
    with raises(DataError, "another model"):
        pt.extend(replace(model, offset=model.offset + 1.0), found)


@pytest.mark.slow
def test_nothing_is_learned_where_all_that_counts_lies_in_one_piece(dipping):
    """The memory becomes known near the end: no other piece could show that a dependence repeats."""
    model, _ = dipping
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    late = round(0.85 * u.size)
    t = np.arange(late) * DT_S
    moved = np.concatenate((0.75 + 0.2 * np.sin(20.0 * t) * np.sin(3.0 * t), u[: u.size - late]))
    assert pt.diagnose(_run(moved, 2.0 * _dip(moved) - _static(moved)), model).dependences == ()


class _Pieces:
    """Errors on pieces of a fit that is known by its squares alone."""

    def __init__(self, **errors):
        self.errors = errors

    def pieces(self, fitted):
        return np.asarray(self.errors[fitted.name], dtype=float)

    def rates(self, fitted):
        return np.zeros(0)  # too few blocks


class _Fit:
    def __init__(self, name, squares):
        self.name, self.squares = name, squares


@pytest.mark.parametrize(
    ("after", "expected"),
    [
        ([1.0, 1.0, 1.0, 1.0, 1.0], True),
        ([1.0, 1.0, 1.0, 1.0, 2.2], True),  # a little worse on one piece
        ([0.0, 0.0, 0.0, 0.0, 4.0], False),  # much worse on one
        ([1.8, 1.8, 1.8, 1.8, 1.8], False),  # hardly better on any
        ([], False),  # too short a record to leave pieces out
    ],
)
def test_what_repeats(after, expected):
    """Half of what the fit gains, and no piece worse by a tenth of it."""
    held_out = _Pieces(before=[2.0] * 5, after=after)
    share = repeated(held_out, _Fit("before", 10.0), _Fit("after", 5.0))
    assert (share >= LIMITS.repeated) is expected


def test_a_zero_that_wanders_explains_what_follows_the_time_and_no_more():
    """Against the weights: two slow turns of the zero, and as much that follows the average current."""
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    slow = 0.2 * np.sin(2.0 * np.pi * (2.0 * np.arange(u.size) / u.size + 0.1))
    for y, low, high in ((_static(u) + slow, 0.95, 1.0), (_dip(u), 0.0, 0.5)):
        records = [Record(u / 1.5, y / SPAN, np.ones(u.size), dt_s=DT_S)]
        problem = problem_for(records, 0.0, 1.0, signed=False, base=None)
        fitted = weights_for(problem, (), None)
        share = dependence.of_a_wandering_zero(fitted, HeldOut(problem), Unlisted.order) / fitted.squares
        assert low <= share <= high


@given(st.integers(0, 10**6))
def test_the_bank_is_scored_as_piece_by_piece(seed):
    """Each state's curve fitted to all pieces but one, and the fall of the squares on that one."""
    rng = np.random.default_rng(seed)
    piece = rng.permutation(np.arange(100) % LIMITS.pieces)
    states = [rng.normal(size=(100, KNOTS - 1)).astype(np.float32) for _ in range(3)]
    signals = rng.normal(size=(100, 2)) + states[1][:, :2]
    naive = np.zeros((3, 2))
    for k, columns in enumerate(states):
        for left_out in range(LIMITS.pieces):
            rest, own = columns[piece != left_out], columns[piece == left_out]
            ridge = dependence._penalty(np.asarray(columns.T @ columns, dtype=np.float64))
            curve = np.linalg.solve(rest.T @ rest + ridge, rest.T @ signals[piece != left_out])
            before = signals[piece == left_out]
            naive[k] += np.sum(before**2 - (before - own @ curve) ** 2, axis=0)
    np.testing.assert_allclose(dependence._falls(states, signals, piece), naive, rtol=1e-4, atol=1e-3)
    still = dependence._falls([np.zeros_like(states[0])], signals, piece)  # a state that never changes
    np.testing.assert_array_equal(still, np.zeros((1, 2)))


def _triangles(turns, rates):
    """Triangles through these turns, ten ranges at each of these rates, without a rest."""
    pieces = []
    way = float(np.sum(np.abs(np.diff(turns))))
    for rate in rates:
        for _ in range(round(10.0 * rate / way)):
            pieces += [
                np.linspace(a, b, max(round(abs(b - a) / rate * RATE_HZ), 3), endpoint=False)
                for a, b in pairwise(turns)
            ]
    return np.concatenate(pieces)


@pytest.mark.slow
@pytest.mark.parametrize("turns", [(0.0, 1.5, 0.5, 1.1, 0.3, 1.3, 0.0), (0.0, 1.5, 0.0)])
def test_an_input_that_never_rests_does_not_make_it_noise(turns):
    """What is slow is heard as noise where nothing rests; a dependence is sought in it all the same."""
    u = _triangles(turns, (1.5, 3.0, 6.0))
    run = _run(u, _dip(u, tau_s=0.3))
    model = pt.identify(run)
    found = pt.diagnose([run], model, seed=0)
    assert found.verdict == "unlisted"
    assert [one.tau_s for one in found.dependences] == [pytest.approx(0.3, rel=0.1)]
    assert model.fit.rms > 0.008 * SPAN
    assert found.left.percent < 0.15  # the noise is 0.1 % of the span


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ([0.0, 6.0, 16.0, 27.0, 32.0, 27.0, 15.0, 5.0], "higher by 29 mN when it is near 5"),
        ([0.0, -6.0, -16.0, -27.0, -32.0, -27.0, -15.0, -5.0], "lower by 29 mN when it is near 5"),
        ([0.0, 2.0, 9.0, 20.0, 28.0, 31.0, 32.0, 32.0], "higher by 32 mN when it goes from 1 to 1100"),
    ],
)
def test_a_curve_is_told_by_its_bump_or_by_its_ends(value, said):
    """A wide bump is one: it stands out from the line between its ends by more than they differ."""
    at = np.asarray([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 1100.0])
    kind = SimpleNamespace(unit="1", words="it", saturates=False)
    curve = learned._Curve(SimpleNamespace(kind=kind, gain=False), 1.0, at, np.asarray(value), np.zeros(8))
    words = {"input": "current", "output": "force", "u": "A", "y": "mN"}
    assert f"it is {said}" in learned._text(curve, words)
    of_gain = replace(curve, part=SimpleNamespace(kind=kind, gain=True))
    assert f"its gain is {said.replace('mN', '%')}" in learned._text(of_gain, words)
