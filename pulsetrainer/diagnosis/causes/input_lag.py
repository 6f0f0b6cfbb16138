"""the input is smoothed by its sensor or filter: P[u + tau u'].

The recorded u trails the true one, v: tau u' + u = v. A slow thermometer in a device that heats up and cools
down is one. To undo the lag its slope is needed, and noise has steep slopes: it is taken off before.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import input_noise
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Taken, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.late import RecordedLate

_NOISE = 1e-3  # of the range: slopes are taken over as many samples as leave less of it than that
_WINDOW = 0.5  # of the time constant: over no more than that
_HALF = 0.5  # of a time step: 1 / (exp(dt / tau) - 1) is about tau / dt less that
_SLOPE = 1.2247  # sqrt(1.5): a slope over h samples to either side has this error times the noise, over h^1.5


class InputLag(RecordedLate):
    """A first-order lag of the input's recorder."""

    id = "input-lag"
    title = (
        "the {input} is smoothed (by a slow sensor, by its filter): the {output} seems to answer before it"
    )
    formula = "P[u + tau u']"
    signature = "the output answers before the input moves; the recorded input has no sharp turn"
    stage = "input"
    order = 10
    parameters = (Quantity("tau", "s", 0.0, 0.5, 0.0005, "time constant of the input's recorder"),)

    def __init__(self, *, steps: bool = False) -> None:
        self._steps = steps  # as a digital filter computes it: the slope is that before the sample

    def alternatives(self) -> tuple[Cause, ...]:
        """Filters of converters go from sample to sample: half a time step apart."""
        return (InputLag(steps=True),)

    def on_input(self, u: FloatArray, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        if "clean" not in frame.kept:
            cleaned = input_noise.clean(u)
            frame.kept["clean"], frame.kept["noise"] = cleaned.input, np.asarray(cleaned.sigma)
        return _restored(
            frame.kept["clean"], values[0] / frame.dt_s, float(frame.kept["noise"]), steps=self._steps
        )

    def undo_input(self, u: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Input (n,) before its lag."""
        cleaned = input_noise.clean(u)
        return _restored(cleaned.input, values[0] / taken.raw.record.step, cleaned.sigma)


def _restored(u: FloatArray, lag: float, sigma: float, *, steps: bool = False) -> FloatArray:
    """Return u + tau u' (n,) for a time constant of ``lag`` time steps and noise of ``sigma``, input unit.

    With ``steps`` it went from sample to sample: the lag is half a step shorter, the slope as much earlier.
    """
    allowed = _NOISE * float(np.ptp(u))
    needed = np.cbrt(_SLOPE * lag * sigma / allowed) ** 2 if sigma > 0 and allowed > 0 else 1.0
    half = int(np.clip(needed, 1.0, max(0.5 * _WINDOW * lag, 1.0)))
    window = 2 * half + 1
    if 2 * window > u.size:
        return u
    slope = scipy.signal.savgol_filter(u, window, min(half, 2), deriv=1)
    if steps:
        slope[1:] = 0.5 * (slope[1:] + slope[:-1])
        lag = max(lag - _HALF, 0.0)
    return _with_turns(u + lag * slope, half)


def _with_turns(u: FloatArray, half: int) -> FloatArray:
    """Return u (n,) with turns as sharp as they were before means over half a window to either side.

    A line through what lies before goes on to the turn, as does one through what comes after it. Where both
    leave the mean to one side, the nearer of them is taken.
    """
    held = np.pad(u, 2 * half, mode="edge")
    before = 2.0 * held[half : half + u.size] - held[: u.size] - u
    after = 2.0 * held[-half - u.size : -half] - held[-u.size :] - u
    nearer = np.where(np.abs(before) < np.abs(after), before, after)
    return u + np.where(before * after > 0, nearer, 0.0)
