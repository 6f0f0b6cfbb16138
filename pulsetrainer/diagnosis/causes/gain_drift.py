"""the gain drifts slowly with time, and the zero may do so as well: y + b t + c t (t - T) + g t (y - y0).

A sensor loses its sensitivity, a magnet ages, a supply runs down. y0 is the output of empty memory. A gain
that drifts about another zero moves that output as well, so this is the formula of a drift of the zero with
one term more, and takes its place only where noise cannot make the difference (`stages.exchange`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Taken, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.offset_drift import OffsetDrift

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.finding import Estimate

_TRIED = 0.01  # of the gain over the record
_MOST = 0.9  # of the gain over the longest record: with more nothing would be left of the output


class GainDrift(Cause):
    """A gain that moves with time."""

    id = "gain-drift"
    title = "the gain of the {output} drifts slowly with time"
    formula = "y + b t + c t (t - T) + g t (y - y0)"
    signature = "all loops differ from the first by a gain that changes evenly with time"
    excitation = "the same loop at the beginning, in the middle and at the end"
    source = "Ljung, System Identification, 1999, section 14.1"
    stage = "output"
    order = 125
    family = "slow gain"
    drifts = True
    strengths = 3
    parameters = (
        *OffsetDrift.parameters[:2],
        Quantity("gain", "1/s", -1e6, 1e6, 1e-5, "change of the gain in a second, as a share of it"),
    )
    lasting = False
    corrects = True
    _zero = OffsetDrift()

    def coarser(self) -> Cause | None:
        """A drift of the zero alone."""
        return self._zero

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        *zero, gain = self.parameters
        most = _MOST / frame.length_s
        return (*zero, replace(gain, low=-most, high=most))

    def strengths_of(self, parameters: Sequence[Estimate]) -> Sequence[Estimate]:
        """Return the drift of the gain: without it this is another cause."""
        return parameters[2:]

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        (block,) = self._zero.starts(frames, residual)
        return [[*((*values, 0.0) for values in block), (0.0, 0.0, _TRIED / frames[0].length_s)]]

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        *zero, gain = values
        moved = self._zero.on_output(y, tuple(zero), frame)
        return np.asarray(moved + gain * frame.time_s * (y - frame.zero))

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) with the gain and the zero of the first sample."""
        *zero, gain = values
        still = self._zero.undo(y, tuple(zero), taken)
        return taken.empty + (still - taken.empty) / (1.0 + gain * taken.time_s)
