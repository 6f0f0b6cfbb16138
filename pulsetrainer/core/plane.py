"""The discrete Preisach plane, its Everett surface, and the two readings of its weights (``Reading``).

The half-plane alpha >= beta over [L_0, L_n] is cut by n_h + 1 edges L into n_q = n_h (n_h + 1) / 2 cells.
Cell (i, j), i >= j, holds the relays that switch up in [L_i, L_i+1] and down in [L_j, L_j+1]; cells
are numbered k = i (i + 1) / 2 + j. Cells on the diagonal are triangles: half the area.

The Everett function E(alpha, beta) is the mass of the relays inside the triangle between beta and
alpha (Everett 1955; Mayergoyz 2003, eq. 1.15). At the nodes it is a double cumulative sum of the cells'
masses, and node (i + 1, j) is numbered like cell (i, j), so that masses and node values are two
coordinate systems of one space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pulsetrainer.errors import ArgumentError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

Reading = Literal["continuous", "relay"]


def float_array(name: str, values: ArrayLike) -> FloatArray:
    """Return ``values`` as an array of floats of any shape.

    ArgumentError where they are no numbers, or rows of unlike lengths.
    """
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentError(
            f"{name} must be numbers: {error}", hint=f"pass {name} as one array of floats"
        ) from error


def finite_vector(name: str, values: ArrayLike, *, at_least: int = 1) -> FloatArray:
    """Return ``values`` as a float array (n,), n no less than ``at_least``.

    ArgumentError where it is not one-dimensional, is shorter than ``at_least``, or holds NaN or infinity.
    """
    array = float_array(name, values)
    if array.ndim != 1 or array.size < at_least:
        raise ArgumentError(
            f"{name} must be a vector of at least {at_least} samples, got shape {array.shape}",
            hint=f"pass a one-dimensional {name}" if array.ndim != 1 else f"pass at least {at_least} samples",
        )
    bad = ~np.isfinite(array)
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        raise ArgumentError(
            f"{name} must be finite, got {array[first]} at sample {first} "
            f"({int(bad.sum())} of {array.size} samples are not finite)",
            hint=f"mask or remove the samples of {name} that are not numbers",
        )
    return array


def positive(**named: float) -> None:
    """Let pass numbers that are positive and finite; ArgumentError, with its name, where one is not."""
    for name, number in named.items():
        if not (number > 0 and np.isfinite(number)):
            raise ArgumentError(
                f"{name} must be positive and finite, got {number:g}", hint=f"give a {name} above zero"
            )


def ascending(low: float, high: float, *, what: str = "the input range") -> None:
    """Let pass a range that is neither empty nor infinite.

    ArgumentError where ``low`` is not below ``high``, or their distance is not finite.
    """
    if not (low < high and np.isfinite(float(high) - float(low))):
        raise ArgumentError(
            f"{what} must have low < high, both finite, got low = {low:g}, high = {high:g}",
            hint="record an input that moves",
        )


def ends_of(signals: Sequence[FloatArray]) -> tuple[float, float]:
    """Return the lowest and the highest value of some signals (n,)."""
    return min(float(one.min()) for one in signals), max(float(one.max()) for one in signals)


MOST_LEVELS = 10_000  # fifty million cells


@dataclass(frozen=True)
class Plane:
    """The edges of the cells of a discrete Preisach plane; everything else follows from them.

    ArgumentError for fewer than 3 edges, one that is not finite, or edges that do not strictly increase.

    Source: Preisach 1935; Mayergoyz, Mathematical Models of Hysteresis, 2003, chapter 1.
    """

    edges: FloatArray  # (n_h + 1,) borders of the cells, input unit, strictly increasing

    def __post_init__(self) -> None:
        edges = finite_vector("edges", self.edges)
        if edges.size < 3:
            raise ArgumentError(
                f"a Preisach plane needs at least 2 levels (3 edges), got {edges.size} edges",
                hint="use more levels, 48 for instance",
            )
        if not np.all(np.diff(edges) > 0):
            raise ArgumentError(
                f"edges must strictly increase, got {edges[0]:g} .. {edges[-1]:g} with a smallest step of "
                f"{np.diff(edges).min():g}",
                hint="the input range must not be zero",
            )
        object.__setattr__(self, "edges", edges)

    @classmethod
    def uniform(cls, low: float, high: float, n_h: int) -> Plane:
        """Return the plane with ``n_h`` even levels over [low, high].

        ArgumentError for fewer than 2 levels, more than ``MOST_LEVELS``, or a range that is zero or not
        finite.
        """
        if not 2 <= n_h <= MOST_LEVELS or n_h != int(n_h):
            raise ArgumentError(
                f"n_h must be a whole number of at least 2 and at most {MOST_LEVELS}, got {str(n_h)[:20]}",
                hint="48 levels suit most devices",
            )
        ascending(low, high)
        return cls(np.linspace(low, high, n_h + 1))

    @property
    def n_h(self) -> int:
        """Number of levels: one less than there are edges."""
        return self.edges.size - 1

    @property
    def n_q(self) -> int:
        """Number of cells: n_q = n_h (n_h + 1) / 2."""
        return self.n_h * (self.n_h + 1) // 2

    @property
    def low(self) -> float:
        """Lower end L_0 of the input range, input unit."""
        return float(self.edges[0])

    @property
    def high(self) -> float:
        """Upper end L_n of the input range, input unit."""
        return float(self.edges[-1])

    @cached_property
    def cell_indices(self) -> tuple[IntArray, IntArray]:
        """Bands (i, j), i >= j, of every cell k = i (i + 1) / 2 + j, each (n_q,)."""
        i, j = np.tril_indices(self.n_h)
        return i.astype(np.int64), j.astype(np.int64)

    @cached_property
    def areas(self) -> FloatArray:
        """Areas of the cells (n_q,), input unit squared.

        A_k = (L_i+1 - L_i) (L_j+1 - L_j), half of that on the diagonal.
        """
        i, j = self.cell_indices
        return self._steps[i] * self._steps[j] * np.where(i == j, 0.5, 1.0)

    @cached_property
    def thresholds(self) -> FloatArray:
        """Middles of the bands (n_h,), input unit: where the relays of the paper's reading switch."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    def check_weights(self, weights: ArrayLike, *, signed: bool = False) -> FloatArray:
        """Return ``weights`` (n_q,) when they can belong to this plane; ``signed`` ones may be negative.

        A weight is a density: output unit per input unit squared.

        ArgumentError where the length is not n_q, or a weight is not finite, or negative where it must not
        be.
        """
        array = float_array("weights", weights)
        if array.shape != (self.n_q,):
            raise ArgumentError(
                f"weights must have shape ({self.n_q},) for {self.n_h} levels, got {array.shape}",
                hint="weights and edges must come from the same model",
            )
        bad = ~np.isfinite(array) if signed else ~(array >= 0) | ~np.isfinite(array)
        if np.any(bad):
            k = int(np.flatnonzero(bad)[0])
            wanted = "finite" if signed else "finite and not negative"
            raise ArgumentError(
                f"weights must be {wanted}, got {array[k]:g} in cell {k}", hint="identify the model again"
            )
        return array

    def unpack(self, packed: FloatArray) -> FloatArray:
        """Spread (..., n_q) cell values over the lower triangle of (..., n_h, n_h) squares of zeros.

        ArgumentError where there is not one value for each cell.
        """
        self._check_cells(packed)
        i, j = self.cell_indices
        square = np.zeros((*packed.shape[:-1], self.n_h, self.n_h))
        square[..., i, j] = packed
        return square

    def _check_cells(self, packed: FloatArray) -> None:
        """Raise ArgumentError unless there is one value for each cell."""
        if packed.shape[-1:] != (self.n_q,):
            raise ArgumentError(
                f"cell values must have shape (..., {self.n_q}) for {self.n_h} levels, got {packed.shape}",
                hint="cell values and edges must come from the same model",
            )

    def everett_nodes(self, masses: FloatArray) -> FloatArray:
        """Everett values at the nodes, packed (..., n_q), from masses of cells (..., n_q), both output unit.

        E[i + 1, j] = sum of masses over p <= i, q >= j: two cumulative sums.

        ArgumentError as ``unpack``.

        Source: Everett 1955; Mayergoyz 2003, eq. 1.15.
        """
        square = self.unpack(masses)
        np.cumsum(square, axis=-2, out=square)
        square = np.cumsum(square[..., ::-1], axis=-1)[..., ::-1]
        i, j = self.cell_indices
        return square[..., i, j]

    def adjoint(self, node_values: FloatArray) -> FloatArray:
        """Transpose of ``everett_nodes``: (..., n_q) node space to (..., n_q) cell space.

        Cell (p, q) collects the nodes (i + 1, j) with i >= p and j <= q, so that for all a and b
        a . everett_nodes(b) = adjoint(a) . b.

        ArgumentError as ``unpack``.
        """
        self._check_cells(node_values)
        i, j = self.cell_indices
        # row by row with the leading axes last: many at once take a tenth of the time of two cumulative sums
        square = np.zeros((self.n_h, self.n_h, *node_values.shape[:-1]))
        square[i, j] = np.moveaxis(node_values, -1, 0)
        for k in range(self.n_h - 1, 0, -1):
            square[k - 1] += square[k]
        for k in range(1, self.n_h):
            square[:, k] += square[:, k - 1]
        return np.moveaxis(square[i, j], 0, -1)

    def everett_grid(self, nodes: FloatArray) -> FloatArray:
        """Everett values (n_q,) on the full (n_h + 1, n_h + 1) grid of nodes, zero on and above the diagonal.

        ArgumentError as ``unpack``.
        """
        return np.pad(self.unpack(nodes), ((1, 0), (0, 1)))  # node (i + 1, j) is numbered like cell (i, j)

    def bands(self, values: FloatArray) -> tuple[IntArray, FloatArray]:
        """Band and fraction in [0, 1] of input values (n,), each (n,); those outside are clipped to the ends.

        u = L_k + s (L_k+1 - L_k) for the band k and the fraction s.
        """
        fraction = np.clip(values, self.low, self.high)
        band = self.edges[1:-1].searchsorted(fraction, side="right")
        fraction -= self.edges[band]
        fraction /= self._steps[band]
        return band, fraction

    @cached_property
    def _steps(self) -> FloatArray:
        return np.diff(self.edges)

    def round_to_nodes(self, values: FloatArray) -> FloatArray:
        """Round input values (n,) to edges (n,), as the relays of the paper's reading see them.

        Relays switch at the middles of the bands: a relay is up from its threshold on.
        """
        return self.edges[np.searchsorted(self.thresholds, values, side="right")]

    @cached_property
    def signed_nodes(self) -> tuple[IntArray, FloatArray]:
        """Number k and sign of node (a, b) on the flattened grid, each ((n_h + 1)^2,).

        k = a (a - 1) / 2 + b for a > b with the sign +1; -1 where a < b, the two exchanged; 0 where a = b.
        """
        a, b = np.indices((self.n_h + 1, self.n_h + 1)).reshape(2, -1)
        upper, lower = np.maximum(a, b), np.minimum(a, b)
        number = np.where(a == b, 0, upper * (upper - 1) // 2 + lower)
        return number.astype(np.int64), np.sign(a - b).astype(np.float64)

    def corners(self, to: FloatArray, origin: FloatArray) -> tuple[IntArray, FloatArray]:
        """Flat grid numbers and bilinear shares, each (4, n), of the points (to, origin), inputs (n,) each.

        For fractions s of ``to`` and t of ``origin``: (1 - s)(1 - t), (1 - s) t, s (1 - t), s t.
        """
        i, s = self.bands(to)
        j, t = self.bands(origin)
        first = i * (self.n_h + 1) + j
        number = np.stack((first, first + 1, first + self.n_h + 1, first + self.n_h + 2))
        st = s * t
        return number, np.stack((1.0 - s - t + st, t - st, s - st, st))

    def signed_everett(self, nodes: FloatArray) -> FloatArray:
        """Everett values (n_q,) on the flattened grid, ((n_h + 1)^2,), antisymmetric: G(b, a) = -G(a, b).

        Interpolated bilinearly, G(to, origin) is the signed step of the output from ``origin`` to
        ``to``. Off the diagonal that is the exact integral of a density constant over each cell. In a
        diagonal cell it comes out as m (to - origin) / step: the cell's mass sits on the diagonal and is the
        reversible part, and no case needs telling apart.
        """
        number, sign = self.signed_nodes
        return sign * nodes[number]
