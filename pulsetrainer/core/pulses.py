"""Pulse shapes: one period of a normalised pressure, made into a train of forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.excitations import check_size
from pulsetrainer.core.plane import FloatArray, ascending, finite_vector, positive
from pulsetrainer.errors import ArgumentError

FEWEST_SAMPLES = 4  # of a period


@dataclass(frozen=True, slots=True)
class Shape:
    """One period of a pulse: even or uneven samples, the first one comes again after ``period_s``."""

    name: str
    time_s: FloatArray  # (n,) from 0
    value: FloatArray  # (n,) any unit; 0..1 in the library
    source: str = ""
    feet_s: tuple[float, ...] = (0.0,)  # where its beats begin, from the first sample on
    unit: str = ""  # of the values, where it is known
    note: str = ""  # what a person should know of where it was read from

    def __post_init__(self) -> None:
        t = finite_vector("time", self.time_s, at_least=FEWEST_SAMPLES)
        value = finite_vector("value", self.value, at_least=FEWEST_SAMPLES)
        if t.size != value.size:
            raise ArgumentError(
                f"the waveform {self.name} needs one value for each time, got shapes {t.shape} of time and "
                f"{value.shape} of value",
                hint="give as many of both",
            )
        if not np.all(np.diff(t) > 0):
            k = int(np.flatnonzero(np.diff(t) <= 0)[0])
            raise ArgumentError(
                f"the time of the waveform {self.name} does not increase: {t[k + 1]:g} s after {t[k]:g} s",
                hint="sort the samples by time, each time once",
            )
        with np.errstate(over="ignore"):
            length, span = self.period_s, float(np.ptp(value))
        if not np.isfinite([length, span]).all():
            raise ArgumentError(
                f"the waveform {self.name} is too long or too high for numbers: {length:g} s, {span:g}",
                hint="give its time in s and values of any usual size",
            )
        feet = np.append(self.feet_s, length)
        if feet[0] != 0.0 or not np.all(np.diff(feet) > 0):
            raise ArgumentError(
                f"the beats of the waveform {self.name} must begin at 0 and rise within its {length:g} s, "
                f"got {self.feet_s}",
                hint="correct the comment `beats:` of the table",
            )
        if span == 0:
            raise ArgumentError(
                f"the waveform {self.name} is constant at {value[0]:g}", hint="give a pulse that moves"
            )

    @property
    def period_s(self) -> float:
        """Length of the period: the last sample is one step before the first comes again."""
        return float(self.time_s[-1] - self.time_s[0] + np.median(np.diff(self.time_s)))

    @property
    def normalised(self) -> FloatArray:
        """Values scaled to 0..1 (n,)."""
        return (self.value - self.value.min()) / np.ptp(self.value)


def train(shape: Shape, *, periods: int, rate_Hz: float, low: float, high: float) -> FloatArray:
    """Samples (n,) of ``periods`` periods of a shape, shifted and scaled to [low, high].

        y_k = low + (high - low) P(k / rate mod T),   k = 0 .. n - 1,   n = round(periods T rate)

    P is the shape normalised to 0..1, T its period, s; ``low``, ``high`` and y share a unit. P is
    interpolated without overshoot (monotone cubic), so the extremes stay those of the shape.

    Source: Fritsch and Carlson, SIAM Journal on Numerical Analysis 17 (1980), 238.

    ArgumentError for no periods, an empty range, a rate that is not positive or leaves no sample, or more
    than ``excitations.MOST_SAMPLES``.
    """
    if periods < 1:
        raise ArgumentError(f"a pulse train needs at least 1 period, got {periods}", hint="12 suit a session")
    ascending(low, high, what="the range of the pulse")
    positive(rate=rate_Hz)
    check_size(periods, shape.period_s * rate_Hz, what="periods")
    t = shape.time_s - shape.time_s[0]
    curve = scipy.interpolate.PchipInterpolator(
        np.append(t, shape.period_s), np.append(shape.normalised, shape.normalised[0])
    )
    count = round(periods * shape.period_s * rate_Hz)
    if count < 1:
        raise ArgumentError(
            f"a rate of {rate_Hz:g} Hz leaves no sample in {periods * shape.period_s:g} s of pulses",
            hint="1000 Hz suits the solenoid",
        )
    values = np.clip(curve((np.arange(count) / rate_Hz) % shape.period_s), 0.0, 1.0)
    return low + (high - low) * values
