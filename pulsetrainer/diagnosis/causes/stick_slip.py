"""the output sticks, then jumps: found on the raw data, or in what a fit leaves.

The value at which the output sticks follows from the exact moment of the last jump, so no model of the jumps
can be fitted sample by sample. What repeats is their size F. Large jumps are seen one by one. Small ones are
not; but while the output sticks, the residual falls as fast as the model's output M rises, and at the end it
jumps by F. As a function of M, the residual of a stroke is therefore a sawtooth with period F and fundamental
F/pi, whatever the rate. Its phase differs from stroke to stroke, so the powers are added:

    P(F) = sum over strokes |sum r exp(-2 pi i M / F)|^2 / n.

For white noise this is sigma^2 times a gamma variable with as many degrees as there are strokes (Scargle,
Astrophysical Journal 263, 1982). Errors of the levels are periodic too, but far smaller than their period.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import input_noise
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import OfTheRecord
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.raw import Firing, Raw, coarse_step, evenly, noise_of
from pulsetrainer.diagnosis.thresholds import TINY

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.fitting import Fitted

# Jumps one by one
_WIDE_S = 0.006  # width of each of the two means whose difference is a jump
_WIDE_LEAST = 3  # samples in each mean, at least
_SHORTEST = 20  # times that width: a shorter record shows no jumps
_RATE = 5  # times that width, over which the rate of the input is averaged
_APART = 6  # times that width, before and after: where the rate changes, other causes make jumps too
_RATES = (0.1, 3.0)  # ranges a second: slow motion, where sticking shows
_EVEN = 0.2  # of the rate: a larger change of it is a turn
_SIGMAS = 7.0  # of the noise of the difference of two means
_AROUND = 15  # such differences in a median: equal on a smooth branch, zero between the jumps of a stuck one
_SHARPER = 4.0  # times that median
_JUMPS = 15  # fewer may be chance
_LEVELS = 8  # of the output, each with its own noise
_REST = 0.02  # ranges a second: slower is rest
_ENOUGH = 40  # times that width: samples needed to estimate the noise of a level
_QUIET = 0.25  # quantile of slow samples: jumps spoil the larger ones
# Sawtooth of what is left
_PERIODS = (0.008, 0.08)  # sizes sought, of the span: smaller is quantisation, larger is seen jump by jump
_FINENESS = 0.004  # from one period to the next, relative
_BINS = 16.0  # per shortest period, into which the residual is sorted
_TURN = 0.02  # of the range: smaller turns of the input are noise
_STROKE_PERIODS = 3.0  # in a stroke, at least
_SAMPLES = 4.0  # in a period, at least
_STROKE = 5.0  # periods with that many samples: shorter strokes are left out
_STROKES = 5  # at least; fewer show no period
_SURE = 8.0  # standard deviations of noise
_LIKE = (0.2, 1.4)  # fundamental over F/pi, from, to: errors of the model of the order of F blur the phase
_SHARP = 4.0  # times what neighbouring periods show: other errors have no sharp period (decision 044)
_BESIDE = ((0.8, 0.93), (1.07, 1.25))  # times the period: the neighbouring ones
_BOTH = 4.0  # 2 squared: an amplitude is twice what one of its two frequencies shows

Strokes = list[tuple[FloatArray, FloatArray]]  # model's output and residual, each (n,)


class StickSlip(OfTheRecord):
    """Flat runs and jumps of one size."""

    id = "stick-slip"
    title = "the {output} sticks, then jumps"
    formula = "y is held until |P[u] - y| > F, then jumps"
    signature = "flat stretches and then jumps of about equal size while the input moves slowly"
    excitation = "slow ramps"
    source = "Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30, 1994"
    order = 3
    family = "stick-slip"
    jagged = True
    blinded_by = ("saturation", "frozen")
    doubted = True
    size = "of a typical jump of the {output}"
    texts = sentences("""
        gate: {count:.0f} jumps of about {size:.3g}{in_y} between flat stretches in slow motion
        left: the output moves in jumps of about {size:.3g}{in_y}, whatever the rate
    """)

    def gate(self, raw: Raw) -> Firing | None:
        """Jumps that last, while the input moves slowly: far more than noise or a smooth branch makes."""
        record = evenly(raw.calm, raw.stamps)
        dt_s = record.step / raw.second
        wide = max(_WIDE_LEAST, round(_WIDE_S / dt_s))
        if record.output.size < _SHORTEST * wide or coarse_step(raw.calm.output) > 0:
            return None
        moved = _jumps(record.output, wide)
        size = np.abs(moved)
        rate = scipy.ndimage.uniform_filter1d(np.gradient(record.input, dt_s), _RATE * wide) / raw.reach
        noise = np.sqrt(2.0 / wide) * noise_of(record.output)
        least = _SIGMAS * np.maximum(_spread(moved, record.output, np.abs(rate), wide), noise)
        peak = (size == scipy.ndimage.maximum_filter1d(size, 2 * wide + 1)) & (size > least)
        broken = replace(raw, record=record, stamps=None).beside_breaks(_APART * wide)
        found = _slow(rate, wide) & peak & (size > _SHARPER * _around(size, wide)) & ~broken
        count = np.count_nonzero(found)
        if count < _JUMPS:
            return None
        typical = float(np.median(size[found]))
        figures = {"count": float(count), "size": typical}
        return Firing(self.id, "gate", typical, "{y}", figures)

    def gate_left(self, fitted: Fitted) -> Firing | None:
        """Return the size of the jumps if what a model leaves is a sawtooth of its own output."""
        problem = fitted.problem
        noise = [noise_of(record.output, record.sample_weight) for record in problem.records]
        white = float(np.mean(np.square(noise)))
        strokes = _strokes(fitted)
        if not strokes or white <= 0.0:
            return None
        count = round(np.log(_PERIODS[1] / _PERIODS[0]) / _FINENESS)
        period = np.geomspace(*_PERIODS, count) * float(np.ptp(problem.measured))
        power, squares, used = _lines(strokes, period)
        enough = used >= _STROKES
        if not enough.any():
            return None
        used = np.maximum(used, 1.0)
        sure = np.where(enough, (power / white - used) / np.sqrt(used), 0.0)
        amplitude = np.where(enough, np.sqrt(squares), 0.0)
        best = int(np.argmax(sure))
        ratio = period / period[best]
        beside = np.any([(low < ratio) & (ratio < high) for low, high in _BESIDE], axis=0)
        sharp = sure[best] > max(_SURE, _SHARP * float(np.median(sure[beside])) if beside.any() else 0.0)
        # coloured noise lifts all periods alike
        level = float(np.median((power / used)[beside])) if beside.any() else white
        sharp = sharp and power[best] / max(level, white) - used[best] > _SURE * np.sqrt(used[best])
        if not sharp or not _LIKE[0] < amplitude[best] * np.pi / period[best] < _LIKE[1]:
            return None
        size = float(period[best])
        return Firing(self.id, "left", size, "{y}", {"size": size})


def _jumps(y: FloatArray, wide: int) -> FloatArray:
    """Difference (n,) of the means of ``wide`` samples from each sample on and before it."""
    total = np.concatenate(([0.0], np.cumsum(y)))
    at = np.arange(wide, y.size - wide)  # the first sample after a jump
    jump = np.zeros(y.size)
    jump[at] = (total[at + wide] - 2.0 * total[at] + total[at - wide]) / wide
    return jump


def _around(jumps: FloatArray, wide: int) -> FloatArray:
    """Median (n,) of the jumps around each sample."""
    return scipy.ndimage.median_filter(jumps[::wide], _AROUND, mode="nearest").repeat(wide)[: jumps.size]


def _spread(moved: FloatArray, output: FloatArray, speed: FloatArray, wide: int) -> FloatArray:
    """Standard deviation (n,) of the differences of two means by noise alone, whatever its colour and level.

    At rest the output does not stick; where no rest is at a level, it is the slow samples that change least.
    """
    apart = np.abs(moved - _around(moved, wide))
    level = scipy.ndimage.uniform_filter1d(output, wide)
    edges = np.quantile(level, np.linspace(0.0, 1.0, _LEVELS + 1))
    group = np.clip(np.searchsorted(edges, level) - 1, 0, _LEVELS - 1)
    spread = np.zeros(_LEVELS)
    for k in range(_LEVELS):
        own = group == k
        for part, share in ((own & (speed < _REST), 0.5), (own & (speed < _RATES[1]), _QUIET), (own, _QUIET)):
            if np.count_nonzero(part) >= _ENOUGH * wide:
                spread[k] = float(np.quantile(apart[part], share)) / scipy.stats.norm.ppf(0.5 + 0.5 * share)
                break
    return spread[group]


def _slow(rate: FloatArray, wide: int) -> FloatArray:
    """Whether the input moves slowly and evenly at each sample (n,), by its rate."""
    moved = np.abs(rate)
    # both sides: between two rests a short ramp is no even motion, and all of it looks like a jump
    change = np.max([np.abs(np.roll(rate, side * _APART * wide) - rate) for side in (-1, 1)], axis=0)
    return np.asarray((moved > _RATES[0]) & (moved < _RATES[1]) & (change < _EVEN * moved))


def _strokes(fitted: Fitted) -> Strokes:
    """Return every stroke of the input that has no masked sample in it."""
    problem = fitted.problem
    reach = problem.plane.high - problem.plane.low
    found = []
    for record, said in zip(problem.records, fitted.simulator.full(fitted.terms), strict=True):
        left = record.output - said
        turns = input_noise.real_turns(record.input, _TURN * reach)
        for begin, end in pairwise(turns.tolist()):
            if end - begin > _STROKE * _SAMPLES and np.all(record.sample_weight[begin:end]):
                found.append((said[begin:end], left[begin:end] - left[begin:end].mean()))
    return found


def _lines(strokes: Strokes, period: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """For each period (k,) the power added over the strokes, the squared amplitude, and the strokes used.

    The residual of a stroke is put in narrow bins of the model's output: one product of matrices then gives
    all periods.
    """
    step = float(period[0]) / _BINS
    at = [np.round((said - said.min()) / step).astype(np.int64) for said, _ in strokes]
    rows = np.zeros((len(strokes), max(int(one.max()) for one in at) + 1))
    for row, one, (_, left) in zip(rows, at, strokes, strict=True):
        row[: one.max() + 1] = np.bincount(one, weights=left)
    turn = 2.0 * np.pi * step * np.arange(rows.shape[1])[:, None] / period
    along = (rows @ np.cos(turn)) ** 2 + (rows @ np.sin(turn)) ** 2
    size = np.asarray([float(said.size) for said, _ in strokes])[:, None]
    moved = np.asarray([abs(float(said[-1] - said[0])) for said, _ in strokes])[:, None]
    taken = (moved >= _STROKE_PERIODS * period) & (moved * _SAMPLES <= period * size)
    power = np.sum(np.where(taken, along / size, 0.0), axis=0)
    total = np.maximum(np.sum(np.where(taken, size**2, 0.0), axis=0), TINY)
    squares = _BOTH * np.sum(np.where(taken, along, 0.0), axis=0) / total
    return power, squares, np.count_nonzero(taken, axis=0).astype(np.float64)
