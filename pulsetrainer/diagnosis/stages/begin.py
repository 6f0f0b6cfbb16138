"""Begin: the model that goes on is also fitted to the beginning of the records, where it can be.

The after-effects of what a device did before a record decay in it, so the search fits the beginning of each
record freely (``design``). But a free beginning hides how a slow cause begins, and a model that is used
elsewhere has none: it starts from rest. So the causes that repeat are refitted without it. That refit becomes
the model on either of two conditions: its error over the whole record is not relevantly larger, or it
predicts what comes after the first fifth of each record better than the first fit does from rest. Otherwise
something was going on before the records, and the beginning stays free.

Both fits are of the same records, so the interval of a parameter covers the results of both. If that interval
then spans zero for all strengths of a cause, the cause is in doubt. So is a slow fault of the measurement
whose size differs by more than a factor of two: it has another course than its formula.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.diagnosis.finding import Estimate, Finding, may_be_nothing
from pulsetrainer.diagnosis.fitting import Fitted, refit
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.stages.parameters import estimates_of
from pulsetrainer.diagnosis.stages.rivals import MAY_BE_NOTHING, squares_moved
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS

TWO_SIZES = "two sizes"


def stage(state: State) -> State:
    """Return the state with the model that is passed on: the causes that repeat, and their parameters."""
    kept = state.repeated
    assert kept is not None
    if kept.terms:
        trial = refit(begins_at_rest(state.problem), kept.terms, None)
        if trial.squares - kept.squares < state.floor.relevant or late(trial) < late(kept):
            kept = trial
    if kept is state.current:
        return replace(state, repeated_estimates=state.estimates)
    told = state.in_its_units(estimates_of(kept, state.scores, state.held_out, state.floor))
    findings = tuple(
        _sized(state, kept, _told_by_both(one, told.get(one.cause.id, ()))) for one in state.findings
    )
    told = {name: _hull(rows, state.estimates.get(name, ())) for name, rows in told.items()}
    return replace(state, repeated=kept, repeated_estimates=told, findings=findings)


def begins_at_rest(problem: Problem) -> Problem:
    """Return a problem in which every record starts from rest, without a free beginning."""
    return replace(problem, bins=replace(problem.bins, begins_free=False))


def _told_by_both(found: Finding, others: tuple[Estimate, ...]) -> Finding:
    """Return a finding with the intervals of both fits, in doubt if its strength may then be zero.

    A slow fault is told by the fit from rest: a free beginning and a large drift may imitate another course.
    """
    first, second = found.parameters, others
    if others and _is_slow_fault(found):
        first, second = second, first
    both = replace(found, parameters=_hull(first, second))
    strengths = both.cause.strengths_of(both.parameters) if found.found else ()
    if not may_be_nothing(strengths) or MAY_BE_NOTHING in found.doubts:
        return both
    return replace(both, doubts=(*both.doubts, MAY_BE_NOTHING))


def _is_slow_fault(one: Finding) -> bool:
    return one.found and one.cause.drifts and not one.cause.lasting


def _sized(state: State, kept: Fitted, found: Finding) -> Finding:
    """Return a finding in doubt if it is a slow fault of which both fits tell another size.

    What wanders in another way than the formula says is imitated by a free beginning and a large drift.
    """
    terms = [
        [one for one in fitted.terms if one.cause.id == found.cause.id] for fitted in (state.current, kept)
    ]
    if not _is_slow_fault(found) or not all(terms):
        return found
    fits = zip((state.current, kept), terms, strict=True)
    low, high = sorted(squares_moved(replace(state, current=fitted), term) for fitted, (term,) in fits)
    return replace(found, doubts=(*found.doubts, TWO_SIZES)) if high > LIMITS.two_sizes**2 * low else found


def _hull(rows: tuple[Estimate, ...], others: tuple[Estimate, ...]) -> tuple[Estimate, ...]:
    """Return parameters with intervals that also cover those of another fit to the same records."""
    if [one.name for one in rows] != [one.name for one in others]:  # another number of curves
        return rows
    return tuple(
        replace(one, lower=min(one.lower, other.lower), upper=max(one.upper, other.upper))
        for one, other in zip(rows, others, strict=True)
    )


def late(fitted: Fitted) -> float:
    """Variance of what a model leaves after the first fifth of each record, if it starts from rest."""
    bins, left = fitted.problem.bins, fitted.problem.measured - fitted.simulated
    ends = np.asarray([bins.time_s[bins.record == k].max(initial=0.0) for k in range(len(bins.number))])
    return float(np.var(left[bins.time_s > LIMITS.begin_share * ends[bins.record]]))
