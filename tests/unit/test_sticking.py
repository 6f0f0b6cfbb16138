"""Sticking too small to be seen in single jumps, by the sawtooth that it leaves over the model's output."""

from __future__ import annotations

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import fired_on, library
from pulsetrainer.diagnosis.fitting import weights_for
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.raw import Firing, Raw

DT = 1e-3
FINE = excitations.diagnostic(0.0, 1.5, rate_Hz=10 / DT).value[:600_000]  # a device jumps between samples too
INPUT = FINE[::10]
NOISE = 0.04
STICKING = library()["stick-slip"]


def _smooth() -> FloatArray:
    plane = Plane.uniform(0.0, 1.5, 40)
    i, j = plane.cell_indices
    weights = 1.0 + np.exp(-(((i - j) / 40 - 0.25) ** 2) / 0.02)
    return Preisach(plane, weights * 7.0 / float((weights * plane.areas).sum()), 7.0)(FINE)


def _stuck(y: FloatArray, force: float) -> FloatArray:
    """Hold the output until the imbalance is ``force``; it then jumps by six tenths of that."""
    held, path = float(y[0]), []
    for wanted in y.tolist():
        if abs(wanted - held) > force:
            held = wanted - 0.4 * force * np.sign(wanted - held)
        path.append(held)
    return np.asarray(path)[::10]


def _sawtooth(y: FloatArray, seed: int = 1) -> tuple[Firing | None, Record]:
    noisy = y + NOISE * np.random.default_rng(seed).standard_normal(y.size)
    record = Record(INPUT, noisy, dt_s=DT)
    problem = problem_for([record], 0.0, 1.5)
    return STICKING.gate_left(weights_for(problem, (), None)), record


@pytest.mark.parametrize("force", [0.2, *(pytest.param(f, marks=pytest.mark.slow) for f in (0.25, 0.4))])
def test_jumps_of_a_few_times_the_noise_are_measured(force):
    """Their size within a tenth; no jump alone, seen against the noise, would do."""
    found, record = _sawtooth(_stuck(_smooth(), force))
    assert found is not None
    assert found.cause == "stick-slip"
    assert found.value == pytest.approx(0.6 * force, rel=0.1)
    if force < 0.3:  # the gate on single jumps is blind to these
        assert "stick-slip" not in {f.cause for f in fired_on(Raw(record, 0.0, 1.5))}


def test_large_jumps_are_seen_one_by_one():
    """Where few of them fit into a stroke the gate on the raw data sees each."""
    _, record = _sawtooth(_stuck(_smooth(), 0.9))
    fired = {f.cause: f.value for f in fired_on(Raw(record, 0.0, 1.5))}
    assert fired["stick-slip"] == pytest.approx(0.54, rel=0.2)


@pytest.mark.slow
def test_other_errors_are_no_sawtooth():
    """Nothing, a wandering gain, steps now and then, ringing bursts: none has a sharp period."""
    y, t = _smooth()[::10], np.arange(INPUT.size) * DT
    rng = np.random.default_rng(7)
    leant = 0.35 * (np.searchsorted(np.sort(rng.uniform(0, 60, 24)), t) % 2)
    for wrong in (
        y,
        y * (1.0 + 0.02 * np.sin(2 * np.pi * t / 9.0)),
        y + leant,
        y + 0.25 * np.sin(2 * np.pi * 11 * t + 3 * np.sin(4.4 * t)) * (np.sin(t / 2.7) > 0.3),
    ):
        assert _sawtooth(wrong)[0] is None


def test_sticking_in_coarse_steps_at_one_rate_is_told_before_the_steps():
    """A valve: no slow motion to see single jumps in, and what it leaves was taken for noise."""
    turns = np.repeat(np.random.default_rng(7).uniform(0.1, 0.9, 60), 2)
    along = np.append(0.0, np.cumsum(np.abs(np.diff(turns))))
    u = np.interp(np.linspace(0.0, along[-1], 3600), along, turns)
    held, path = float(u[0]), []
    for wanted in u.tolist():
        if abs(wanted - held) > 0.04:
            held = wanted + 0.01 * np.sign(wanted - held)
        path.append(held)
    y = np.asarray(path) + 1e-3 * np.random.default_rng(8).standard_normal(u.size)
    time = 1.0 * np.arange(u.size)
    for step, found in ((0.004, ["stick-slip", "quantisation"]), (1e-6, ["stick-slip"])):
        run = pt.Run(time_s=time, input=u, output=step * np.round(y / step), input_unit="%", output_unit="%")
        answer = pt.diagnose(run, pt.identify(run, levels=32))
        assert answer.verdict == "stick-slip"
        assert [one.cause for one in answer.causes if one.found] == found
        size = next(one for one in answer.causes if one.cause == "stick-slip").parameters[0].value
        assert size == pytest.approx(0.05, rel=0.1)
