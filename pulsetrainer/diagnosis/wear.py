"""A gain that wears off: what heat looks like in a recording that was too short for it, or never rests.

    y - k (1 - e^(-x / l)) (y - y0),    x the time, or the way of the input

It is no cause of the library: one record does not tell wear from a gain that wanders. Where it fits as well
as heat, that does not go into a model, which would go on with it in the next record.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Frame, Quantity, Values
from pulsetrainer.diagnosis.causes.thermal_drift import ThermalDrift
from pulsetrainer.diagnosis.doubt import doubt
from pulsetrainer.diagnosis.extended import Term
from pulsetrainer.diagnosis.fitting import refit
from pulsetrainer.diagnosis.state import State
from pulsetrainer.diagnosis.thresholds import LIMITS


class Wear(Cause):
    """A gain that falls with time, or with the way of the input."""

    id = "wear"
    stage = "output"
    order = ThermalDrift.order  # in its place
    family = "slow gain"
    title = formula = signature = excitation = source = ""
    parameters = (
        Quantity("share", "1", *LIMITS.worn_shares, LIMITS.worn_step, "share of the {output} that is lost"),
        Quantity(
            "length", "1", *LIMITS.worn_lengths, LIMITS.worn_step, "of the record, until it has followed"
        ),
    )

    def __init__(self, *, by_way: bool, zero: float) -> None:
        self._by_way = by_way
        self._zero = zero  # of the range of the output, from that of empty memory: where a gain does nothing

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        """Output (n,) of the gain that is left."""
        done = frame.path if self._by_way else frame.time_s
        share, length = values
        zero = frame.zero + self._zero * (frame.ends[1] - frame.ends[0])
        return np.asarray(y + share * np.expm1(-done / (length * done[-1])) * (y - zero))


def is_as_good(state: State, term: Term) -> bool:
    """Whether wear fits as well in the place of a cause that was found, where it may look like that."""
    zero = term.cause.wears_about
    if zero is None:
        return False
    current, without = state.current, state.without[term.cause.id]
    for by_way, length in product((False, True), LIMITS.worn_within):
        worn = Term(Wear(by_way=by_way, zero=zero), (LIMITS.worn, length))
        trial = refit(state.problem, (*without.terms, worn), without)
        if trial.squares - current.squares < doubt(current, trial, state.scores.noise):
            return True
    return False
