"""Smoothing of mu: how bent the density is, and how much of that the data ask for.

    minimise  sum_t v_t (y_t - y0 - r_t . m)^2  +  s^8 g B(m),     g = trace(G) / n_q

G is the centred Gram matrix and B the bending of the density, in coordinates x = u / range:

    B = integral of (d2 mu / d alpha^2)^2 + (d2 mu / d beta^2)^2 over the plane
      + 10 x integral of (d2 rho / dx^2)^2 along the diagonal

by second differences of neighbouring cells (Wahba, "Spline Models for Observational Data", SIAM 1990,
chapter 2). The diagonal cells carry the reversible part, a density rho per length and not per area:
they are coupled along the diagonal only.

The output sees the density through two integrals, so a ripple of wavelength 2 pi / k enters the first sum
as k^-4 and B as k^4: the two meet at k = 1 / s. The number s is therefore a length, as a share of the
input's range: what is narrower than s in the density is smoothed away. It has no units and does not
depend on the number of levels or samples. Where edges crowd (``core.edges``), x is the number of the edge
over n_h instead: what is smoothed away is narrower there too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import nnls
from pulsetrainer.core.edges import thinned
from pulsetrainer.core.equations import NodeSums, NormalEquations, normal_equations, parted_sums
from pulsetrainer.core.initial_state import near_ends
from pulsetrainer.core.memory import Trace
from pulsetrainer.core.metrics import correlation_time
from pulsetrainer.core.operator import Preisach, follow
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, Plane, Reading
from pulsetrainer.core.record import Record
from pulsetrainer.errors import ArgumentError

# Blocks are dealt out to this many folds, so that each fold is spread over the whole record.
FOLDS = 5
BLOCKS = 40
# A block left out leaves a hole in the data, and a long one asks how well the fit bridges holes that the
# whole record does not have: the smooth answer wins. So blocks are short, but longer than the residual
# remembers.
_MOST_BLOCKS = 200
_APART = 2.0  # correlation times of the residual a block lasts at least
_PILOT = 0.0177  # s of the fit whose residual is looked at
# From far below a cell of any plane that fits in memory to a fifth of the range.
_STEP = 2.0**0.5
_GRID = 0.0125 * _STEP ** np.arange(-1, 9)
_BIAS = _STEP**8  # by which a step multiplies the square of what is smoothed away
_ALONE = 0.9  # of all likelihood: more leaves nothing to a mean over the grid
_MIDDLE = 4  # of the grid, where the search begins
_HOPELESS = 1.5  # times the least error so far: smoother ones are not tried
# The choice is made on at most this many levels: s does not depend on them, the time does, as n_h^6.
CHOICE_LEVELS = 32
# Weights of either sign are not determined without some smoothing.
LEAST_SIGNED = 0.0125
# Measured on four plants: 10 is better than 0.1 or 1 by a few hundredths of the error, and never worse.
_DIAGONAL = 10.0


@dataclass(frozen=True, slots=True)
class Choice:
    """The smoothing chosen by held-out blocks, and all that were tried on the way to it."""

    smoothing: float  # s, share of the input's range
    tried: tuple[tuple[float, float], ...]  # (s, rms error on held-out blocks, output unit), s rising


def bending(plane: Plane, usable: BoolArray) -> scipy.sparse.csr_array:
    """Rows (k, n_q) whose products with the masses, squared and summed, are the bending B.

    Rows are second differences over three neighbouring cells of which all are ``usable`` (n_q,): where
    the signal never was, no mass is invented.
    """
    n = plane.n_h
    i, j = plane.cell_indices
    cell = np.full((n, n), -1, dtype=np.int64)
    cell[i, j] = np.where(usable, np.arange(plane.n_q), -1)
    off = np.where(np.tril(np.ones((n, n), dtype=bool), -1), cell, -1)
    # n^2 of steps 1 / n, times a density for a mass, times the root of the area or length each stands for
    weight, along_diagonal = float(n) ** 3, np.sqrt(_DIAGONAL) * float(n) ** 2.5
    pieces = [
        _second_differences(off, weight, plane.n_q),
        _second_differences(off.T, weight, plane.n_q),
        _second_differences(np.diagonal(cell), along_diagonal, plane.n_q),
    ]
    return scipy.sparse.vstack(pieces, format="csr")


def _second_differences(cells: IntArray, weight: float, n_q: int) -> scipy.sparse.csr_array:
    """One row for each three neighbours that exist along the first axis of ``cells`` (n, ...); -1: none."""
    triple = np.stack((cells[:-2], cells[1:-1], cells[2:]), axis=-1)
    chosen = triple[np.all(triple >= 0, axis=-1)]
    values = np.tile(weight * np.array([1.0, -2.0, 1.0]), len(chosen))
    pointer = 3 * np.arange(len(chosen) + 1)
    return scipy.sparse.csr_array((values, chosen.ravel(), pointer), shape=(len(chosen), n_q))


def penalty(plane: Plane, diagonal: FloatArray, smoothing: float) -> scipy.sparse.csr_array:
    """Return s^8 g B as a matrix (n_q, n_q) on the masses; s is a share of the input's range.

    Cells where ``diagonal`` (n_q,), that of the centred Gram matrix, is zero are left alone. ArgumentError if
    ``smoothing`` is negative, not finite, or more than 1.
    """
    if not 0 <= smoothing <= 1:
        raise ArgumentError(
            f"smoothing must be a share of the input's range in 0..1, or 'auto', got {smoothing:g}",
            hint="0 is none, 0.03 is mild",
        )
    usable = diagonal > nnls.SMALLEST_DIAGONAL * diagonal.max(initial=0.0)
    rows = bending(plane, usable)
    return (rows.T @ rows) * (smoothing**8 * float(diagonal.sum()) / plane.n_q)


def smoothed(equations: NormalEquations, smoothing: float) -> tuple[FloatArray, FloatArray]:
    """Centred Gram matrix (n_q, n_q) with s^8 g B added, and the right side (n_q,).

    ArgumentError where ``smoothing`` is out of range.
    """
    gram, rhs = equations.centred()
    if smoothing != 0:
        gram += penalty(equations.plane, np.diagonal(gram).copy(), smoothing).toarray()
    return gram, rhs


def blocks(inputs: FloatArray, low: float, high: float, count: int = BLOCKS) -> IntArray:
    """Cut a record into ``count`` blocks and return the number of the block of each sample (n,).

    The cuts are even, then each is moved to the nearest place, within half a block, where the input is at
    an end of [low, high]: there every remembered extreme is wiped out, and blocks share no memory.
    """
    n = inputs.size
    count = max(1, min(count, n // 2))
    cuts = np.arange(1, count) * n // count
    ends = near_ends(inputs, low, high)
    if ends.size:
        right = np.minimum(np.searchsorted(ends, cuts), ends.size - 1)
        left = np.maximum(right - 1, 0)
        nearest = np.where(np.abs(ends[left] - cuts) < np.abs(ends[right] - cuts), ends[left], ends[right])
        cuts = np.where(np.abs(nearest - cuts) * 2 * count <= n, nearest, cuts)
    return np.searchsorted(cuts, np.arange(n), side="right").astype(np.int64)


def dealt(block: IntArray) -> IntArray:
    """Fold (n,) of each sample in a ``block`` (n,): each fold once in ``FOLDS`` blocks, in a drawn order.

    Dealt in turn, a fold would meet one place of every curve, where a curve is as long as ``FOLDS`` blocks.
    """
    in_turn = np.tile(np.arange(FOLDS), (int(block.max()) // FOLDS + 1, 1))
    return np.random.default_rng(0).permuted(in_turn, axis=1).ravel()[block]


def choose(records: Sequence[Record], plane: Plane, reading: Reading, *, signed: bool = False) -> Choice:
    """Choose s by the error on held-out blocks of the records, for weights >= 0 or of either sign.

    Each of ``FOLDS`` fits leaves out its own fifth of the blocks (``dealt``); all are simulated from the
    start of their record. The sums of the whole minus those of the left-out blocks give the fit, the latter
    alone its error. The grid is tried in steps of a factor 2^(1/2), and no smoothing as its lower end. Where
    the held-out error e(s) is flat its minimum is chance, so s is the mean of the grid, in logarithms,
    weighted by

        exp(-(n / tau) (e(s)^2 / e_min^2 - 1) / 2)

    as likelihoods of n samples whose errors remember themselves for tau. Where one length has nearly all of
    that, the least lies between it and its neighbours: there e^2 = a - b k + c 16^k at k steps of the grid,
    since noise falls with the logarithm of s, and what is smoothed away, a square, rises as s^8. The
    likelihoods are too sure where few blocks
    decide. So s is no smaller than a step of the grid below the largest whose squared error is above the
    least by no more than a standard error of their difference from block to block (Breiman, Friedman, Olshen,
    Stone, Classification and Regression Trees, 1984, section 3.4.3).

    ArgumentError where all samples with weight lie in one block, so that none can be held out.
    """
    coarse = thinned(plane, CHOICE_LEVELS)
    memory = _memory_of_residual(records, coarse, reading, signed=signed)
    counts = [int(np.clip(r.input.size / (_APART * memory), BLOCKS, _MOST_BLOCKS)) for r in records]
    cuts = [
        _Cut(r, follow(coarse, r.input, r.start, reading), blocks(r.input, plane.low, plane.high, count))
        for r, count in zip(records, counts, strict=True)
    ]
    sums = parted_sums(coarse, records, reading, [cut.fold for cut in cuts], FOLDS)
    held_out = {fold: part for fold, part in enumerate(sums) if part.weight_sum > 0}
    if len(held_out) < 2:
        raise ArgumentError(
            "`smoothing` auto tries a model of one part of a record on another, but the "
            f"{sum(np.count_nonzero(r.counts) for r in records)} samples that count make one part only",
            hint="record more, or give `smoothing` a number, such as 0.02",
        )
    error = _HeldOut(held_out, reading, signed=signed)
    tried = _tried(error)
    likely = _mean_length(tried, error.whole.weight_sum / memory)
    alike = _longest_alike(tried, lambda s: np.concatenate([cut.squares(error.operators(s)) for cut in cuts]))
    # three digits: what more there are is rounding of small differences, and would depend on the units
    return Choice(float(f"{max(likely, alike / _STEP):.3g}"), tried)


def _memory_of_residual(records: Sequence[Record], plane: Plane, reading: Reading, *, signed: bool) -> float:
    """Samples for which the residual of a little smoothed fit remembers itself."""
    equations = normal_equations(plane, records, reading)
    gram, rhs = smoothed(equations, _PILOT)
    masses = nnls.solve_signed(gram, rhs) if signed else nnls.solve(gram, rhs).x
    operator = Preisach(plane, masses / plane.areas, equations.offset(masses), reading, signed=signed)
    return correlation_time([(r.output - operator(r.input, r.start))[r.counts] for r in records])


@dataclass(frozen=True, slots=True)
class _Cut:
    """A record cut into blocks."""

    record: Record
    path: Trace
    block: IntArray  # (n,) number of each sample's block

    @property
    def fold(self) -> IntArray:
        """Fold (n,) of each sample."""
        return dealt(self.block)

    def squares(self, operators: Mapping[int, Preisach]) -> FloatArray:
        """Sum of squared errors of each block, by the operator of the fold that it was left out of."""
        left, folds = np.zeros(self.block.size), self.fold
        for fold, operator in operators.items():
            here = folds == fold
            left[here] = (operator.traced(self.path) - self.record.fitted_output)[here]
        return np.bincount(self.block, self.record.sample_weight * left**2).astype(np.float64)


class _HeldOut:
    """The error on held-out blocks as a function of s."""

    def __init__(self, sums: Mapping[int, NodeSums], reading: Reading, *, signed: bool = False) -> None:
        self.reading: Reading = reading
        self.signed = signed
        self.parts = {fold: part.dense() for fold, part in sums.items()}
        whole = reduce(add, sums.values())
        self.whole = whole.dense()
        gram, _ = self.whole.centred()
        self.unit = penalty(self.whole.plane, np.diagonal(gram).copy(), 1.0).toarray()
        self.passive: dict[int, BoolArray] = {}
        self.errors: dict[float, float] = {}
        self.fits: dict[float, dict[int, tuple[FloatArray, float]]] = {}

    def __call__(self, smoothing: float) -> float:
        if smoothing not in self.errors:
            fits = self.fits[smoothing] = {fold: self._fit(fold, smoothing) for fold in self.parts}
            total = sum(part.sum_of_squares(*fits[fold]) for fold, part in self.parts.items())
            self.errors[smoothing] = float(np.sqrt(max(total, 0.0) / self.whole.weight_sum))
        return self.errors[smoothing]

    def operators(self, smoothing: float) -> dict[int, Preisach]:
        """Operator that was fitted without each fold."""
        plane = self.whole.plane
        return {
            fold: Preisach(plane, masses / plane.areas, offset, self.reading, signed=self.signed)
            for fold, (masses, offset) in self.fits[smoothing].items()
        }

    def _fit(self, fold: int, smoothing: float) -> tuple[FloatArray, float]:
        """Masses (n_q,) and offset that were fitted without a fold."""
        rest = self.whole - self.parts[fold]
        gram, rhs = rest.centred()
        gram += self.unit * (smoothing**8 * rest.weight_sum / self.whole.weight_sum)
        if self.signed:
            masses = nnls.solve_signed(gram, rhs)
        else:
            found = nnls.solve(gram, rhs, passive=self.passive.get(fold))
            masses, self.passive[fold] = found.x, found.passive
        return masses, rest.offset(masses)


def _tried(error: _HeldOut) -> tuple[tuple[float, float], ...]:
    """Errors of the grid from its middle down to no smoothing, then up while there is hope; s rising."""
    grid: list[float] = _GRID.tolist()
    for s in reversed([s for s in (0.0, *grid[: _MIDDLE + 1]) if not error.signed or s >= LEAST_SIGNED]):
        error(s)
    for s in grid[_MIDDLE + 1 :]:
        if error(s) > _HOPELESS * min(error.errors.values()):
            break
    return tuple(sorted(error.errors.items()))


def _mean_length(tried: Sequence[tuple[float, float]], samples: float) -> float:
    """Mean of the lengths tried, by what their errors on so many independent samples say; see ``choose``."""
    length, error = np.asarray(tried).T
    least = float(error.min())
    if least <= 0:
        return float(length[np.argmin(error)])
    weight = np.exp(-0.5 * samples * ((error / least) ** 2 - 1.0))
    mean = float(np.exp(weight @ _logarithm(length) / weight.sum()))
    best = int(np.argmin(error))
    if 0 < best < error.size - 1 and weight[best] > _ALONE * weight.sum():
        return min(mean, _between(length[best - 1 : best + 2], error[best - 1 : best + 2] ** 2))
    return mean


def _between(length: FloatArray, squares: FloatArray) -> float:
    """Length of the least of a - b k + c 16^k through three squared errors, of which the middle is least.

    16 is the eighth power of a step of the grid.
    """
    before, least, after = squares.tolist()
    c = (after - 2.0 * least + before) / (_BIAS - 1.0) ** 2
    b = (_BIAS - 1.0) * c + before - least
    steps = float(np.clip(np.log(b / (c * np.log(_BIAS))) / np.log(_BIAS), 0.0, 2.0)) if c > 0 else 1.0
    return float(length[1] * _STEP ** (steps - 1.0))


def _longest_alike(tried: Sequence[tuple[float, float]], squares: Callable[[float], FloatArray]) -> float:
    """Largest length whose error is the least but for chance, between those tried; see ``choose``.

    ``squares`` returns the sum of squared errors of each block at a length.
    """
    length, error = np.asarray(tried).T
    best = int(np.argmin(error))
    least = squares(tried[best][0])
    more = [squares(s) - least for s, _ in tried[best:]]
    excess = np.asarray([float(d.sum() - np.sqrt(d.size) * d.std(ddof=1)) for d in more])
    place = _logarithm(length[best:])
    last = int(np.flatnonzero(excess <= 0)[-1])
    if last + 1 < excess.size:
        share = excess[last] / (excess[last] - excess[last + 1])
        return float(np.exp(place[last] + share * (place[last + 1] - place[last])))
    return float(np.exp(place[last]))


def _logarithm(length: FloatArray) -> FloatArray:
    """Logarithm of lengths (k,), of which none is a step below the grid."""
    return np.log(np.maximum(length, _GRID[0] / _STEP))
