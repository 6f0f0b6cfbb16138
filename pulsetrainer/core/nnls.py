"""Non-negative least squares on the normal equations: block principal pivoting.

minimise x' G x / 2 - f' x subject to x >= 0, with G symmetric positive (semi)definite.

Portugal, Judice, Vicente, "A comparison of block pivoting and interior-point algorithms for linear least
squares problems with nonnegative variables", Math. Comp. 63 (1994) 625-643; with the column
grouping of Kim and Park, SIAM J. Sci. Comput. 33 (2011) 3261-3281 left out: there is one right side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, finite_vector
from pulsetrainer.errors import ArgumentError, ConvergenceError

# A pivot below this share of the largest diagonal entry is rounding noise of the sums that made G.
_RELATIVE_RIDGE = 1e-13
# Variables whose diagonal entry is below this share of the largest never appear in the data.
SMALLEST_DIAGONAL = 1e-14
# Some ten units in the last place of a sum of a thousand terms.
_ROUNDING = 1e-14
# Added to the diagonal where the data leave so much open that no end was found: the solution then violates
# the optimality conditions by about a hundredth of this.
_LAST_RIDGE = 1e-10
Factor = tuple[FloatArray, bool]
_ACTIVE_SETS = 30  # times the number of variables
# Systems after which the exchanges leave the rest to the active set of scipy.
_SYSTEMS = 200
# Full exchanges that may fail to reduce the infeasibilities before descent takes over.
_PATIENCE = 3


class NonNegative(NamedTuple):
    """The minimiser, where it is positive, and how many systems were solved."""

    x: FloatArray  # (q,)
    passive: BoolArray  # (q,) True where x may be positive
    iterations: int


def solve(
    gram: FloatArray, rhs: FloatArray, *, passive: BoolArray | None = None, max_iterations: int = _SYSTEMS
) -> NonNegative:
    """Return the non-negative minimiser of x' G x / 2 - f' x for G = ``gram`` (q, q) and f = ``rhs`` (q,).

    All variables on the wrong side are exchanged at once, which usually ends within ten systems. Where
    the exchanges stop making progress, Newton steps that never climb go on from there, so they cannot cycle:
    as in Lawson and Hanson, "Solving Least Squares Problems", 1974, chapter 23, but freeing all variables
    that descend at once, and putting all to zero at once where that is lower. With fewer samples than
    variables those steps may be short: each ends where one of hundreds of variables that the data cannot tell
    apart reaches zero. After ``max_iterations`` systems the active set of ``scipy.optimize.nnls`` ends it,
    on a root of G: it frees one variable at a time and never returns to a set that it left.

    Variables whose diagonal entry is zero never appear in the data and stay at zero. ``passive``
    is a first guess of the positive variables, from a neighbouring problem.

    ArgumentError for shapes that do not fit, or numbers that are not finite; ConvergenceError where no
    method settled: the matrix is not positive semidefinite.
    """
    return Gram(gram).solve(rhs, passive=passive, max_iterations=max_iterations)


class Gram:
    """A matrix G (q, q) for many right sides; the factor of the last set of positive variables is kept."""

    def __init__(self, matrix: FloatArray) -> None:
        if matrix.shape != (len(matrix), len(matrix)) or not np.all(np.isfinite(matrix)):
            raise _unfit(matrix, len(matrix))
        self.matrix, self.size = matrix, np.abs(matrix)
        diagonal = np.diagonal(matrix)
        self.scale = float(diagonal.max(initial=0.0))
        self.usable = diagonal > SMALLEST_DIAGONAL * self.scale
        self._factored: tuple[IntArray, Factor] | None = None

    def solve(
        self, rhs: FloatArray, *, passive: BoolArray | None = None, max_iterations: int = _SYSTEMS
    ) -> NonNegative:
        """Return the non-negative minimiser: see ``solve``."""
        rhs = finite_vector("rhs", rhs)
        if self.matrix.shape != (rhs.size, rhs.size):
            raise _unfit(self.matrix, rhs.size)
        if passive is not None and passive.shape != rhs.shape:
            raise ArgumentError(
                f"passive must have shape {rhs.shape}, got {passive.shape}",
                hint="one guess for each variable",
            )
        try:
            return _exchange(self, rhs, passive, max_iterations)
        except ConvergenceError:
            pass
        try:
            return self._active_set(rhs, max_iterations)
        except RuntimeError:
            # a record of one branch only: no cell is better than its neighbours
            ridge = _LAST_RIDGE * self.scale
            raised = Gram(self.matrix + ridge * np.diag(self.usable))
            return _exchange(raised, rhs, passive, max_iterations)

    def _active_set(self, rhs: FloatArray, used: int) -> NonNegative:
        """Minimise |A x - b|^2 / 2 with A'A = G and A'b = f, A from the eigenvectors of G (rank, q)."""
        x = np.zeros(rhs.size)
        value, vector = scipy.linalg.eigh(self.matrix[np.ix_(self.usable, self.usable)])
        kept = value > _RELATIVE_RIDGE * value[-1]
        root, vector = np.sqrt(value[kept]), vector[:, kept].T
        b = (vector @ rhs[self.usable]) / root
        x[self.usable], _ = scipy.optimize.nnls(root[:, None] * vector, b, maxiter=_ACTIVE_SETS * rhs.size)
        return NonNegative(x, x > 0, used)

    def minimise(self, rhs: FloatArray, free: BoolArray) -> FloatArray:
        """Minimiser (q,) over the free variables (q,), of either sign, the others zero."""
        x = np.zeros(rhs.size)
        index = np.flatnonzero(free)
        if index.size:
            x[index] = scipy.linalg.cho_solve(self._factor(index), rhs[index], check_finite=False)
        return x

    def descends(self, x: FloatArray, rhs: FloatArray) -> BoolArray:
        """Where the gradient (q,) is negative by more than the rounding of the sums it came from."""
        return self.matrix @ x - rhs < -_ROUNDING * (self.size @ np.abs(x) + np.abs(rhs))

    def is_lower(self, there: FloatArray, here: FloatArray, rhs: FloatArray) -> bool:
        """Whether the quadratic is lower there than here; not as a difference of two large numbers."""
        step = there - here
        change = float(step @ (self.matrix @ here - rhs + 0.5 * (self.matrix @ step)))
        return change < -_ROUNDING * float(np.abs(rhs) @ here)

    def _factor(self, index: IntArray) -> Factor:
        if self._factored is None or not np.array_equal(self._factored[0], index):
            # cells the data cannot tell apart share their mass
            ridge = np.full(index.size, _RELATIVE_RIDGE * self.scale)
            self._factored = index, factor_of(self.matrix[np.ix_(index, index)], ridge)
        return self._factored[1]


def _unfit(matrix: FloatArray, size: int) -> ArgumentError:
    return ArgumentError(
        f"gram must be finite, of shape {(size, size)} like rhs, got {matrix.shape}",
        hint="sum gram and rhs over the same finite samples",
    )


def factor_of(matrix: FloatArray, ridge: FloatArray) -> Factor:
    """Cholesky factor of a matrix (k, k) with a ridge (k,) on its diagonal, for ``scipy.linalg.cho_solve``.

    The ridge, positive, grows tenfold until there is a factor: what the data do not tell is rounding there,
    and may be negative.
    """
    while True:
        raised = matrix.copy()
        raised[np.diag_indices_from(raised)] += ridge
        try:
            return scipy.linalg.cho_factor(raised, lower=True, check_finite=False, overwrite_a=True)
        except scipy.linalg.LinAlgError:
            ridge = 10.0 * ridge


def _exchange(gram: Gram, rhs: FloatArray, passive: BoolArray | None, max_iterations: int) -> NonNegative:
    """Exchange all variables on the wrong side at once, until there are none."""
    q = rhs.size
    free = np.zeros(q, dtype=bool) if passive is None else passive & gram.usable
    fewest, patience = q + 1, _PATIENCE
    for iteration in range(1, max_iterations + 1):
        x = gram.minimise(rhs, free)
        wrong = np.where(free, _negative(x), gram.usable & gram.descends(x, rhs))
        count = int(wrong.sum())
        if count == 0:
            return NonNegative(np.maximum(x, 0.0), free, iteration)
        if count < fewest:
            fewest, patience = count, _PATIENCE
        elif patience > 0:
            patience -= 1
        else:
            return _descend(gram, rhs, np.maximum(x, 0.0), iteration, max_iterations)
        free = free ^ wrong
    raise _unsettled(max_iterations)


def _negative(x: FloatArray) -> BoolArray:
    return x < -_ROUNDING * np.abs(x).max(initial=0.0)


def _descend(gram: Gram, rhs: FloatArray, x: FloatArray, used: int, max_iterations: int) -> NonNegative:
    """Newton steps from a feasible ``x`` that never climb, until the optimality conditions hold.

    What a step pushes below zero is put to zero where that is lower than ``x``; else the step ends where the
    first variable reaches zero, and that one stays there.
    """
    free = gram.usable & ((x > 0) | gram.descends(x, rhs))
    gained = True  # since variables were last freed
    for iteration in range(used + 1, max_iterations + 1):
        newton = gram.minimise(rhs, free)
        falling = free & _negative(newton)
        put = np.maximum(newton, 0.0)
        lower = gram.is_lower(put, x, rhs)
        gained = gained or lower
        if not np.any(falling):
            x = put
            more = gram.usable & ~free & gram.descends(x, rhs)
            if not np.any(more) or not gained:  # what was freed and gained nothing descends by rounding only
                return NonNegative(x, free, iteration)
            free, gained = free | more, False
        elif lower:
            x = put
            free = gram.usable & ((x > 0) | gram.descends(x, rhs))
        else:
            share = x[falling] / (x[falling] - newton[falling])
            first = float(share.min())
            x = np.maximum(x + first * (newton - x), 0.0)
            ends = np.flatnonzero(falling)[share <= first]
            x[ends], free[ends] = 0.0, False
            gained = gained or first > 0
    raise _unsettled(max_iterations)


def _unsettled(max_iterations: int) -> ConvergenceError:
    return ConvergenceError(
        f"the non-negative fit did not settle within {max_iterations} systems",
        hint="use fewer levels, add smoothing, or record a signal that covers the plane",
    )


def solve_signed(gram: FloatArray, rhs: FloatArray) -> FloatArray:
    """Return the minimiser (q,) of x' G x / 2 - f' x, of either sign; zero where the data never were."""
    whole = Gram(gram)
    return whole.minimise(rhs, whole.usable)


def kkt_violation(gram: FloatArray, rhs: FloatArray, x: FloatArray) -> float:
    """Largest violation of the optimality conditions, relative to the largest entry of ``rhs``.

    x >= 0, G x - f >= 0, x (G x - f) = 0.
    """
    gradient = gram @ x - rhs
    size = max(float(np.abs(rhs).max(initial=0.0)), np.finfo(float).tiny)
    worst = np.where(x > 0, np.abs(gradient), np.maximum(-gradient, 0.0))
    return float(worst.max(initial=0.0)) / size
