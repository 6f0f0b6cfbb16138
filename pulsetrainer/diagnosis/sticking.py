"""Sticking that no single jump shows: along a stroke the residual is a sawtooth of the model's own output.

While the output sticks, the residual falls as fast as the model's output rises; at the end it jumps by F. So
over the model's output M the residual of a stroke is periodic with period F and has the fundamental F/pi of
a sawtooth, whatever the rate. Its phase is another one in every stroke: the powers are added,

    P(F) = sum over strokes |sum r exp(-2 pi i M / F)|^2 / n,

which of white noise is sigma^2 times a gamma variable of as many degrees as there are strokes (Scargle,
Astrophysical Journal 263, 1982). Errors of the levels are periodic too, but far smaller than their period.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pulsetrainer.core import input_noise
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.gates import Firing, noise_of
from pulsetrainer.diagnosis.problem import Problem

_SMALLEST, _LARGEST = 0.008, 0.08  # periods sought, shares of the span
_FINENESS = 0.004  # from one period to the next, relative
_PERIODS = 3.0  # a stroke must hold
_SAMPLES = 4.0  # a period must hold
_STROKES = 5
_SURE = 8.0  # standard deviations of noise
# Fundamental over F / pi: where the model errs by some of F the phase is blurred.
_LIKE_SAWTOOTH = (0.2, 1.4)
_SHARP = 4.0  # times what periods beside it show: errors of other kinds have no sharp period
_BESIDE = ((0.8, 0.93), (1.07, 1.25))  # times the period

Strokes = list[tuple[FloatArray, FloatArray]]  # model's output and residual, each (n,)


def sawtooth(problem: Problem, fitted: Fitted) -> Firing | None:
    """Return the size of the jumps if what a model leaves is such a sawtooth."""
    noise = [noise_of(record.output, record.sample_weight) for record in problem.records]
    white = float(np.mean(np.square(noise)))
    strokes = _strokes(problem, fitted)
    if not strokes or white <= 0.0:
        return None
    count = round(np.log(_LARGEST / _SMALLEST) / _FINENESS)
    period = np.geomspace(_SMALLEST, _LARGEST, count) * float(np.ptp(problem.measured))
    sure, amplitude = np.asarray([_line(strokes, one, white) for one in period]).T
    best = int(np.argmax(sure))
    ratio = period / period[best]
    beside = np.any([(low < ratio) & (ratio < high) for low, high in _BESIDE], axis=0)
    sharp = sure[best] > max(_SURE, _SHARP * float(np.median(sure[beside])) if beside.any() else 0.0)
    share = amplitude[best] * np.pi / period[best]
    if not sharp or not _LIKE_SAWTOOTH[0] < share < _LIKE_SAWTOOTH[1]:
        return None
    return Firing(
        "stick-slip",
        f"the output follows in jumps of about {period[best]:.3g}, whatever the rate",
        1.0,
        float(period[best]),
        "y",
    )


def _strokes(problem: Problem, fitted: Fitted) -> Strokes:
    """Every stroke of the input without a masked sample in it."""
    reach = problem.plane.high - problem.plane.low
    found = []
    for record, said in zip(problem.records, fitted.simulator.full(fitted.terms), strict=True):
        left = record.output - said
        turns = input_noise.real_turns(record.input, 0.02 * reach)
        for begin, end in pairwise(turns.tolist()):
            if end - begin > 5 * _SAMPLES and np.all(record.sample_weight[begin:end] > 0):
                found.append((said[begin:end], left[begin:end] - left[begin:end].mean()))
    return found


def _line(strokes: Strokes, period: float, white: float) -> tuple[float, float]:
    """How far the power at one period is above noise, in its standard deviations, and the amplitude."""
    power, squares, total, used = 0.0, 0.0, 0, 0
    for said, left in strokes:
        moved = abs(float(said[-1] - said[0]))
        if moved < _PERIODS * period or moved * _SAMPLES > period * said.size:
            continue
        along = abs(complex(left @ np.exp(-2j * np.pi / period * said))) ** 2
        power += along / said.size
        squares += 4.0 * along
        total += said.size**2
        used += 1
    if used < _STROKES:
        return 0.0, 0.0
    return (power / white - used) / float(np.sqrt(used)), float(np.sqrt(squares / total))
