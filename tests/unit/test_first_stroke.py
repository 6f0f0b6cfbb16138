"""A device that was never cycled: its first stroke is one that no later one repeats."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

import pulsetrainer as pt
from pulsetrainer.core.initial_state import (
    _at_end,
    _stroke,
    counts_from,
    first_stroke_words,
    known_from,
    record_of,
    second_stroke,
)
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.stages import first_stroke

DT_S = 0.02
RADII = np.linspace(0.1, 1.5, 8)
TURNS = (0.0, 5.0, 0.5, 4.5, 1.0, 5.0, 0.0, 3.5, 0.8, 4.8, 0.0, 4.2, 1.1, 5.0, 0.0)


# The end where it begins is reached once more; and a path within the range of a model.
RARE = (0.0, 4.0, 0.5, 5.0, 1.0, 5.0, 0.4, 3.5, 0.8, 4.8, 0.0, 4.5, 1.1, 5.0, 0.5)
FULL = (0.0, 5.0, 0.0, 5.0, 0.0, 3.5, 0.8, 5.0, 0.0, 4.2, 1.1, 5.0, 0.0, 5.0, 0.0)
WITHIN = (0.0, 5.0, 0.5, 4.5, 1.0, 5.0, 0.0, 3.5, 0.8, 4.8, 0.0, 4.2, 1.1, 5.0, 0.0, 5.0, 0.0)
WIDE = (*(x for low in range(-5, 5) for x in (low, 6.0)), -6.0, 5.0, -4.0, 3.0, -2.0, 1.0)


def _record(*, cycled: bool, down: bool = False, noise: float = 0.01, turns: tuple[float, ...] = TURNS):
    """Input and output of eight plays that begin on their own loop, or anywhere; 5 to 0 where ``down``."""
    u = np.interp(np.arange(0.0, 28.0, DT_S), np.arange(len(turns)) * 2.0, turns)
    plays, found = RADII.copy() if cycled else np.zeros(8), []
    for value in u.tolist():
        plays = np.clip(plays, value - RADII, value + RADII)
        found.append(plays.sum() + 2.0 * value)
    y = np.asarray(found) + noise * np.random.default_rng(1).standard_normal(u.size)
    return (5.0 - u, -y) if down else (u, y)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("almost", "late", "known"),
    [
        (4.6, 120, 46),  # within a tenth of the range, and the end itself in the last sixth of the record
        (4.4, 120, 120),  # not so near: too much would stay open
        (4.6, 60, 60),  # not late
    ],
)
def test_an_end_that_is_reached_late_counts_from_where_it_was_almost_reached(almost, late, known, sign):
    """A drift of the output moves its extremes: 143 of 6133 samples counted for a dual model."""
    u = np.full(144, 2.5)
    u[10:70] = np.interp(np.arange(60), [0, 36, 59], [2.5, almost, 2.5])
    u[late:] = 5.0
    u = u if sign > 0 else 5.0 - u
    assert abs(counts_from(u, 0.0, 5.0) - known) <= 1  # from a hundredth of the range before it
    assert record_of(u, u, 0.0, 5.0).counts.sum() == u.size - counts_from(u, 0.0, 5.0)


@pytest.mark.parametrize("noisy", [0.0, 0.02])
@pytest.mark.parametrize("down", [False, True])
def test_a_first_stroke_apart_does_not_count(down, noisy):
    """From the next end on the memory is known; where the device was cycled before, from the first sample.

    Noise that leaves the end and comes back again and again makes no strokes.
    """
    u, y = _record(cycled=False, down=down)
    u = u + noisy * np.random.default_rng(2).standard_normal(u.size)
    at = known_from(u, 0.0, 5.0, y)
    assert u[at] == pytest.approx(0.0 if down else 5.0, abs=0.06)
    assert at * DT_S == pytest.approx(2.0, abs=0.06)
    assert str(at) in first_stroke_words(u, y, 0.0, 5.0)
    u, y = _record(cycled=True, down=down)
    assert known_from(u, 0.0, 5.0, y) == 0
    assert first_stroke_words(u, y, 0.0, 5.0) == ""


@pytest.mark.parametrize(
    ("moment", "within"), [(0.0, False), (0.05, True), (1.9, True), (2.1, False), (12.05, True)]
)
def test_a_step_within_a_first_stroke_may_be_that_stroke(moment, within):
    """A record that begins at 10 s counts as well; other causes have no moment."""
    frames = [Frame(0.1, np.zeros(100), 1.0, 1.0, begin_s=begin) for begin in (0.0, 10.0, 12.0)]
    terms = [Term(library()["step"], (0.1, 0.0, moment)), Term(library()["creep"], (0.1, 1.0))]
    state = SimpleNamespace(current=SimpleNamespace(terms=terms), problem=SimpleNamespace(frames=frames))
    assert first_stroke._changes_within(state, [21, 0, 5]) is within


ONCE = (0.0, 5.0, 0.0, 4.0, 1.0, 3.5, 1.5, 4.2, 0.8, 3.0, 2.0, 4.0, 0.6, 3.2, 1.1)


@pytest.mark.parametrize("down", [False, True])
def test_a_first_stroke_shows_against_a_single_later_one(down):
    """It begins elsewhere and comes nearer on the way; a step or a drift of the zero keeps its distance."""
    u, y = _record(cycled=False, down=down, turns=ONCE)
    assert known_from(u, 0.0, 5.0, y) * DT_S == pytest.approx(2.0, abs=0.06)
    u, y = _record(cycled=True, down=down, turns=ONCE)
    span, after = np.ptp(y), np.arange(u.size)
    assert known_from(u, 0.0, 5.0, y) == 0
    assert known_from(u, 0.0, 5.0, y + 0.1 * span * (after > 150)) == 0
    assert known_from(u, 0.0, 5.0, y + 0.1 * span * after / u.size) == 0


@pytest.mark.parametrize(
    ("begins", "ends", "left_out"),
    [
        (0.021, 0.0104, True),  # shares of the output's span, of the first and the last third
        (0.019, 0.0, False),  # too near for a single later stroke to tell
        (0.021, 0.0106, False),  # it does not come nearer by half
    ],
)
def test_how_a_first_stroke_differs_from_a_single_later_one(begins, ends, left_out):
    """The means of the first and of the last seven and six of twenty places count."""
    u = np.concatenate([np.linspace(a, b, 501)[1:] for a, b in pairwise((0.0, 5.0, 0.0, 4.0, 1.0))])
    apart = np.interp(u, [1.5, 2.5], [begins, ends]) * (np.arange(u.size) < 500)
    assert known_from(u, 0.0, 5.0, u - 5.0 * apart * (u < 4.94)) == (494 if left_out else 0)


@pytest.mark.parametrize("down", [False, True])
def test_a_first_stroke_ends_where_the_input_turns_before_an_end_that_it_never_reaches(down):
    """A model up to 6.5, loops up to 5: not the whole slow half of such a record is left out."""
    u, y = _record(cycled=False, down=down)
    ends = (-1.5, 5.0) if down else (0.0, 6.5)
    at = known_from(u, *ends, y)
    assert at * DT_S == pytest.approx(2.0, abs=0.06)
    assert second_stroke(u, *ends) == pytest.approx(at, abs=3)


@pytest.mark.parametrize(
    ("first", "later", "left_out"),
    [
        ((0.0052, 0.0), 3, True),  # shares of the output's span, of the first stroke and of two later ones
        ((0.0048, 0.0), 3, False),
        ((0.03, 0.0149), 3, True),  # twice as far apart as these
        ((0.03, 0.0151), 3, False),
        ((0.0052, 0.0), 2, True),
        ((0.0052, 0.0), 1, True),  # the strokes from the other end are alike
        ((0.0048, 0.0), 1, False),
    ],
)
@pytest.mark.parametrize("down", [False, True])
def test_how_far_apart_a_first_stroke_lies(first, later, left_out, down):
    """By the rms of twenty places from two hundredths of the range on; too short a stroke is not compared."""
    tops = (5.0, 0.0, *(later * (5.0, 0.0)), 0.9, 0.0)
    u = np.concatenate([[0.0], *(np.linspace(a, b, 501)[1:] for a, b in pairwise((0.0, *tops)))])
    places = np.linspace(0.1, 5.0, 20)
    apart, unlike = np.array(first) / np.sqrt(np.mean((places / 5.0 * (places < 4.8)) ** 2))
    shares = np.zeros(len(tops))
    shares[[0, 2]] = -apart, unlike
    if later > 1:
        shares[4] = -unlike
    stroke = np.maximum(np.arange(u.size) - 1, 0) // 500
    y = u + shares[stroke] * u * (u < 4.8)
    y[stroke == len(tops) - 2] += 3.0
    if down:
        u, y = 5.0 - u, -y
    assert known_from(u, 0.0, 5.0, y) == (495 if left_out else 0)  # within a hundredth of the other end
    assert known_from(np.append(2.0, u), 0.0, 5.0, np.append(2.0, y)) == 1  # it came from elsewhere


@pytest.mark.parametrize("effect", ["creep", "heat"])
@pytest.mark.parametrize("down", [False, True])
def test_what_goes_on_at_the_other_end_is_no_first_stroke(effect, down):
    """There all memory is wiped out; a device that was cycled, and does something else, loses no sample."""
    u, y = _record(cycled=True, turns=FULL)
    fresh, virgin = _record(cycled=False, turns=FULL)
    t = np.arange(u.size) * DT_S
    spoilt = {
        "creep": lambda y: y + 0.05 * np.ptp(y) * np.exp(-t / 3.0),
        "heat": lambda y: y * (1.0 - 0.05 * (1.0 - np.exp(-t / 3.0))),
    }[effect]
    if down:
        assert known_from(5.0 - u, 0.0, 5.0, -spoilt(y)) == 0
        assert known_from(5.0 - fresh, 0.0, 5.0, -virgin) * DT_S == pytest.approx(2.0, abs=0.06)
    else:
        assert known_from(u, 0.0, 5.0, spoilt(y)) == 0
        assert known_from(fresh, 0.0, 5.0, virgin) * DT_S == pytest.approx(2.0, abs=0.06)


@pytest.mark.parametrize("seed", range(8))
def test_ends_and_strokes_sample_by_sample(seed):
    """An end is left twice as far away as it is reached; a stroke ends where it turns by a hundredth."""
    rng = np.random.default_rng(seed)
    away = np.abs(np.cumsum(rng.normal(size=300)) * 0.02)
    near = 0.05
    told = [a <= near for a in away if not near < a <= 2.0 * near]
    at, expected = told[0], []
    for one in away.tolist():
        at = True if one <= near else False if one > 2.0 * near else at
        expected.append(at)
    assert _at_end(away, near).tolist() == expected
    way, said = [away[0]], [0.0]
    for k, one in enumerate(away.tolist()):
        if one < way[-1] - 0.01 * 20.0:
            break
        if one > way[-1]:
            way.append(one)
            said.append(float(k))
    found = _stroke(away, np.arange(300.0), 20.0)
    assert (found[0].tolist(), found[1].tolist()) == (way, said)


def test_one_later_stroke_is_enough_where_those_from_the_other_end_are_alike():
    """They are, unless something else goes on: then the first stroke counts."""
    u, y = _record(cycled=False, turns=RARE)
    assert known_from(u, 0.0, 5.0, y) * DT_S == pytest.approx(6.0, abs=0.06)
    u, y = _record(cycled=True, turns=RARE)
    assert known_from(u, 0.0, 5.0, y) == 0
    drift = np.linspace(0.0, 0.2 * np.ptp(y), u.size)
    assert known_from(u, 0.0, 5.0, y + drift) == 0


def _wide(turns: tuple[float, ...], before: float) -> pt.Run:
    """A record of eight wide plays, from saturation at ``before``."""
    way = (before, *turns)
    u = np.interp(np.arange(0.0, 2.0 * len(turns), DT_S), np.arange(len(way)) * 2.0, way)
    plays, found = before - 2.0 * np.sign(before) * RADII, []
    for value in u.tolist():
        plays = np.clip(plays, value - 2.0 * RADII, value + 2.0 * RADII)
        found.append(plays.sum() + 2.0 * value)
    y = np.asarray(found) + 0.01 * np.random.default_rng(2).standard_normal(u.size)
    begin = round(2.0 / DT_S)
    u, y = u[begin:], y[begin:]
    return pt.Run(time_s=np.arange(u.size) * DT_S, input=u, output=y, input_unit="V", output_unit="um")


@pytest.mark.parametrize("before", [-6.0, 6.0])
@pytest.mark.parametrize("down", [False, True])
def test_within_the_range_of_a_model_what_came_before_is_no_cause(before, down):
    """A record that begins at its own end: the first stroke may switch what no later one does.

    Neither that stroke nor the constant that is left of what came before is a fault of the model.
    """
    model = pt.identify(_wide(WIDE, -6.0), levels=24)
    run = _wide(tuple(5.0 - x for x in WITHIN) if down else WITHIN, before)
    apart = (before > 0) is down
    assert (known_from(run.input, -6.0, 6.0, run.output) > 0) is apart
    found = pt.diagnose(run, model, quick=True)
    assert found.verdict == "none"
    assert any("first stroke" in note for note in found.notes) is apart


def test_it_neither_spoils_the_fit_nor_is_it_a_cause():
    """The fit is as good as of the cycled device; it is said; the diagnosis finds nothing."""
    left = []
    for cycled in (False, True):
        run = _run(*_record(cycled=cycled))
        model = pt.identify(run, levels=24)
        said = [note for note in model.fit.notes if "first stroke" in note]
        assert len(said) == (0 if cycled else 1)
        assert all("differs from all later ones" in note for note in said)
        left.append(model.fit.rms_percent)
        found = pt.diagnose(run, model, quick=True)
        assert not any(one.found for one in found.causes)
        assert any("first stroke" in note for note in found.notes) is not cycled
    assert left[0] < 1.3 * left[1]


# From the end where it begins only a short stroke follows: by itself the record shows nothing.
SHORT = (0.0, 5.0, 0.0, 1.5, 0.4, 4.2, 1.0, 3.6, 1.5, 3.0, 0.6, 4.0, 0.8, 2.5, 0.3)


@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize("turns", [SHORT, (1.0, 0.0, *SHORT[1:-1])])
def test_a_fit_shows_a_first_stroke_that_nothing_can_be_compared_with(down, turns):
    """Without it the fit is as good as of the cycled device, whose first stroke stays; wherever it begins."""
    left = {}
    cycled = [_run(*_record(cycled=True, down=down, turns=one)) for one in (turns, TURNS)]
    for run in (_run(*_record(cycled=False, down=down, turns=turns)), cycled[0]):
        assert known_from(run.input, 0.0, 5.0, run.output) == known_from(run.input, 0.0, 5.0)
        model = pt.identify(run, levels=24)
        said = [note for note in model.fit.notes if "first stroke" in note]
        assert len(said) == (0 if run is cycled[0] else 1)
        assert not [note for note in model.fit.notes if "wild" in note]
        left[run is cycled[0]] = pt.evaluate(cycled[1], model).models[0].rms_percent
    assert left[False] < 1.3 * left[True]


@pytest.mark.parametrize("what", ["drift", "step", "lag"])
def test_what_else_a_fit_leaves_is_no_first_stroke(what):
    """It stays in all that comes later."""
    u, y = _record(cycled=True, turns=SHORT)
    t, span = np.arange(u.size) * DT_S, float(np.ptp(y))
    y = {
        "drift": lambda: y + 0.1 * span * t / t[-1],
        "step": lambda: y + 0.05 * span * (t > 15.0),
        "lag": lambda: signal.lfilter([0.1], [1.0, -0.9], y - y[0]) + y[0],
    }[what]()
    notes = pt.identify(_run(u, y), levels=24).fit.notes
    assert any("noise from sample to sample" in note for note in notes)
    assert not any("first stroke" in note for note in notes)


def _run(u, y):
    return pt.Run(time_s=np.arange(u.size) * DT_S, input=u, output=y, input_unit="V", output_unit="um")


def test_it_is_no_error_of_a_model():
    """A record of a device that was not cycled: the model predicts the rest of it as well as its own."""
    cycled, fresh = (_run(*_record(cycled=one)) for one in (True, False))
    found = pt.evaluate(fresh, pt.identify(cycled, levels=24))
    assert found.models[0].rms_percent < 1.5 * pt.evaluate(cycled, found.model).models[0].rms_percent
    assert [note for note in found.notes if "first stroke" in note]


@pytest.mark.parametrize(
    ("times", "until", "apart"), [(3.1, 16, True), (2.9, 16, False), (3.1, 14, False), (3.1, 40, False)]
)
def test_a_first_stroke_that_the_model_misses_far_more_than_the_rest_is_apart(times, until, apart):
    """Two samples to an average: of fewer than eight averages noise may be as large, and some must follow."""
    number = np.arange(40) // 2
    residual = np.where(np.arange(20) < until // 2, times, 1.0) * np.resize([1.0, -1.0], 20)
    state = SimpleNamespace(
        problem=SimpleNamespace(bins=SimpleNamespace(number=[number])),
        current=SimpleNamespace(residual=residual),
    )
    assert first_stroke._misses(state, 0, until) is apart
