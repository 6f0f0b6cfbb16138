"""What the fit needs to know of the data: sums over samples, small and additive.

A design row r_t is a signed sum of a few Everett nodes, so sum v r r' is sparse in node space.
``NodeSums`` holds it there; sums of parts of a record add up to those of the whole, so that leaving out a
block, or drawing blocks again, needs no second look at the data. ``NodeSums.dense`` carries them to the
cells by cumulative sums: the n x n_q design matrix never exists.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from operator import add, sub
from typing import Any, Generic, Self, TypeVar

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.memory import Trace
from pulsetrainer.core.operator import base_rows, follow, steps
from pulsetrainer.core.plane import FloatArray, IntArray, Plane, Reading
from pulsetrainer.core.record import Record

_Matrix = TypeVar("_Matrix")
_CHUNK = 200_000  # samples whose sparse rows are held at one time


@dataclass(frozen=True, slots=True)
class _Sums(Generic[_Matrix]):
    """Sums over samples of rows r and outputs y; v is the sample weight."""

    plane: Plane
    gram: _Matrix  # (n_q, n_q) sum v r r'
    moment: FloatArray  # (n_q,) sum v r y
    row_sum: FloatArray  # (n_q,) sum v r
    weight_sum: float  # sum v
    output_sum: float  # sum v y
    output_square: float  # sum v y^2

    def __add__(self, other: Self) -> Self:
        """Sums over both sets of samples."""
        return self._with(other, add)

    def __sub__(self, part: Self) -> Self:
        """Sums over the samples that are not in ``part``."""
        return self._with(part, sub)

    def _with(self, other: Self, how: Callable[[Any, Any], Any]) -> Self:
        names = [field.name for field in fields(self) if field.name != "plane"]
        sums: dict[str, Any] = {name: how(getattr(self, name), getattr(other, name)) for name in names}
        return replace(self, **sums)


class NormalEquations(_Sums[FloatArray]):
    """Sums over all samples in the coordinates of the cells' masses; relays are -1 or +1."""

    __slots__ = ()

    def centred(self) -> tuple[FloatArray, FloatArray]:
        """Gram matrix and right side with the offset eliminated: rows and outputs minus their means."""
        gram = self.gram - np.outer(self.row_sum, self.row_sum / self.weight_sum)
        return gram, self.moment - self.row_sum * (self.output_sum / self.weight_sum)

    def offset(self, masses: FloatArray) -> float:
        """Best offset for given masses (n_q,): y0 = sum v (y - r . m) / sum v, output unit."""
        return float(self.output_sum - self.row_sum @ masses) / self.weight_sum

    def sum_of_squares(self, masses: FloatArray, offset: float) -> float:
        """Weighted sum of squared residuals, from the sums alone (rounding: about 1e-12 of sum v y^2)."""
        return float(
            self.output_square
            - 2 * (self.moment @ masses + offset * self.output_sum)
            + masses @ self.gram @ masses
            + 2 * offset * (self.row_sum @ masses)
            + offset**2 * self.weight_sum
        )

    def rms(self, masses: FloatArray, offset: float) -> float:
        """Rms error sqrt(sum v (y - y0 - r . m)^2 / sum v) of masses (n_q,) and an offset, output unit."""
        return float(np.sqrt(max(self.sum_of_squares(masses, offset), 0.0) / self.weight_sum))


class NodeSums(_Sums["scipy.sparse.csr_array"]):
    """Sums over samples in the coordinates of the Everett nodes.

    Here a row rises from 0, all relays down, to 2 E(high, low), all up; the constant -W is left out.
    """

    __slots__ = ()

    @classmethod
    def nothing(cls, plane: Plane) -> NodeSums:
        """Sums over no samples."""
        zero = np.zeros(plane.n_q)
        return cls(plane, scipy.sparse.csr_array((plane.n_q, plane.n_q)), zero, zero, 0.0, 0.0, 0.0)

    def dense(self) -> NormalEquations:
        """Carry the sums to the cells: two cumulative sums on each side."""
        plane = self.plane
        cells = plane.adjoint(plane.adjoint(self.gram.toarray()).T.copy())
        row_sum, moment = plane.adjoint(self.row_sum), plane.adjoint(self.moment)
        # so far rows rise from 0, all relays down, to 2: subtract the constant 1 from each
        cells += self.weight_sum - row_sum[:, None] - row_sum[None, :]
        return NormalEquations(
            plane,
            cells,
            moment - self.output_sum,
            row_sum - self.weight_sum,
            self.weight_sum,
            self.output_sum,
            self.output_square,
        )


