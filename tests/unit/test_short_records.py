"""Hand-read loops, and records that hold nothing to fit."""

from __future__ import annotations

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.errors import ArgumentError, DataError
from wording import raises


def loop(points):
    """A hand-read loop: there and back, with a width of a tenth."""
    half = points // 2
    u = np.concatenate((np.linspace(0.0, 1.0, half), np.linspace(1.0, 0.0, points - half + 1)[1:]))
    rising = np.arange(points) < half
    y = u + np.where(rising, -0.2, 0.2) * u * (1.0 - u)
    return u, np.round(y, 3)


@pytest.mark.parametrize("points", [20, 41, 60])
def test_a_hand_read_loop_is_data(points):
    """20 to 60 points: as many levels as they support, said, and the loop is met."""
    u, y = loop(points)
    model = pt.identify(pt.Run(time_s=None, input=u, output=y))
    assert model.levels == points // 2
    assert any(str(model.levels) in note for note in model.fit.notes)
    assert model.fit.rms_percent < 1.0
    assert (model.form, model.fit.loop, model.fit.warning) == ("direct", "counterclockwise", "")


def test_levels_that_are_asked_for_are_kept():
    """Nothing is said of them."""
    u, y = loop(60)
    model = pt.identify(pt.Run(time_s=None, input=u, output=y), levels=8)
    assert model.levels == 8
    assert not any("short" in note for note in model.fit.notes)


def test_a_long_record_has_48_levels():
    """As before."""
    u, y = loop(400)
    assert pt.identify(pt.Run(time_s=None, input=u, output=y)).levels == 48


@pytest.mark.parametrize("form", ["auto", "direct", "dual", "signed"])
@pytest.mark.parametrize("points", [0, 1, 2, 3])
def test_a_record_of_next_to_nothing_is_refused(points, form):
    """None to three samples are no loop, of any form."""
    u = np.arange(float(points))
    with pytest.raises((DataError, ArgumentError)):
        pt.identify(pt.Run(time_s=None, input=u, output=u), form=form)


@pytest.mark.parametrize("form", ["auto", "dual", "signed"])
def test_an_output_that_does_not_move_is_refused(form):
    """It has no loop that runs either way."""
    u, y = loop(200)
    with pytest.raises((DataError, ArgumentError)):
        pt.identify(pt.Run(time_s=None, input=u, output=np.ones_like(y)), form=form)


@pytest.mark.parametrize("step", [0.0, -0.1])
def test_time_that_stands_or_goes_back_is_refused(step):
    """Before anything is fitted; the message names the sample."""
    u, y = loop(50)
    time = np.arange(50.0)
    time[20] = time[19] + step
    with raises(DataError, "names it", named="sample 20"):
        pt.Run(time_s=time, input=u, output=y)


def _swings(*turns, each=60):
    """An input through some turns, ``each`` samples from one to the next, and what a device makes of it."""
    u = np.interp(np.arange((len(turns) - 1) * each + 1) / each, np.arange(len(turns)), turns)
    plane = Plane.uniform(0.0, 1.0, 12)
    return u, Preisach(plane, np.ones(plane.n_q))(u)


def test_a_memory_that_is_known_late_leaves_few_samples_that_count():
    """They may all lie in one block, so that no form can be held against another."""
    turns = (0.5, 0.6, 0.4, 0.6, 0.4, 0.6, 0.4, 0.6, 0.4, 0.5)
    u, _ = _swings(*turns, each=110)
    u = np.concatenate((u, np.linspace(0.5, 0.0, 10)[1:], np.linspace(0.0, 1.0, 12)[1:]))
    plane = Plane.uniform(0.0, 1.0, 12)
    model = pt.identify(pt.Run(None, u, Preisach(plane, np.ones(plane.n_q))(u)), levels=8)
    assert (model.form, model.fit.rms_percent) == ("direct", pytest.approx(0.0, abs=0.5))


def test_a_part_without_a_sample_that_counts_does_not_spoil_the_others():
    """Its memory becomes known only where its samples are masked."""
    whole, late = _swings(0, 1, 0, 1, 0.3, 0.9, 0.2, 1, 0.4, 0.6, 0), _swings(0.5, 0.6, 0.4, 0.7, 0.3, 1, 0.2)
    masked = np.arange(late[0].size) > 260
    model = pt.identify([pt.Run(None, *whole), pt.Run(None, *late, masked=masked)], levels=12)
    assert model.fit.rms_percent < 0.01


def test_the_band_of_a_record_within_the_range_is_around_its_prediction():
    """Such a record is followed from a state of its own; the bootstrap follows it from there too."""
    within, whole = _swings(0.5, 0.2, 0.8, 0.3, 0.7, 0.2, 0.8), _swings(0, 1, 0, 1, 0.3, 0.9, 0.2, 1, 0)
    noise = np.random.default_rng(0)
    runs = [pt.Run(None, u, y + noise.normal(0.0, 1e-3, y.size)) for u, y in (within, whole)]
    fit, again = (pt.identify(runs, levels=12, bootstrap=20, **seed).fit for seed in ({}, {"seed": 0}))
    np.testing.assert_array_equal(
        fit.predicted_upper, again.predicted_upper
    )  # who gives no seed has that one
    np.testing.assert_allclose(0.5 * (fit.predicted_lower + fit.predicted_upper), fit.predicted, atol=0.02)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("swing", [1e-4, 1e-8])
def test_a_record_of_a_device_at_rest_gets_an_answer(swing, seed):
    """Its output is all noise, which by chance falls as often as it rises."""
    u, y = _swings(0, 1, 0, 1, 0.3, 0.9, 0.2, 1, 0.4, 0.6, 0)
    model = pt.identify(pt.Run(None, u, y), levels=12)
    time_s = np.arange(2000) / 100.0
    noise = 0.01 * np.random.default_rng(seed).standard_normal(time_s.size)
    rest = 0.5 + swing * np.sin(3.0 * time_s) ** 2
    run = pt.Run(time_s, rest, model.predict(rest, None) + noise)
    assert pt.diagnose(run, model, quick=True).verdict != "condition-change"


@pytest.mark.parametrize(("timed", "unit"), [(True, "s"), (False, "samples")])
def test_a_moment_of_a_record_without_time_is_a_number_of_samples(timed, unit):
    """Only their order is known: a change is so many samples after the first, not so many seconds."""
    rng = np.random.default_rng(3)
    turns = np.concatenate(([0.0, 1.0, -1.0], rng.uniform(-1.0, 1.0, 30), [1.0, -1.0, 1.0]))
    u = np.interp(np.linspace(0.0, turns.size - 1.0, 1500), np.arange(turns.size), turns)
    y = np.tanh(2.0 * u) + 0.003 * rng.standard_normal(u.size) + 0.1 * (np.arange(u.size) > 900)
    run = pt.Run(0.01 * np.arange(u.size) if timed else None, u, y)
    found = pt.diagnose(run, pt.identify(run, levels=12), quick=True)
    step = next(one for one in found.causes if one.cause == "step")
    assert {one.name: one.unit for one in step.parameters} == {"offset": "N", "gain": "1", "time": unit}


@pytest.mark.parametrize("captured", [True, False])
def test_only_who_captured_a_run_is_sent_to_capture_another(captured):
    """Of an imported one, the command would be that of another device."""
    still = np.ones(20)
    with pytest.raises(DataError) as caught:
        pt.identify(pt.Run(time_s=None, input=still, output=still, captured=captured))
    assert "record a run that sweeps the range" in caught.value.hint
    assert ("pulsetrainer capture" in caught.value.hint) is captured
