"""Identification: from measured input and output to the weights mu-hat >= 0 and the offset y0-hat.

    minimise  sum_t v_t (y_t - y0 - r_t . m)^2   over masses m = mu A >= 0 and a free offset y0

``equations`` makes the sums over samples. The offset is eliminated exactly by centring. Carneiro, Abreu,
Restivo (2018) alternate instead between the offset and the weights; that is ``method="alternating"`` and
ends at the same point. With non-negativity the problem stays well posed with fewer samples than cells:
weights that the data do not ask for are zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isqrt
from typing import Literal

import numpy as np

from pulsetrainer.core import large, nnls
from pulsetrainer.core.edges import thinned
from pulsetrainer.core.equations import NormalEquations, node_sums, normal_equations
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import BoolArray, FloatArray, Plane, Reading
from pulsetrainer.core.record import Record, counted, counted_output, levelled
from pulsetrainer.core.smoothing import LEAST_SIGNED, Choice, choose, smoothed
from pulsetrainer.core.stiffness import choose_stiffness, penalised
from pulsetrainer.errors import ArgumentError, ConvergenceError

Method = Literal["joint", "alternating"]
Smoothing = float | Literal["auto"]

# The dense path holds about ten matrices of n_q^2 numbers at its peak; above this it goes matrix-free.
DENSE_BYTES = 1_000_000_000
_DENSE_COPIES = 10
_MOST_ALTERNATIONS = 200
# A correlation of input and output above this tells by itself whether the loop rises or falls.
CLEAR = 0.5
_SIGN_LEVELS = 24
_SIGN_SMOOTHING = 0.05
# Below this share of the output's span the fit is good, and no stiffer density is tried.
_POOR = 0.02
# How far first-order curves of signed weights may leave the recorded outputs, of their span ...
_BEYOND = 0.1
# ... and the ridges that are tried to keep them there.
_RIDGES: list[float] = (10.0 ** np.arange(-6.0, 0.5, 0.5)).tolist()
# Records get an offset each where that lowers the rms error by at least this share.
SHIFTED = 0.1


@dataclass(frozen=True, slots=True)
class Identified:
    """The fitted operator and how it was found."""

    operator: Preisach
    method: Method
    iterations: int
    kkt: float  # largest violation of the optimality conditions, relative
    smoothing: float = 0.0  # s, share of the input's range; see ``core.smoothing``
    tried: tuple[tuple[float, float], ...] = ()  # (s, held-out rms) when it was chosen, output unit
    stiffness: float = 0.0  # t, how alike the loops are along the diagonal; see ``core.stiffness``
    samples: int = 0  # that count; fewer than cells: what the data do not ask for is zero
    ridge: float = 0.0  # r, share of trace(G) / n_q, that keeps weights of either sign from running off


def correlation_of(records: Sequence[Record]) -> float:
    """Return the correlation of input and output, -1..1; 0 where one of them does not vary."""
    u, y = counted(records, [r.input for r in records]), counted_output(records)
    # both scaled to 1 first: the product of two small numbers must not underflow
    u, y = (
        x / max(float(np.abs(x).max(initial=0.0)), np.finfo(float).tiny) for x in (u - u.mean(), y - y.mean())
    )
    size = float(np.sqrt(np.mean(u * u) * np.mean(y * y)))
    return float(np.mean(u * y)) / size if size > 0 else 0.0


def polarity_of(records: Sequence[Record], plane: Plane, reading: Reading = "continuous") -> int:
    """Return 1 when the output rises with the input, -1 when it falls.

    It is the sign of their correlation. Where that is weaker than ``CLEAR`` both signs are fitted, and the
    one that leaves less is returned: the loop's direction then tells more than its trend.

    ConvergenceError where a fit did not settle.
    """
    correlation = correlation_of(records)
    if abs(correlation) >= CLEAR:
        return -1 if correlation < 0 else 1
    coarse = thinned(plane, _SIGN_LEVELS)
    equations = normal_equations(coarse, levelled(records)[0], reading)
    gram, rhs = smoothed(equations, _SIGN_SMOOTHING)
    gains = {sign: float(sign * rhs @ nnls.solve(gram, sign * rhs).x) for sign in (1, -1)}
    return max(gains, key=gains.__getitem__)


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
    signed: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Identified:
    """Fit weights mu >= 0 and a free offset to one or several records.

    Planes whose dense matrices would take more than ``DENSE_BYTES`` (above 83 levels) are solved by
    ``large.solve``, which needs none.

    All ``records`` share one set of weights and one offset; inputs outside the range of the ``plane`` are
    clipped. ``polarity`` is 1, -1, or None to detect it. ``smoothing`` is the length s, share of the input's
    range, below which features of the density are smoothed away; 0 for none; "auto" to choose it by held-out
    blocks (see ``core.smoothing``). ``signed`` weights may be of either sign: plain regularised least
    squares, at least ``LEAST_SIGNED`` smooth. ``progress`` is told the share of the work of ``large.solve``
    that is done.

    ArgumentError for no records, no sample that counts, an input or an output that does not vary, fewer
    samples than levels, an unknown method, a smoothing out of range, or ``method="alternating"`` on a plane
    too large for it; signed weights of relays, on a plane too large for dense matrices, or not "joint".
    ConvergenceError if the fit did not settle.
    """
    samples = _check(records, plane, method, smoothing)
    if signed:
        return _signed(records, plane, reading, method, smoothing, samples)
    sign = polarity_of(records, plane, reading) if polarity is None else polarity
    turned, zero = levelled(records, sign)
    choice = choose(turned, plane, reading) if smoothing == "auto" else Choice(smoothing, ())
    length, stiffness = choice.smoothing, 0.0
    if not fits_dense(plane):
        masses, offset, iterations, kkt = _fit_large(turned, plane, reading, method, length, progress)
    else:
        equations = normal_equations(plane, turned, reading)
        masses, offset, iterations, kkt = _fit_dense(equations, method, length, 0.0)
        if choice.tried and equations.rms(masses, offset) > _POOR * float(np.ptp(counted_output(turned))):
            stiffness = choose_stiffness(turned, plane, reading)
        if stiffness:
            length = 0.0  # a density that is alike along the diagonal needs no other smoothing
            masses, offset, iterations, kkt = _fit_dense(equations, method, length, stiffness)
    operator = Preisach(plane, masses / plane.areas, sign * (offset + zero), reading, polarity=sign)
    return Identified(operator, method, iterations, kkt, length, choice.tried, stiffness, samples)


def _signed(
    records: Sequence[Record],
    plane: Plane,
    reading: Reading,
    method: Method,
    smoothing: Smoothing,
    samples: int,
) -> Identified:
    """Fit weights of either sign."""
    if reading != "continuous" or method != "joint":
        raise ArgumentError(
            f"signed weights are fitted jointly, in the continuous reading, got {method} and {reading}",
            hint="leave method and reading out",
        )
    if not fits_dense(plane):
        cells = isqrt(DENSE_BYTES // (8 * _DENSE_COPIES))
        most = (isqrt(8 * cells + 1) - 1) // 2  # n (n + 1) / 2 <= cells
        raise ArgumentError(
            f"weights of either sign, which this record is fitted with, have at most {most} levels, got "
            f"{plane.n_h}: more take over {DENSE_BYTES / 1e9:.0f} GB",
            hint=f"give `levels` {most} or less, or `form` direct",
        )
    upright, zero = levelled(records)
    choice = choose(upright, plane, reading, signed=True) if smoothing == "auto" else Choice(smoothing, ())
    length = max(float(choice.smoothing), LEAST_SIGNED)
    operator, ridge = _kept_in_range(normal_equations(plane, upright, reading), length, upright)
    operator = replace(operator, offset=operator.offset + zero)
    return Identified(operator, method, 1, 0.0, length, choice.tried, 0.0, samples, ridge)


def _kept_in_range(
    equations: NormalEquations, smoothing: float, records: Sequence[Record]
) -> tuple[Preisach, float]:
    """Fit weights of either sign with the least ridge that keeps first-order curves in the recorded range.

    A record says nothing of weights that it never tells apart, and smoothing lets those run off: after a
    reversal that was not recorded the output would be many times what it ever was. So r sum m_k^2 is added,
    r a share of trace(G) / n_q, by the least r of ``_RIDGES`` with which no first-order reversal curve leaves
    the recorded outputs by more than ``_BEYOND`` of their span (Hoerl, Kennard, "Ridge regression",
    Technometrics 12, 1970). Returns the operator and r.
    """
    plane = equations.plane
    gram, rhs = smoothed(equations, smoothing)
    diagonal = gram.diagonal().copy()
    size = float(diagonal.mean())
    measured = counted_output(records)
    beyond = _BEYOND * float(np.ptp(measured))
    for ridge in (0.0, *_RIDGES):
        np.fill_diagonal(gram, diagonal + ridge * size)
        masses = nnls.solve_signed(gram, rhs)
        operator = Preisach(plane, masses / plane.areas, equations.offset(masses), signed=True)
        lowest, highest = operator.first_order_range
        if lowest >= measured.min() - beyond and highest <= measured.max() + beyond:
            break
    return operator, ridge


def offsets_between(records: Sequence[Record], plane: Plane, reading: Reading = "continuous") -> FloatArray:
    """Offsets (k,) of the outputs of k records against their mean, in output units, zero where they agree.

    All records share one set of weights and each has an offset of its own, eliminated by centring. They are
    zero unless that makes the error smaller by ``SHIFTED``: records of one device in one state keep one
    offset.

    ConvergenceError where the fit did not settle.
    """
    told = np.asarray([np.any(r.counts) for r in records])
    if not told.all():  # what has no sample that counts has no offset
        offsets = np.zeros(len(records))
        offsets[told] = offsets_between([records[k] for k in np.flatnonzero(told).tolist()], plane, reading)
        return offsets
    if len(records) < 2:
        return np.zeros(len(records))
    coarse = thinned(plane, _SIGN_LEVELS)
    sign = polarity_of(records, plane, reading)
    turned, _ = levelled(records, sign)
    single = [normal_equations(coarse, [record], reading) for record in turned]
    whole = normal_equations(coarse, turned, reading)
    shared_gram, shared_rhs = smoothed(whole, _SIGN_SMOOTHING)
    bent = shared_gram - whole.centred()[0]
    centred = [one.centred() for one in single]
    shared = nnls.solve(shared_gram, shared_rhs).x
    gram = bent + np.sum([g for g, _ in centred], axis=0)
    own = nnls.solve(gram, np.sum([f for _, f in centred], axis=0)).x
    offsets = np.asarray([one.offset(own) for one in single])
    before = whole.sum_of_squares(shared, whole.offset(shared))
    after = sum(one.sum_of_squares(own, y0) for one, y0 in zip(single, offsets, strict=True))
    if after > (1.0 - SHIFTED) ** 2 * before:
        return np.zeros(len(records))
    weight = np.asarray([one.weight_sum for one in single])
    return sign * (offsets - float(weight @ offsets / weight.sum()))


def _check(records: Sequence[Record], plane: Plane, method: Method, smoothing: Smoothing) -> int:
    """Return the number of samples that count, or raise ArgumentError when they cannot be fitted."""
    samples = sum(int(np.count_nonzero(r.counts)) for r in records)
    if samples == 0:
        raise ArgumentError(
            f"records must hold at least one sample that counts, got none in {len(records)} records",
            hint="record a run, or give some sample a sample_weight above 0",
        )
    if method not in ("joint", "alternating"):
        raise ArgumentError(f"method must be 'joint' or 'alternating', got {method!r}", hint="use 'joint'")
    if isinstance(smoothing, str) and smoothing != "auto":
        raise ArgumentError(
            f"smoothing must be 'auto' or a number in 0..1, got {smoothing!r}", hint="use 'auto'"
        )
    inputs = np.concatenate([np.clip(r.input, plane.low, plane.high) for r in records])
    for name, values in (("input", inputs), ("output", counted_output(records))):
        if np.ptp(values) <= 1e-12 * np.abs(values).max():
            raise ArgumentError(
                f"the {name} does not vary: it is {values[0]:g} in all of its {values.size} samples "
                f"(the plane spans {plane.low:g} .. {plane.high:g})",
                hint="check the wiring, and that the run sweeps the range of the plane",
            )
    if samples < plane.n_h:
        raise ArgumentError(
            f"a model of {plane.n_h} levels needs at least as many samples that count, got {samples}",
            hint="use fewer `levels`, or a longer record",
        )
    return samples


_Fitted = tuple[FloatArray, float, int, float]  # masses, offset, iterations, relative KKT violation


def _fit_dense(equations: NormalEquations, method: Method, smoothing: float, stiffness: float) -> _Fitted:
    """Fit with the Gram matrix of the cells in memory."""
    gram, rhs = penalised(equations, smoothing, stiffness)
    if method == "joint":
        found = nnls.solve(gram, rhs)
        masses, offset, iterations = found.x, equations.offset(found.x), found.iterations
    else:
        penalty = gram - equations.centred()[0]
        masses, offset, iterations = _alternate(equations, equations.gram + penalty)
    return masses, offset, iterations, nnls.kkt_violation(gram, rhs, masses)


def _fit_large(
    records: Sequence[Record],
    plane: Plane,
    reading: Reading,
    method: Method,
    smoothing: float,
    progress: Callable[[float], None] | None,
) -> _Fitted:
    """Fit without any dense matrix."""
    if method != "joint":
        raise ArgumentError(
            f"method='alternating' needs dense matrices of {plane.n_q} x {plane.n_q} cells, more than "
            f"{DENSE_BYTES / 1e9:.0f} GB",
            hint="use the joint method: it ends at the same point",
        )
    return large.solve(node_sums(plane, records, reading), smoothing, progress=progress)


def _alternate(equations: NormalEquations, gram: FloatArray) -> tuple[FloatArray, float, int]:
    """Alternate between the offset and the weights until neither moves (Carneiro et al. 2018, section 3).

    The plain alternation creeps: ten thousand rounds at 48 levels. Its moves are a piecewise linear
    function of the offset, so the next offset is taken where the line through the last two moves is zero.
    """
    offset = equations.output_sum / equations.weight_sum
    spread = np.sqrt(max(equations.output_square / equations.weight_sum - offset**2, 0.0))
    passive: BoolArray | None = None
    before: tuple[float, float] | None = None
    for iteration in range(1, _MOST_ALTERNATIONS + 1):
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
        f"offset and weights still moved after {_MOST_ALTERNATIONS} alternations", hint="use the joint method"
    )