def _part_sums(
    plane: Plane, path: Trace, base: scipy.sparse.csr_array, samples: IntArray, y: FloatArray, v: FloatArray
) -> NodeSums:
    """Node-space sums of the chosen samples of one record.

    r = own + base: own rows have at most four entries; base rows are shared by all samples of an anchor,
    so they enter once per anchor with the sums of its own rows.
    """
    used, anchors = np.unique(path.anchor[samples], return_inverse=True)
    base, nodes = base[used], used.size
    gram = scipy.sparse.csr_array((plane.n_q, plane.n_q))
    by_anchor = scipy.sparse.csr_array((nodes, plane.n_q))  # sum of v own over the samples of an anchor
    own_sum, own_y = np.zeros(plane.n_q), np.zeros(plane.n_q)
    for begin in range(0, samples.size, _CHUNK):
        part = samples[begin : begin + _CHUNK]
        anchor = anchors[begin : begin + _CHUNK]
        own = steps(plane, path.value[part], path.node_value[path.anchor[part]])
        scaled = own.multiply(v[part, None]).tocsr()
        gram = gram + own.T @ scaled
        size = own.shape[0]
        gather = scipy.sparse.csr_array((np.ones(size), (anchor, np.arange(size))), shape=(nodes, size))
        by_anchor = by_anchor + gather @ scaled
        own_sum += scaled.sum(axis=0)
        own_y += scaled.T @ y[part]
    v, y = v[samples], y[samples]
    count = np.bincount(anchors, weights=v, minlength=nodes)
    count_y = np.bincount(anchors, weights=v * y, minlength=nodes)
    cross = base.T @ by_anchor
    gram = gram + cross + cross.T + base.T @ base.multiply(count[:, None]).tocsr()
    return NodeSums(
        plane,
        gram.tocsr(),
        own_y + base.T @ count_y,
        own_sum + base.T @ count,
        float(v.sum()),
        float(v @ y),
        float(v @ (y * y)),
    )


def node_sums(plane: Plane, records: Sequence[Record], reading: Reading) -> NodeSums:
    """Sums over all samples of all records in node space: S = sum v r r' (n_q, n_q), sparse, and its like.

    Each record is followed from its own start, inputs beyond the plane are clipped, and a sample counts as
    much as its sample weight v says. ArgumentError if the reading is unknown.
    """
    every = [np.zeros(record.input.size, dtype=np.int64) for record in records]
    return parted_sums(plane, records, reading, every, 1)[0]


def parted_sums(
    plane: Plane, records: Sequence[Record], reading: Reading, parts: Sequence[IntArray], count: int
) -> list[NodeSums]:
    """Sums of ``count`` parts of the records, each record followed once, from its start.

    ``parts`` holds for each record the number of the part of each of its samples (n,), 0 .. count - 1.
    Samples with any other number are left out of the sums, but not out of the memory.

    ArgumentError where the reading is unknown.
    """
    sums = [NodeSums.nothing(plane) for _ in range(count)]
    for record, part in zip(records, parts, strict=True):
        path = follow(plane, record.input, record.start, reading)
        base, y, v = base_rows(plane, path), record.fitted_output, record.sample_weight
        for k in range(count):
            sums[k] = sums[k] + _part_sums(plane, path, base, np.flatnonzero(part == k), y, v)
    return sums


def normal_equations(plane: Plane, records: Sequence[Record], reading: Reading) -> NormalEquations:
    """Sums over all samples of all records in the coordinates of the masses: ``node_sums``, carried there.

    ArgumentError where the reading is unknown.
    """
    return node_sums(plane, records, reading).dense()
