"""Single beats of a pulse, drawn at any length: what a session is put together from.

A shorter interval takes most from diastole. With T0 the beat's own interval and T the one asked for,
time runs in the beat as

    tau(t) / T0 = a x + (1 - a) x^2,    x = t / T,    a = sqrt(T / T0)

so that systole is shortened by the root of the interval, as it is in the electrocardiogram (H. C. Bazett,
Heart 1920, 7, 353-370), and diastole takes the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.pulses import Shape

SLOWEST_BPM, FASTEST_BPM = 20.0, 240.0
_STEEPEST = 1.9  # at 2 the time of a beat would stand still at its end


@dataclass(frozen=True)
class Pulse:
    """A pulse as beats: its shape between the feet of the beats in its record."""

    shape: Shape

    @property
    def name(self) -> str:
        """The shape's."""
        return self.shape.name

    @property
    def beats(self) -> int:
        """Number of beats in a record."""
        return len(self.shape.feet_s)

    @property
    def own_bpm(self) -> float:
        """Mean rate at which the record was drawn."""
        return 60.0 * self.beats / self.shape.period_s

    @cached_property
    def _curve(self) -> scipy.interpolate.PchipInterpolator:
        t = self.shape.time_s - self.shape.time_s[0]
        level = self.shape.normalised
        # three samples of the turns before and after: the slope at the seam is that of the record
        last = slice(-3, None)
        times = np.concatenate((t[last] - self.shape.period_s, t, t[:3] + self.shape.period_s))
        return scipy.interpolate.PchipInterpolator(times, np.concatenate((level[last], level, level[:3])))

    def own_interval_s(self, number: int) -> float:
        """Length of a beat of the record, the first is 0; they come round and round."""
        feet = (*self.shape.feet_s, self.shape.feet_s[0] + self.shape.period_s)
        at = number % self.beats
        return feet[at + 1] - feet[at]

    def record(self, stretch: float, rate_Hz: float) -> FloatArray:
        """Level 0..1 (n,) of the whole record, each beat ``stretch`` times as long as its own interval."""
        beats = []
        for number in range(self.beats):
            interval_s = self.own_interval_s(number) * stretch
            count = max(round(interval_s * rate_Hz), 2)
            beats.append(self.level(number, interval_s, np.arange(count) * interval_s / count))
        return np.concatenate(beats)

    def level(self, number: int, interval_s: float, time_s: FloatArray) -> FloatArray:
        """Level 0..1 (n,) of a beat stretched to ``interval_s``, at ``time_s`` (n,) from its foot."""
        own = self.own_interval_s(number)
        share = time_s / interval_s
        steep = min(np.sqrt(interval_s / own), _STEEPEST)
        place = self.shape.feet_s[number % self.beats] + own * share * (steep + (1.0 - steep) * share)
        return np.clip(self._curve(place % self.shape.period_s), 0.0, 1.0)
