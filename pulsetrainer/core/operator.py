"""The Preisach operator: from an input and its memory to the output.

y = y0 + sum_k mu_k A_k s_k, with s_k in [-1, 1] the mean state of the relays in cell k (Carneiro, Abreu,
Restivo 2018, eq. 2; relays are -1 or +1). Summed over triangles this is

    y = y0 - W + 2 sum over the memory's steps of +-E(upper, lower),      W = E(high, low),

with + for a step up and - for a step down: a short sum over turning points instead of n_q relays.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts load when they are first used
from numpy.typing import ArrayLike

from pulsetrainer.core.memory import State, Trace, negative_saturation, trace, trace_after
from pulsetrainer.core.plane import FloatArray, IntArray, Plane, Reading, finite_vector, float_array
from pulsetrainer.errors import ArgumentError

_CHUNK = 4096  # samples at a time: their arrays stay in the cache


def steps(plane: Plane, to: FloatArray, origin: FloatArray) -> scipy.sparse.csr_array:
    """Rows (n, n_q) in node space of the signed output steps 2 G(to, origin), four entries each at most.

    G is the Everett function continued antisymmetrically, interpolated bilinearly between nodes
    (``Plane.signed_everett``); ``to`` and ``origin`` (n,) are inputs.
    """
    corner, share = plane.corners(to, origin)
    number, sign = plane.signed_nodes
    share *= 2.0 * sign[corner]
    pointer = np.arange(to.size + 1, dtype=np.int64) * 4
    rows = scipy.sparse.csr_array(
        (share.T.ravel(), number[corner].T.ravel(), pointer), shape=(to.size, plane.n_q)
    )
    rows.sum_duplicates()
    rows.eliminate_zeros()
    return rows


def follow(plane: Plane, values: ArrayLike, start: State | None, reading: Reading) -> Trace:
    """Trace an input through the plane's memory under a reading.

    ArgumentError where the input is empty, not one-dimensional or not finite; the reading is unknown.
    """
    _check_reading(reading)
    u = finite_vector("input", values)
    state = start or negative_saturation(plane.low)
    if reading == "continuous":
        return trace(u, state, plane.low, plane.high)
    extremes = plane.round_to_nodes(np.asarray(state.extremes))
    return trace_after(extremes, plane.round_to_nodes(u), plane.low, plane.high)


def _check_reading(reading: str) -> None:
    if reading not in ("continuous", "relay"):
        raise ArgumentError(
            f"reading must be 'continuous' or 'relay', got {reading!r}", hint="use 'continuous'"
        )


def rows(plane: Plane, path: Trace, at: IntArray | slice = slice(None)) -> scipy.sparse.csr_array:
    """Design rows (k, n_q) of samples of a traced input in node space; the constant -W is left out.

    All steps up to the anchor of a sample, and the one from there to the sample.
    """
    anchor = path.anchor[at]
    return steps(plane, path.value[at], path.node_value[anchor]) + base_rows(plane, path)[anchor]


def base_rows(plane: Plane, path: Trace) -> scipy.sparse.csr_array:
    """Rows (m, n_q) of all turning points: each is its parent's row plus one step."""
    return path.along_tree(steps(plane, path.node_value, path.node_value[path.parent]))


