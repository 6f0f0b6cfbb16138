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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts load when they are first used
from numpy.typing import NDArray

from pulsetrainer.core import nnls
from pulsetrainer.core.correlation import correlation_time
from pulsetrainer.core.edges import thinned
from pulsetrainer.core.equations import NodeSums, NormalEquations, normal_equations, parted_sums
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, IntArray, Plane, Reading
from pulsetrainer.core.record import Record
from pulsetrainer.errors import ArgumentError

# Blocks are dealt out to this many folds in turn, so that each fold is spread over the whole record.
FOLDS = 5
BLOCKS = 40
# A block left out leaves a hole in the data, and a long one asks how well the fit bridges holes that the
# whole record does not have: the smooth answer wins. So blocks are short, but longer than the residual
# remembers.
_MOST_BLOCKS = 200
_APART = 2.0  # correlation times of the residual a block lasts at least
_PILOT = 0.0177  # s of the fit whose residual is looked at
# From far below a cell of any plane that fits in memory to a fifth of the range.
_GRID = 0.0125 * 2.0 ** (np.arange(-1, 9) / 2.0)
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


def bending(plane: Plane, usable: NDArray[np.bool_]) -> scipy.sparse.csr_array:
    """Rows (k, n_q) whose products with the masses, squared and summed, are the bending B.

    Rows are second differences over three neighbouring cells of which all are ``usable`` (n_q,): where
    the signal never was, no mass is invented.
    """
    n = plane.n_h
    i, j = plane.cell_indices
    cell = np.full((n, n), -1, dtype=np.int64)
    cell[i, j] = np.where(usable, np.arange(plane.n_q), -1)
    size = np.full(n, 1.0 / n)
    middle = (np.arange(n) + 0.5) / n
    per_mass = np.ones(plane.n_q)  # density per mass
    per_mass[i != j] = 1.0 / (size[i] * size[j])[i != j]
    per_mass[i == j] = 1.0 / size
    inside = np.tril(np.ones((n, n), dtype=bool), -1)
    off = np.where(inside, cell, -1)
    diagonal = np.diagonal(cell)

    second = _second_differences(middle)  # (n - 2, 3)
    column = np.broadcast_to(size, (max(n - 2, 0), n))
    along_alpha = (off[:-2], off[1:-1], off[2:])
    along_beta = (off.T[:-2], off.T[1:-1], off.T[2:])
    share = np.sqrt(size[1:-1, None] * column)  # root of the area each difference stands for
    pieces = [
        _rows(along_alpha, second[:, None, :], share, per_mass, plane.n_q),
        _rows(along_beta, second[:, None, :], share, per_mass, plane.n_q),
        _rows(
            (diagonal[:-2], diagonal[1:-1], diagonal[2:]),
            second,
            np.sqrt(_DIAGONAL * size[1:-1]),
            per_mass,
            plane.n_q,
        ),
    ]
    return scipy.sparse.vstack(pieces, format="csr")


def _second_differences(x: FloatArray) -> FloatArray:
    """Coefficients (n - 2, 3) of the second derivative at the inner points of uneven ``x`` (n,)."""
    left, right = x[1:-1] - x[:-2], x[2:] - x[1:-1]
    both = left + right
    return np.stack((2.0 / (left * both), -2.0 / (left * right), 2.0 / (right * both)), axis=-1)


def _rows(
    cells: tuple[IntArray, IntArray, IntArray],
    second: FloatArray,
    share: FloatArray,
    per_mass: FloatArray,
    n_q: int,
) -> scipy.sparse.csr_array:
    """One row for each triple of cells that exist, of second differences of density times ``share``."""
    triple = np.stack(cells, axis=-1)
    exists = np.all(triple >= 0, axis=-1)
    chosen = triple[exists]
    coefficient = (second * share[..., None])[exists] * per_mass[chosen]
    pointer = 3 * np.arange(chosen.shape[0] + 1)
    return scipy.sparse.csr_array(
        (coefficient.ravel(), chosen.ravel(), pointer), shape=(chosen.shape[0], n_q)
    )


