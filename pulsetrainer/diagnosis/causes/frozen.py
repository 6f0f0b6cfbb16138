"""the output freezes: a recorder repeats its last value while the device moves on; found on the raw data.

Noise changes a value from sample to sample. So a value that is repeated exactly, more often than chance
allows, was not measured anew, if meanwhile the input moves, and the output then jumps to where it has come.
Where single values are repeated here and there, it is their number that chance does not allow.
"""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.core.wild import runs_of
from pulsetrainer.diagnosis.causes.base import OfTheRecord
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.raw import Firing, Raw, noise_of, spacing_of

_NOISY = 1.0  # converter steps: with less noise a value repeats itself
_EQUAL = 2.0 * np.pi**0.5  # the share of equal neighbours is a step over so many times the noise ...
_MOST = 0.5  # ... and no more than this
_CHANCE = 1e-6  # that a record has one such stretch
_LEAST = 5  # equal values in a row: fewer may be rounding
_MOVED = 0.01  # of the range: the input must go on by this much meanwhile
_JUMP = 8.0  # times the noise: by so much the next value must differ
_TIMES = 2  # a single stretch may be anything
_SHARE = 0.02  # of all samples: so many repeats ...
_BY_CHANCE = 4.0  # ... and so many times those of the noise
_CLOSE = 0.125  # ... and as many as change, but by no more than this times the noise ...
_NEAR = 0.5  # ... and so many times those that change, but by no more than the noise
_LOUD = 8.0  # converter steps: beside a repeat values must differ by more, or there is no noise there


class Frozen(OfTheRecord):
    """Stretches in which one value is repeated."""

    id = "frozen"
    title = "the {output} freezes: its recorder repeats one value while the device moves on"
    formula = "y is held, then jumps to where it has come"
    signature = "equal values without noise in the middle of noise, and a jump after them"
    excitation = "any that moves"
    order = 2
    family = "frozen"
    corrects = True
    size = "of the largest jump of the {output} after it was frozen"
    texts = sentences("""
        gate: {stretches:.0f} stretches repeat one value exactly, {count:.0f} samples in all, while the input
            moves and other samples have noise: the recorder missed what happened there
    """)

    def gate(self, raw: Raw) -> Firing | None:
        """Equal values in a row, too many for the noise, that end with a jump."""
        y, u = raw.calm.output, raw.record.input
        noise, step = noise_of(y), spacing_of(y)
        if noise <= _NOISY * step or y.size <= _LEAST:
            return None
        equal = min(step / (_EQUAL * noise), _MOST)
        least = max(_LEAST, 1 + int(np.ceil(np.log(_CHANCE / y.size) / np.log(equal)))) if equal else _LEAST
        ends, breaks = (y.min(), y.max()), raw.beside_breaks(1)
        long = [(k, last) for k, last in runs_of(np.diff(y) == 0.0) if last + 1 - k >= least]
        mask, jumps = np.zeros(y.size, dtype=np.bool_), []
        for begin, last in long:
            if y[begin] in ends or np.ptp(u[begin : last + 1]) <= _MOVED * raw.reach:
                continue
            mask[begin + 1 : last + 1] = True
            jump = abs(float(y[last + 1] - y[last])) if last + 1 < y.size else 0.0
            if jump > _JUMP * noise and not breaks[last : last + 2].any():
                jumps.append(jump)
        again = _repeats(y, noise, step, equal)
        if again.any():
            mask |= again
            jumps.append(float(np.max(np.abs(np.diff(y))[again[:-1]], initial=0.0)))
        elif len(jumps) < _TIMES:
            return None
        figures = {"stretches": float(len(runs_of(mask))), "count": float(np.count_nonzero(mask))}
        return Firing(self.id, "gate", max(jumps), "{y}", figures, mask)


def _repeats(y: FloatArray, noise: float, step: float, equal: float) -> BoolArray:
    """Samples (n,) that repeat the value before, if there are too many for the noise; none otherwise.

    ``equal`` is the share of equal neighbours by chance, if ``step`` is that of the converter. It may be
    hidden by what was added later. But then as many values change by one step as are equal, or more.
    """
    change = np.abs(np.diff(y))
    again = np.append(False, change == 0.0)
    beside = np.maximum(np.append(change, 0.0), np.append(0.0, change))  # before or after
    around = np.maximum(np.append(beside[1:], 0.0), np.append(0.0, beside[:-1]))
    often = np.mean(again) >= max(_SHARE, _BY_CHANCE * equal)
    moved = change[change > 0.0]
    close, near = (np.count_nonzero(moved <= share * noise) for share in (_CLOSE, 1.0))
    often &= np.count_nonzero(again) >= max(close, _NEAR * near)
    if not often or np.median(around[again]) <= _LOUD * step or _is_held(again):
        return np.zeros(y.size, dtype=np.bool_)
    return again & (y != y.min()) & (y != y.max())


def _is_held(again: BoolArray) -> bool:
    """Whether most values stand several times: a recorder that is slower than the table loses nothing."""
    return int(np.argmax(np.bincount(np.diff(np.flatnonzero(~again), append=again.size)))) > 1
