"""Identification: from measured input and output to the weights mu-hat >= 0 and the offset y0-hat.

    minimise  sum_t v_t (y_t - y0 - r_t . m)^2   over masses m = mu A >= 0 and a free offset y0

``equations`` makes the sums over samples. The offset is eliminated exactly by centring. Carneiro, Abreu,
Restivo (2018) alternate instead between the offset and the weights; that is ``method="alternating"`` and
ends at the same point. With non-negativity the problem stays well posed with fewer samples than cells:
weights that the data do not ask for are zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.core import large, nnls
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.equations import NormalEquations, Record, node_sums, normal_equations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane, Reading
from pulsetrainer.core.smoothing import choose, smoothed
from pulsetrainer.errors import ArgumentError, ConvergenceError

__all__ = [
    "Identified",
    "Method",
    "NormalEquations",
    "Record",
    "Smoothing",
    "coverage",
    "identify",
    "normal_equations",
    "polarity_of",
]

Method = Literal["joint", "alternating"]
Smoothing = float | Literal["auto"]

# The dense path holds about ten matrices of n_q^2 numbers at its peak; above this it goes matrix-free.
DENSE_BYTES = 1_000_000_000
_DENSE_COPIES = 10


@dataclass(frozen=True, slots=True)
class Identified:
    """The fitted operator and how it was found."""

    operator: Preisach
    method: Method
    iterations: int
    kkt: float  # largest violation of the optimality conditions, relative
    smoothing: float = 0.0  # s, share of the input's range; see ``core.smoothing``
    tried: tuple[tuple[float, float], ...] = ()  # (s, held-out rms) when it was chosen, output unit
    samples: int = 0  # with weight; fewer than cells: what the data do not ask for is zero


def polarity_of(records: Sequence[Record]) -> int:
    """Return 1 when the output rises with the input, -1 when it falls: the sign of their covariance."""
    u = np.concatenate([r.input if r.weight is None else r.input[r.weight > 0] for r in records])
    y = np.concatenate([r.output if r.weight is None else r.output[r.weight > 0] for r in records])
    return -1 if float(np.mean((u - u.mean()) * (y - y.mean()))) < 0 else 1


def fits_dense(plane: Plane) -> bool:
    """Tell whether the dense path stays within ``DENSE_BYTES``."""
    return _DENSE_COPIES * 8 * plane.n_q**2 <= DENSE_BYTES


def identify(
    records: Sequence[Record],
    plane: Plane,
    *,
    reading: Reading = "continuous",
    method: Method = "joint",
    polarity: int | None = None,
    smoothing: Smoothing = 0.0,
) -> Identified:
    """Fit weights mu >= 0 and a free offset to one or several records.

    Planes whose dense matrices would take more than ``DENSE_BYTES`` (above 82 levels) are solved by
    ``large.solve``, which needs none.

    Parameters
    ----------
    records
        Measured inputs and outputs; all share one set of weights and one offset.
    plane
        The levels; inputs outside are clipped.
    polarity
        1, -1, or None to detect it.
    smoothing
        Length s, share of the input's range, below which features of the density are smoothed away; 0 for
        none; "auto" to choose it by held-out blocks (see ``core.smoothing``).

    Raises
    ------
    ArgumentError
        No records, no weight, an input or an output that does not vary, fewer samples than levels, an
        unknown method, a smoothing out of range, or ``method="alternating"`` on a plane too large for it.
    ConvergenceError
        The fit did not settle.
    """
    samples = _check(records, plane, method, smoothing)
    sign = polarity_of(records) if polarity is None else polarity
    turned = [Record(r.input, sign * r.output, r.weight, r.start) for r in records]
    tried: tuple[tuple[float, float], ...] = ()
    if smoothing == "auto":
        choice = choose(turned, plane, reading)
        smoothing, tried = choice.smoothing, choice.tried
    fit = _fit_dense if fits_dense(plane) else _fit_large
    masses, offset, iterations, kkt = fit(turned, plane, reading, method, smoothing)
    operator = Preisach(plane, masses / plane.areas, sign * offset, reading, polarity=sign)
    return Identified(operator, method, iterations, kkt, smoothing, tried, samples)


def _check(records: Sequence[Record], plane: Plane, method: Method, smoothing: Smoothing) -> int:
    """Return the number of samples with weight, or raise ArgumentError when they cannot be fitted."""
    samples = sum(int(np.count_nonzero(r.weights)) for r in records)
    if samples == 0:
        raise ArgumentError(
            f"records must hold at least one sample with weight, got {len(records)} records without any",
            hint="record a run, or give some sample a weight above 0",
        )
    if method not in ("joint", "alternating"):
        raise ArgumentError(f"method must be 'joint' or 'alternating', got {method!r}", hint="use 'joint'")
    if isinstance(smoothing, str) and smoothing != "auto":
        raise ArgumentError(
            f"smoothing must be 'auto' or a number in 0..1, got {smoothing!r}", hint="use 'auto'"
        )
    inputs = np.concatenate([np.clip(r.input, plane.low, plane.high) for r in records])
    outputs = np.concatenate([r.output[r.weights > 0] for r in records])
    for name, values in (("input", inputs), ("output", outputs)):
        if np.ptp(values) <= 1e-12 * np.abs(values).max():
            raise ArgumentError(
                f"the {name} does not vary: it is {values[0]:g} in all of its {values.size} samples "
                f"(levels are {plane.low:g} .. {plane.high:g})",
                hint="check the wiring, and that the run sweeps the range of the levels",
            )
    if samples < plane.n_h:
        raise ArgumentError(
            f"records must hold at least one sample for each of the {plane.n_h} levels, got {samples}",
            hint="use fewer levels or a longer record",
        )
    return samples


_Fitted = tuple[FloatArray, float, int, float]  # masses, offset, iterations, relative KKT violation


def _fit_dense(
    records: Sequence[Record], plane: Plane, reading: Reading, method: Method, smoothing: float
) -> _Fitted:
    """Fit with the Gram matrix of the cells in memory."""
    equations = normal_equations(plane, records, reading)
    gram, rhs = smoothed(equations, smoothing)
    if method == "joint":
        found = nnls.solve(gram, rhs)
        masses, offset, iterations = found.x, equations.offset(found.x), found.iterations
    else:
        penalty = gram - equations.centred()[0]
        masses, offset, iterations = _alternate(equations, equations.gram + penalty)
    return masses, offset, iterations, nnls.kkt_violation(gram, rhs, masses)


def _fit_large(
    records: Sequence[Record], plane: Plane, reading: Reading, method: Method, smoothing: float
) -> _Fitted:
    """Fit without any dense matrix."""
    if method != "joint":
        raise ArgumentError(
            f"method='alternating' needs dense matrices of {plane.n_q} x {plane.n_q} cells, more than "
            f"{DENSE_BYTES / 1e9:.0f} GB",
            hint="use the joint method: it ends at the same point",
        )
    found = large.solve(node_sums(plane, records, reading), smoothing)
    return found.masses, found.offset, found.iterations, found.kkt


def _alternate(
    equations: NormalEquations, gram: FloatArray, limit: int = 200
) -> tuple[FloatArray, float, int]:
    """Alternate between the offset and the weights until neither moves (Carneiro et al. 2018, section 3).

    The plain alternation creeps: ten thousand rounds at 48 levels. Its moves are a piecewise linear
    function of the offset, so the next offset is taken where the line through the last two moves is zero.
    """
    offset = equations.output_sum / equations.weight
    spread = np.sqrt(max(equations.output_square / equations.weight - offset**2, 0.0))
    passive: NDArray[np.bool_] | None = None
    before: tuple[float, float] | None = None
    for iteration in range(1, limit + 1):
        found = nnls.solve(gram, equations.moment - offset * equations.row_sum, passive=passive)
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
