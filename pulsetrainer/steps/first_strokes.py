"""First strokes of devices that were never cycled before: no later one repeats them, and a model misses them.

Where several later strokes from the same end are alike, the record alone shows the first one
(``core.initial_state``). Elsewhere a fit shows it: without the first stroke it leaves far less of the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pulsetrainer.artefacts import BoolArray, Run
from pulsetrainer.core.fit import Fitted
from pulsetrainer.core.initial_state import known_from, second_stroke
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.thresholds import LIMITS

FALLS = 2.0  # times what is left of later strokes without the first one: what must be left with it


def apart(
    on: Callable[..., Fitted], fitted: Fitted, runs: Sequence[Run], masks: Sequence[BoolArray]
) -> list[int]:
    """Return how many samples of each run are a first stroke that keeps the fit from the rest; 0 for none.

    ``on`` fits signals on a range, where ``kept`` (n,), and ``masks`` (n,) are wild samples. Without first
    strokes a fit must leave at most half as much of what comes later, and miss them three times as much.
    """
    low, high = fitted.operator.low, fitted.operator.high
    until = [_until(run, low, high) for run in runs]
    if not any(until):
        return until
    later = [np.arange(mask.size) >= at for mask, at in zip(masks, until, strict=True)]
    kept = [~mask & after for mask, after in zip(masks, later, strict=True)]
    trial = on([(run.input, run.output) for run in runs], low, high, kept=kept)
    left = _left(trial, kept)
    missed = _left(trial, [~mask & ~after for mask, after in zip(masks, later, strict=True)])
    helps = FALLS * left < _left(fitted, kept) and missed > LIMITS.first_stroke_missed * left
    return until if helps else [0] * len(until)


def of_later(on: Callable[..., Fitted], until: Sequence[int]) -> Callable[..., Fitted]:
    """Return a fit that does not count the first samples of each run, as many as ``until`` says."""

    def fit(
        signals: Sequence[tuple[FloatArray, FloatArray]],
        low: float,
        high: float,
        kept: Sequence[BoolArray] | None = None,
    ) -> Fitted:
        later = [np.arange(u.size) >= at for (u, _), at in zip(signals, until, strict=True)]
        both = later if kept is None else [one & k for one, k in zip(later, kept, strict=True)]
        return on(signals, low, high, kept=both)

    return fit


def _until(run: Run, low: float, high: float) -> int:
    """Where the second stroke of a run begins; 0 where it is long, or where the first is left out already."""
    at = second_stroke(run.input, low, high)
    shown = known_from(run.input, low, high, run.output) > known_from(run.input, low, high)
    return 0 if shown or at > LIMITS.first_stroke_most * run.input.size else at


def _left(fitted: Fitted, where: Sequence[BoolArray]) -> float:
    """Rms error of a fit over some samples (n,) of each record, where its memory is known."""
    found = []
    for record, residual, one in zip(fitted.records, fitted.residuals, where, strict=True):
        known = np.arange(one.size) >= known_from(record.input, fitted.operator.low, fitted.operator.high)
        found.append(residual[one & known])
    return root_mean_square(np.concatenate(found))
