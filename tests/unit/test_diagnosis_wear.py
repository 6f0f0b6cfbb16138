"""A gain that wears off, in the place of heat."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import wear
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit, weights_for
from pulsetrainer.diagnosis.problem import problem_for

STEP_S = 0.02
HEAT, STEP = library()["thermal-drift"], library()["step"]


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
        lost = 1.0 - np.exp(-done / 0.4)
        np.testing.assert_allclose(shown, u * (1.0 - 0.3 * lost), atol=1e-12)
        shown = wear.Settling(by_way=by_way, zero=0.5).on_output(u, (0.3, 0.4, 0.2), frame)
        np.testing.assert_allclose(shown, u * (1.0 - 0.3 * lost) - 0.2 * lost, atol=1e-12)


@pytest.mark.parametrize("worn", [True, False])
def test_wear_is_as_good_where_it_is_the_truth(worn):
    """And not where heat is, in the same loops."""
    u = _loops()
    y = 3.0 * u + 0.5 * u**2
    way = np.cumsum(np.abs(np.diff(u, prepend=0.0)))
    frame = Frame(STEP_S, u, float(np.ptp(y)), 1.0)
    cooler = HEAT.on_output(y, (0.3, 20.0), frame)
    wears = y * (1.0 - 0.1 * (1.0 - np.exp(-way / 15.0)))
    assert _as_good(u, wears if worn else cooler, Term(HEAT, (0.1, 20.0))) is worn


@pytest.mark.parametrize("at", [0.1, 0.5])
@pytest.mark.parametrize("settles", [True, False])
def test_what_settles_is_no_step_and_a_step_is_not_what_settles(settles, at):
    """The gain and the zero settle, or change at a moment."""
    u = _loops()
    y = 3.0 * u + 0.5 * u**2
    way = np.linspace(0.0, 1.0, u.size)
    moved = np.exp(-way / at) if settles else way < at
    length_s = u.size * STEP_S
    term = Term(STEP, (-0.05, -0.03, at * length_s))
    assert _as_good(u, y + (0.03 * y + 0.05) * moved, term, held=0.7) is settles


def _as_good(u: np.ndarray, y: np.ndarray, begun: Term, held: float = 0.1) -> bool:
    """Whether what settles is as good as a cause, of which a refit leaves a share of the squares."""
    problem = problem_for([Record(u, y, dt_s=STEP_S)], 0.0, 1.0)
    without = weights_for(problem, (), None)
    (term,) = refit(problem, (begun,), without).terms
    current = refit(problem, (term,), without)
    assert current.squares < held * without.squares
    state = SimpleNamespace(
        problem=problem,
        current=current,
        without={term.cause.id: without},
        scores=SimpleNamespace(noise=None),  # exact: the better one fits better
    )
    return wear.is_as_good(state, term)
