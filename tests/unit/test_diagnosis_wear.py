"""A gain that wears off, in the place of heat."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import wear
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Frame
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit, weights_for
from pulsetrainer.diagnosis.problem import problem_for

STEP_S = 0.02
HEAT = library()["thermal-drift"]


def _loops() -> np.ndarray:
    """Shrinking loops from 0, thrice, without a rest."""
    tips = np.stack((np.linspace(1.0, 0.3, 10), np.linspace(0.0, 0.25, 10)), axis=1).ravel()
    return np.interp(np.arange(4000), np.linspace(0, 3999, 61), np.append(0.0, np.tile(tips, 3)))


def test_the_formula():
    """A share of what is above the zero is lost, by 1/e of it in a length of the whole way, or time."""
    u = _loops()
    frame = Frame(STEP_S, u, 1.0, 1.0, ends=(-1.0, 1.0), zero=-1.0)
    for by_way, done in ((True, frame.path / frame.path[-1]), (False, np.linspace(0, 1, u.size))):
        shown = wear.Wear(by_way=by_way, zero=0.5).on_output(u, (0.3, 0.4), frame)
        np.testing.assert_allclose(shown, u * (1.0 - 0.3 * (1.0 - np.exp(-done / 0.4))), atol=1e-12)


@pytest.mark.parametrize("worn", [True, False])
def test_wear_is_as_good_where_it_is_the_truth(worn):
    """And not where heat is, in the same loops."""
    u = _loops()
    y = 3.0 * u + 0.5 * u**2
    way = np.cumsum(np.abs(np.diff(u, prepend=0.0)))
    frame = Frame(STEP_S, u, float(np.ptp(y)), 1.0)
    cooler = HEAT.on_output(y, (0.3, 20.0), frame)
    record = Record(u, y * (1.0 - 0.1 * (1.0 - np.exp(-way / 15.0))) if worn else cooler, dt_s=STEP_S)
    problem = problem_for([record], 0.0, 1.0)
    without = weights_for(problem, (), None)
    (term,) = refit(problem, (Term(HEAT, (0.1, 20.0)),), without).terms
    current = refit(problem, (term,), without)
    state = SimpleNamespace(
        problem=problem,
        current=current,
        without={HEAT.id: without},
        scores=SimpleNamespace(noise=None),  # exact: the better one fits better
    )
    assert current.squares < 0.1 * without.squares
    assert wear.is_as_good(state, term) is worn
