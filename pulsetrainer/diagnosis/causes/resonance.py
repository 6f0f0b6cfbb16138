"""the output follows like a damped oscillator: y'' + 2 zeta w y' + w^2 y = w^2 P[u], w = 2 pi f."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.input_noise import real_turns
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame

_TRIED_Hz = (3.0, 80.0, 20)  # frequencies: from, to, how many
_TRIED_DAMPING = (0.07, 0.25)  # one that rings for long, and one that rings shortly
_FASTEST = 0.2  # of the sample rate: faster ringing is not sampled
_KEPT = 128  # filters kept in memory: the grid above and those of some fits
_TURN = 0.02  # of the range: smaller turns of the input are noise
_PERIODS = 3.0  # that fit between the two turns farthest apart: with fewer no ringing can be seen


class Resonance(Cause):
    """A second-order oscillator driven by the output."""

    id = "resonance"
    title = "the {output} follows like a damped oscillator: it rings or overshoots"
    formula = "y'' + 2 zeta w y' + w^2 y = w^2 P[u], w = 2 pi f"
    signature = "a decaying oscillation of one frequency after every stop, whatever the rate before it"
    excitation = "fast stops"
    source = "Ogata, Modern Control Engineering, section 5.3"
    stage = "output"
    order = 70
    family = "resonance"
    scales = True
    strengths = 0
    in_rows = True
    parameters = (
        Quantity("frequency", "Hz", 1.0, 200.0, 0.1, "of the ringing"),
        Quantity("damping", "1", 0.01, 0.7, 0.005, "ratio: near 0 it rings for long, at 1 not at all"),
    )

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        fastest = _FASTEST / frames[0].dt_s
        grid = np.geomspace(*_TRIED_Hz).tolist()
        return [[(f, zeta)] for f in grid if f < fastest for zeta in _TRIED_DAMPING]

    def can_be_told(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether the input leaves it alone for some periods: else the loop itself leads or lags."""
        return any(values[0] * _longest_stroke_s(frame) >= _PERIODS for frame in frames)

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        b, a = _filter(*values, frame.dt_s)
        at_first = np.multiply.outer(scipy.signal.lfilter_zi(b, a), y[0])
        state = frame.remembered(self.id, at_first)
        moved, state = scipy.signal.lfilter(b, a, y, axis=0, zi=state)
        frame.remember(self.id, state)
        return np.asarray(moved)


def _longest_stroke_s(frame: Frame) -> float:
    """Longest time between two turns of the input, with the rests in it."""
    turns = real_turns(frame.input, _TURN * frame.reach)
    return float(np.diff(turns, prepend=0, append=frame.input.size - 1).max()) * frame.dt_s


@lru_cache(maxsize=_KEPT)
def _filter(frequency: float, damping: float, dt_s: float) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the oscillator, exact for an output that is straight between samples."""
    turn = 2.0 * np.pi * frequency
    oscillator = (np.asarray([turn**2]), np.asarray([1.0, 2.0 * damping * turn, turn**2]))
    b, a, _ = scipy.signal.cont2discrete(oscillator, dt_s, method="foh")
    return b.ravel(), a
