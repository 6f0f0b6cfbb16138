"""What a record shows before any model is fitted: noise without a hum, steps, and the gates that fired."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.core.wild import repaired
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.thresholds import DIFFERENCES, LIMITS, NORMAL_MAD, THIRD_DIFFERENCE, TINY
from pulsetrainer.errors import DataError


@dataclass(frozen=True)
class Raw:
    """A record as a gate sees it, with the range of the input that was identified."""

    record: Record
    low: float
    high: float
    second: float = 1.0  # s: what a second is for the search of causes, see ``scale``
    stamps: FloatArray | None = None  # s, (n,) times of the samples; None: even steps
    wild: BoolArray | None = None  # samples that are wrong one by one
    polarity: int = 1  # the output is that as measured times this
    said: FloatArray | None = None  # (n,) what the model as given says; None: that is not known

    @property
    def reach(self) -> float:
        """Range of the input."""
        return self.high - self.low

    def beside_breaks(self, near: int) -> BoolArray:
        """Tell which samples (n,) lie within ``near`` samples of a gap, or of a jump of the input.

        Neighbours there are none in time, and an output that jumps with its input is no fault.
        """
        breaks = np.abs(np.diff(self.record.input)) > LIMITS.jump_of_input * self.reach
        if self.stamps is not None:
            breaks |= _gaps(self.stamps, self.record.step)
        found = np.zeros(self.record.input.size, dtype=bool)
        for at in np.flatnonzero(breaks).tolist():
            found[max(at + 1 - near, 0) : at + 1 + near] = True
        return found

    @property
    def calm(self) -> Record:
        """The record with its wild samples filled in: they pile up at the converter's end."""
        if self.wild is None:
            return self.record
        return replace(self.record, output=repaired(self.record.output, self.wild))


@dataclass(frozen=True)
class Firing:
    """One gate that fired."""

    cause: str
    kind: str  # which of the cause's texts says it
    value: float  # the size of it
    unit: str  # "{y}", "{u}" or "1"
    figures: Mapping[str, float] = field(default_factory=dict)  # for the text
    mask: BoolArray | None = None  # samples to leave out
    spread: float = 0.0  # of the value, where it is known

    @property
    def evidence(self) -> Evidence:
        """What it says."""
        return Evidence(self.kind, self.cause, self.figures)


def evenly(record: Record, stamps: FloatArray | None) -> Record:
    """Return a record at even time steps, straight between samples; what fills a gap has no weight.

    DataError where more of the record is gaps than samples.
    """
    if stamps is None or record.dt_s is None:
        return record
    step = max(record.dt_s, float(stamps[-1]) / LIMITS.most_even)
    grid = np.arange(round(float(stamps[-1]) / step) + 1) * step
    following = np.clip(np.searchsorted(stamps, grid), 1, stamps.size - 1)
    hole = _gaps(stamps, step)[following - 1]
    if np.mean(hole) > LIMITS.least_present:
        raise DataError(
            f"a record has {stamps.size} samples where even steps of {step:.4g} s would have {grid.size}: "
            "most of it is gaps",
            hint="cut it into several runs at the gaps",
        )
    known = np.interp(grid, stamps, record.sample_weight) >= 0.5  # of two neighbours the nearer one
    reference = None if record.reference is None else np.interp(grid, stamps, record.reference)
    return Record(
        np.interp(grid, stamps, record.input),
        np.interp(grid, stamps, record.output),
        np.where(hole, 0.0, known.astype(np.float64)),
        dt_s=step,
        reference=reference,
    )


def _gaps(stamps: FloatArray, step: float) -> BoolArray:
    """Tell which steps (n - 1,) between stamps are gaps: longer than those around them, and than usual."""
    steps = np.diff(stamps)
    usual = np.maximum(scipy.ndimage.median_filter(steps, LIMITS.usual_of, mode="nearest"), step)
    return np.asarray(steps > LIMITS.gap_steps * usual)


