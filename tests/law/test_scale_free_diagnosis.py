"""Diagnosis knows no unit: time, input and output may be multiplied, shifted, or sampled ten times as fast.

    t -> k t,    u -> a u + b,    y -> c y + d

leave the verdict, the causes found and the gain as they are, and transform the parameters.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.procedure import diagnose
from pulsetrainer.diagnosis.scale import Scale
from pulsetrainer.diagnosis.state import Question, State

DATA = Path(__file__).resolve().parents[1] / "data"
DT_S = 0.01
INPUT = excitations.diagnostic(0.0, 1.0, rate_Hz=1 / DT_S).value
# hidden causes whose parameters transform, with their strengths where all scales are one
HIDDEN = {
    "output-lag": (0.03,),
    "creep": (0.1, 1.0),
    "thermal-drift": (0.1, 15.0),
    "viscous": (0.01, 0.0),
    "offset-drift": (0.0005,),
}
POWERS = st.floats(-9, 6).map(lambda power: 10.0**power)


def _operator() -> Preisach:
    plane = Plane.uniform(0.0, 1.0, 20)
    i, j = plane.cell_indices
    weights = 1.0 + np.exp(-(((i - j) / 20 - 0.25) ** 2) / 0.02)
    return Preisach(plane, weights * 0.5 / float((weights * plane.areas).sum()), 0.5)


def _output(cause: str) -> np.ndarray:
    frame = Frame(DT_S, INPUT, 1.0, 1.0)
    noise = 0.001 * np.random.default_rng(4).standard_normal(INPUT.size)
    return library()[cause].on_output(_operator()(INPUT), HIDDEN[cause], frame) + noise


@cache
def _plain(cause: str) -> State:
    """What is found where all scales are one."""
    return _found(cause)


def _found(
    cause: str, k: float = 1.0, a: float = 1.0, b: float = 0.0, c: float = 1.0, d: float = 0.0
) -> State:
    record = Record(a * INPUT + b, c * _output(cause) + d, dt_s=k * DT_S)
    return diagnose(Question([record], b, a + b, np.random.default_rng(0)))


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("cause", HIDDEN)
@settings(max_examples=2, deadline=None)
@given(k=POWERS, a=POWERS, b=st.floats(-10, 10), c=POWERS, d=st.floats(-10, 10))
def test_a_hidden_cause_is_the_same_in_all_units(cause, k, a, b, c, d):
    """From nanoseconds to weeks; its parameters are in those units."""
    first, moved = _plain(cause), _found(cause, k, a, a * b, c, c * d)
    scale = Scale(reach=a, span=c, second=k)
    assert moved.verdict == first.verdict == cause
    known = {one.cause.id: one for one in first.findings if one.found}
    found = {one.cause.id: one for one in moved.findings if one.found}
    assert set(found) == set(known)
    for name, one in found.items():
        before = known[name]
        assert one.held_out_gain_percent == pytest.approx(before.held_out_gain_percent, rel=0.01)
        assert one.explains_percent == pytest.approx(before.explains_percent, rel=0.01)
        for there, here in zip(one.parameters, before.parameters, strict=True):
            assert there.value == pytest.approx(scale.of_unit(here.unit) * here.value, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("power", [-30, 20])
def test_powers_of_two_of_the_time_change_nothing_at_all(power):
    """No digit of the gain, and none of the parameter but for that power."""
    moved, first = _found("output-lag", k=2.0**power), _plain("output-lag")
    (there,), (here,) = ([f for f in s.findings if f.found] for s in (moved, first))
    assert there.held_out_gain_percent == here.held_out_gain_percent
    assert there.parameters[0].value == here.parameters[0].value * 2.0**power


# --- measured records
def _measured(name: str, *, k=1.0, a=1.0, b=0.0, c=1.0, d=0.0, faster=1) -> pt.Run:
    t, u, y = np.loadtxt(DATA / f"{name}.csv", delimiter=",", skiprows=1).T
    at = np.arange(0, t.size - 1 + 1e-9, 1 / faster)
    t, u, y = (np.interp(at, np.arange(t.size), values) for values in (t, u, y))
    return pt.Run(time_s=k * t, input=a * u + b, output=c * y + d, input_unit="V", output_unit="mm")


def _told(fitted: str, asked: str, **moved):
    run = _measured(asked, **moved)
    return pt.diagnose(run, pt.identify(_measured(fitted, **moved), form="direct"))


@pytest.fixture(scope="module")
def as_measured():
    """What is said of records as they were measured: a tool, its load, a damper, a cylinder."""
    pairs = (("davinci_f0p3_torque10", "davinci_f0p5_torque10"),
             ("davinci_f0p1_torque10", "davinci_f0p3_torque40"),
             ("mrdamper_ensaio1_1", "mrdamper_ensaio1_1"))  # fmt: skip
    return {pair: _told(*pair) for pair in pairs}


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "moved",
    [
        {"k": 1e-9},
        {"k": 1e6},
        {"a": 1e3, "b": -7e3},
        {"c": -1e-4, "d": 3.0},
        {"faster": 10},
        {"k": 3e-7, "a": 0.01, "b": 5.0, "c": -77.0, "d": 1e3},
    ],
    ids=["fast", "slow", "input", "output", "ten samples for one", "all"],
)
def test_measured_records_are_told_the_same_in_all_units(as_measured, moved):
    """Verdict, causes and what is left of records that nobody here made."""
    for pair, first in as_measured.items():
        found = _told(*pair, **moved)
        assert found.verdict == first.verdict
        assert {one.cause for one in found.found} == {one.cause for one in first.found}
        left = 0.1 if "faster" in moved or "a" in moved else 0.01  # where rounding is noise, see below
        assert found.static_percent == pytest.approx(first.static_percent, rel=left)
