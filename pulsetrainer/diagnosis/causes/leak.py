"""the output leaks away while it is held: z' = y' - k z, as behind a charge amplifier or an AC coupling.

Whatever is held long enough falls back to one value. How much had leaked before a record began is not known,
so it is a parameter, for each record of its own; where the device's zero was, no record shows. If the input
begins at zero, what is left of the corrected output without an input is that one value. The rows of the
weights pass the leak: it may take away most of the output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.core import wild
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Taken, Values, spread
from pulsetrainer.diagnosis.causes.frame import Frame, low_pass

_FASTEST = 0.5  # 1/s: the fastest leak that is tried
_SLOWEST = 0.3  # over a record: of the output that is held, as much is gone in the slowest one
_RATIO = 3.0  # from one that is tried to the next
_AT_ZERO = 0.02  # of the input's range: where it begins so near to zero, the empty memory has no input


class Leak(Cause):
    """A first-order high-pass after the hysteresis."""

    id = "leak"
    title = "the {output} leaks away while it is held (charge amplifier, AC coupling)"
    formula = "z' = y' - k z, as z = y0 + (y - y0) - LP(y - y0; 1/k) + b (e^-kt - 1)"
    signature = "after every move, the output falls back towards one and the same value"
    excitation = "stops on several levels, as long as the leak takes"
    source = "Gautschi, Piezoelectric Sensorics, 2002, section 11.2: time constant of a charge amplifier"
    stage = "output"
    order = 115
    family = "slow memory"
    in_rows = True
    parameters = (
        Quantity("rate", "1/s", 0.0, 2.0, 1e-4, "1 over the time in which a held {output} falls to 37 %"),
        Quantity("before", "{y}", -1.5, 1.5, 1e-3, "what it was off by when the recording began"),
    )
    lasting = False
    corrects = True

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """One rate; what had leaked before each record, by its number."""
        rate, before = self.parameters
        later = [replace(before, name=f"{before.name} {k + 1}") for k in range(1, frame.records)]
        return rate, before, *later

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        none = (0.0,) * frames[0].records
        return [[(one, *none)] for one in spread(_SLOWEST / frames[0].length_s, _FASTEST, _RATIO)]

    def can_be_told(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether what is held falls back: a leak slower than any that is tried is a drift."""
        return any(values[0] * frame.length_s >= _SLOWEST / _RATIO for frame in frames)

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        rate, before = values[0], values[1 + frame.record]
        if rate <= 0.0:
            return y
        moved = y - frame.zero
        slow = np.apply_along_axis(low_pass, 0, moved, 1.0 / rate, frame.dt_s, np.zeros(2))
        gone = np.expm1(-rate * np.arange(y.shape[0]) * frame.dt_s)
        # a row of the design is what one weight adds, and nothing of it was there before
        return np.asarray(y - slow + (before * gone if y.ndim == 1 else 0.0))

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) as it was before it leaked, exact where that is straight between samples."""
        rate, before = values[0], values[1 + taken.record]
        if rate <= 0.0:
            return y
        held = wild.repaired(y, ~np.isfinite(y)) - taken.empty
        steps = rate * np.diff(taken.time_s)
        left = np.exp(-steps)
        moves = (held[1:] - left * held[:-1]) * steps / (1.0 - left)
        whole = taken.empty + held[0] + np.append(0.0, np.cumsum(moves)) + rate * before * taken.time_s
        reach = taken.raw.high - taken.raw.low
        # without an input nothing is held, and the output is where all that is held falls back to
        unloaded = abs(taken.raw.low) <= _AT_ZERO * reach
        return np.where(np.isfinite(y), whole - before * unloaded, np.nan)
