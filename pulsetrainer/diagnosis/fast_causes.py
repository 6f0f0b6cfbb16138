"""Causes as fast as the samples: a slow record shows how late they make the output, and little else."""

from __future__ import annotations

from collections.abc import Sequence

from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.causes.creep import Creep
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.late import Late
from pulsetrainer.diagnosis.causes.viscous import Viscous
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.thresholds import LIMITS


def fast_s(term: Term, frame: Frame) -> float | None:
    """Return the time constant or delay of a cause, if a record hardly shows any shorter one; else None."""
    if term.cause.sudden or term.cause.stage == "record":
        return None
    bounds = term.cause.quantities(frame)
    times = [(value, one.low) for value, one in zip(term.values, bounds, strict=True) if one.unit == "s"]
    shortest = LIMITS.fast_steps * frame.dt_s
    fast = [max(value, frame.dt_s) for value, low in times if value <= max(shortest, LIMITS.fast_low * low)]
    return min(fast, default=None)


def as_late(term: Term, frame: Frame) -> list[Term]:
    """Return creep for a fast lag, lags for a fast creep, that make the output as late; else nothing."""
    tau = fast_s(term, frame)
    if tau is None:
        return []
    share = LIMITS.fast_share
    if isinstance(term.cause, Creep):
        strength = max(term.values[0], 0.0)
        late = strength / (1.0 + strength) * term.values[1]
        return [Term(one, (late,)) for one in library().values() if isinstance(one, Late)]
    if isinstance(term.cause, Late):
        return [_creep(share, (1.0 + share) / share * term.values[0], frame)]
    return [_creep(share, tau, frame)] if isinstance(term.cause, Viscous) else []


def _creep(amplitude: float, tau: float, frame: Frame) -> Term:
    """Return creep with one time constant, within its bounds."""
    cause: Cause = Creep(max(Creep.tried))
    bound = cause.quantities(frame)[1]
    return Term(cause, (amplitude, min(max(tau, bound.low), bound.high)))


def beside_fast_creep(term: Term, terms: Sequence[Term], frame: Frame) -> bool:
    """Return whether a cause is as fast as the samples, beside a creep faster than any that is tried."""
    fastest = LIMITS.fast_low * Creep.parameters[1].low
    creep = any(isinstance(one.cause, Creep) and one.values[1] <= fastest for one in terms if one is not term)
    return creep and fast_s(term, frame) is not None
