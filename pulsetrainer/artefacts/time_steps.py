"""The steps between time stamps: even or not, and where the gaps are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pulsetrainer.artefacts.data import BoolArray, FloatArray

# Steps within this share of the median are even: time stamps are written with few digits.
EVEN = 0.02
GAP = 1.5  # a step longer than this times the median one is a gap
# Within so few steps little is lost, and single samples that are lost are no end of a record.
_LONG = 5.0
_FAR = 0.01  # of the input's range: an extreme that is missed by less hardly changes what is remembered
_SECOND = np.sqrt(6.0)  # second differences of white noise have six times its variance
_LOOKED_AT = 1_000_000  # steps for their median
BLOCK = 1 << 18  # samples at a time where a copy of a long record would be in the way


@dataclass(frozen=True, slots=True)
class Steps:
    """How even the time stamps of a run are, s."""

    median: float
    shortest: float
    longest: float  # that is no gap
    gaps: int
    longest_gap: float  # 0 where there is none

    @property
    def even(self) -> bool:
        """True where no step differs from the median by more than ``EVEN``; gaps count apart."""
        low, high = (1.0 - EVEN) * self.median, (1.0 + EVEN) * self.median
        return low <= self.shortest and self.longest <= high


class Gaps(NamedTuple):
    """How many gaps there are in some parts of a run, and the longest, s."""

    number: int
    longest_s: float  # 0 where there is none


def gaps_of(time_s: FloatArray | None, seam: BoolArray | None) -> Gaps:
    """Return the gaps within the parts of a record (n,): a pause between two of them is none."""
    if time_s is None:
        return Gaps(0, 0.0)
    parts = [time_s] if seam is None else np.split(time_s, np.flatnonzero(seam))
    steps = [steps_of(part) for part in parts if part.size > 1]
    return Gaps(sum(one.gaps for one in steps), max((one.longest_gap for one in steps), default=0.0))


def behind_turns(time_s: FloatArray, inputs: FloatArray) -> list[int]:
    """Return the samples before which an input (n,) may have turned unseen, in a gap.

    In as long a time before or behind the gap it went so far, within it on the whole less. Half of what is
    missing may be a way out that was gone back: where that is far, what is remembered is not known. A gap
    behind which the input never again comes to an end of its range is none of them: what was remembered
    before it is the best that is known.
    """
    if time_s.size < 2:
        return []
    longest = _LONG * steps_of(time_s).median
    low, high = float(np.fmin.reduce(inputs)), float(np.fmax.reduce(inputs))
    far = _FAR * (high - low)
    doubtful = []
    for k in range(0, time_s.size - 1, BLOCK):
        for at in (k + 1 + np.flatnonzero(np.diff(time_s[k : k + BLOCK + 1]) > longest)).tolist():
            length = time_s[at] - time_s[at - 1]
            before = inputs[np.searchsorted(time_s, time_s[at - 1] - length) : at]
            behind = inputs[at : np.searchsorted(time_s, time_s[at] + length, side="right")]
            if max(_way(before), _way(behind)) - abs(inputs[at] - inputs[at - 1]) > 2.0 * far:
                doubtful.append(at)
    found: list[int] = []
    for at in reversed(doubtful):
        part = inputs[at : found[-1] if found else None]
        if np.any((part <= low + far) | (part >= high - far)):
            found.append(at)
    return found[::-1]


def _way(inputs: FloatArray) -> float:
    """How far an input (n,) goes, without what its noise adds to that."""
    noise = float(np.ptp(np.diff(inputs, 2))) / _SECOND if inputs.size > 3 else 0.0
    return float(np.ptp(inputs)) - noise


def steps_of(time_s: FloatArray) -> Steps:
    """Sum up the steps between time stamps (n,), n >= 2.

    Of more than a million steps, the median is that of a million that lie evenly among them.
    """
    every = -(-(time_s.size - 1) // _LOOKED_AT)
    median = float(np.median(time_s[1::every] - time_s[:-1:every]))
    shortest, longest, gaps, longest_gap = np.inf, -np.inf, 0, 0.0
    for k in range(0, time_s.size - 1, BLOCK):
        step = np.diff(time_s[k : k + BLOCK + 1])
        is_gap = step > GAP * median
        shortest = min(shortest, float(step.min()))
        longest = max(longest, float(step[~is_gap].max(initial=-np.inf)))
        gaps += int(is_gap.sum())
        longest_gap = max(longest_gap, float(step[is_gap].max(initial=0.0)))
    return Steps(median, shortest, longest, gaps, longest_gap)
