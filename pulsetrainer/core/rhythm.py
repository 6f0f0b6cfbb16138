"""The rhythm of a heart: how long each beat lasts and how strong it is, from a seed.

Every number depends on the seed and the number of the beat alone, so that a beat can be asked for twice. The
intervals between beats, as a share of the even one:

    (1 + v g_k) (1 + r sin(2 pi f t))     v: variability, g_k: standard normal; r: respiration

A premature beat comes after ``COUPLING`` of the even interval, is weaker, since it found the heart half
filled, and is followed by a compensatory pause: the beat after it comes when it would have come anyway.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pulsetrainer.errors import ArgumentError

BREATH_Hz = 0.25  # 15 breaths a minute
COUPLING = 0.65  # of the even interval: from a beat to a premature one
PREMATURE_STRENGTH = 0.6  # of a beat that had its time to fill
_WIDEST = 3.0  # standard deviations: no beat is drawn farther out
_MOST_VARIABILITY = 0.25  # a wider spread is no rhythm that a beat of 0.65 fits into
_MOST_RESPIRATION = 0.3
_MOST_ECTOPIC = 0.5


@dataclass(frozen=True, slots=True)
class Timing:
    """How a beat differs from an even, full one."""

    interval: float  # of the even one
    strength: float  # of a full one; a premature one is weaker


@dataclass(frozen=True, slots=True)
class Rhythm:
    """What makes a pulse uneven; all zero: nothing."""

    variability: float = 0.0  # standard deviation of the intervals, of their mean
    respiration: float = 0.0  # swing of the intervals with the breath, of their mean
    ectopic: float = 0.0  # share of premature beats
    seed: int = 0

    def __post_init__(self) -> None:
        for name, most in (
            ("variability", _MOST_VARIABILITY),
            ("respiration", _MOST_RESPIRATION),
            ("ectopic", _MOST_ECTOPIC),
        ):
            value = getattr(self, name)
            if not 0.0 <= value <= most:
                raise ArgumentError(
                    f"{name} must be from 0 to {100 * most:g} %, got {100 * value:g} %",
                    hint="5 % is a lot for a heart at rest",
                )
        if self.seed < 0:
            raise ArgumentError(
                f"a seed must not be negative, got {self.seed}", hint="give any whole number from 0"
            )

    def timing(self, number: int, time_s: float) -> Timing:
        """Return how beat ``number``, from 0, that begins at ``time_s``, differs from an even one."""
        draw = np.random.default_rng((self.seed, number)).standard_normal()
        interval = 1.0 + self.variability * float(np.clip(draw, -_WIDEST, _WIDEST))
        interval *= 1.0 + self.respiration * float(np.sin(2.0 * np.pi * BREATH_Hz * time_s))
        if self._premature(number):
            return Timing(interval * (2.0 - COUPLING), PREMATURE_STRENGTH)
        return Timing(interval * (COUPLING if self._premature(number + 1) else 1.0), 1.0)

    def _premature(self, number: int) -> bool:
        """Whether a beat is premature: never the first, and never two in a row."""
        if self.ectopic == _MOST_ECTOPIC:  # all are drawn
            return number % 2 == 1
        run = 0  # of beats drawn up to this one, of which every second is premature
        while number > run and self._drawn(number - run):
            run += 1
        return run % 2 == 1

    def _drawn(self, number: int) -> bool:
        # of a share e of all beats, given that none follows another: e / (1 - e) of those that may be
        wanted = self.ectopic / (1.0 - self.ectopic)
        return bool(np.random.default_rng((self.seed, number, 1)).random() < wanted)
