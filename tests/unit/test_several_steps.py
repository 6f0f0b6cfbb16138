"""Several steps of one record: as many as there are, and none that something else explains."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit, weights_for
from pulsetrainer.diagnosis.problem import problem_for
from pulsetrainer.diagnosis.several_steps import fitted_with

DT_S, NOISE = 0.01, 0.002
STEP = library()["step"]


def _state(changed):
    """Ninety loops of two widths, and what changes their output; 90 s."""
    turns = np.tile([0.0, 1.5, 0.4, 1.1], 45)
    u = np.interp(np.arange(9000) * DT_S, np.linspace(0.0, 90.0, turns.size), turns)
    at, y = 0.0, []
    for one in u.tolist():  # one play
        at = min(max(at, one - 0.2), one + 0.2)
        y.append(at)
    t = np.arange(u.size) * DT_S
    output = changed(np.asarray(y), t) + NOISE * np.random.default_rng(7).standard_normal(u.size)
    problem = problem_for([Record(u, output, dt_s=DT_S)], 0.0, 1.5)
    current = weights_for(problem, (), None)
    count = problem.bins.count
    floor = SimpleNamespace(quick=SimpleNamespace(squares=1e-6 * count), relevant=3e-6 * count)
    return SimpleNamespace(problem=problem, current=current, floor=floor)


@pytest.mark.parametrize(
    "jumps",
    [
        ((25.0, 0.05), (60.0, 0.05)),
        ((25.0, 0.05), (60.0, -0.05)),
        ((20.0, 0.04), (45.0, 0.03), (70.0, 0.05)),
        ((15.0, 0.05), (35.0, 0.04), (55.0, 0.05), (75.0, 0.04)),
    ],
)
def test_as_many_are_found_as_there_are(jumps):
    """Each within a twentieth of its size and 0.1 s; no gain changes."""
    state = _state(lambda y, t: y + sum(size * (t > moment) for moment, size in jumps))
    fitted = fitted_with(state, STEP, [])
    (term,) = fitted.terms
    found = STEP.each(term.values)
    assert [one[0] for one in found] == pytest.approx([size for _, size in jumps], rel=0.05)
    assert [one[2] for one in found] == pytest.approx([moment for moment, _ in jumps], abs=0.1)
    assert max(abs(one[1]) for one in found) < 0.003


@pytest.mark.parametrize(
    "changed",
    [
        lambda y, t: y,
        lambda y, t: y + 0.05 * (t > 40.0),  # one step is tried as such
        lambda y, t: y + 0.1 * t / t[-1],
        lambda y, t: y * (1.0 + 0.1 * t / t[-1]),
    ],
)
def test_there_are_none_where_one_cause_is_as_good(changed):
    """Nothing, one step, a drift of the zero, a drift of the gain."""
    state = _state(changed)
    begun = {"offset-drift": (1e-3, 0.0), "gain-drift": (1e-3, 0.0, 1e-3), "step": (0.05, 0.0, 40.0)}
    terms = [Term(library()[name], values) for name, values in begun.items()]
    others = [refit(state.problem, (term,), state.current) for term in terms]
    assert fitted_with(state, STEP, others) is None
