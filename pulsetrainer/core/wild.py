"""Wild samples: single readings that are far from their neighbours, or from what a fit says.

A sample is compared with the median of its neighbours, which one wild sample does not move (Hampel, J. Am.
Stat. Assoc. 69 (1974) 383-393). What noise does is read off the 95 % quantile of all these distances: in
tails that fall exponentially, m times that quantile is exceeded by 0.05^m of the samples. What motion does is
read off the steps near by. Only short runs are wild: what lasts is an event of the device.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import nnls
from pulsetrainer.core.equations import normal_equations
from pulsetrainer.core.plane import BoolArray, FloatArray, Plane
from pulsetrainer.core.record import Record, levelled
from pulsetrainer.core.smoothing import smoothed

FEWEST = 50  # samples; below, nothing is called wild
MOST = 0.1  # of the samples: more of them are no exceptions
LONGEST = 3  # samples of a run
_TAIL = 3.2  # times the 95 % quantile: beyond it lie 7 of 100 000 samples with exponential tails
_NEAR = 0.01  # of the span: what is not further off does no harm
_FITS = 0.05  # of the span, median: a fit that leaves more tells nothing of single samples
_WINDOW = 7  # samples of a median: three wild ones do not move it
_AROUND = 31  # samples whose steps tell how fast the signal moves
_STEPS = 4.0  # such steps a turn may be away from the median of its neighbours
_TURN = 2.0  # such steps a turn may be away from the line between its neighbours
_LOOKS = 4  # each without what the one before it found
_MIDDLE = 1.5  # times the steps of the medians: a median is slower than the signal near a turn
_FAST = 80.0  # percentile of the steps near by
_QUICK_LEVELS = 16
_QUICK_SMOOTHING = 0.05
_QUANTA = 3.0  # usual steps: a converter that flickers is not wild


def isolated(values: FloatArray) -> BoolArray:
    """Tell for each sample (n,) of a signal whether it is far from its neighbours.

    Several wild samples close together look like motion. So what is found is taken out and the rest looked at
    again, and it moves no faster than the medians of its neighbours do.
    """
    found = np.zeros(values.size, dtype=bool)
    for _ in range(_LOOKS if values.size >= FEWEST else 0):
        left = repaired(values, found)
        step, moving = _motion(left)
        middle = scipy.ndimage.median_filter(left, size=_WINDOW, mode="mirror")
        moving = np.minimum(moving, _MIDDLE * _motion(middle)[1])
        usual = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
        more = _far(left, _STEPS * moving + _QUANTA * usual) & ~found
        if not more.any():
            break
        found |= more
    return found if np.mean(found) <= MOST else np.zeros_like(found)


def _motion(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Steps (n,) of a signal (n,), and how large they are near by."""
    step = np.abs(np.diff(values, prepend=values[0]))
    return step, scipy.ndimage.percentile_filter(step, _FAST, size=_AROUND, mode="mirror")


def off(residuals: Sequence[FloatArray], span: float) -> list[BoolArray]:
    """Tell for each sample of each record whether its residual (n,) is far from those near by.

    Parameters
    ----------
    span
        Of the output; nothing closer than a hundredth of it is wild, nor anything beside a fit that leaves
        more than a twentieth of it throughout: that fit tells nothing of single samples.
    """
    return [
        _far(e, np.full(e.size, _NEAR * span))
        if e.size >= FEWEST and np.median(np.abs(e)) <= _FITS * span
        else np.zeros(e.size, dtype=bool)
        for e in residuals
    ]


def _far(values: FloatArray, motion: FloatArray) -> BoolArray:
    """Where values (n,) are further from their neighbours' median than noise and ``motion`` (n,) make."""
    # mirrored, so that the first and the last sample are alone among their neighbours too
    apart = np.abs(values - scipy.ndimage.median_filter(values, size=_WINDOW, mode="mirror"))
    body = np.quantile(values, [0.01, 0.99])
    floor = _NEAR * float(body[1] - body[0])
    found = apart > np.maximum(_TAIL * float(np.quantile(apart, 0.95)) + motion, floor)
    label, _ = scipy.ndimage.label(found)
    found &= np.bincount(label.ravel())[label] <= LONGEST
    return found if np.mean(found) <= MOST else np.zeros_like(found)


def repaired(values: FloatArray, wild: BoolArray) -> FloatArray:
    """Return the signal (n,) with its wild samples taken between their neighbours."""
    if not wild.any():
        return values
    place = np.arange(values.size)
    return np.interp(place, place[~wild], values[~wild])


def repaired_where_off(
    values: FloatArray, suspect: BoolArray, instead: FloatArray | None = None
) -> FloatArray:
    """Return a signal (n,) with those suspect samples between their neighbours that are off their path.

    A residual does not tell whether input or output was wild. The one that was not is kept: between its
    neighbours a turn would lose its extreme, which is remembered.

    Parameters
    ----------
    instead
        What is put there (n,), such as what a fit predicts; None: the line between the neighbours.
    """
    between = repaired(values, suspect)
    _, moving = _motion(between)
    off = suspect & ~(np.abs(values - between) <= _TURN * moving)
    return repaired(values, off) if instead is None else np.where(off, instead, values)


@dataclass(frozen=True, slots=True)
class Tamed:
    """A measured signal pair with its wild samples between their neighbours, and which they were."""

    input: FloatArray  # (n,)
    output: FloatArray  # (n,)
    wild: BoolArray  # (n,)


def tame(signals: Sequence[tuple[FloatArray, FloatArray]]) -> list[Tamed]:
    """Return records, pairs of input and output (n,), without their wild samples.

    A short excursion of the input may be real: a reversal curve that begins at saturation for one sample. It
    then is in the output, there and in the memory. A quick fit with and without the excursions tells: what
    fits better is true.
    """
    found = [(isolated(u), isolated(y)) for u, y in signals]
    inputs = [repaired(u, wild) for (u, _), (wild, _) in zip(signals, found, strict=True)]
    if any(wild.any() for wild, _ in found) and not _fits_better(signals, inputs, found):
        inputs = [u for u, _ in signals]
        found = [(np.zeros_like(in_input), in_output & ~in_input) for in_input, in_output in found]
    return [
        Tamed(u, repaired(y, in_output), in_input | in_output)
        for u, (_, y), (in_input, in_output) in zip(inputs, signals, found, strict=True)
    ]


def _fits_better(
    signals: Sequence[tuple[FloatArray, FloatArray]],
    inputs: Sequence[FloatArray],
    found: Sequence[tuple[BoolArray, BoolArray]],
) -> bool:
    """Tell whether the repaired ``inputs`` leave less than the measured ones, of weights of either sign."""
    low, high = min(float(u.min()) for u, _ in signals), max(float(u.max()) for u, _ in signals)
    plane = Plane.uniform(low, high, _QUICK_LEVELS)

    def left(given: Sequence[FloatArray]) -> float:
        records = [
            Record(u, y, np.where(in_output & ~in_input, 0.0, 1.0))
            for u, (_, y), (in_input, in_output) in zip(given, signals, found, strict=True)
        ]
        equations = normal_equations(plane, levelled(records)[0], "continuous")
        masses = nnls.solve_signed(*smoothed(equations, _QUICK_SMOOTHING))
        return equations.rms(masses, equations.offset(masses))

    return left(inputs) < left([u for u, _ in signals])
