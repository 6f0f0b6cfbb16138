"""Gates on the raw data, before any model: what fires is a finding, and its samples are masked."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record

BoolArray = NDArray[np.bool_]

_OUTLIER_SIGMAS = 8.0  # of Gaussian noise one sample in 10^15
_LINE = 5  # samples beside a suspect that may explain it
_STICKING_SIGMAS = 7.0  # of the difference of two short means
_USED = 2  # times, on average, each value of a quantised output occurs at least
_TRACKING_SHARE = 0.02  # of the input's range
_OUTSIDE_SHARE = 0.01
_LEFT_OVER = 0.25  # of the samples with weight


@dataclass(frozen=True)
class Firing:
    """One gate that fired."""

    cause: str
    text: str
    share: float  # of the samples
    value: float  # the size of it
    unit: str  # "y", "u" or "1"
    mask: BoolArray | None = None  # samples to leave out
    spread: float = 0.0  # of the value, where it is known


def noise_of(y: FloatArray, weight: FloatArray | None = None) -> float:
    """White noise (rms) of a record from its third differences, robust against jumps.

    A smooth output hardly has any; of white noise they have twenty times the variance. Where samples
    without ``weight`` were filled in there is no noise to be seen.
    """
    if y.size < 8:
        return 0.0
    third = np.diff(y, 3)
    if weight is not None:
        known = ndimage.minimum_filter1d(weight, 4, origin=-2)[:-3] > 0
        third = third[known] if np.count_nonzero(known) >= 8 else third
    return float(np.median(np.abs(third - np.median(third))) / 0.6745 / np.sqrt(20.0))


def coarse_step(y: FloatArray) -> float:
    """Step of the output where it is coarse against its noise, else 0: its error does not average out."""
    step = spacing_of(y)
    return step if step > 1.5 * noise_of(y) else 0.0


def spacing_of(y: FloatArray) -> float:
    """Distance of the distinct values of ``y``: the step of its converter."""
    values = np.unique(y)
    return float(np.median(np.diff(values))) if values.size > 1 else 0.0


def check(record: Record, low: float, high: float) -> list[Firing]:
    """All gates on one record; ``low`` and ``high`` are the range that was identified."""
    wild = _outliers(record)
    calm = record
    if wild is not None and wild.mask is not None:  # wild samples pile up at the converter's end
        good = np.flatnonzero(~wild.mask)
        calm = replace(record, output=np.interp(np.arange(wild.mask.size), good, record.output[good]))
    cut = _saturated(calm)
    found = [
        cut,
        wild,
        _quantised(record),
        None if cut is not None else jumps(calm, high - low),
        _tracking(record, high - low),
        _outside(record, low, high),
    ]
    return [one for one in found if one is not None]


def _saturated(record: Record) -> Firing | None:
    """Maxima, or minima, that repeat exactly far more often than the values just inside them."""
    y, span = record.output, float(np.ptp(record.output))
    step = spacing_of(y)
    for rail, side in ((float(y.max()), 1.0), (float(y.min()), -1.0)):
        at = np.abs(y - rail) <= 0.5 * step
        # a pile at the end of a distribution: noise makes a tail there instead
        inside = (np.abs(y - rail) <= 10.5 * step) & ~at & (np.abs(y - rail) < 0.02 * span)
        moving = np.count_nonzero(at) > 20 and np.count_nonzero(at) > 2.0 * np.count_nonzero(inside)
        if moving and noise_of(y) > 0.5 * step and side > 0:
            share = float(at.mean())
            return Firing(
                "saturation",
                f"{np.count_nonzero(at)} samples sit at exactly {rail:.4g}: the output is cut off there",
                share,
                rail,
                "y",
                # next to it only the samples with low noise are left: those must go too
                ndimage.binary_dilation(at, iterations=3)
                | (ndimage.uniform_filter1d(y, 9) > rail - 3.0 * noise_of(y, np.where(at, 0.0, 1.0))),
                step,
            )
    return None


def _outliers(record: Record) -> Firing | None:
    """Samples far from the median around them, farther than fast turns go."""
    y = record.output
    apart = np.abs(y - ndimage.median_filter(y, 7, mode="nearest"))
    # a tip at full speed also stands out from its median, by up to three steps of the fast branches
    usual = 4.0 * float(np.quantile(np.abs(np.diff(y)), 0.95))
    limit = max(_OUTLIER_SIGMAS * np.sqrt(2.0) * noise_of(y), usual, 2.0 * spacing_of(y))
    wild = apart > limit
    for at in np.flatnonzero(wild):  # where a stroke ends with a jump, its last sample still lies on it
        wild[at] = min(_off_line(y, int(at), -1), _off_line(y, int(at), 1)) > limit
    if np.count_nonzero(wild) < 3:
        return None
    return Firing(
        "outliers",
        f"{np.count_nonzero(wild)} samples stand out from those around them by more than {limit:.3g}",
        float(wild.mean()),
        float(apart[wild].max()),
        "y",
        wild,
    )


def _off_line(y: FloatArray, at: int, side: int) -> float:
    """Distance of a sample from the line through those on one side of it, robust against a wild one there."""
    near = y[max(at - _LINE, 0) : at][::-1] if side < 0 else y[at + 1 : at + 1 + _LINE]
    if near.size < _LINE:
        return float("inf")
    steps = np.arange(1, _LINE + 1)
    first, second = np.triu_indices(_LINE, 1)
    slope = np.median((near[second] - near[first]) / (steps[second] - steps[first]))  # Theil and Sen
    return float(abs(y[at] - np.median(near - slope * steps)))


def jumps(record: Record, reach: float) -> Firing | None:
    """Jumps that last, while the input moves slowly: far more than noise or a smooth branch makes."""
    y, sigma = record.output, noise_of(record.output)
    wide = max(3, round(0.006 / record.step))
    if y.size < 20 * wide or coarse_step(y) > 0:
        return None
    total = np.concatenate(([0.0], np.cumsum(y)))
    at = np.arange(wide, y.size - wide)  # the first sample after a jump
    jump = np.zeros(y.size)
    jump[at] = (total[at + wide] - 2.0 * total[at] + total[at - wide]) / wide
    size = np.abs(jump)
    rate = ndimage.uniform_filter1d(np.gradient(record.input, record.step), 5 * wide) / reach
    moved = np.abs(rate)
    # where the input changes its rate other causes make jumps too
    change = np.abs(np.roll(rate, -6 * wide) - np.roll(rate, 6 * wide))
    slow = (moved > 0.1) & (moved < 3.0) & (change < 0.2 * moved)
    # a smooth branch has equal differences everywhere, a stuck one none between its jumps
    around = ndimage.median_filter(size[::wide], 15, mode="nearest").repeat(wide)[: y.size]
    least = _STICKING_SIGMAS * np.sqrt(2.0 / wide) * sigma
    peak = (size == ndimage.maximum_filter1d(size, 2 * wide + 1)) & (size > least)
    found = slow & peak & (size > 4.0 * around)
    if np.count_nonzero(found) < 15:
        return None
    typical = float(np.median(size[found]))
    return Firing(
        "stick-slip",
        f"{np.count_nonzero(found)} jumps of about {typical:.3g} between flat runs in slow motion",
        float(found.mean()),
        typical,
        "y",
    )


def _quantised(record: Record) -> Firing | None:
    y = record.output
    step, span = spacing_of(y), float(np.ptp(y))
    # steps show where values come again; in a short record all may differ, far apart as they are
    if span == 0 or step < 0.004 * span or _USED * np.unique(y).size > y.size:
        return None
    return Firing(
        "quantisation",
        f"the output comes in steps of {step:.4g}, {100 * step / span:.2g} % of its span",
        1.0,
        step,
        "y",
        spread=0.5 * float(np.ptp(np.quantile(np.diff(np.unique(y)), [0.05, 0.95]))),
    )


def _tracking(record: Record, reach: float) -> Firing | None:
    if record.reference is None:
        return None
    error = np.abs(record.input - record.reference)
    worst = float(np.quantile(error, 0.99))
    if worst <= _TRACKING_SHARE * reach:
        return None
    return Firing(
        "current-tracking",
        f"the input differs from its reference by {worst:.3g} or more in one sample of a hundred",
        float(np.mean(error > _TRACKING_SHARE * reach)),
        worst,
        "u",
    )


def _outside(record: Record, low: float, high: float) -> Firing | None:
    """Input beyond the range; what it leaves in the memory lasts until the other end is reached."""
    slack = _OUTSIDE_SHARE * (high - low)
    above, below = record.input > high + slack, record.input < low - slack
    outside = above | below
    if not outside.any():
        return None
    beyond = float(np.max(np.maximum(low - record.input, record.input - high)))
    at_low, at_high = record.input <= low + slack, record.input >= high - slack
    lasting = _lasting(above, at_low) | _lasting(below, at_high)
    return Firing(
        "out-of-range",
        f"{np.count_nonzero(outside)} samples of the input lie outside {low:.4g} .. {high:.4g}, "
        f"by up to {beyond:.3g}",
        float(outside.mean()),
        beyond,
        "u",
        # an input that never comes to the other end leaves hardly any: then what is outside must do
        lasting
        if record.sample_weight[~lasting].sum() > _LEFT_OVER * record.sample_weight.sum()
        else outside,
    )


def _lasting(begins: BoolArray, ends: BoolArray) -> BoolArray:
    """From every sample that ``begins`` to the next that ``ends``, which is not in it."""
    number = np.arange(begins.size)
    last_begin = np.maximum.accumulate(np.where(begins, number, -1))
    last_end = np.maximum.accumulate(np.where(ends, number, -1))
    return np.asarray(last_begin > last_end)
