"""Identification: from measured input and output to the weights mu-hat >= 0 and the offset y0-hat.

    minimise  sum_t v_t (y_t - y0 - r_t . m)^2   over masses m = mu A >= 0 and a free offset y0

A row r_t is a short sum of Everett nodes, so the normal matrix is assembled sparsely in node space,
branch by branch, and carried to the cells by cumulative sums: the n x n_q design matrix never exists.
The offset is eliminated exactly by centring. Carneiro, Abreu, Restivo (2018) alternate instead between
the offset and the weights; that is ``method="alternating"`` and ends at the same point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from pulsetrainer.core import nnls
from pulsetrainer.core.memory import State, Trace
from pulsetrainer.core.operator import Preisach, base_rows, follow, steps
from pulsetrainer.core.plane import FloatArray, Plane, Reading, finite_vector
from pulsetrainer.errors import ArgumentError, ConvergenceError

Method = Literal["joint", "alternating"]

_CHUNK = 200_000  # samples whose sparse rows are held at one time


@dataclass(frozen=True, slots=True)
class Record:
    """One record to be fitted: input, output and, if some samples count less, their weights."""

    input: FloatArray  # (n,)
    output: FloatArray  # (n,)
    weight: FloatArray | None = None  # (n,) 0 masks a sample out of the fit, not out of the memory
    start: State | None = None  # None: negative saturation

    def __post_init__(self) -> None:
        u = finite_vector("input", self.input, at_least=2)
        v = np.ones(u.size) if self.weight is None else finite_vector("weight", self.weight)
        y = np.asarray(self.output, dtype=np.float64)
        if y.shape != u.shape or v.shape != u.shape:
            raise ArgumentError(
                f"input, output and weight must have one length, got {u.shape}, {y.shape} and {v.shape}",
                hint="cut the record to the samples that have both",
            )
        if np.any(v < 0):
            raise ArgumentError(f"weight must not be negative, got {v.min():g}", hint="0 masks a sample")
        finite_vector("output", y[v > 0])  # masked samples may be anything


@dataclass(frozen=True, slots=True)
class NormalEquations:
    """Everything the fit needs to know of the data: sums over all samples, in mass space."""

    plane: Plane
    gram: FloatArray  # (n_q, n_q) sum v r r'
    moment: FloatArray  # (n_q,) sum v r y
    row_sum: FloatArray  # (n_q,) sum v r
    weight: float  # sum v
    output_sum: float  # sum v y
    output_square: float  # sum v y^2

    def centred(self) -> tuple[FloatArray, FloatArray]:
        """Gram matrix and right side with the offset eliminated: rows and outputs minus their means."""
        gram = self.gram - np.outer(self.row_sum, self.row_sum / self.weight)
        return gram, self.moment - self.row_sum * (self.output_sum / self.weight)

    def offset(self, masses: FloatArray) -> float:
        """Best offset y0 for given masses (n_q,)."""
        return float(self.output_sum - self.row_sum @ masses) / self.weight

    def sum_of_squares(self, masses: FloatArray, offset: float) -> float:
        """Weighted sum of squared residuals, from the sums alone (rounding: about 1e-12 of sum v y^2)."""
        return float(
            self.output_square
            - 2 * (self.moment @ masses + offset * self.output_sum)
            + masses @ self.gram @ masses
            + 2 * offset * (self.row_sum @ masses)
            + offset**2 * self.weight
        )


@dataclass(frozen=True, slots=True)
class Identified:
    """The fitted operator and how it was found."""

    operator: Preisach
    method: Method
    iterations: int
    kkt: float  # largest violation of the optimality conditions, relative


def _node_sums(
    plane: Plane, path: Trace, y: FloatArray, v: FloatArray
) -> tuple[sparse.csr_array, FloatArray]:
    """Node-space sums of one record: sum v r r' (n_q, n_q) sparse, and (3, n_q): sum v r, sum v r y, zeros.

    r = own + base: own rows have at most four entries; base rows are shared by all samples of an anchor,
    so they enter once per anchor with the sums of its own rows.
    """
    base = base_rows(plane, path)
    nodes = path.node_value.size
    gram = sparse.csr_array((plane.n_q, plane.n_q))
    by_anchor = sparse.csr_array((nodes, plane.n_q))  # sum of v own over the samples of an anchor
    own_sum, own_y = np.zeros(plane.n_q), np.zeros(plane.n_q)
    origin = path.node_value[path.anchor]
    for begin in range(0, y.size, _CHUNK):
        part = slice(begin, begin + _CHUNK)
        own = steps(plane, path.value[part], origin[part])
        scaled = own.multiply(v[part, None]).tocsr()
        gram = gram + own.T @ scaled
        size = own.shape[0]
        gather = sparse.csr_array((np.ones(size), (path.anchor[part], np.arange(size))), shape=(nodes, size))
        by_anchor = by_anchor + gather @ scaled
        own_sum += scaled.sum(axis=0)
        own_y += scaled.T @ y[part]
    count = np.bincount(path.anchor, weights=v, minlength=nodes)
    count_y = np.bincount(path.anchor, weights=v * y, minlength=nodes)
    cross = base.T @ by_anchor
    gram = gram + cross + cross.T + base.T @ base.multiply(count[:, None]).tocsr()
    sums = np.stack((own_sum + base.T @ count, own_y + base.T @ count_y))
    return gram, sums


def normal_equations(plane: Plane, records: Sequence[Record], reading: Reading) -> NormalEquations:
    """Assemble the normal equations of all records in mass space; relays are -1 or +1."""
    gram = sparse.csr_array((plane.n_q, plane.n_q))
    sums = np.zeros((2, plane.n_q))
    weight, output, square = 0.0, 0.0, 0.0
    for record in records:
        v = np.ones(record.input.size) if record.weight is None else record.weight
        y = np.where(v > 0, record.output, 0.0)
        path = follow(plane, record.input, record.start, reading)
        part, part_sums = _node_sums(plane, path, y, v)
        gram, sums = gram + part, sums + part_sums
        weight, output, square = weight + float(v.sum()), output + float(v @ y), square + float(v @ (y * y))
    cells = plane.adjoint(plane.adjoint(gram.toarray()).T.copy())
    row_sum, moment = plane.adjoint(sums)
    # so far rows rise from 0, all relays down, to 2: subtract the constant 1 from each
    cells += weight - row_sum[:, None] - row_sum[None, :]
    return NormalEquations(plane, cells, moment - output, row_sum - weight, weight, output, square)


def polarity_of(records: Sequence[Record]) -> int:
    """Return 1 when the output rises with the input, -1 when it falls: the sign of their covariance."""
    u = np.concatenate([r.input if r.weight is None else r.input[r.weight > 0] for r in records])
    y = np.concatenate([r.output if r.weight is None else r.output[r.weight > 0] for r in records])
    return -1 if float(np.mean((u - u.mean()) * (y - y.mean()))) < 0 else 1


def identify(
    records: Sequence[Record],
    plane: Plane,
    *,
    reading: Reading = "continuous",
    method: Method = "joint",
    polarity: int | None = None,
) -> Identified:
    """Fit weights mu >= 0 and a free offset to one or several records.

    Parameters
    ----------
    records
        Measured inputs and outputs; all share one set of weights and one offset.
    plane
        The levels; inputs outside are clipped.
    polarity
        1, -1, or None to detect it.

    Raises
    ------
    ArgumentError
        No records, or an output that does not vary.
    ConvergenceError
        The fit did not settle.
    """
    if not records or sum(float(np.sum(_weights(r))) for r in records) == 0:
        raise ArgumentError("identify needs at least one sample with weight, got none", hint="record a run")
    sign = polarity_of(records) if polarity is None else polarity
    turned = [Record(r.input, sign * np.asarray(r.output), r.weight, r.start) for r in records]
    equations = normal_equations(plane, turned, reading)
    mean = equations.output_sum / equations.weight
    if equations.output_square / equations.weight - mean**2 <= 1e-24 * max(mean**2, np.finfo(float).tiny):
        raise ArgumentError(
            f"the output does not vary: it is {sign * mean:g} in all samples",
            hint="check the sensor's wiring",
        )
    if method == "joint":
        gram, rhs = equations.centred()
        found = nnls.solve(gram, rhs)
        masses, offset, iterations = found.x, equations.offset(found.x), found.iterations
    elif method == "alternating":
        masses, offset, iterations = _alternate(equations)
    else:
        raise ArgumentError(f"method must be 'joint' or 'alternating', got {method!r}", hint="use 'joint'")
    gram, rhs = equations.centred()
    operator = Preisach(plane, masses / plane.areas, sign * offset, reading, polarity=sign)
    return Identified(operator, method, iterations, nnls.kkt_violation(gram, rhs, masses))


def _weights(record: Record) -> FloatArray:
    return np.ones(record.input.size) if record.weight is None else record.weight


def _alternate(equations: NormalEquations, limit: int = 200) -> tuple[FloatArray, float, int]:
    """Alternate between the offset and the weights until neither moves (Carneiro et al. 2018, section 3).

    The plain alternation creeps: ten thousand rounds at 48 levels. Its moves are a piecewise linear
    function of the offset, so the next offset is taken where the line through the last two moves is zero.
    """
    offset = equations.output_sum / equations.weight
    spread = np.sqrt(max(equations.output_square / equations.weight - offset**2, 0.0))
    passive: NDArray[np.bool_] | None = None
    before: tuple[float, float] | None = None
    for iteration in range(1, limit + 1):
        found = nnls.solve(equations.gram, equations.moment - offset * equations.row_sum, passive=passive)
        passive = found.passive
        moved = equations.offset(found.x) - offset
        if abs(moved) <= 1e-12 * spread:
            return found.x, offset, iteration
        change = moved
        if before is not None and before[1] != moved:
            change = -moved * (offset - before[0]) / (moved - before[1])
        before = (offset, moved)
        offset += change
    raise ConvergenceError(
        f"offset and weights still moved after {limit} alternations", hint="use the joint method"
    )


def coverage(plane: Plane, inputs: Sequence[ArrayLike]) -> NDArray[np.bool_]:
    """Tell for every cell (n_q,) whether some input switched it on and, later, off.

    Cell (i, j) is switched on at the first input >= the middle of band i, and off when the input
    then falls below the middle of band j.
    """
    done = np.zeros(plane.n_q, dtype=bool)
    i, j = plane.cell_indices
    for values in inputs:
        u = finite_vector("input", values)
        highest = np.maximum.accumulate(u)
        first = np.searchsorted(highest, plane.thresholds, side="left")  # (n_h,) n where never
        lowest_after = np.append(np.minimum.accumulate(u[::-1])[::-1], np.inf)[first]
        done |= lowest_after[i] < plane.thresholds[j]
    return done
