"""The steps between time stamps: even or not, and where the gaps are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pulsetrainer.artefacts.data import FloatArray
from pulsetrainer.artefacts.run import Run

# Steps within this share of the median are even: time stamps are written with few digits.
EVEN = 0.02
GAP = 1.5  # a step longer than this times the median one is a gap
_LOOKED_AT = 1_000_000  # steps for their median
_BLOCK = 1 << 18  # samples at a time where a copy of a long record would be in the way


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


def gaps_of(parts: Sequence[Run]) -> Gaps:
    """Return the gaps within the parts of a run: a pause between two of them is none."""
    steps = [steps_of(part.time_s) for part in parts if part.time_s is not None and part.time_s.size > 1]
    return Gaps(sum(one.gaps for one in steps), max((one.longest_gap for one in steps), default=0.0))


def steps_of(time_s: FloatArray) -> Steps:
    """Sum up the steps between time stamps (n,), n >= 2.

    Of more than a million steps, the median is that of a million that lie evenly among them.
    """
    every = -(-(time_s.size - 1) // _LOOKED_AT)
    median = float(np.median(time_s[1::every] - time_s[:-1:every]))
    shortest, longest, gaps, longest_gap = np.inf, -np.inf, 0, 0.0
    for k in range(0, time_s.size - 1, _BLOCK):
        step = np.diff(time_s[k : k + _BLOCK + 1])
        is_gap = step > GAP * median
        shortest = min(shortest, float(step.min()))
        longest = max(longest, float(step[~is_gap].max(initial=-np.inf)))
        gaps += int(is_gap.sum())
        longest_gap = max(longest_gap, float(step[is_gap].max(initial=0.0)))
    return Steps(median, shortest, longest, gaps, longest_gap)
