"""Whether the output follows the velocity of the input: then a Preisach model is the wrong one.

A Preisach operator with weights mu >= 0 lags behind its input: over a closed cycle its loop turns one way.
The force of a damper or of friction leads the input: it jumps when the motion turns, or depends on how fast
the motion is. No choice of weights repairs that, whatever the polarity. The test needs no model of the
damper: the mean of the output over groups of equal velocity, f(v), is compared with the fitted operator.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.core.record import Record, counted, counted_output
from pulsetrainer.diagnosis import wording
from pulsetrainer.diagnosis.evidence import Evidence
from pulsetrainer.diagnosis.thresholds import LIMITS, PERCENT

_PARABOLA = 2  # degree


class Comparison(NamedTuple):
    """What is left of the output, rms, output unit, by two kinds of model."""

    preisach: float
    velocity: float  # a static function of the velocity, or of its sign where there is no time
    span: float
    beside: float = float("inf")  # that function, with a part in proportion to the input beside it

    @property
    def wrong(self) -> bool:
        """True where the output follows the velocity, and the operator fits badly."""
        return self.preisach > LIMITS.poor * self.span and self.velocity < LIMITS.better * self.preisach


def compare(
    records: Sequence[Record], dt_s: Sequence[float | None], residuals: Sequence[FloatArray]
) -> Comparison:
    """Compare the operator's residuals (n,) of each record with those of a function of the velocity.

    A part in proportion to the input, beside that function, is a spring beside a damper.

    ``dt_s`` is the time step of each record, s; None where only the order of the samples is known: the
    direction of motion then takes the place of the velocity.
    """
    output, left = counted_output(records), counted(records, residuals)
    steps = dt_s if None not in dt_s else [None] * len(records)
    speed = counted(records, [_velocity(r.input, step) for r, step in zip(records, steps, strict=True)])
    edges = np.unique(np.quantile(speed, np.linspace(0.0, 1.0, LIMITS.speed_groups + 1)[1:-1]))
    group = np.searchsorted(edges, speed, side="right")
    place = counted(records, [r.input for r in records])
    rest, apart = (_within(group, values) for values in (output, place))
    square = float(apart @ apart)
    beside = rest - apart * (float(rest @ apart) / square) if square > 0 else rest
    return Comparison(
        root_mean_square(left), root_mean_square(rest), float(np.ptp(output)), root_mean_square(beside)
    )


def _within(group: IntArray, values: FloatArray) -> FloatArray:
    """Values (n,) less the mean of their group."""
    mean = np.bincount(group, weights=values) / np.maximum(np.bincount(group), 1)
    return np.asarray(values - mean[group])


def _velocity(u: FloatArray, dt_s: float | None) -> FloatArray:
    """Slope of local parabolas (n,), input unit per s; without time its sign."""
    if u.size < LIMITS.speed_window:
        return np.sign(np.gradient(u)) if dt_s is None else np.gradient(u, dt_s)
    slope = scipy.signal.savgol_filter(u, LIMITS.speed_window, _PARABOLA, deriv=1, delta=dt_s or 1.0)
    return np.sign(slope) if dt_s is None else np.asarray(slope)


def evidence(found: Comparison) -> Evidence:
    """Return the comparison as evidence against the kind of model."""
    percent = PERCENT / found.span
    figures = {"preisach": found.preisach * percent, "velocity": found.velocity * percent}
    if found.beside < LIMITS.better * found.velocity:
        return Evidence("wrong kind, both", figures=figures | {"beside": found.beside * percent})
    return Evidence("wrong kind", figures=figures)


def warning(found: Comparison, input_quantity: str, output_quantity: str) -> str:
    """Return in words that the model is the wrong one, or nothing."""
    if not found.wrong:
        return ""
    return wording.text(evidence(found), {"input": input_quantity, "output": output_quantity})
