"""Non-negative identification on large planes, without any dense n_q x n_q matrix.

The problem of ``identification`` is solved by a primal-dual interior-point method with predictor and
corrector (Mehrotra, SIAM J. Optim. 2 (1992) 575-601). Its Newton systems

    (G + Q + diag(lambda / m)) dm = right side,      Q = smoothing + a tiny ridge

are dense in the cells but sparse in the Everett nodes: with e = C m, the cumulative sums, and m = D e, the
stencil that undoes them, they read (S - s s'/w + D' (Q + diag(lambda / m)) D) de = right side, where S is the
sparse sum of v r r'. The matrix without its rank-one term s s'/w is factorised sparsely, and conjugate
gradients deal with the rank-one term. Where S couples too many nodes to be factorised (thousands of
random reversals), its couplings between cells that do not touch are left to the conjugate gradients too.

Stopping rule: the relative violation of the optimality conditions, as ``nnls.kkt_violation`` defines it
and with all masses below their multipliers set to zero, is at most ``TOLERANCE``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import nnls
from pulsetrainer.core.equations import NodeSums
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, Plane
from pulsetrainer.core.smoothing import penalty
from pulsetrainer.errors import ConvergenceError

TOLERANCE = 1e-7
# As in ``nnls``: below this share of the largest diagonal entry, a pivot is rounding noise.
_RIDGE = 1e-13
# Measured at 200 levels: with more entries a row, factorising S takes longer than iterating on its near part.
_FACTORISED_ROW = 250
# Share of the couplings left out that is added to the diagonal instead; 1 takes a third more iterations.
_LUMPED = 0.1
# Steps stop this share short of the boundary.
_SHORT = 0.995
_USUAL = 25  # Newton steps: 20 were taken at 200 levels, 25 at 300


class Large(NamedTuple):
    """Masses (n_q,) and offset, how many Newton steps they took, and how optimal they are."""

    masses: FloatArray
    offset: float
    iterations: int
    kkt: float  # largest violation of the optimality conditions, relative


def solve(
    sums: NodeSums,
    smoothing: float = 0.0,
    *,
    max_iterations: int = 60,
    progress: Callable[[float], None] | None = None,
) -> Large:
    """Return the non-negative minimiser for the sums of a record, smoothed over s = ``smoothing``.

    ``progress`` is told, before each Newton step, the share of the usual number that is done.

    ArgumentError where ``smoothing`` is out of range; ConvergenceError where the stopping rule was not met
    within ``max_iterations`` Newton steps.
    """
    problem = _Problem(sums, smoothing)
    usable, count = problem.usable, int(problem.usable.sum())
    size = np.sqrt(max(sums.output_square / sums.weight_sum - (sums.output_sum / sums.weight_sum) ** 2, 0.0))
    largest = float(np.abs(problem.rhs).max())
    m = np.where(usable, 2.0 * size / count, 0.0)
    lam = np.where(usable, 0.01 * largest, 0.0)
    system = _System(problem)
    best = Large(m, 0.0, 0, np.inf)
    for iteration in range(max_iterations + 1):
        cut = np.where(m * largest > lam * size, m, 0.0)
        kkt = problem.kkt_violation(cut)
        if kkt < best.kkt:
            best = Large(cut, problem.offset(cut), iteration, kkt)
        if kkt <= TOLERANCE:
            return best
        if iteration == max_iterations:
            break
        if progress is not None:
            progress(min(iteration / _USUAL, 1.0))
        dual = np.where(usable, problem.gradient(m) - lam, 0.0)
        gap = float(m @ lam) / count
        system.factorise(np.divide(lam, m, out=np.zeros_like(m), where=usable))
        exact = min(1e-3, 0.1 * gap * count / float(problem.rhs @ m))
        dm, dlam = _newton(system, usable, m, lam, dual, np.zeros_like(m), 1e-2)
        after = float((m + _reach(m, dm) * dm) @ (lam + _reach(lam, dlam) * dlam)) / count
        centring = (after / gap) ** 3 * gap - dm * dlam
        dm, dlam = _newton(system, usable, m, lam, dual, centring, max(exact, 1e-9))
        step = min(1.0, _SHORT * _reach(m, dm), _SHORT * _reach(lam, dlam))
        m, lam = m + step * dm, lam + step * dlam
    raise ConvergenceError(
        f"the fit on {sums.plane.n_h} levels did not settle within {max_iterations} Newton steps: relative "
        f"violation {best.kkt:.1e}, wanted {TOLERANCE:.1e}",
        hint="use fewer levels, add smoothing, or record a signal that covers the plane",
    )


def _newton(
    system: _System,
    usable: BoolArray,
    m: FloatArray,
    lam: FloatArray,
    dual: FloatArray,
    centring: FloatArray,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    """Newton steps (dm, dlam) towards gradient = lam and m lam = ``centring``."""
    aim = np.divide(centring, m, out=np.zeros_like(m), where=usable) - lam
    dm = np.where(usable, system.solve(aim - dual, tolerance), 0.0)
    return dm, np.where(usable, aim - system.barrier * dm, 0.0)


def _reach(x: FloatArray, dx: FloatArray) -> float:
    """Longest step in 0..1 along ``dx`` that keeps ``x`` from falling below zero."""
    falling = dx < 0
    return float((x[falling] / -dx[falling]).min(initial=1.0))


class _Problem:
    """The centred quadratic in the masses, by products only."""

    def __init__(self, sums: NodeSums, smoothing: float) -> None:
        self.sums, self.plane = sums, sums.plane
        diagonal = centred_diagonal(sums)
        largest = float(diagonal.max())
        self.usable = diagonal > nnls.SMALLEST_DIAGONAL * largest
        # cells the data never touch are not part of the problem: any curvature keeps them at zero
        extra = scipy.sparse.diags_array(np.where(self.usable, _RIDGE, 1.0) * largest)
        self.extra = (extra + penalty(self.plane, diagonal, smoothing)).tocsr()
        self.mean = sums.row_sum / np.sqrt(sums.weight_sum)
        self.rhs_nodes = sums.moment - sums.row_sum * (sums.output_sum / sums.weight_sum)
        self.rhs = self.plane.adjoint(self.rhs_nodes)

    def gradient(self, masses: FloatArray) -> FloatArray:
        """(G + Q) m - f, by cumulative sums around the sparse S."""
        e = self.plane.everett_nodes(masses)
        nodes = self.sums.gram @ e - self.mean * float(self.mean @ e) - self.rhs_nodes
        return self.plane.adjoint(nodes) + self.extra @ masses

    def offset(self, masses: FloatArray) -> float:
        """Best offset y0; rows in node space lack the constant -W, so the mass of the plane is added."""
        e = self.plane.everett_nodes(masses)
        return float(self.sums.output_sum - self.sums.row_sum @ e) / self.sums.weight_sum + float(
            masses.sum()
        )

    def kkt_violation(self, masses: FloatArray) -> float:
        """Largest violation of the optimality conditions, relative to the largest entry of the right side."""
        gradient = self.gradient(masses)[self.usable]
        worst = np.where(masses[self.usable] > 0, np.abs(gradient), np.maximum(-gradient, 0.0))
        return float(worst.max()) / float(np.abs(self.rhs).max())


class _System:
    """The Newton systems: a sparse factor of all or most of the matrix, and conjugate gradients."""

    def __init__(self, problem: _Problem) -> None:
        gram = problem.sums.gram
        self.undo = difference(problem.plane)
        extra = self.undo.T @ problem.extra @ self.undo
        self.fixed = (gram + extra).tocsr()
        few = gram.nnz <= _FACTORISED_ROW * problem.plane.n_q
        self.near = self.fixed if few else (_near_part(gram, problem.plane) + extra).tocsr()
        self.plane, self.mean = problem.plane, problem.mean
        self.order: IntArray | None = None
        self.barrier = np.zeros(problem.plane.n_q)

    def factorise(self, barrier: FloatArray) -> None:
        """Prepare solutions with diag(``barrier``) in the cells."""
        self.barrier = barrier
        curvature = self.undo.T @ scipy.sparse.diags_array(barrier) @ self.undo
        self.matrix = (self.fixed + curvature).tocsr()
        matrix = self.matrix if self.near is self.fixed else (self.near + curvature).tocsr()
        options = {"SymmetricMode": True}
        if self.order is None:  # the pattern stays: order it once
            factor = scipy.sparse.linalg.splu(
                matrix.tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
            )
            self.order = np.argsort(factor.perm_c).astype(np.int64)
        permuted = matrix[self.order][:, self.order].tocsc()
        self.factor = scipy.sparse.linalg.splu(permuted, "NATURAL", diag_pivot_thresh=0.0, options=options)

    def _precondition(self, residual: FloatArray) -> FloatArray:
        assert self.order is not None
        x = np.empty_like(residual)
        x[self.order] = self.factor.solve(residual[self.order])
        return x

    def solve(self, rhs: FloatArray, tolerance: float, limit: int = 500) -> FloatArray:
        """Solve for a right side in the cells (n_q,): conjugate gradients in the nodes, step in the masses.

        Ends where the residual, weighed by the factor, is down to ``tolerance``, or after ``limit`` products:
        Newton steps forgive.
        """
        residual = self.undo.T @ rhs
        x = np.zeros_like(residual)
        z = self._precondition(residual)
        direction, energy = z, float(residual @ z)
        first = energy
        for _ in range(limit):
            if energy <= tolerance**2 * first:
                break
            product = self.matrix @ direction - self.mean * float(self.mean @ direction)
            curvature = float(direction @ product)
            if curvature <= 0:  # rounding has the last word
                break
            length = energy / curvature
            x = x + length * direction
            residual = residual - length * product
            z = self._precondition(residual)
            energy, before = float(residual @ z), energy
            direction = z + (energy / before) * direction
        return self.undo @ x


def difference(plane: Plane) -> scipy.sparse.csr_array:
    """The stencil D (n_q, n_q) that takes Everett nodes to masses: the inverse of the cumulative sums.

    m[i, j] = E[i + 1, j] - E[i, j] - E[i + 1, j + 1] + E[i, j + 1].
    """
    i, j = plane.cell_indices
    row, column, value = [], [], []
    for a, b, sign in ((i + 1, j, 1.0), (i, j, -1.0), (i + 1, j + 1, -1.0), (i, j + 1, 1.0)):
        inside = a > b  # the Everett function is zero on the diagonal
        row.append(np.flatnonzero(inside))
        column.append((a * (a - 1) // 2 + b)[inside])
        value.append(np.full(int(inside.sum()), sign))
    entries = (np.concatenate(value), (np.concatenate(row), np.concatenate(column)))
    return scipy.sparse.csr_array(entries, shape=(plane.n_q, plane.n_q))


def centred_diagonal(sums: NodeSums) -> FloatArray:
    """Diagonal (n_q,) of the centred Gram matrix of the cells.

    Cell k sums S over all pairs of nodes in its cone. A pair lies in the cones of the cells up to its own
    corner (smaller i, larger j), so one cumulative sum over the corners does it.
    """
    plane = sums.plane
    i, j = plane.cell_indices
    pairs = sums.gram.tocoo()
    upper = np.minimum(i[pairs.row], i[pairs.col])
    lower = np.maximum(j[pairs.row], j[pairs.col])
    inside = lower <= upper
    corner = (upper * (upper + 1) // 2 + lower)[inside]
    diagonal = plane.adjoint(
        np.bincount(corner, weights=pairs.data[inside], minlength=plane.n_q).astype(np.float64)
    )
    diagonal -= plane.adjoint(sums.row_sum) ** 2 / sums.weight_sum
    diagonal[diagonal <= 1e-13 * sums.weight_sum] = 0.0  # rounding of relays that never switched
    return diagonal


def _near_part(gram: scipy.sparse.csr_array, plane: Plane) -> scipy.sparse.csr_array:
    """Entries of S between nodes that touch; a share of the others goes to the diagonal."""
    i, j = plane.cell_indices
    pairs = gram.tocoo()
    row, column = pairs.row, pairs.col
    touching = (np.abs(i[row] - i[column]) <= 1) & (np.abs(j[row] - j[column]) <= 1)
    far = np.bincount(row[~touching], weights=np.abs(pairs.data[~touching]), minlength=plane.n_q)
    near = scipy.sparse.csr_array((pairs.data[touching], (row[touching], column[touching])), shape=gram.shape)
    return (near + scipy.sparse.diags_array(_LUMPED * far)).tocsr()
