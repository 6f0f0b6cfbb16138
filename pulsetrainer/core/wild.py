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

from pulsetrainer.core import input_noise, nnls
from pulsetrainer.core.equations import normal_equations
from pulsetrainer.core.plane import BoolArray, FloatArray, Plane, ends_of
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
_TURN = 1.0  # such steps a turn may be away from the path of its neighbours
_USUAL = 1.0  # times the median step of a prediction: larger ones are jumps
_SIDE = 3  # samples whose path is continued
_OF_FOURTH = 1.0 / (0.6745 * 70.0**0.5)  # standard deviation of noise, of the median fourth difference
_SIGMAS = 8.0  # a peak of noise with exponential tails is higher once in 100 000 samples
_BOTH = 2.5  # times the steps near by: a stroke of one sample makes two, up and down
_HELD = 0.2  # of all steps are zero: the samples are those of a coarse converter ...
_FLICKER = 1.5  # ... and a peak of one of its steps is a flicker
_REAL_TURN = 0.02  # of the range of the input: smaller turns may be noise
_AFTER_TURN = 6  # samples that a jump at a turn may be seen in
_CHANCE = 1e-4  # that as many wild samples lie at turns
_LOOKS = 6  # each without what the one before it found
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
        kept = np.flatnonzero(~found)
        left = values[kept]
        step, moving = _motion(left)
        middle = scipy.ndimage.median_filter(left, size=_WINDOW, mode="mirror")
        moving = np.minimum(moving, _MIDDLE * _motion(middle)[1])
        usual = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
        more = _exceptions(_far(left, _STEPS * moving + _QUANTA * usual))
        if not more.any():  # what is far off is gone and spoils no path
            more = _peaks(left, moving)
        longer = found.copy()
        longer[kept[more]] = True
        longer = found | _exceptions(longer)  # what would make a run too long is left
        if np.array_equal(longer, found):
            break
        found = longer
    return found if np.mean(found) <= MOST else np.zeros_like(found)


