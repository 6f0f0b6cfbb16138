"""Errors on blocks that were left out of the fit.

A record is cut into blocks where a major loop wipes the memory out. Weights, parameters, offset and start are
refitted without some blocks, linearised around the joint fit, with the cells that are positive there.
Predictions of the blocks left out always run from the start of the record.
"""

from __future__ import annotations

from collections.abc import Iterator
from weakref import WeakKeyDictionary

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.nnls import SMALLEST_DIAGONAL, factor_of
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray
from pulsetrainer.core.smoothing import blocks
from pulsetrainer.diagnosis import residual
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.floor import Floor
from pulsetrainer.diagnosis.problem import Problem
from pulsetrainer.diagnosis.thresholds import LIMITS, TINY

_HALVES = 2


class HeldOut:
    """Cross-validation and jackknife over the blocks of one problem."""

    def __init__(self, problem: Problem) -> None:
        self.count = problem.bins.count
        self.block = _blocks_of(problem)
        self._by_rate = _sorted_by_rate(problem, self.block)
        self._known: WeakKeyDictionary[Fitted, dict[tuple[int, str], FloatArray]] = WeakKeyDictionary()

    def error(self, fitted: Fitted) -> float:
        """Sum of squares on both halves of the blocks, each predicted from the other; NaN for few blocks."""
        halves = self._squares(fitted, _HALVES, "in turn")
        return float(halves.sum()) if halves.size == _HALVES else float("nan")

    def gain(self, before: Fitted, after: Fitted, floor: Floor) -> float:
        """Share of the reducible held-out error that the extension removes, at most all of it."""
        return _share(self.error(before), self.error(after), floor)

    def gain_told(self, before: Fitted, after: Fitted, floor: Floor) -> float:
        """The same of a cause that was accepted; by whole pieces where halves tell nothing.

        Where each cell is told by one half alone, the other half predicts nothing, and the larger model may
        seem to do harm. Whole pieces, of which a little is told, then count, if that predicts half of it.
        """
        share = self.gain(before, after, floor)
        if share < 0.0:
            of_pieces = self.gain_of_pieces(before, after, floor)
            return of_pieces if of_pieces > LIMITS.half else share
        return share

    def gain_of_pieces(self, before: Fitted, after: Fitted, floor: Floor) -> float:
        """The same as ``gain``, by whole pieces of which a little is told."""
        first, second = (float(np.sum(self.pieces(one))) for one in (before, after))
        return _share(first, second, floor)

    def pieces(self, fitted: Fitted) -> FloatArray:
        """Sums of squares (pieces,) on whole pieces of the time, each predicted from the others; or empty.

        Blocks that alternate interpolate what wanders slowly; whole pieces have to predict it.
        """
        return self._squares(fitted, LIMITS.pieces, "pieces")

    def rates(self, fitted: Fitted) -> FloatArray:
        """Sums of squares (rates,) on the slowest to the fastest blocks, each predicted from the others.

        Empty for too few blocks. A formula that only holds at the rates of a record misleads at others.
        """
        return self._squares(fitted, LIMITS.rates, "rates")

    def _squares(self, fitted: Fitted, folds: int, how: str) -> FloatArray:
        """Sum of squares of each fold, or nothing for too few blocks; made once for all who ask."""
        known = self._known.setdefault(fitted, {})
        if (folds, how) not in known:
            block = self._by_rate if how == "rates" else self.block
            errors = self._left_out(fitted, folds, whole=how != "in turn", block=block)
            known[folds, how] = np.asarray([float(error @ error) for error, _ in errors])
        return known[folds, how]

    @property
    def piece(self) -> IntArray:
        """Number of the piece of the time that each average (count,) is in."""
        return np.asarray(_fold_of(LIMITS.pieces, whole=True)[self.block])

    def jackknife(self, fitted: Fitted) -> FloatArray | None:
        """Variances (p,) of the parameters from leaving out one tenth of the blocks after another.

        Efron and Stein, Annals of Statistics 9, 1981. None where a tenth cannot be left out.
        """
        parts = self._left_out(fitted, LIMITS.jackknife, block=self.block)
        changes = np.asarray([change for _, change in parts])
        if changes.shape[0] < LIMITS.jackknife:
            return None
        return (1.0 - 1.0 / LIMITS.jackknife) * np.sum((changes - changes.mean(axis=0)) ** 2, axis=0)

    def _left_out(
        self, fitted: Fitted, folds: int, *, block: IntArray, whole: bool = False
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """For each fold its errors, and the changes (p,) of the parameters, when it is left out."""
        fold_of = _fold_of(folds, whole=whole)
        design, free = fitted.design, fitted.projector.cells
        extra, starts = fitted.slopes.shape[1], design.bins.free.shape[1]
        test = fold_of[block][:, None] == np.arange(folds)  # (count, folds)
        size = free.size + extra + starts
        if np.any((self.count - test.sum(axis=0) < LIMITS.rows_per_unknown * size) | ~test.any(axis=0)):
            return
        rows = _Rows(fitted)
        parts = [rows.products(own) for own in test.T]
        masses = (fitted.simulator.operator.weights * design.plane.areas)[free]
        smooth, pull = np.zeros((size, size)), np.zeros(size)  # pull: of the smoothing at the joint fit
        smooth[: free.size, : free.size] = design.smooth[np.ix_(free, free)]
        pull[: free.size] = smooth[: free.size, : free.size] @ masses
        # without its first block a record says nothing of its start: what all of it said is kept
        smooth[-starts:, -starts:] = LIMITS.start_kept * np.eye(starts)
        told = LIMITS.piece_told if whole else 0.0  # what the rest cannot tell stays as all of it said
        share = 1.0 - (1.0 - told) / folds
        total = sum(parts)
        for own, part in zip(test.T, parts, strict=True):
            left = total - (1.0 - told) * part
            normal = share * smooth + left[:-1, :-1]
            diagonal = np.diagonal(normal)
            ridge = LIMITS.ridge_held_out * diagonal + TINY
            # a cell that is on throughout is an offset as well: its own entry is rounding, of either sign
            ridge[: free.size] += SMALLEST_DIAGONAL * float(diagonal.max())
            change = scipy.linalg.cho_solve(
                factor_of(normal, ridge), left[:-1, -1] - share * pull, check_finite=False
            )
            yield fitted.residual[own] - rows.output(change)[own], change[free.size : free.size + extra]


def repeated(held_out: HeldOut, before: Fitted, after: Fitted) -> float:
    """Return the share of the gain of the fit that is found on whole pieces of the time that were left out.

    It is 0 where the error rises on any piece, or at any rates told from the others. A record too short to
    leave pieces out does not tell, and what is not told does not repeat.
    """
    first, second = held_out.pieces(before), held_out.pieces(after)
    if min(first.size, second.size) < LIMITS.pieces:
        return 0.0
    gains, fit = first - second, before.squares - after.squares
    first_at, second_at = held_out.rates(before), held_out.rates(after)
    told = min(first_at.size, second_at.size)  # a part that the larger model cannot do without tells nothing
    if min(gains.min(), (first_at[:told] - second_at[:told]).min(initial=np.inf)) < -LIMITS.piece_worse * fit:
        return 0.0
    return float(gains.sum() / fit) if fit > 0 else 0.0


class _Rows:
    """Rows [D, G, F, r] of all that is fitted (cells, slopes, offset and start) and of the residual.

    D (count, k) are the columns of the cells without their part along F; where the nodes are
    sparse they are never made, and their products come of those of the nodes.
    """

    def __init__(self, fitted: Fitted) -> None:
        self._design, self._cells = fitted.design, fitted.projector.cells
        bins = self._design.bins
        self._beside = np.hstack((bins.settled(fitted.slopes), bins.free, fitted.residual[:, None]))
        self._starts = slice(fitted.slopes.shape[1], self._beside.shape[1] - 1)

    def products(self, own: BoolArray) -> FloatArray:
        """R'R (k + m, k + m) over the rows ``own`` (count,)."""
        beside = self._beside[own]
        cells, across = self._design.products(own, self._cells, beside)
        squares = beside.T @ beside
        taken = self._design.taken[:, self._cells]
        along = taken.T @ across[:, self._starts].T
        cells = cells - along - along.T + taken.T @ squares[self._starts, self._starts] @ taken
        across = across - taken.T @ squares[self._starts]
        return np.block([[cells, across], [across.T, squares]])

    def output(self, change: FloatArray) -> FloatArray:
        """What a change (k + m - 1,) of all that is fitted adds (count,)."""
        masses = np.zeros(self._design.plane.n_q)
        masses[self._cells] = change[: self._cells.size]
        added = self._design.bins.settled(self._design.output(masses))
        return np.asarray(added + self._beside[:, :-1] @ change[self._cells.size :])


def _share(first: float, second: float, floor: Floor) -> float:
    """Share of the error above the floor by which a second error is less than the first, at most 1."""
    return min((first - second) / max(first - floor.squares, floor.relevant), 1.0)


def _fold_of(folds: int, *, whole: bool) -> IntArray:
    """Fold of each block: whole pieces of the time, or blocks that alternate."""
    number = np.arange(LIMITS.blocks)
    return number * folds // LIMITS.blocks if whole else number % folds


def _blocks_of(problem: Problem) -> IntArray:
    """Block of every average; the cuts are where the memory is wiped out."""
    plane, bins = problem.plane, problem.bins
    found = np.zeros(bins.count, dtype=np.int64)
    for record, number in zip(problem.records, bins.number, strict=True):
        part = blocks(record.input, plane.low, plane.high, LIMITS.blocks)
        inside = number >= 0
        found[number[inside]] = part[inside]
    return found


def _sorted_by_rate(problem: Problem, block: IntArray) -> IntArray:
    """Block of every average (count,), the blocks numbered anew from the slowest to the fastest."""
    square = np.bincount(block, residual.rates(problem) ** 2, LIMITS.blocks)
    mean = square / np.maximum(np.bincount(block, minlength=LIMITS.blocks), 1)
    return np.asarray(np.argsort(np.argsort(mean, kind="stable"))[block])
