"""A gap of the time stamps in which the input turned: nobody knows what the device remembers behind it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.artefacts.time_steps import behind_turns
from pulsetrainer.steps.import_ import import_parts

STEP = 0.005
NOISE = 0.003


def _triangle(*points: float):
    ways = [np.linspace(a, b, round(abs(b - a) / STEP), endpoint=False) for a, b in pairwise(points)]
    return np.append(np.concatenate(ways), points[-1])


def _curves():
    """Reversal curves: from the top down to ever lower ends."""
    return _triangle(0.0, *(end for low in np.linspace(0.9, 0.05, 18) for end in (1.0, low)), 1.0, 0.0)


def _plays(u):
    """Output of ten play operators: a Preisach operator."""
    out = np.zeros(u.size)
    for width, share in zip(np.linspace(0.02, 0.4, 10), np.linspace(0.14, 0.06, 10), strict=True):
        play = 1.0
        for k, one in enumerate(u):
            play = min(max(play, one - width), one + width)
            out[k] += share * play
    return out


U = _curves()
Y = _plays(U) + NOISE * np.random.default_rng(5).standard_normal(U.size)
TURNS = np.flatnonzero(np.diff(np.sign(np.diff(U)))) + 1
MIDDLE = int(TURNS[TURNS.size // 2])
AMID = (MIDDLE + int(TURNS[TURNS.size // 2 - 1])) // 2  # of a stroke


def _without(start: int, stop: int) -> pt.Run:
    kept = np.delete(np.arange(U.size), np.arange(start, stop))
    return pt.Run(time_s=kept * 1e-3, input=U[kept], output=Y[kept], signal="a.csv")


WHOLE = _without(0, 0)
STRAIGHT = _without(AMID - 15, AMID + 15)
TURNED = _without(AMID - 10, int(TURNS[TURNS.size // 2 + 1]) + 30)


def test_only_a_gap_that_may_hide_a_turn_parts_a_record():
    """Not one of a straight stroke, nor of few samples, nor one sample in ten."""
    assert TURNED.unseen_turns == [AMID - 10]
    assert [part.input.size for part in TURNED.parts()] == [AMID - 10, TURNED.input.size - AMID + 10]
    some = np.flatnonzero(np.random.default_rng(2).random(U.size) > 0.1)
    for run in (WHOLE, STRAIGHT, _without(MIDDLE - 1, MIDDLE + 2)):
        assert run.parts() == (run,)
        assert run.gap_words == ""
    assert behind_turns(some * 1e-3, U[some]) == []


def test_noise_of_the_input_is_no_turn():
    """At rest, and on a straight way."""
    t = np.delete(np.arange(1000), np.arange(400, 440)) * 1e-3
    noise = 0.01 * np.random.default_rng(3).standard_normal(t.size)
    for way in (np.where(t < 0.5, 0.0, 1.0), t):
        assert behind_turns(t, way + noise) == []


def test_a_memory_that_never_becomes_known_again_is_followed_on():
    """Ever smaller loops: what was remembered before the gap is the best that is known."""
    t = np.arange(3000.0)
    u = np.exp(-t / 1000) * np.cos(2 * np.pi * t / 200)
    kept = np.delete(np.arange(t.size), np.arange(880, 1020))
    assert behind_turns(t[kept], u[kept]) == []
    assert behind_turns(t[kept], np.append(u[kept][:-1], 1.0)) == [880]


def test_what_a_gap_hides_does_not_spoil_the_fit():
    """As good as the whole record; it was 1.04 % and 11.9 % where the memory was followed on."""
    errors = []
    for run in (WHOLE, STRAIGHT, TURNED):
        model = pt.identify(run, levels=32)
        found = pt.evaluate(run, [model])
        errors.append((found.models[0].rms_percent, found.models[0].max_percent))
        said = "turned unseen in 1 gap"
        assert any(said in note for note in found.notes) == (run is TURNED)
        assert model.fit is not None
        assert any(said in note for note in model.fit.notes) == (run is TURNED)
    assert errors[1] == pytest.approx(errors[0], rel=0.05)
    assert errors[2] == pytest.approx(errors[0], rel=0.05)


def test_what_a_gap_hides_is_no_cause():
    """A lag was named, to follow a lost turn."""
    found = pt.diagnose(TURNED, pt.identify(TURNED, levels=32), quick=True)
    assert found.verdict == "none"
    assert any("turned unseen in 1 gap" in note for note in found.notes)


def test_a_hidden_turn_is_not_filled_with_a_straight_line():
    """A straight stroke is."""
    filled, parted = (import_parts([run], resample="even") for run in (STRAIGHT, TURNED))
    np.testing.assert_allclose(filled.run.input, U, atol=1e-9)
    assert len(parted.run.parts()) == 2
    assert parted.run.input.size == TURNED.input.size
    assert parted.run.signal == "a.csv"
    assert any("turned unseen in 1 gap" in note for note in parted.notes)


@pytest.mark.parametrize(("pause_s", "seams"), [(1e-3, []), (0.1, [3000])])
def test_parts_whose_clock_goes_on_are_one(pause_s, seams):
    """One time step after the end of the part before it is its continuation, a tenth of a second a pause."""
    time_s = 1e-3 * np.arange(U.size)
    time_s[3000:] += pause_s - 1e-3
    parts = [pt.Run(time_s=time_s[k], input=U[k], output=Y[k]) for k in (slice(3000), slice(3000, None))]
    seam = import_parts(parts).run.seam
    assert (np.zeros(0) if seam is None else np.flatnonzero(seam)).tolist() == seams