@dataclass(frozen=True)
class Preisach:
    """A Preisach operator with known weights."""

    plane: Plane
    weights: FloatArray  # mu (n_q,), output unit per input unit squared; negative only where ``signed``
    offset: float = 0.0  # y0, output unit
    reading: Reading = "continuous"
    polarity: int = 1  # -1: the output falls when the input rises
    signed: bool = False  # weights may be negative: the loop crosses itself, branches need not be monotone

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", self.plane.check_weights(self.weights, signed=self.signed))
        if self.polarity not in (-1, 1):
            raise ArgumentError(f"polarity must be 1 or -1, got {self.polarity}", hint="1: the output rises")
        if not np.isfinite(self.offset):
            raise ArgumentError(
                f"offset must be finite, got {self.offset:g}", hint="identify the model again"
            )
        _check_reading(self.reading)

    @cached_property
    def masses(self) -> FloatArray:
        """Mass mu_k A_k of every cell (n_q,), output unit."""
        return self.weights * self.plane.areas

    @cached_property
    def nodes(self) -> FloatArray:
        """Everett values at the nodes (n_q,), output unit."""
        return self.plane.everett_nodes(self.masses)

    @cached_property
    def grid(self) -> FloatArray:
        """Everett values on the full grid of nodes (n_h + 1, n_h + 1), output unit."""
        return self.plane.everett_grid(self.nodes)

    @cached_property
    def total(self) -> float:
        """Mass W of the whole plane, output unit."""
        return float(self.grid[-1, 0])

    @property
    def low(self) -> float:
        """Lower end of the input range."""
        return self.plane.low

    @property
    def high(self) -> float:
        """Upper end of the input range."""
        return self.plane.high

    @property
    def saturation(self) -> tuple[float, float]:
        """Outputs at the negative and at the positive saturation, output unit."""
        return self.offset - self.polarity * self.total, self.offset + self.polarity * self.total

    @property
    def first_order_range(self) -> tuple[float, float]:
        """Lowest and highest output of all first-order reversal curves, output unit.

        Down from alpha to beta, -W + 2 E(alpha, low) - 2 E(alpha, beta); up from beta to alpha,
        W - 2 E(high, beta) + 2 E(alpha, beta). Where mu >= 0 they lie between the saturations.

        Source: Mayergoyz, Mathematical Models of Hysteresis and Their Applications, 2003, section 1.2.
        """
        alpha, beta = np.tril_indices(self.plane.n_h + 1)
        back = 2.0 * self.grid[alpha, beta]
        down = 2.0 * self.grid[alpha, 0] - self.total - back
        up = self.total - 2.0 * self.grid[-1, beta] + back
        curves = self.offset + self.polarity * np.concatenate((down, up))
        return float(curves.min()), float(curves.max())

    @cached_property
    def _signed(self) -> FloatArray:
        return 2.0 * self.plane.signed_everett(self.nodes)

    def step(self, to: FloatArray, origin: FloatArray) -> FloatArray:
        """Signed output steps (n,), polarity 1, when the input goes straight from ``origin`` to ``to``."""
        return self._step(*self.plane.bands(to), *self.plane.bands(origin))

    def _step(self, i: IntArray, s: FloatArray, j: IntArray, t: FloatArray) -> FloatArray:
        """Steps (n,) to fraction ``s`` of band ``i`` from fraction ``t`` of band ``j``: bilinear."""
        row = self.plane.n_h + 1
        corner = i * row
        corner += j
        here, beside = self._signed.take(corner), self._signed.take(corner + 1)
        corner += row
        above, opposite = self._signed.take(corner), self._signed.take(corner + 1)
        # along t on both sides of the cell, then along s between them
        beside -= here
        beside *= t
        here += beside
        opposite -= above
        opposite *= t
        above += opposite
        above -= here
        above *= s
        here += above
        return here

    def __call__(self, values: ArrayLike, start: State | None = None) -> FloatArray:
        """Output (n,) for an input (n,) from negative saturation, or from ``start``."""
        return self.run(values, start)[0]

    def run(self, values: ArrayLike, start: State | None = None) -> tuple[FloatArray, State]:
        """Output (n,) and the final state, with which the next piece of the input can go on.

        ArgumentError where the input is empty, not one-dimensional or not finite.
        """
        path = follow(self.plane, values, start, self.reading)
        return self.traced(path), path.final

    def traced(self, path: Trace, bands: tuple[IntArray, FloatArray] | None = None) -> FloatArray:
        """Output (n,) along an input that was followed; ``bands`` of its samples, where they are known."""
        band, fraction = self.plane.bands(path.node_value)
        turning = path.along_tree(self._step(band, fraction, band[path.parent], fraction[path.parent]))
        turning -= self.total
        y = np.empty(path.value.size)
        for begin in range(0, y.size, _CHUNK):
            part = slice(begin, begin + _CHUNK)
            anchor = path.anchor[part]
            i, t = self.plane.bands(path.value[part]) if bands is None else (bands[0][part], bands[1][part])
            step = self._step(i, t, band[anchor], fraction[anchor])
            step += turning[anchor]
            y[part] = step
        y *= self.polarity
        y += self.offset
        return y


def outputs(
    plane: Plane,
    weights: ArrayLike,
    offsets: ArrayLike,
    values: ArrayLike,
    *,
    start: State | None = None,
    reading: Reading = "continuous",
) -> FloatArray:
    """Outputs (b, n) of one input under many weight vectors (b, n_q) and offsets (b,) at once.

    The memory is followed once.

    ArgumentError where the input is not a finite vector, the weights do not fit the plane or are negative, or
    weights or offsets are not finite.
    """
    mu, y0 = float_array("weights", weights), float_array("offsets", offsets)
    if mu.ndim != 2 or mu.shape[1] != plane.n_q or y0.shape != mu.shape[:1]:
        raise ArgumentError(
            f"weights must have shape (b, {plane.n_q}) and offsets (b,), got {mu.shape} and {y0.shape}",
            hint="one row of weights for each offset",
        )
    finite_vector("offsets", y0, at_least=0)
    operators = [Preisach(plane, row, offset, reading) for row, offset in zip(mu, y0.tolist(), strict=True)]
    path = follow(plane, values, start, reading)
    bands = plane.bands(path.value)
    return np.stack([operator.traced(path, bands) for operator in operators])
