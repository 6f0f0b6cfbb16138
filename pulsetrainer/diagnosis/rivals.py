"""Which causes cannot be told from the one found: a name is unique only if the set has one member."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.screening import Score, Screen, screen

# At one rate these are all a loop a little wider than it is at rest.
_RATE_FAMILIES = ("lag", "viscous")
_CLOSEST = 3


def rivals(
    problem: Problem,
    fitted: Fitted,
    without: Fitted,
    term: Term,
    floor: Floor,
    lacks: Sequence[str],
    rng: np.random.Generator,
) -> tuple[str, ...]:
    """Causes that repair the data as well as ``term``, within the noise of the comparison.

    Parameters
    ----------
    fitted, without
        The joint fit with the term, and the one without it.
    lacks
        What the records lack, in the words of ``residual.excitation_limits``.
    """
    gain = without.squares - fitted.squares
    scores = screen(problem, without, rng, draws=20)
    margin = max(0.005 * gain, 0.3 * floor.relevant, 12.0 * fitted.squares / floor.count)
    found = []
    for score in scores.scores[:_CLOSEST]:
        if score.cause.id in (term.cause.id, *fitted.names) or score.gain < 0.5 * gain:
            continue
        trial = refit(problem, (*without.terms, Term(score.cause, score.start)), without, rounds=2)
        if trial.squares - fitted.squares < margin:
            found.append(score.cause.id)
    if "one single rate" in lacks and term.cause.family in _RATE_FAMILIES:
        alike = [c.id for c in library().values() if c.family in _RATE_FAMILIES and c is not term.cause]
        found += [name for name in alike if name not in (*found, *fitted.names)]
    return tuple(found)


def alike(best: Score, scores: Screen) -> tuple[str, ...]:
    """Causes whose columns are hardly to be told from those of the best: |cos| above 0.9."""
    return tuple(
        s.cause.id
        for s in scores.scores
        if s is not best and float(np.linalg.norm(best.basis.T @ s.basis, ord=2)) > 0.9
    )