def penalty(plane: Plane, diagonal: FloatArray, smoothing: float) -> scipy.sparse.csr_array:
    """Return s^8 g B as a matrix (n_q, n_q) on the masses.

    Parameters
    ----------
    diagonal
        Diagonal (n_q,) of the centred Gram matrix; cells where it is zero are left alone.
    smoothing
        s, share of the input's range.

    Raises
    ------
    ArgumentError
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

    Raises
    ------
    ArgumentError
        ``smoothing`` is out of range.
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
    near = 0.01 * (high - low)
    ends = np.flatnonzero((inputs <= low + near) | (inputs >= high - near))
    if ends.size:
        right = np.clip(np.searchsorted(ends, cuts), 0, ends.size - 1)
        left = np.maximum(right - 1, 0)
        nearest = np.where(np.abs(ends[left] - cuts) < np.abs(ends[right] - cuts), ends[left], ends[right])
        cuts = np.where(np.abs(nearest - cuts) * 2 * count <= n, nearest, cuts)
    return np.searchsorted(cuts, np.arange(n), side="right").astype(np.int64)


def choose(records: Sequence[Record], plane: Plane, reading: Reading, *, signed: bool = False) -> Choice:
    """Choose s by the error on held-out blocks of the records, for weights >= 0 or of either sign.

    Each of ``FOLDS`` fits leaves out every fifth block; all are simulated from the start of their record.
    The sums of the whole minus those of the left-out blocks give the fit, the latter alone its error. The
    grid is tried in steps of a factor 2^(1/2), and no smoothing as its lower end. Where the held-out error
    e(s) is flat its minimum is chance, so s is the mean of the grid, in logarithms, weighted by

        exp(-(n / tau) (e(s)^2 / e_min^2 - 1) / 2)

    as likelihoods of n samples whose errors remember themselves for tau.

    Raises
    ------
    ArgumentError
        Too few samples with weight to hold any out.
    """
    coarse = thinned(plane, CHOICE_LEVELS)
    memory = _memory_of_residual(records, coarse, reading, signed=signed)
    counts = [int(np.clip(r.input.size / (_APART * memory), BLOCKS, _MOST_BLOCKS)) for r in records]
    folds = [
        blocks(r.input, plane.low, plane.high, count) % FOLDS
        for r, count in zip(records, counts, strict=True)
    ]
    sums = parted_sums(coarse, records, reading, folds, FOLDS)
    held_out = [part for part in sums if part.weight_sum > 0]
    if len(held_out) < 2:
        raise ArgumentError(
            f"smoothing='auto' needs at least {2 * FOLDS} samples to hold some out, "
            f"got {sum(r.input.size for r in records)}",
            hint="give smoothing as a number",
        )
    error = _HeldOut(held_out, signed=signed)
    tried = _tried(error)
    return Choice(_mean_length(tried, error.whole.weight_sum / memory), tried)


def _memory_of_residual(records: Sequence[Record], plane: Plane, reading: Reading, *, signed: bool) -> float:
    """Samples for which the residual of a little smoothed fit remembers itself."""
    equations = normal_equations(plane, records, reading)
    gram, rhs = smoothed(equations, _PILOT)
    masses = nnls.solve_signed(gram, rhs) if signed else nnls.solve(gram, rhs).x
    operator = Preisach(plane, masses / plane.areas, equations.offset(masses), reading, signed=signed)
    return correlation_time([(r.output - operator(r.input, r.start))[r.sample_weight > 0] for r in records])


class _HeldOut:
    """The error on held-out blocks as a function of s."""

    def __init__(self, sums: Sequence[NodeSums], *, signed: bool = False) -> None:
        self.signed = signed
        self.parts = [part.dense() for part in sums]
        whole = sum(sums[1:], start=sums[0])
        self.whole = whole.dense()
        gram, _ = self.whole.centred()
        self.unit = penalty(self.whole.plane, np.diagonal(gram).copy(), 1.0).toarray()
        self.passive: list[NDArray[np.bool_] | None] = [None] * len(self.parts)
        self.errors: dict[float, float] = {}

    def __call__(self, smoothing: float) -> float:
        if smoothing not in self.errors:
            total = sum(self._error(k, smoothing) for k in range(len(self.parts)))
            self.errors[smoothing] = float(np.sqrt(max(total, 0.0) / self.whole.weight_sum))
        return self.errors[smoothing]

    def _error(self, k: int, smoothing: float) -> float:
        rest = self.whole - self.parts[k]
        gram, rhs = rest.centred()
        gram += self.unit * (smoothing**8 * rest.weight_sum / self.whole.weight_sum)
        if self.signed:
            masses = nnls.solve_signed(gram, rhs)
        else:
            found = nnls.solve(gram, rhs, passive=self.passive[k])
            masses, self.passive[k] = found.x, found.passive
        return self.parts[k].sum_of_squares(masses, rest.offset(masses))


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
    logarithm = np.log(np.maximum(length, _GRID[0] / np.sqrt(2.0)))
    return float(np.exp(weight @ logarithm / weight.sum()))
