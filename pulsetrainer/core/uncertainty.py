"""How sure the fit is: block bootstrap of the weights, of the offset, and of the predicted output.

Blocks of the record are drawn with replacement, long enough for the residual to forget itself from one to
the next (Kuensch, Ann. Statist. 17 (1989) 1217-1241). The memory is followed once, from the start of the
record: the sums of a block stay what they are however often it is drawn, so a resample is a
weighted sum of them and one warm-started fit.

Refits smoothed as the fit is share its bias: they are smoothed over a shorter length, so that the intervals
are wider, and around a fit of less bias. They still are a little narrow, as bootstraps are, and what the
levels cannot follow they do not see: decision 006 has the figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy  # its parts load when they are first used
from numpy.typing import ArrayLike

from pulsetrainer.core import nnls
from pulsetrainer.core.equations import NodeSums, parted_sums
from pulsetrainer.core.identification import Identified, fits_dense
from pulsetrainer.core.memory import State
from pulsetrainer.core.metrics import correlation_time
from pulsetrainer.core.operator import Preisach, outputs
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray
from pulsetrainer.core.record import Record, levelled
from pulsetrainer.core.stiffness import penalised
from pulsetrainer.errors import ArgumentError

# More blocks cost memory and time, and do not change the intervals any more.
_MOST_BLOCKS = 400
_FEWEST_BLOCKS = 20
_SHORTER = 0.7  # times the smoothing of the fit; half of it gains no more
LEVEL = 0.9  # of the draws, which an interval holds


class Interval(NamedTuple):
    """Lower and upper ends of a confidence interval, in the unit of what they enclose."""

    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, slots=True)
class Ensemble:
    """The fit, and what it might as well have been: B refits to resampled blocks."""

    operator: Preisach
    weights: FloatArray  # (B, n_q) mu, output unit per input unit squared
    offsets: FloatArray  # (B,) y0, output unit

    def weight_interval(self) -> Interval:
        """Ends (n_q,) of the 90 % interval of every weight."""
        return interval(self.weights)

    def output_band(self, values: ArrayLike, *, start: State | None = None) -> Interval:
        """Ends (n,) of the 90 % band of the predicted output for an input (n,) from ``start``, output unit.

        It holds the output without the noise of a measurement. None: from negative saturation.

        ArgumentError where the input is no finite vector.
        """
        operator = self.operator
        rising = outputs(
            operator.plane,
            self.weights,
            operator.polarity * self.offsets,
            values,
            start=start,
            reading=operator.reading,
        )
        return interval(operator.polarity * rising)


def interval(draws: FloatArray) -> Interval:
    """Ends (...) between which nine tenths of the draws (B, ...) lie."""
    lower, upper = np.quantile(draws, [0.5 * (1 - LEVEL), 0.5 * (1 + LEVEL)], axis=0)
    return Interval(lower, upper)


def block_length(residuals: Sequence[FloatArray]) -> int:
    """Samples after which residuals have forgotten themselves: n^(1/3) tau^(2/3).

    tau is ``correlation_time``. The power of n balances the bias of short blocks against the scatter of few
    (Hall, Horowitz, Jing, Biometrika 82 (1995) 561-574).
    """
    n = sum(r.size for r in residuals)
    if not any(np.any(r != r[0]) for r in residuals if r.size):
        return max(1, n // _MOST_BLOCKS)  # a fit without any residual: nothing to be unsure about
    tau = correlation_time(residuals)
    length = int(np.ceil(n ** (1 / 3) * tau ** (2 / 3)))
    return int(np.clip(length, -(-n // _MOST_BLOCKS), max(1, n // _FEWEST_BLOCKS)))


def bootstrap(
    records: Sequence[Record], fit: Identified, *, rng: np.random.Generator, draws: int
) -> Ensemble:
    """Refit ``draws`` resamples of blocks of the records, as long as the residuals say.

    Stiffness and polarity of the ``fit`` are kept, its smoothing is shortened. ArgumentError for fewer than 2
    draws, or a plane too large for dense matrices.
    """
    operator = fit.operator
    plane, sign = operator.plane, operator.polarity
    if draws < 2:
        raise ArgumentError(f"draws must be at least 2, got {draws}", hint="draws=200")
    if not fits_dense(plane):
        raise ArgumentError(
            f"the bootstrap needs dense matrices, too large for {plane.n_h} levels", hint="use 48 levels"
        )
    turned, zero = levelled(records, sign)
    left = [(r.fitted_output - operator(r.input, r.start))[r.counts] for r in records]
    parts, count = _blocks(records, block_length(left))
    stack = _Stack(parted_sums(plane, turned, operator.reading, parts, count))
    weights, offsets = np.empty((draws, plane.n_q)), np.empty(draws)
    passive: BoolArray | None = operator.weights > 0
    for k in range(draws):
        drawn = rng.multinomial(count, np.full(count, 1.0 / count)).astype(np.float64)
        equations = stack.weighted(drawn).dense()
        gram, rhs = penalised(equations, _SHORTER * fit.smoothing, fit.stiffness)
        found = nnls.solve(gram, rhs, passive=passive)
        weights[k], offsets[k] = found.x / plane.areas, sign * (equations.offset(found.x) + zero)
    return Ensemble(operator, weights, offsets)


def _blocks(records: Sequence[Record], length: int) -> tuple[list[IntArray], int]:
    """Numbers of the blocks of all samples, -1 where the weight is zero, and how many there are."""
    parts, count = [], 0
    for record in records:
        fitted = record.counts
        place = np.cumsum(fitted) - 1
        parts.append(np.where(fitted, count + place // length, -1).astype(np.int64))
        count += -(-int(fitted.sum()) // length)
    return parts, count


class _Stack:
    """The sums of all blocks, so laid out that a weighted sum of them is one sparse product."""

    def __init__(self, sums: Sequence[NodeSums]) -> None:
        self.plane = sums[0].plane
        n_q = self.plane.n_q
        pairs = [s.gram.tocoo() for s in sums]
        place = np.concatenate([p.row.astype(np.int64) * n_q + p.col for p in pairs])
        self.place, column = np.unique(place, return_inverse=True)
        row = np.repeat(np.arange(len(sums)), [p.nnz for p in pairs])
        entries = (np.concatenate([p.data for p in pairs]), (column, row))
        self.gram = scipy.sparse.csr_array(entries, shape=(self.place.size, len(sums)))
        self.moment = np.stack([s.moment for s in sums])
        self.row_sum = np.stack([s.row_sum for s in sums])
        self.scalars = np.asarray([(s.weight_sum, s.output_sum, s.output_square) for s in sums])

    def weighted(self, drawn: FloatArray) -> NodeSums:
        """Sums over a resample in which block k comes ``drawn[k]`` times."""
        n_q = self.plane.n_q
        gram = scipy.sparse.csr_array(
            (self.gram @ drawn, (self.place // n_q, self.place % n_q)), shape=(n_q, n_q)
        )
        weight, output, square = (drawn @ self.scalars).tolist()
        return NodeSums(self.plane, gram, drawn @ self.moment, drawn @ self.row_sum, weight, output, square)
