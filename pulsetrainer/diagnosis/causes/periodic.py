"""a disturbance at a fixed frequency (mains, a fan, day and night): y + A sin(2 pi f t) + B cos(2 pi f t)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Taken, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.floor import Floor

_SLOWEST_Hz = 0.4  # slower lines are drift ...
_PERIODS = 8.0  # ... and so are lines with fewer periods in the record
_LINES = 61  # lines of the spectrum: a line is compared with the median of these
_FLOOR = 1e-12  # of the highest line: keeps the ratio finite where the spectrum is empty
_LEAST = 0.02  # of the highest line: lower ones are noise, however far above their surroundings
_FINER = 41  # frequencies tried between the two neighbours of a line
_TRIED = 0.003  # of the span
_FAINT_NOISE = 1.5  # times the noise of single samples, rms: a smaller hum is part of the noise ...
_FAINT = 0.005  # ... if it is no larger than this share of the span
_ONE_LINE = 0.9  # of the power of the input: one of a single frequency has 0.97, whatever its shape ...
_WIDE = 2  # ... in the highest line and this many on each side
_INDEPENDENT = 0.51  # of the number of samples: the number of independent frequencies (sqrt(pi/3) / 2)


class Periodic(Cause):
    """A sine of fixed frequency, locked to the clock."""

    id = "periodic"
    title = "a disturbance at a fixed frequency (mains, a fan, day and night)"
    formula = "y + A sin(2 pi f t) + B cos(2 pi f t)"
    signature = "one line in the spectrum of the residual, at rest and in motion alike"
    excitation = "a rest of a few periods"
    source = "Kay, Fundamentals of Statistical Signal Processing, 1993, example 4.2"
    stage = "output"
    order = 130
    family = "periodic"
    strengths = 2
    parameters = (
        Quantity("sine", "{y}", -1e6, 1e6, 1e-4, "of the {output}, times sin(2 pi f t)"),
        Quantity("cosine", "{y}", -1e6, 1e6, 1e-4, "of the {output}, times cos(2 pi f t)"),
        Quantity("frequency", "Hz", 0.0, 1e6, 1e-4, "f, of the disturbance"),
    )
    lasting = False
    corrects = True
    line = True
    texts = sentences(
        "background: a hum at {frequency:.4g} Hz, no larger than the noise: reported, but not a verdict"
    )

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """Return a phase for each record, since no clock runs through all of them, and one frequency."""
        *own, frequency = self.parameters
        more = [replace(one, name=f"{one.name} {k + 1}") for k in range(1, frame.records) for one in own]
        return (*own, *more, frequency)

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        k = int(np.argmax([one.size for one in residual]))  # a long record has the sharpest lines
        frame, one = frames[k], residual[k]
        power = np.abs(scipy.fft.rfft(one * np.hanning(one.size))) ** 2
        frequency = scipy.fft.rfftfreq(one.size, frame.dt_s)
        power[frequency < max(_SLOWEST_Hz, _PERIODS / (one.size * frame.dt_s))] = 0.0
        if not power.any():
            return []
        # against its surroundings: a line, not the slope of a spectrum
        around = scipy.ndimage.median_filter(power, size=_LINES) + _FLOOR * power.max(initial=0.0) + TINY
        k = int(np.argmax(power / around * (power > _LEAST * power.max(initial=0.0))))
        best = _refined(one, float(frequency[k]), float(frequency[1]), frame.dt_s)
        size = _TRIED * frame.span
        strengths = size * np.eye(2 * frame.records)
        return [[(*row.tolist(), best) for row in strengths]]

    def is_background(self, sizes: Sequence[float], floor: Floor) -> bool:
        """Return whether it is a hum of the noise's size."""
        rms = float(np.hypot(sizes[0], sizes[1])) / np.sqrt(2.0)
        return bool(rms <= min(_FAINT_NOISE * floor.noise, _FAINT))

    def stands_out(self, values: Values, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> bool:
        """Return whether its line is far above all others near it in what a model without it leaves."""
        one, frame = max(zip(residual, frames, strict=True), key=lambda pair: pair[0].size)
        amplitude = np.abs(scipy.fft.rfft(one * np.hanning(one.size)))
        k = round(values[-1] * one.size * frame.dt_s)
        near = amplitude[max(k - _LINES, 0) : k + _LINES + 1]
        line = amplitude[max(k - _WIDE, 0) : k + _WIDE + 1]
        return bool(line.size and line.max() > LIMITS.line_stands * np.median(near))

    def in_step(self, values: Values, frames: Sequence[Frame]) -> bool:
        """Return whether the input has one frequency, of which this is a multiple as far as can be told."""
        frame = max(frames, key=lambda one: one.input.size)
        moved = frame.input - frame.input.mean()
        power = np.abs(scipy.fft.rfft(moved * np.hanning(moved.size))) ** 2
        k, apart = int(np.argmax(power)), 1.0 / (moved.size * frame.dt_s)
        if k == 0 or np.sum(power[max(k - _WIDE, 0) : k + _WIDE + 1]) < _ONE_LINE * np.sum(power):
            return False
        own = _refined(moved, k * apart, apart, frame.dt_s)
        return bool(abs(values[-1] - max(round(values[-1] / own), 1) * own) <= apart)

    def choices(self, frames: Sequence[Frame]) -> float:
        """Return from how many independent frequencies ``starts`` chooses: Baluev's W."""
        return _INDEPENDENT * max(frame.input.size for frame in frames)

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        return y + _seen(values[-1], frame) * _sine(values, frame.record, frame.time_s)

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) without the sine."""
        return y - _sine(values, taken.record, taken.time_s)


def _sine(values: Values, record: int, time_s: FloatArray) -> FloatArray:
    """The sine (n,), with the phase of its record."""
    sine, cosine = values[2 * record : 2 * record + 2]
    phase = 2.0 * np.pi * values[-1] * time_s
    return np.asarray(sine * np.sin(phase) + cosine * np.cos(phase))


def _seen(frequency: float, frame: Frame) -> float:
    """Share of a sine's amplitude that the means of its samples show."""
    half = np.pi * frequency * frame.dt_s
    single = frame.averaged * np.sin(half / frame.averaged)
    return float(np.sin(half) / single) if single != 0.0 else 1.0


def _refined(residual: FloatArray, frequency: float, width: float, dt_s: float) -> float:
    """Frequency of the largest line within a ``width`` of ``frequency``: a spectrum's bins are too coarse."""
    low, high = max(frequency - width, 0.0), min(frequency + width, 0.5 / dt_s)
    lines = scipy.signal.zoom_fft(residual, [low, high], _FINER, fs=1.0 / dt_s, endpoint=True)
    return float(np.linspace(low, high, _FINER)[int(np.argmax(np.abs(lines)))])
