"""The part of a model that has an inverse: all of a direct or dual model, a range of a signed one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pulsetrainer.artefacts import Model
from pulsetrainer.artefacts.units import with_unit
from pulsetrainer.core import excitations, inversion
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.monotone import invertible_range
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.errors import ArgumentError, DataError

CONDITIONING_TIME_S = 0.5  # for each way of the major loop that comes first
REST_S = 0.2
# Times the rms error of the fit: a branch of a signed model that turns back less is monotone.
_TURNS_BACK = 2.0
_ROUNDING = 1e-9  # of the range of the input


@dataclass(frozen=True, slots=True)
class Invertible:
    """Where a model is inverted, and how."""

    whole: Preisach | Dual
    low: float  # ends of the input
    high: float
    reach: tuple[float, float]  # outputs, rising
    polarity: int
    lead: FloatArray  # (n,) input that wipes out whatever came before and ends at ``low``
    tail: FloatArray  # (m,) input back to the rest of the whole model
    inverse: Callable[[FloatArray], inversion.Inverse]  # after the lead

    def limits(self, model: Model) -> str:
        """Say in words where the inverse exists."""
        u, y = (f"{a:.4g} .. {b:.4g}" for a, b in ((self.low, self.high), self.reach))
        return (
            f"the inverse exists for the {model.output_quantity} in {with_unit(y, model.output_unit)}, "
            f"with the {model.input_quantity} in {with_unit(u, model.input_unit)}"
        )

    def around(self, model: Model) -> str:
        """Say in words how far the drive goes before and after, empty where that is no further."""
        if (self.low, self.high) == (self.whole.low, self.whole.high):
            return ""
        ends = with_unit(f"{self.whole.low:.4g} .. {self.whole.high:.4g}", model.input_unit)
        return f"; before and after the pulse the drive goes over all of {ends}, to wipe out what came before"


def major_loop(low: float, high: float, rate_Hz: float) -> FloatArray:
    """Input (n,) that wipes out whatever came before and ends at its low end."""
    speed = (high - low) / CONDITIONING_TIME_S
    return excitations.conditioning(low, high, speed=speed, rate_Hz=rate_Hz, rest_s=REST_S)


def invertible(model: Model, rate_Hz: float) -> Invertible:
    """Return the part of a model that can be inverted; DataError where branches of a signed one never are."""
    whole = operator_of(model)
    if isinstance(whole, Dual):
        return _recorded(whole, model, rate_Hz)
    loop = major_loop(whole.low, whole.high, rate_Hz)
    if whole.signed:
        return _within(whole, model, loop, rate_Hz)
    low, high = sorted(whole.saturation)
    inverse = partial(inversion.invert, whole)
    return Invertible(whole, whole.low, whole.high, (low, high), whole.polarity, loop, np.zeros(0), inverse)


def _recorded(whole: Dual, model: Model, rate_Hz: float) -> Invertible:
    """Return a dual model within the inputs that it was fitted to: its own ends follow from the weights."""
    low, high, seen = whole.low, whole.high, model.known
    if seen is not None:
        low, high = max(low, seen.input_low), min(high, seen.input_high)
    loop = major_loop(low, high, rate_Hz)
    outputs = whole(loop)
    below, above = sorted((float(outputs[np.argmax(loop)]), float(outputs[-1])))

    def inverse(target: FloatArray) -> inversion.Inverse:
        found = whole.inverse(target, loop)
        beyond = np.maximum(low - found.input, found.input - high) > _ROUNDING * (high - low)
        clipped = max(found.clipped, int(np.sum(beyond)))  # a target out of reach is beyond both
        return replace(found, input=np.clip(found.input, low, high), clipped=clipped)

    return Invertible(whole, low, high, (below, above), whole.polarity, loop, np.zeros(0), inverse)


def _within(whole: Preisach, model: Model, loop: FloatArray, rate_Hz: float) -> Invertible:
    """Return the range of a signed model in which the output moves most and all branches are monotone."""
    error = model.fit.rms if model.fit else 0.0
    try:
        found = invertible_range(whole, _TURNS_BACK * error)
    except ArgumentError as none:
        raise DataError(none.message, hint=none.hint) from none
    held = found.operator
    speed = (whole.high - whole.low) / CONDITIONING_TIME_S
    way = excitations.through(found.lead, speed, rate_Hz)
    back = excitations.through((held.low, whole.low), speed, rate_Hz) if held.low > whole.low else np.zeros(0)
    low, high = sorted(held.saturation)
    lead, inverse = np.concatenate((loop, way)), partial(inversion.invert, held, monotone=True)
    return Invertible(whole, held.low, held.high, (low, high), held.polarity, lead, back, inverse)
