"""A falling device: its diagnosis is that of the rising one, with the signs of what was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import pulsetrainer as pt
from pulsetrainer.artefacts import Extension, Parameter
from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane

RATE_HZ = 250.0
VISCOUS, DRIFT = 0.06, 0.02  # N s/A, N/s


def _run(viscous: float, drift: float) -> pt.Run:
    """A rising device with a viscous part, or whose zero drifts."""
    plane = Plane.uniform(0.0, 1.5, 40)
    i, j = plane.cell_indices
    weights = 1.0 + np.exp(-(((i - j) / 40 - 0.2) ** 2) / 0.02)
    static = Preisach(plane, weights * 7.0 / float((weights * plane.areas).sum()), 7.0)
    u = excitations.diagnostic(0.0, 1.5, rate_Hz=RATE_HZ).value
    time_s = np.arange(u.size) / RATE_HZ
    speed = np.diff(u, prepend=u[:1]) * RATE_HZ
    noise = 0.01 * np.random.default_rng(3).standard_normal(u.size)
    return pt.Run(time_s, u, static(u) + viscous * speed + drift * time_s + noise)


def _answer(run: pt.Run) -> tuple[pt.Model, pt.Diagnosis]:
    model = pt.identify(run, levels=40)
    return model, pt.diagnose(run, model)


def _mirrored(
    rising: pt.Run, cause: str, name: str, size: float
) -> list[tuple[pt.Run, pt.Model, pt.Diagnosis]]:
    """Return a record and its falling copy, each with model and diagnosis, once these say the same."""
    falling = replace(rising, output=-rising.output)
    (model, up), (turned, down) = _answer(rising), _answer(falling)
    assert turned.polarity == -model.polarity
    assert down.verdict == up.verdict == cause
    assert [one.cause for one in down.found] == [one.cause for one in up.found]
    (one,) = [p for p in up.found[0].parameters if p.name == name]
    (other,) = [p for p in down.found[0].parameters if p.name == name]
    assert one.value == pytest.approx(size, rel=0.2)
    assert (other.value, other.lower, other.upper) == pytest.approx(
        (-one.value, -one.upper, -one.lower), rel=1e-3
    )
    return [(rising, model, up), (falling, turned, down)]


@pytest.mark.slow
def test_a_falling_copy_drifts_the_other_way_and_is_corrected_alike():
    """Verdict and correction are those of the rising record, times minus one."""
    one, other = _mirrored(_run(0.0, DRIFT), "offset-drift", "rate", DRIFT)
    corrected = [pt.correct(run, found).output for run, _, found in (one, other)]
    assert np.ptp(corrected[0] - one[0].output) > 0.5 * DRIFT * one[0].time_s[-1]
    np.testing.assert_allclose(corrected[1], -corrected[0], atol=1e-3)


@pytest.mark.slow
def test_a_falling_copy_has_the_mirrored_viscous_part_and_is_extended_alike():
    """What the extended model predicts is that of the rising one, times minus one."""
    one, other = _mirrored(_run(VISCOUS, 0.0), "viscous", "coefficient", VISCOUS)
    extended = [pt.extend(model, found) for _, model, found in (one, other)]
    said = [model.predict(one[0].input, 1.0 / RATE_HZ) for model in extended]
    np.testing.assert_allclose(said[1], -said[0], atol=0.02)
    assert np.std(said[0] - one[0].output) < 0.02
    assert not any(model.captured for model in extended)


def test_a_file_from_before_keeps_its_meaning():
    """Parameters that do not say so are of the output times the polarity."""
    edges = np.linspace(0.0, 1.5, 9)
    one = pt.Model(edges, np.ones(36), 1.0, np.ones(36, bool), polarity=-1)
    u = np.sin(np.arange(500) / 20.0) ** 2

    def said(coefficient: float, *, as_measured: bool) -> np.ndarray:
        parameters = (Parameter("coefficient", coefficient, "N s/A", coefficient, coefficient),)
        own = replace(one, extensions=(Extension("viscous", parameters),), as_measured=as_measured)
        return own.predict(u, 0.01)

    np.testing.assert_allclose(said(0.3, as_measured=False), said(-0.3, as_measured=True))
    assert np.abs(said(0.3, as_measured=False) - said(0.3, as_measured=True)).max() > 0.1


def test_a_falling_output_is_clipped_where_it_was_measured():
    """The end of the converter's range is told as it was read, and not turned over."""
    rising = _run(0.0, 0.0)
    cut = np.minimum(np.round(rising.output, 3), 11.0)
    for sign in (1, -1):
        model = pt.identify(replace(rising, output=sign * rising.output), levels=24, form="direct")
        found = pt.diagnose(replace(rising, output=sign * cut), model, quick=True).found
        (one,) = [cause for cause in found if cause.cause == "saturation"]
        assert one.parameters[0].value == pytest.approx(sign * 11.0)
        assert f"exactly {sign * 11} N" in one.text


@pytest.mark.slow
def test_a_dependence_on_a_falling_output_is_drawn_over_what_was_measured():
    """Places and words are those of the record, and the places rise."""
    rising = _run(0.0, 0.0)
    average = signal.lfilter([0.01], [1.0, -0.99], rising.output)  # of the last 0.4 s
    dip = 0.5 * np.exp(-0.5 * ((average - 5.0) / 1.2) ** 2)
    run = replace(rising, output=dip - rising.output)
    (one,) = pt.diagnose(run, pt.identify(run, levels=32, form="direct")).dependences
    assert (one.unit, one.state[:18]) == ("N", "the average force ")
    assert np.all(np.diff(one.at) > 0)
    assert one.at[np.argmax(one.value)] == pytest.approx(-5.0, abs=0.5)
    assert "is higher by 0." in one.text
    assert "is near -" in one.text
