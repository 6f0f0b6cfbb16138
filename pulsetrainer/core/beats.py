"""Single beats of a recorded pulse: found by their peaks, cut at their feet.

The systolic peaks are the maxima that stand out by half of the record's pulse height
(``scipy.signal.find_peaks``), so that a dicrotic wave is none. A beat goes from foot to foot; the foot is
the lowest sample between two peaks, the last one where several are equally low. What the next foot lies
higher or lower is taken out as a straight line, so that the beat can be repeated without a jump.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.core.pulses import Shape
from pulsetrainer.errors import DataError

_PROMINENCE = 0.5  # of the height between the 5th and the 95th percentile
_SHORTEST_S = 0.25  # of a beat: 240 a minute
_SMOOTH_S = 0.02  # of the local parabolas in which feet are sought
_AT_FOOT = 0.1  # of the height: the record's own ends count as feet up to here


@dataclass(frozen=True, slots=True)
class Beats:
    """The whole beats of a record."""

    record: Shape
    feet: IntArray  # (k + 1,) sample numbers; beat i goes from feet[i] to feet[i + 1]

    @property
    def count(self) -> int:
        """How many whole beats there are."""
        return self.feet.size - 1

    @property
    def periods_s(self) -> FloatArray:
        """Length of each beat (k,), s."""
        return np.diff(self.record.time_s[self.feet])

    def single(self, number: int) -> Shape:
        """Return one beat, the first is 1; DataError where there is no such beat."""
        if not 1 <= number <= self.count:
            held = f"{self.count} whole beat{'s' if self.count != 1 else ''}"
            raise DataError(
                f"{self.record.name} has no beat {number}: it holds {held}",
                hint=f"give `beat` {'1' if self.count == 1 else f'from 1 to {self.count}'}, or mean",
            )
        begin, end = int(self.feet[number - 1]), int(self.feet[number])
        time_s = self.record.time_s[begin:end] - self.record.time_s[begin]
        value = self.record.value[begin:end]
        rise = float(self.record.value[end] - self.record.value[begin])
        level = value - rise * time_s / float(self.record.time_s[end] - self.record.time_s[begin])
        return replace(self.record, name=f"{self.record.name}_beat{number}", time_s=time_s, value=level)

    def mean(self) -> Shape:
        """Return the mean of all beats, each stretched to the median length."""
        singles = [self.single(k + 1) for k in range(self.count)]
        period = float(np.median(self.periods_s))
        count = round(period / float(np.median(np.diff(self.record.time_s))))
        phase = np.arange(count) / count
        total = np.zeros(count)
        for beat, length in zip(singles, self.periods_s.tolist(), strict=True):
            ends = np.append(beat.time_s / length, 1.0)
            total += np.interp(phase, ends, np.append(beat.value, beat.value[0]))
        return replace(
            self.record, name=f"{self.record.name}_mean", time_s=phase * period, value=total / self.count
        )


def find_beats(record: Shape) -> Beats:
    """Find the whole beats of a record (n,) of several, in any unit: k beats have k + 1 feet.

    A foot is the lowest sample, of two that are equal the later, between two systolic peaks of the record
    smoothed by local parabolas over 20 ms; a peak stands out by half of the height between the 5th and the
    95th percentile, and is no nearer than 0.25 s to the next.

    Source: Savitzky and Golay, Analytical Chemistry 36 (1964), 1627, for the parabolas.

    DataError where there is no whole beat in it.
    """
    t, p = record.time_s, record.value
    step = float(np.median(np.diff(t)))
    low, high = np.percentile(p, [5.0, 95.0])
    height = float(high - low)
    window = 2 * max(round(0.5 * _SMOOTH_S / step), 1) + 1
    smooth = scipy.signal.savgol_filter(p, window, 2) if window < p.size else p
    # a record may begin or end in a peak's flank: lower ends make the first and last peak whole
    padded = np.concatenate(([low - height], smooth, [low - height]))
    peaks, _ = scipy.signal.find_peaks(
        padded, prominence=_PROMINENCE * height, distance=max(_SHORTEST_S / step, 1.0)
    )
    peaks = peaks - 1
    if peaks.size == 0 or not height > 0:
        raise DataError(f"{record.name} holds no pulse that stands out", hint="leave `beat` out for one beat")
    feet = [_lowest(smooth, a, b) for a, b in pairwise(peaks.tolist())]
    foot = float(np.median(smooth[feet])) if feet else float(smooth.min())
    before, after = _lowest(smooth, 0, int(peaks[0])), _lowest(smooth, int(peaks[-1]), p.size - 1)
    if smooth[before] <= foot + _AT_FOOT * height:
        feet.insert(0, before)
    if smooth[after] <= foot + _AT_FOOT * height:
        feet.append(after)
    if len(feet) < 2:
        raise DataError(
            f"{record.name} holds no whole beat, only a part of one",
            hint="leave `beat` out, or record longer",
        )
    return Beats(record, np.asarray(feet, dtype=np.int64))


def _lowest(values: FloatArray, begin: int, end: int) -> int:
    """Last of the lowest samples in begin..end."""
    part = values[begin : end + 1]
    return begin + part.size - 1 - int(np.argmin(part[::-1]))
