"""A curve of the output over a hysteretic quantity, y = f(P[u]), compared with weights of either sign.

What a swing of the input adds to the output of a Preisach operator, of whatever sign, depends on the swing
alone and not on where the output stands: its minor loops between the same limits are congruent (Mayergoyz,
Mathematical Models of Hysteresis and Their Applications, 2003, section 1.2). The strain of a ferroelectric
is the square of a polarisation that lags: a butterfly whose minor loops are not congruent. Weights of
either sign follow the branches that they were fitted to, and no others.

The test needs no two loops between the same limits. Both forms are fitted to blocks of the record and judged
by the others. With mu >= 0 and f in straight pieces, each Gauss-Newton step is

    minimise  sum_t (y_t - f(z_t) - f'(z_t) r_t . (m - m_0))^2 + bending   over m >= 0,    z = r . m_0

with f refitted to the z that follows, shorter where that leaves more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pulsetrainer.core import nnls, operator
from pulsetrainer.core.edges import plane_for, thinned
from pulsetrainer.core.memory import negative_saturation, trace
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, Plane
from pulsetrainer.core.record import Record
from pulsetrainer.core.smoothing import FOLDS, blocks, penalty

# A curve that leaves less than this share of what weights of either sign leave tells that loops are not
# congruent. Of congruent devices none has less than 1.0, see decision 074.
BETTER = 0.9
_MOST = 1500  # samples that both are fitted to
_LEVELS = 24  # on 16, what a coarse plane leaves speaks against weights of either sign
_KNOTS = 20
_SMOOTHINGS = (0.025, 0.05)
_SMOOTHINGS_SIGNED = (0.025, 0.05, 0.1)
_STEPS = 12  # of the whole record; from there those without a fold begin
_MORE = 6
_LOOK = 4  # steps after which the best beginning is known
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step, until one leaves less
_SETTLED = 1e-4
_BEND = 1e-3  # of f, against the samples
_RIDGE = 1e-6


@dataclass(frozen=True, slots=True)
class Rivals:
    """What two forms leave on held-out blocks, rms, output unit."""

    signed: float
    curve: float

    def congruent(self, least: float) -> bool:
        """Tell whether no curve over a hysteretic quantity is better by more than chance, and by ``least``.

        ``least`` is the rms, output unit, of what only the curve tells.
        """
        return self.curve >= BETTER * self.signed or self.signed**2 - self.curve**2 <= least**2


def rivals(records: Sequence[Record], low: float, high: float) -> Rivals | None:
    """Fit both forms to blocks of records over [low, high]; None where no block can be held out.

    ConvergenceError where a fit did not settle.
    """
    plane = thinned(plane_for(records, low, high, 2 * _LEVELS), _LEVELS)
    counted = [np.flatnonzero(r.counts) for r in records]
    every = max(1, sum(at.size for at in counted) // _MOST)
    kept = [at[::every] for at in counted]
    rows = np.concatenate([_states(plane, r, at) for r, at in zip(records, kept, strict=True)])
    y = np.concatenate([r.output[at] for r, at in zip(records, kept, strict=True)])
    fold = np.concatenate(
        [blocks(r.input, low, high)[at] % FOLDS for r, at in zip(records, kept, strict=True)]
    )
    if np.unique(fold).size < 2:
        return None
    size = float(np.ptp(y)) or 1.0
    y = (y - y.mean()) / size
    signed = min(_held_out_signed(plane, rows, y, fold, s) for s in _SMOOTHINGS_SIGNED)
    curve = min(_held_out_curve(plane, rows, y, fold, s) for s in _SMOOTHINGS)
    return Rivals(signed * size, curve * size)


def _states(plane: Plane, record: Record, at: IntArray) -> FloatArray:
    """States (k, n_q) of the cells in some samples (k,) of a record."""
    way = trace(record.input, record.start or negative_saturation(plane.low), plane.low, plane.high)
    return plane.adjoint(operator.rows(plane, way, at).toarray())


def _held_out_signed(plane: Plane, rows: FloatArray, y: FloatArray, fold: IntArray, s: float) -> float:
    left = np.empty(y.size)
    for number in np.unique(fold):
        rest = fold != number
        middle, level = rows[rest].mean(axis=0), float(y[rest].mean())
        about = rows[rest] - middle
        gram = _bent(plane, about.T @ about, s)
        masses = nnls.solve_signed(gram, about.T @ (y[rest] - level))
        left[~rest] = y[~rest] - level - (rows[~rest] - middle) @ masses
    return root_mean_square(left)


def _bent(plane: Plane, gram: FloatArray, smoothing: float) -> FloatArray:
    """Gram matrix (n_q, n_q) with the bending of the density added."""
    return gram + penalty(plane, np.diagonal(gram).copy(), smoothing).toarray()


@dataclass(frozen=True, slots=True)
class _Curve:
    """A curve in straight pieces over z = rows . masses."""

    masses: FloatArray  # (n_q,), of sum 1
    knots: FloatArray  # (_KNOTS,)
    value: FloatArray  # (_KNOTS,)
    squares: float  # what it leaves

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Output (n,) in states (n, n_q)."""
        return np.interp(rows @ self.masses, self.knots, self.value)