def _motion(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Steps (n,) of a signal (n,), and how large they are near by."""
    step = np.abs(np.diff(values, prepend=values[:1]))
    return step, scipy.ndimage.percentile_filter(step, _FAST, size=_AROUND, mode="mirror")


def off(
    outputs: Sequence[FloatArray],
    predicted: Sequence[FloatArray],
    span: float,
    doubtful: Sequence[BoolArray] | None = None,
) -> list[BoolArray]:
    """Tell for each sample of each record whether what a fit leaves there is far from what it leaves near by.

    Where ``predicted`` jumps from sample to sample it may be off by as much. Nothing closer than a hundredth
    of ``span``, that of the output, is wild; a fit that leaves more than a twentieth of it throughout tells
    nothing of single samples. ``doubtful`` samples (n,) may be wild: they do not count for what is usual,
    and where the fit tells nothing they are returned.
    """
    unsure = [np.zeros(y.size, dtype=bool) for y in outputs] if doubtful is None else doubtful
    found = []
    for y, said, doubt in zip(outputs, predicted, unsure, strict=True):
        left = y - said
        if y.size >= FEWEST and np.median(np.abs(left)) <= _FITS * span:
            far = _far(left, _NEAR * span + _jumps_beside(said), ~doubt)
            found.append((far & doubt) | _exceptions(far & ~doubt))
        else:
            found.append(doubt)
    return found


def by_chance(found: BoolArray, inputs: FloatArray, span: float) -> BoolArray:
    """Return the samples ``found`` (n,), without those at turns of the input (n,) if chance puts fewer there.

    Wild samples come at any time. What comes at turns more often than that is the device, whose output jumps
    there, as a force does that follows the speed. ``span`` is the range of the input.
    """
    at_turn = np.zeros(found.size, dtype=bool)
    for turn in input_noise.real_turns(inputs, _REAL_TURN * span):
        at_turn[max(turn - 1, 0) : turn + _AFTER_TURN] = True
    there, count = int(np.count_nonzero(found & at_turn)), int(np.count_nonzero(found))
    if there == 0 or scipy.special.bdtrc(there - 1, count, float(at_turn.mean())) > _CHANCE:
        return found
    return found & ~at_turn


def _jumps_beside(values: FloatArray) -> FloatArray:
    """How much larger than usual the steps (n,) before and after the neighbours of a sample are.

    Those to itself do not count.
    """
    step = np.abs(np.diff(values))
    more = np.pad(np.maximum(step - _USUAL * float(np.median(step)), 0.0), 2)
    return np.maximum(more[:-3], more[3:])


def _far(values: FloatArray, motion: FloatArray, usual: BoolArray | slice = slice(None)) -> BoolArray:
    """Where values (n,) are further from their neighbours' median than noise and ``motion`` (n,) make.

    Noise is read off the samples (n,) that are ``usual``.
    """
    # mirrored, so that the first and the last sample are alone among their neighbours too
    apart = np.abs(values - scipy.ndimage.median_filter(values, size=_WINDOW, mode="mirror"))
    tail = _TAIL * float(np.quantile(apart[usual], 0.95))
    return apart > np.maximum(tail + motion, _NEAR * _body(values[usual]))


def _exceptions(found: BoolArray) -> BoolArray:
    """Return those of the samples (n,) that are in short runs; none where they are too many."""
    label, _ = scipy.ndimage.label(found)
    found = found & (np.bincount(label.ravel())[label] <= LONGEST)
    return found if np.mean(found) <= MOST else np.zeros_like(found)


def _peaks(values: FloatArray, motion: FloatArray) -> BoolArray:
    """Where values (n,) lie beyond both neighbours, and beyond where either side was going to.

    A turn lies on the line of the samples before it or of those after it, so this sees what is much smaller
    than a stroke. A stroke that is as short as one sample is no faster than others.
    """
    step = np.abs(np.diff(values))
    held = np.mean(step == 0) > _HELD and np.any(step > 0)
    flicker = _FLICKER * float(np.median(step[step > 0])) if held else 0.0
    before2, before, here, after, after2 = np.lib.stride_tricks.sliding_window_view(values, 5).T
    # noise may go with the level: fourth differences, which hold no motion, tell it near by
    rough = np.abs(before2 - 4.0 * before + 6.0 * here - 4.0 * after + after2)
    near_by = scipy.ndimage.median_filter(rough, size=_AROUND, mode="mirror") * _OF_FOURTH
    noise = _SIGMAS * np.maximum(input_noise.white(values), near_by)
    around = np.stack((before, after, 2.0 * before - before2, 2.0 * after - after2))
    beyond = np.maximum(here - around.max(axis=0), around.min(axis=0) - here)
    both = np.abs(here - before) + np.abs(here - after)
    least = max(flicker, _NEAR * _body(values))
    found = (beyond > np.maximum(noise, least)) & (both > noise + _BOTH * motion[2:-2])
    found = _exceptions(found)
    # beside a wild sample a turn looks like one too: it is looked at again without
    found &= both >= scipy.ndimage.maximum_filter1d(np.where(found, both, 0.0), 5)
    return np.pad(found, 2)  # at the ends there is one side only


def _body(values: FloatArray) -> float:
    """Span of all values (n,) but the outermost hundredths."""
    low, high = np.quantile(values, [0.01, 0.99])
    return float(high - low)


def runs_of(at: BoolArray) -> list[tuple[int, int]]:
    """Return where each run of samples that are ``at`` (n,) begins, and the first sample after it."""
    ends = np.flatnonzero(np.diff(at, prepend=False, append=False)).tolist()
    return list(zip(ends[::2], ends[1::2], strict=True))


def repaired(values: FloatArray, wild: BoolArray) -> FloatArray:
    """Return the signal (n,) with its wild samples taken between their neighbours."""
    if not wild.any():
        return values
    place = np.arange(values.size)
    return np.interp(place, place[~wild], values[~wild])


def through_turns(values: FloatArray, wild: BoolArray) -> FloatArray:
    """Return the signal (n,) with its wild samples on the path of their neighbours, which may turn there.

    Where both sides move towards the same extreme they are continued until they meet: on the line between
    its neighbours a turn would lose its extreme, which is remembered.
    """
    path = repaired(values, wild)
    for first, end in runs_of(wild):
        left, right = path[max(first - _SIDE, 0) : first], path[end : end + _SIDE][::-1]
        if end - first > LONGEST or min(left.size, right.size) < _SIDE:
            continue
        steps = np.concatenate((np.diff(left), np.diff(right)))
        if not (np.all(steps > 0) or np.all(steps < 0)):
            continue
        sign = np.sign(steps[0])
        ahead = np.arange(1.0, end - first + 1)
        met = np.minimum(_continued(sign * left, ahead), _continued(sign * right, ahead[::-1]))
        path[first:end] = sign * np.maximum(met, sign * path[first:end])
    return path


def _continued(side: FloatArray, ahead: FloatArray) -> FloatArray:
    """Three samples continued ``ahead`` (k,) samples, by a parabola where they slow down, else by a line."""
    step = side[2] - side[1]
    bend = min(step - (side[1] - side[0]), 0.0)
    return side[2] + ahead * step + 0.5 * ahead * (ahead + 1) * bend


def repaired_where_off(
    values: FloatArray, suspect: BoolArray, instead: FloatArray | None = None
) -> FloatArray:
    """Return a signal (n,) with those suspect samples mended that are off the path of their neighbours.

    A residual does not tell whether input or output was wild. The one that was not is kept. ``instead`` (n,)
    is put there, such as what a fit predicts; None: the path of the neighbours.
    """
    path = through_turns(values, suspect)
    _, moving = _motion(path)
    off = suspect & ~(np.abs(values - path) <= _TURN * moving)
    return through_turns(values, off) if instead is None else np.where(off, instead, values)


@dataclass(frozen=True, slots=True)
class Tamed:
    """A measured signal pair with its wild samples on the path of their neighbours, and which they were."""

    input: FloatArray  # (n,)
    output: FloatArray  # (n,)
    wild_input: BoolArray  # (n,)
    wild_output: BoolArray  # (n,)


def tame(signals: Sequence[tuple[FloatArray, FloatArray]]) -> list[Tamed]:
    """Return records, pairs of input and output (n,), without their wild samples.

    A short excursion of the input may be real: a reversal curve that begins at saturation for one sample. It
    then is in the output, there and in the memory. A quick fit with and without the excursions tells: what
    fits better is true.
    """
    found = [(isolated(u), isolated(y)) for u, y in signals]
    inputs = [through_turns(u, wild) for (u, _), (wild, _) in zip(signals, found, strict=True)]
    if any(wild.any() for wild, _ in found) and not fits_better(signals, inputs, found):
        inputs = [u for u, _ in signals]
        found = [(np.zeros_like(in_input), in_output & ~in_input) for in_input, in_output in found]
    return [
        Tamed(u, repaired(y, in_output), in_input, in_output)
        for u, (_, y), (in_input, in_output) in zip(inputs, signals, found, strict=True)
    ]


def fits_better(
    signals: Sequence[tuple[FloatArray, FloatArray]],
    inputs: Sequence[FloatArray],
    found: Sequence[tuple[BoolArray, BoolArray]],
) -> bool:
    """Tell whether other ``inputs`` (n,) leave less than those of the ``signals``, of weights of either sign.

    ``found`` tells for each record which samples (n,) are wild in the input, and in the output: the latter do
    not count.
    """
    lost = [in_output & ~in_input for in_input, in_output in found]
    others = [(u, y) for u, (_, y) in zip(inputs, signals, strict=True)]
    return left_by_a_quick_fit(others, lost) < left_by_a_quick_fit(signals, lost)


def left_by_a_quick_fit(signals: Sequence[tuple[FloatArray, FloatArray]], lost: Sequence[BoolArray]) -> float:
    """Return the rms that a coarse fit of weights of either sign leaves of the outputs, output unit.

    ``signals`` are input and output of each record, both (n,); infinity where no input moves. The output does
    not count in the samples that are ``lost`` (n,).
    """
    # one input that is far off would leave all others in one cell of a common plane
    low, high = ends_of([u for u, _ in signals])
    if not high > low:
        return float("inf")
    plane = Plane.uniform(low, high, _QUICK_LEVELS)
    records = [Record(u, y, np.where(bad, 0.0, 1.0)) for (u, y), bad in zip(signals, lost, strict=True)]
    equations = normal_equations(plane, levelled(records)[0], "continuous")
    masses = nnls.solve_signed(*smoothed(equations, _QUICK_SMOOTHING))
    return equations.rms(masses, equations.offset(masses))
