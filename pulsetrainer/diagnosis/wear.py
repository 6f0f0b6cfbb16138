"""What settles from the beginning of a record: heat in a short record, and a sudden change, look like it.

    y - (1 - e^(-x / l)) (k (y - y0) + b),    x the time, or the way of the input

As a rival of heat only the gain wears off (b = 0). Such wear is no cause of the library: one record cannot
distinguish it from a gain that wanders. If it fits as well as the heat that was found, that heat does not go
into a model, which would carry it into the next record. What settles is no step either, and is not taken out
of the record as one.
"""

from __future__ import annotations

from itertools import product
from typing import ClassVar

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.thermal_drift import ThermalDrift
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit
from pulsetrainer.diagnosis.noise import doubt
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


class Wear(Cause):
    """A gain that falls with time, or with the way of the input."""

    id = "wear"
    stage = "output"
    order = ThermalDrift.order  # in its place
    family = "slow gain"
    title = formula = signature = excitation = source = ""
    parameters: ClassVar[tuple[Quantity, ...]] = (
        Quantity("share", "1", *LIMITS.worn_shares, LIMITS.worn_step, "share of the {output} that is lost"),
        Quantity(
            "length", "1", *LIMITS.worn_lengths, LIMITS.worn_step, "of the record, until it has followed"
        ),
    )

    def __init__(self, *, by_way: bool, zero: float) -> None:
        self._by_way = by_way
        self._zero = zero  # of the range of the output, from that of empty memory: where a gain does nothing

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) of the gain, and of the zero, that are left."""
        done = frame.path if self._by_way else frame.time_s
        share, length, *shift = values
        zero = frame.zero + self._zero * (frame.ends[1] - frame.ends[0])
        lost = share * (y - zero) + sum(shift) * frame.span
        return np.asarray(y + np.expm1(-done / (length * done[-1])) * lost)


class Settling(Wear):
    """The same, of the zero as well: what a sudden change of both looks like."""

    parameters = (
        *Wear.parameters,
        Quantity("shift", "1", *LIMITS.worn_shares, LIMITS.worn_step, "of the span, by which the zero falls"),
    )


def is_as_good(state: State, term: Term) -> bool:
    """Whether what settles fits as well in the place of a cause that was found and may look like it."""
    if term.cause.wears_about is None:
        return False
    current, without = state.current, state.without[term.cause.id]
    for worn in _begun(term, state.problem.frames[0].length_s):
        trial = refit(state.problem, (*without.terms, worn), without)
        if trial.squares - current.squares < doubt(current, trial, state.scores.noise):
            return True
    return False


def _begun(term: Term, length_s: float) -> list[Term]:
    """What settles, at the lengths from which it is fitted."""
    zero = term.cause.wears_about or 0.0
    lengths: tuple[float, ...] = LIMITS.worn_within
    if term.cause.sudden:  # it may have settled as quickly as that
        lengths = (*lengths, max(term.values[-1] / length_s, LIMITS.worn_lengths[0]))
    pairs = product((False, True), lengths)
    if term.cause.moves_zero:
        return [Term(Settling(by_way=way, zero=zero), (LIMITS.worn, length, 0.0)) for way, length in pairs]
    return [Term(Wear(by_way=way, zero=zero), (LIMITS.worn, length)) for way, length in pairs]