def noise_of(y: FloatArray, weight: FloatArray | None = None) -> float:
    """White noise (rms) of a record from its third differences, robust against jumps.

    A smooth output hardly has any; of white noise they have twenty times the variance. Where samples
    without ``weight`` were filled in there is no noise to be seen.
    """
    third = _third_differences(y, weight)
    if third.size == 0:
        return 0.0
    return float(np.median(np.abs(third)) / NORMAL_MAD / np.sqrt(THIRD_DIFFERENCE))


def noise_beside_hum(y: FloatArray, weight: FloatArray) -> float:
    """White noise (rms) of a record as ``noise_of``, without a line that has most of it: a hum."""
    third, whole = _third_differences(y, weight), noise_of(y, weight)
    line = _share_of_a_line(third)
    if line <= LIMITS.line_share:
        return whole
    beside = (1.0 - line) * float(np.mean(third**2))
    return min(whole, float(np.sqrt(beside / THIRD_DIFFERENCE)))


def hums(y: FloatArray, weight: FloatArray) -> bool:
    """Whether one line has most of what a record (n,) does from sample to sample."""
    return _share_of_a_line(_third_differences(y, weight)) > LIMITS.line_share


def as_fast_as_its_hum(record: Record, per: int, least: float) -> int:
    """Return how many samples may be averaged, ``per`` at most: a hum must not be seen at another frequency.

    It is the highest line of the output's spectrum where averages would fold it, if it stands out and its
    amplitude is ``least`` times the noise.
    """
    y = record.output - np.median(record.output)
    window = scipy.signal.windows.hann(y.size)
    amplitude = 2.0 * np.abs(scipy.fft.rfft(y * window)) / float(window.sum())
    first = int(y.size * LIMITS.folded / per)
    if amplitude.size - first < LIMITS.line_samples:
        return per
    k = first + int(np.argmax(amplitude[first:]))
    around = float(np.median(amplitude[max(k - LIMITS.line_around, first) : k + LIMITS.line_around]))
    noise = noise_of(record.output, record.sample_weight)
    if amplitude[k] < max(LIMITS.line_stands * around, least * noise):
        return per
    return max(1, min(per, int(y.size * LIMITS.folded / k)))


def _share_of_a_line(third: FloatArray) -> float:
    """Share of the squares of differences (k,) that one line of their spectrum has; 0 of too few."""
    if third.size < LIMITS.line_samples:
        return 0.0
    power = np.abs(scipy.fft.rfft(third * scipy.signal.windows.hann(third.size))) ** 2
    k = int(np.argmax(power))
    return float(
        np.sum(power[max(k - LIMITS.line_wide, 0) : k + LIMITS.line_wide + 1]) / max(np.sum(power), TINY)
    )


def _third_differences(y: FloatArray, weight: FloatArray | None) -> FloatArray:
    """Third differences (k,) of samples with weight, about their median; none of a few samples."""
    if y.size < LIMITS.noise_least:
        return np.zeros(0)
    third = np.diff(y, DIFFERENCES)
    if weight is not None:
        known = scipy.ndimage.minimum_filter1d(weight, DIFFERENCES + 1, origin=-2)[:-DIFFERENCES] > 0
        third = third[known] if np.count_nonzero(known) >= LIMITS.noise_least else third
    return np.asarray(third - np.median(third))


def values_of(y: FloatArray) -> FloatArray:
    """Distinct values (k,) of ``y`` (n,), in order; what only rounding tells apart is one value."""
    values = np.unique(y)
    if values.size == 0:
        return values
    # what an instrument writes for an overload may be 1e38 times the span
    low, high = np.quantile(values, LIMITS.bulk_of_values)
    apart = LIMITS.same_value * (high - low)
    return np.asarray(values[np.append(True, np.diff(values) > apart)])


def spacing_of(y: FloatArray) -> float:
    """Distance of the distinct values of ``y``: the step of its converter."""
    values = values_of(y)
    return float(np.median(np.diff(values))) if values.size > 1 else 0.0


def coarse_step(y: FloatArray) -> float:
    """Step of the output where it is coarse against its noise, else 0: its error does not average out.

    Nor are the few states of a device that switches steps of a converter.
    """
    step = spacing_of(y)
    coarse = LIMITS.coarse_noise * noise_of(y) < step < LIMITS.state * float(np.ptp(y))
    return step if coarse else 0.0
