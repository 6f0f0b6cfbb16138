"""The dual form fitted where its noise is: in the output, which its operator remembers.

Fitting P to u = P[y] takes the measured y for exact. Its noise goes into every remembered extreme, and where
the output is steep in the input (P hardly moves over y) it is amplified: the fit is biased, as regressions
with errors in their variables are (Fuller, Measurement Error Models, 1987, section 1.1). So from there on the
masses m are moved by Gauss-Newton steps on

    minimise  sum_t v_t (y_t - P^-1[u]_t)^2  +  s^8 g B(m)   over m >= 0 and a free offset

whose input is exact. The weights v are those of Huber. On a branch from the turn a to the sample t

    u_t - u_a = 2 G(y_t, y_a; m)   so that   dy_t = -(2 G(y_t, y_a; dm) + 2 d2G dy_a) / 2 d1G

with the Everett function G continued antisymmetrically: the change of a turn is known before that of what
follows it. A turn at an end of the range does not move.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.core import nnls
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.input_noise import MEDIAN_TO_SIGMA
from pulsetrainer.core.memory import Trace, negative_saturation, trace
from pulsetrainer.core.operator import Preisach, steps
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, Plane
from pulsetrainer.core.record import Record
from pulsetrainer.core.smoothing import penalty

_MOST = 4000  # samples
_MOST_TURNS = 4000
_ROUNDS = 6
_SHARES = (1.0, 0.5, 0.25, 0.1, 0.03)  # of a step, until one leaves less
_ENOUGH = 0.01  # of what is minimised: steps that gain less are the last
_HUBER = 2.0  # times the usual error: beyond, an error counts by its size only
_FLAT = 0.05  # of the median slope of P: flatter, the output may be anywhere


def in_output(inner: Preisach, records: Sequence[Record], smoothing: float) -> Preisach:
    """Return P of the dual form, moved from ``inner`` until the error in the output is least.

    ``inner`` goes from output to input, of weights fitted to the input; the ``records`` go from input to
    output. ``smoothing`` is s, a share of the output's range. ConvergenceError if a fit did not settle.
    """
    counted = sum(int(np.count_nonzero(r.counts)) for r in records)
    every = max(1, counted // _MOST)
    kept = [np.flatnonzero(r.counts)[::every] for r in records]
    measured = np.concatenate([r.output[at] for r, at in zip(records, kept, strict=True)])
    found, before = inner, np.inf
    for _ in range(_ROUNDS):
        paths = [_path(found, r) for r in records]
        if sum(path.node_value.size for path, _ in paths) > _MOST_TURNS:
            break
        step = _step(found, paths, kept, measured, smoothing)
        tried = (step.taken(found, share) for share in _SHARES)
        better = (
            (one, cost) for one in tried if (cost := step.cost(one, records, kept, measured)) < step.now
        )
        after, cost = next(better, (found, step.now))
        before, found = step.now, after
        if cost > (1.0 - _ENOUGH) * before:
            break
    return found


def _path(inner: Preisach, record: Record) -> tuple[Trace, int]:
    """Outputs along a record with its past, followed through their memory, and the length of that past."""
    dual = Dual(inner)
    past = np.zeros(0) if record.start is None else np.asarray(record.start.extremes)
    y = dual(np.concatenate((past, record.input)))
    plane = inner.plane
    start = negative_saturation(plane.low) if dual.rest is None else dual.rest
    return trace(y, start, plane.low, plane.high), past.size


@dataclass(frozen=True, slots=True)
class _Step:
    """A Gauss-Newton step: where it leads, and what is minimised here."""

    masses: FloatArray  # (n_q,)
    offset: float  # that it adds to P at its lowest state
    bending: FloatArray  # (n_q, n_q)
    weight: FloatArray  # (k,)
    now: float

    def taken(self, inner: Preisach, share: float) -> Preisach:
        """Return P after a share of the step."""
        masses = inner.masses + share * (self.masses - inner.masses)
        # what is free is P where all relays are down, s (y0 - W): y0 follows
        down = inner.polarity * inner.offset - inner.total + share * self.offset
        offset = inner.polarity * (down + float(masses.sum()))
        return replace(inner, weights=masses / inner.plane.areas, offset=offset)

    def cost(
        self, inner: Preisach, records: Sequence[Record], kept: Sequence[IntArray], measured: FloatArray
    ) -> float:
        """What is minimised, of another P."""
        dual = Dual(inner)
        said = np.concatenate([dual(r.input, r.start)[at] for r, at in zip(records, kept, strict=True)])
        return _cost(self.weight, measured - said, self.bending, inner.masses)


def _cost(weight: FloatArray, error: FloatArray, bending: FloatArray, masses: FloatArray) -> float:
    return float(np.sum(weight * error**2) + masses @ bending @ masses)


def _step(
    inner: Preisach,
    paths: Sequence[tuple[Trace, int]],
    kept: Sequence[IntArray],
    measured: FloatArray,
    smoothing: float,
) -> _Step:
    """Linearise the outputs around P and solve for its masses."""
    pairs = [
        (path.value[at + past], _moved(inner, path, at + past))
        for (path, past), at in zip(paths, kept, strict=True)
    ]
    error = measured - np.concatenate([y for y, _ in pairs])
    rows = np.concatenate([moved for _, moved in pairs])
    usual = MEDIAN_TO_SIGMA * float(np.median(np.abs(error)))
    whole = max(_HUBER * usual, np.finfo(float).tiny)  # errors up to here count whole
    weight = whole / np.maximum(np.abs(error), whole)
    root = np.sqrt(weight)
    moved, free = root[:, None] * rows[:, :-1], root * rows[:, -1]
    wanted = root * (error + rows[:, :-1] @ inner.masses)
    along = free / max(float(np.linalg.norm(free)), np.finfo(float).tiny)
    moved_less = moved - np.outer(along, along @ moved)  # the offset is eliminated
    gram = moved_less.T @ moved_less
    bending = penalty(inner.plane, np.diagonal(gram).copy(), smoothing).toarray()
    masses = nnls.solve(gram + bending, moved_less.T @ wanted).x
    offset = float(along @ (wanted - moved @ masses)) / max(float(np.linalg.norm(free)), np.finfo(float).tiny)
    return _Step(masses, offset, bending, weight, _cost(weight, error, bending, inner.masses))


def _moved(inner: Preisach, path: Trace, at: IntArray) -> FloatArray:
    """Rows (k, n_q + 1): what masses, and P where all relays are down, change in some samples (k,) of y."""
    plane, value, parent = inner.plane, path.node_value, path.parent
    fixed = _at_end(plane, value)
    own, slope, back = _branch(inner, value, value[parent])
    state = np.zeros((value.size, plane.n_q + 1))  # of a turn that does not move: P there is not u
    turned = np.zeros((value.size, plane.n_q + 1))
    state[0, -1] = 1.0
    for k in range(1, value.size):
        row = state[parent[k]].copy()
        row[:-1] += own[k]
        if fixed[k]:
            state[k] = row
        else:
            turned[k] = -slope[k] * (row + back[k] * turned[parent[k]])
    anchor, here = path.anchor[at], path.value[at]
    own, slope, back = _branch(inner, here, value[anchor])
    rows = state[anchor] + back[:, None] * turned[anchor]
    rows[:, :-1] += own
    rows *= -slope[:, None]
    rows[_at_end(plane, here)] = 0.0
    return rows


def _at_end(plane: Plane, values: FloatArray) -> BoolArray:
    return (values <= plane.low) | (values >= plane.high)


def _branch(inner: Preisach, to: FloatArray, origin: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of branches (k,): the masses between (k, n_q), one over the slope at its end, the slope at its origin.

    Where P is flatter than ``_FLAT``, one over that.
    """
    plane = inner.plane
    own = plane.adjoint(steps(plane, to, origin).toarray())
    near = 1e-6 * (plane.high - plane.low)

    def slope(of: FloatArray, difference: tuple[FloatArray, FloatArray]) -> FloatArray:
        width = np.minimum(of + near, plane.high) - np.maximum(of - near, plane.low)
        return (difference[1] - difference[0]) / width

    ends = slope(to, (inner.step(to - near, origin), inner.step(to + near, origin)))
    begins = slope(origin, (inner.step(to, origin - near), inner.step(to, origin + near)))
    flat = max(_FLAT * float(np.median(np.abs(ends))), np.finfo(float).tiny)
    return own, 1.0 / np.maximum(ends, flat), begins
