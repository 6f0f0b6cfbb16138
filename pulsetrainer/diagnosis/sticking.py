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
_SURE = 8.0  # standard deviations of noise
_LIKE_SAWTOOTH = (
    0.25,
    1.4,
)  # fundamental over F / pi: where the model errs by some of F the phase is blurred


def sawtooth(problem: Problem, fitted: Fitted) -> Firing | None:
    """Return the size of the jumps if what a model leaves is such a sawtooth."""
    strokes: list[tuple[FloatArray, FloatArray]] = []
    noise = []
    reach = problem.plane.high - problem.plane.low
    for record, said in zip(problem.records, fitted.simulator.full(fitted.terms), strict=True):
        noise.append(noise_of(record.output, record.weight))
        left = record.output - said
        turns = input_noise.real_turns(record.input, 0.02 * reach)
        for begin, end in pairwise(turns.tolist()):
            if end - begin > 5 * _SAMPLES and np.all(record.weight[begin:end] > 0):
                stroke = left[begin:end]
                strokes.append((said[begin:end], stroke - stroke.mean()))
    span = float(np.ptp(problem.measured))
    count = round(np.log(_LARGEST / _SMALLEST) / _FINENESS)
    best: tuple[float, float, float] = (0.0, 0.0, 0.0)
    for period in np.geomspace(_SMALLEST, _LARGEST, count) * span:
        power, squares, used, total = 0.0, 0.0, 0, 0
        for said, left in strokes:
            moved = abs(float(said[-1] - said[0]))
            if moved < _PERIODS * period or moved * _SAMPLES > period * said.size:
                continue
            along = abs(complex(left @ np.exp(-2j * np.pi / period * said))) ** 2
            power += along / said.size
            squares += 4.0 * along
            total += said.size**2
            used += 1
        if used < 3:
            continue
        white = float(np.mean(np.square(noise)))
        sure = (power / white - used) / np.sqrt(used) if white > 0 else float("inf")
        if sure > best[0]:
            best = sure, float(period), float(np.sqrt(squares / total))
    sure, period, amplitude = best
    if sure < _SURE or not _LIKE_SAWTOOTH[0] < amplitude * np.pi / period < _LIKE_SAWTOOTH[1]:
        return None
    return Firing(
        "stick-slip",
        f"the output follows in jumps of about {period:.3g}, whatever the rate",
        1.0,
        period,
        "y",
    )
