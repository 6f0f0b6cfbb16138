"""the output creeps on under a constant input: a low-pass, or a bank of three or five.

One time constant stands for a single process, such as air that passes a gap. Three or five stand for the many
time constants of a solid, over one decade of time or over two. All kinds are tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import OfKinds, Quantity, Values, spread
from pulsetrainer.diagnosis.causes.frame import Frame

_TRIED = 0.03  # amplitude
_FASTEST_S = 0.1  # the fastest middle time constant
_SLOWEST = 1.0 / 30.0  # of the record: the slowest middle time constant ...
_SHORT = (3.0, 1.0 / 6.0)  # ... but up to these in a short record: in s, and as a share of the record
_RATIO = 10**0.5  # from one time constant tried to the next
_BOUND = 0.2  # of the record: the slowest time constant that a refit reaches
_RATIOS = (0.25, 4.0)  # of the outer time constants of three to the middle one
_DECADES = (0.1, 10**-0.5, 10**0.5, 10.0)  # of the outer ones of five
_EQUAL = 1.0 / 3.0  # share of the middle time constant of three ...
_OTHER = 0.5  # ... and one that is as plausible
_FIVE = 0.2  # share of the middle one of five ...
_UNEVEN = 0.3  # ... and one that is as plausible
_ALONE = 1.0  # share of a time constant alone ...
_NEARLY = 0.75  # ... and one that is as plausible


class Creep(OfKinds):
    """Slow relaxation: one low-pass, or several on a logarithmic grid of time constants."""

    id = "creep"
    title = "the {output} creeps on under a constant {input}"
    formula = "(y + a mean_k LP(y; tau_k)) / (1 + a), tau_k = tau/4, tau, 4 tau, or tau/10 to 10 tau, or tau"
    signature = "the output keeps moving towards a new value while the input rests"
    excitation = "holds of three time constants after reversals, on several levels"
    source = "Kuhnen and Krejci, IEEE Trans. Automatic Control 54, 2009: creep as a bank of low-passes"
    stage = "output"
    order = 80
    family = "slow memory"
    scales = True
    number = "middle"
    meant = (
        "share of that time constant; 0.333: tau/4 and 4 tau have as much each; 0.2: so have four from "
        "tau/10 to 10 tau (1: it is the only one)"
    )
    tried = (_EQUAL, _ALONE, _FIVE)  # shares of the middle time constant
    common = True
    parameters = (
        Quantity(
            "amplitude", "1", -0.3, 0.6, 0.002, "the part that follows slowly, relative to the part at once"
        ),
        Quantity("tau", "s", 0.04, 20.0, 0.02, "time constant; of several, the middle one"),
    )

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        strength, tau = self.parameters
        low = min(tau.low, frame.dt_s)
        return strength, replace(tau, low=low, high=max(_BOUND * frame.length_s, 2.0 * tau.low))

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        length = frames[0].length_s
        slowest = max(_SLOWEST * length, min(_SHORT[0], _SHORT[1] * length))
        return [[(_TRIED, tau)] for tau in spread(_FASTEST_S, slowest, _RATIO)]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        return self._crept(y, values, frame, self.kind)

    def variants(self, y: FloatArray, values: Values, frame: Frame) -> list[FloatArray]:
        """Another share of the middle time constant: no record tells the shares of all of them."""
        other = {_EQUAL: _OTHER, _FIVE: _UNEVEN, _ALONE: _NEARLY}[self.kind]
        return [self._crept(y, values, frame, other)]

    def shapes_strokes(self, values: Values, frames: Sequence[Frame]) -> bool:
        return all(one.is_within_stroke(values[1]) for one in frames)

    def _crept(self, y: FloatArray, values: Values, frame: Frame, middle: float) -> FloatArray:
        """Creep with a share ``middle`` of its amplitude in the middle time constant."""
        slow = middle * frame.low_pass(y, values[1], "creep")
        outer = _DECADES if self.kind == _FIVE else _RATIOS
        for ratio in outer if middle < _ALONE else ():
            part = frame.low_pass(y, values[1] * ratio, f"creep {ratio:g}")
            slow = slow + (1.0 - middle) / len(outer) * part
        return np.asarray((y + values[0] * slow) / (1.0 + values[0]))
