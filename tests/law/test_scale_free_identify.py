"""Identification knows no unit: time, input, output may be multiplied, shifted, or sampled ten times as fast.

    t -> k t,    u -> a u + b,    y -> c y + d

leave form, loop, smoothing and what the fit leaves as they are, and move the prediction alike.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pulsetrainer as pt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))

import form_devices as devices

DEVICES = {
    "direct": devices.play_sum,
    "dual": devices.stop_sum,
    "signed": devices.butterfly_density,
}
SAMPLES, LEVELS, NOISE = 1500, 12, 0.003
POWERS = st.floats(-9, 6).map(lambda power: 10.0**power)
SIGNS = st.sampled_from((1.0, -1.0))
ALIKE = (
    0.02  # of the noise, rms: rounding decides which cells of many that the data cannot tell apart are zero
)


@cache
def _record(form: str) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(31)
    device = DEVICES[form](rng)
    u = devices.record(rng, SAMPLES)
    y = device(u)
    return u, y + rng.normal(0.0, NOISE * float(np.ptp(y)), u.size)


def _model(form: str, *, k=1.0, a=1.0, b=0.0, c=1.0, d=0.0, faster=1) -> pt.Model:
    u, y = _record(form)
    at = np.arange(0, u.size - 1 + 1e-9, 1 / faster)
    u, y = (np.interp(at, np.arange(u.size), x) for x in (u, y))
    run = pt.Run(time_s=k * np.arange(u.size) / faster, input=a * u + b, output=c * y + d)
    return pt.identify(run, levels=LEVELS)


@cache
def _plain(form: str) -> pt.Model:
    """What is found where all scales are one."""
    return _model(form)


@pytest.mark.parametrize(
    "form", [pytest.param(form, marks=pytest.mark.slow if form == "signed" else ()) for form in DEVICES]
)
@settings(max_examples=4, deadline=None)
@given(k=POWERS, a=POWERS, b=st.floats(-10, 10), c=POWERS, sign=SIGNS, d=st.floats(-10, 10))
def test_a_model_is_the_same_in_all_units(form, k, a, b, c, sign, d):
    """From nanounits to millions, the output upright or upside down."""
    first = _plain(form)
    moved = _model(form, k=k, a=a, b=a * b, c=sign * c, d=c * d)
    assert first.form == moved.form == form
    assert first.fit is not None
    assert moved.fit is not None
    assert moved.fit.loop == first.fit.loop
    assert moved.fit.masked_samples == first.fit.masked_samples
    assert bool(moved.fit.warning) == bool(first.fit.warning)
    assert moved.fit.smoothing == pytest.approx(first.fit.smoothing, rel=0.02)
    assert moved.fit.rms_percent == pytest.approx(first.fit.rms_percent, rel=0.01)
    u, y = _record(form)
    there, here = moved.predict(a * u + a * b), first.predict(u)
    apart = (there - c * d) / (sign * c) - here
    assert np.sqrt(np.mean(apart**2)) <= ALIKE * NOISE * np.ptp(y)


@pytest.mark.slow
@pytest.mark.parametrize("form", DEVICES)
def test_ten_samples_for_one_tell_the_same(form):
    """The same form and loop, and the device predicted as well: at most 1.3 times the error."""
    first, faster = _plain(form), _model(form, faster=10)
    assert (faster.form, faster.fit.loop) == (first.form, first.fit.loop)
    device = DEVICES[form](np.random.default_rng(31))
    turns = np.concatenate(([0.0, 1.0, 0.0], np.random.default_rng(32).uniform(0.0, 1.0, 40)))
    unseen = np.interp(np.linspace(0, 42, 2000), np.arange(43), turns)
    wanted = device(unseen)
    errors = [float(np.std(model.predict(unseen) - wanted)) for model in (first, faster)]
    assert errors[1] <= 1.3 * errors[0]