def _curve_over(masses: FloatArray, rows: FloatArray, y: FloatArray) -> _Curve:
    """Fit the curve alone."""
    z = rows @ masses
    knots: FloatArray = np.linspace(float(z.min()), float(z.max()) + 1e-9, _KNOTS)
    share = (z - knots[0]) / (knots[1] - knots[0])
    left = share.astype(np.int64)  # the last knot lies beyond all
    hats = np.zeros((z.size, _KNOTS))
    sample = np.arange(z.size)
    hats[sample, left], hats[sample, left + 1] = 1.0 - (share - left), share - left
    bend = np.diff(np.eye(_KNOTS), 2, axis=0)
    gram = hats.T @ hats + z.size * (_BEND / _KNOTS * bend.T @ bend + 1e-9 * np.eye(_KNOTS))
    value = np.asarray(np.linalg.solve(gram, hats.T @ y), dtype=np.float64)
    return _Curve(masses, knots, value, float(np.sum((y - hats @ value) ** 2)))


def _stepped(
    plane: Plane, found: _Curve, rows: FloatArray, y: FloatArray, smoothing: float, most: int
) -> _Curve:
    """Take Gauss-Newton steps until none leaves less."""
    for _ in range(most):
        slope = np.diff(found.value) / np.diff(found.knots)
        middle = 0.5 * (found.knots[1:] + found.knots[:-1])
        moved = np.interp(rows @ found.masses, middle, slope)[:, None] * rows
        gram = _bent(plane, moved.T @ moved, smoothing)
        gram += _RIDGE * float(np.trace(gram)) / len(gram) * np.eye(len(gram))
        to = nnls.solve(gram, moved.T @ (y - found(rows) + moved @ found.masses)).x
        if not to.sum() > 0:
            break
        ways = (found.masses + share * (to / to.sum() - found.masses) for share in _SHARES)
        better = (
            one for m in ways if (one := _curve_over(m, rows, y)).squares < (1 - _SETTLED) * found.squares
        )
        after = next(better, None)
        if after is None:
            break
        found = after
    return found


def _held_out_curve(plane: Plane, rows: FloatArray, y: FloatArray, fold: IntArray, s: float) -> float:
    begun = (_stepped(plane, _curve_over(m, rows, y), rows, y, s, _LOOK) for m in _beginnings(plane))
    whole = _stepped(plane, min(begun, key=lambda one: one.squares), rows, y, s, _STEPS)
    left = np.empty(y.size)
    for number in np.unique(fold):
        rest = fold != number
        start = _curve_over(whole.masses, rows[rest], y[rest])
        found = _stepped(plane, start, rows[rest], y[rest], s, _MORE)
        left[~rest] = y[~rest] - found(rows[~rest])
    return root_mean_square(left)


def _beginnings(plane: Plane) -> list[FloatArray]:
    """Masses (n_q,) of sum 1 to begin with: an even density, one of narrow loops, one of wide loops."""
    i, j = plane.cell_indices
    x = plane.thresholds
    narrow: BoolArray = x[i] - x[j] < (plane.high - plane.low) / 3
    each = (plane.areas, plane.areas * narrow, plane.areas * ~narrow)
    return [masses / masses.sum() for masses in each]
