"""Piece by piece is the whole, cut: forwards for every lasting cause, backwards for static models."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import worlds

from pulsetrainer.core.inversion import invert, slew_limited
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.extended import Extended
from pulsetrainer.diagnosis.piecewise import Piecewise

DT_S = 1e-3
STATIC = Preisach(Plane.uniform(0.0, 1.5, 12), np.linspace(1.0, 4.0, 78))
LASTING = [cause for cause in library().values() if cause.lasting and cause.stage != "record"]
ENDS = [(0.0, 1.5), (0.0, 300.0), (0.0, 2.2), (0.0, 9e4), (0.0, 20.0), (0.0, 3e3), (-0.5, 0.5), (-99.0, 99.0)]
ENDS += [(0.0, 1.0), (0.0, 1.5), (0.0, 1.0), (0.0, 1.0), (0.0, 1.0)]  # of the states of ``unlisted``
VALUES = {
    "accommodation": (0.2, 4.0),
    "creep": (0.1, 0.3),
    "delay": (0.0123,),
    "field-lag": (0.01,),
    "load-dependence": (0.003,),
    "output-lag": (0.01,),
    "rate-widening": (0.01,),
    "resonance": (20.0, 0.2),
    "thermal-drift": (0.05, 3.0),
    "viscous": (0.02, 0.01),
    # every kind of state at once
    "unlisted": (
        *(one for k, (low, high) in enumerate(ENDS) for one in (float(k), low, high)),
        *([0.05, 0.1, -0.3, 0.2, 0.5, 0.4, -0.1, 0.3] * len(ENDS)),
    ),
}


def _cut(values, cuts):
    return np.split(values, sorted({min(c, values.size - 1) for c in cuts if c > 0}))


def _walk(seed, size):
    steps = np.random.default_rng(seed).normal(size=size)
    return 0.75 + 0.6 * np.sin(np.cumsum(steps) / 20.0)


GAIN = ("unlisted", (-5.0, 0.0, 20.0, 0.05, 0.1, -0.3, 0.2, 0.5, 0.4, -0.1, 0.3))  # by the input's speed
OTHER_KINDS = [("creep", (1.0, 0.1, 0.3)), ("thermal-drift", (0.5, 0.2, 3.0)), GAIN]


@pytest.mark.parametrize("extension", [*((c.id, VALUES[c.id]) for c in LASTING), *OTHER_KINDS])
@given(seed=st.integers(0, 99), cuts=st.lists(st.integers(1, 900), max_size=4))
def test_a_model_played_in_pieces_is_the_whole(extension, seed, cuts):
    """Whatever a cause remembers goes along, wherever the input is cut."""
    extended = Extended.of(STATIC, [extension])
    inputs = _walk(seed, 900)
    pieces = Piecewise(extended, DT_S, slew_per_s=30.0)
    played = np.concatenate([pieces.play(piece) for piece in _cut(inputs, cuts)])
    # the two differ by rounding, but for the feedback, whose passes stop before the last digit
    np.testing.assert_allclose(played, extended(inputs, DT_S), atol=1e-9 * STATIC.total, rtol=0)


@given(
    world=worlds(readings=("continuous",), least=0.05),
    seed=st.integers(0, 99),
    cuts=st.lists(st.integers(1, 700), max_size=5),
    beyond=st.sampled_from([0.0, 0.05, -0.3]),
)
def test_a_static_inverse_in_pieces_is_the_whole(world, seed, cuts, beyond):
    """To rounding, slew limit included, if what comes ahead is as long as the limit reaches.

    As many targets count as out of reach.
    """
    operator = world.operator
    reach = sorted(operator.saturation)
    span = operator.plane.high - operator.plane.low
    target = np.interp(_walk(seed, 700), (0.2, 1.3), reach) + beyond * (reach[1] - reach[0])
    slew = 10.0 * span
    exact = invert(operator, target)
    whole = slew_limited(exact.input, 1 / DT_S, slew)
    pieces = Piecewise(Extended.of(operator, []), DT_S, slew_per_s=slew)
    got, clipped, at = [], 0, 0
    for piece in _cut(target, cuts):
        at += piece.size
        one = pieces.next(piece, target[at : at + pieces.reach])
        got.append(one.input)
        clipped += one.clipped
    # the wish before the first sample is the low end: there the whole has no past, the pieces have one
    settled = slice(pieces.reach, None)
    np.testing.assert_allclose(np.concatenate(got)[settled], whole[settled], atol=1e-9 * span, rtol=0)
    assert clipped == exact.clipped


@settings(max_examples=settings.default.max_examples // 4)  # each is five pieces of an iteration
@given(seed=st.integers(0, 99), wrong=st.integers(100, 199))
def test_a_change_of_mind_makes_no_step(seed, wrong):
    """What comes ahead may turn out to be something else: no step is longer than the slew limit."""
    extended = Extended.of(STATIC, [("field-lag", (0.01,)), ("creep", (0.1, 0.3))])
    reach = STATIC.saturation
    pieces = Piecewise(extended, DT_S, slew_per_s=30.0, band_Hz=30.0)
    given_inputs = [0.0]
    for k in range(5):
        target = np.interp(_walk(seed + k, 200), (0.0, 1.5), reach)
        other = np.interp(_walk(wrong + k, 200), (0.0, 1.5), reach)
        given_inputs.extend(pieces.next(target, other).input.tolist())
    assert np.abs(np.diff(given_inputs)).max() <= 30.0 * DT_S * (1 + 1e-9)


def test_an_extended_inverse_in_pieces_tracks_like_the_whole():
    """Beat by beat with one beat ahead: the error is within a tenth of the whole inverse's."""
    extended = Extended.of(STATIC, [("field-lag", (0.01,)), ("creep", (0.1, 0.3))])
    low, high = STATIC.saturation
    beat = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(800) / 800)
    target = low + (high - low) * (0.1 + 0.7 * np.tile(beat, 12))
    start = np.linspace(0.0, 0.3, 500)
    lead = np.concatenate((np.zeros(100), start))
    whole = extended.invert(target, DT_S, lead=lead, band_Hz=30.0)
    pieces = Piecewise(extended, DT_S, slew_per_s=30.0, band_Hz=30.0)
    pieces.play(lead)
    beats = np.split(target, 12)
    got = [pieces.next(now, ahead) for now, ahead in zip(beats, [*beats[1:], beats[0]], strict=True)]
    error = np.sqrt(np.mean((np.concatenate([p.predicted for p in got]) - target)[800:] ** 2))
    of_whole = np.sqrt(np.mean((whole.predicted - target)[800:-800] ** 2))
    assert error < max(1.1 * of_whole, 1e-3 * (high - low))
