"""What a fit leaves out: wild samples, and first strokes of devices that were never cycled before.

Where several later strokes from the same end are alike, the record alone shows that the first one is apart
(``core.initial_state``). Elsewhere a fit shows it: without the first stroke it leaves far less of the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.artefacts import BoolArray, Run
from pulsetrainer.core import wild
from pulsetrainer.core.fit import Fitted
from pulsetrainer.core.forms import Kept, Signals
from pulsetrainer.core.initial_state import first_stroke_words, known_from, left_out_words, second_stroke
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.steps import fit_notes

_ROUNDS = 3  # of fits, each without the wild samples of the one before
_FALLS = 2.0  # times what is left of later strokes without the first one: what must be left with it


@dataclass(frozen=True)
class Rest:
    """A fit to what counts, the runs as it saw them, and what of each run it leaves out."""

    fitted: Fitted
    runs: list[Run]
    wild: list[BoolArray]  # (n,) of each run
    first_strokes: list[int]  # samples of each run that the fit alone shows to be apart

    def first_strokes_in_words(self, titles: Sequence[str]) -> list[str]:
        """Say which first strokes are left out, by the fit or by the record alone."""
        low, high = self.fitted.operator.low, self.fitted.operator.high
        said = [
            left_out_words(count) if count else first_stroke_words(run.input, run.output, low, high)
            for run, count in zip(self.runs, self.first_strokes, strict=True)
        ]
        return [f"{title}: {words}" for title, words in zip(titles, said, strict=True) if words]


def fit_to_the_rest(
    on: Callable[..., Fitted],
    reach: tuple[float, float],
    runs: list[Run],
    sure: Sequence[BoolArray],
    doubtful: Sequence[BoolArray],
    raw: Sequence[FloatArray],
) -> Rest:
    """Fit without wild samples, and without first strokes that keep the fit from what comes later.

    ``on`` fits signals on a range, where they are ``kept`` (n,). Samples that are known to be wild (n,) are
    ``sure``; those that only look so are ``doubtful``, and ``raw`` is their output (n,) as it was read.
    """
    fitted, mended, masks = _without_wild(on, reach, runs, sure, doubtful, raw)
    until = _first_strokes(on, fitted, mended, sure) if fit_notes.leaves_much(fitted) else [0] * len(runs)
    if any(until):

        def later(signals: Signals, low: float, high: float, kept: Kept = None) -> Fitted:
            after = [np.arange(u.size) >= at for (u, _), at in zip(signals, until, strict=True)]
            both = after if kept is None else [one & k for one, k in zip(after, kept, strict=True)]
            return on(signals, low, high, kept=both)

        fitted, mended, masks = _without_wild(later, reach, runs, sure, doubtful, raw)
    low, high = fitted.operator.low, fitted.operator.high
    strokes = [at and at - known_from(run.input, low, high) for run, at in zip(mended, until, strict=True)]
    return Rest(fitted, mended, masks, strokes)


def _without_wild(
    on: Callable[..., Fitted],
    reach: tuple[float, float],
    runs: list[Run],
    sure: Sequence[BoolArray],
    doubtful: Sequence[BoolArray],
    raw: Sequence[FloatArray],
) -> tuple[Fitted, list[Run], list[BoolArray]]:
    """Fit without the samples that are known to be wild, then without those that its residual shows.

    What only looks wild in the output beside its neighbours is ``doubtful``, such as a sharp turn: where the
    fit predicts the ``raw`` output (n,) it counts again. Whether input or output is wild a residual does not
    tell: what is off its own path is mended. The dual form remembers its output: there what the fit before
    predicts takes the place of outputs that are wild, since between its neighbours a turn would lose its
    extreme. The range of the levels and the form are decided anew, as wild samples move both.
    """
    masks = [one | other for one, other in zip(sure, doubtful, strict=True)]
    fitted = on(signals(runs), *reach, kept=[~m for m in masks] if any(map(np.any, masks)) else None)
    span = float(np.ptp(np.concatenate([run.output for run in runs])))
    masked = list(sure)  # those that are wild by themselves, or beside a fit
    for number in range(_ROUNDS):
        off = wild.off(raw, fitted.predicted, span, masks)
        off = [wild.by_chance(o, run.input, reach[1] - reach[0]) for o, run in zip(off, runs, strict=True)]
        masked = [before | now for before, now in zip(masked, off, strict=True)]
        remembered = number == 0 and fitted.form == "dual" and any(map(np.any, masks))
        if not remembered and all(map(np.array_equal, masked, masks)):
            break
        masks = list(masked)
        predicted = fitted.predicted if fitted.form == "dual" else [None] * len(runs)
        runs = [
            replace(
                run,
                input=wild.repaired_where_off(run.input, mask),
                output=wild.repaired_where_off(y, mask, said),
            )
            for run, y, mask, said in zip(runs, raw, masks, predicted, strict=True)
        ]
        ranges = np.asarray([input_range(run) for run in runs])
        reach = max(reach[0], float(ranges[:, 0].min())), min(reach[1], float(ranges[:, 1].max()))
        fitted = on(signals(runs), *reach, kept=[~mask for mask in masks])
    return fitted, runs, masks


def _first_strokes(
    on: Callable[..., Fitted], fitted: Fitted, runs: Sequence[Run], masks: Sequence[BoolArray]
) -> list[int]:
    """Return where a first stroke ends that keeps the fit from the rest, of each run; all 0 for none.

    Without first strokes a fit must leave at most half as much of what comes later, and miss them three times
    as much.
    """
    low, high = fitted.operator.low, fitted.operator.high
    until = [_until(run, low, high) for run in runs]
    if not any(until):
        return until
    later = [np.arange(mask.size) >= at for mask, at in zip(masks, until, strict=True)]
    kept = [~mask & after for mask, after in zip(masks, later, strict=True)]
    trial = on(signals(runs), low, high, kept=kept)
    left = _left(trial, kept)
    missed = _left(trial, [~mask & ~after for mask, after in zip(masks, later, strict=True)])
    helps = _FALLS * left < _left(fitted, kept) and missed > LIMITS.first_stroke_missed * left
    return until if helps else [0] * len(until)


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


def signals(runs: Sequence[Run]) -> list[tuple[FloatArray, FloatArray]]:
    """Return input and output (n,) of each run."""
    return [(run.input, run.output) for run in runs]


def input_range(run: Run) -> tuple[float, float]:
    """Range of the input of a run; what noise adds beyond the reference does not count."""
    low, high = float(np.min(run.input)), float(np.max(run.input))
    if run.reference is not None:
        low, high = max(low, float(np.min(run.reference))), min(high, float(np.max(run.reference)))
    return low, high
