"""The fit's view of the data: dense design rows of short averages, and everything projected off them.

Rows are made at the full sample rate, so that no tip of a fast loop is lost, and then averaged over
bins of a few milliseconds together with the output: some 20 000 rows whatever the record's length. With
S the smoothing of ``core.smoothing``, the fitted part of any signal c is D (D'D + S)^-1 D'c.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from pulsetrainer.core import nnls
from pulsetrainer.core.operator import follow, rows
from pulsetrainer.core.plane import FloatArray, IntArray, Plane
from pulsetrainer.core.smoothing import penalty
from pulsetrainer.diagnosis.causes.base import Frame
from pulsetrainer.errors import DataError

# Short enough for a resonance of 70 Hz; longer when the records would otherwise make more rows than this.
_BIN_S = 0.005
_MOST_ROWS = 20_000


@dataclass(frozen=True)
class Measured:
    """One record at even time steps; gaps have been filled and have no weight."""

    dt_s: float
    input: FloatArray  # (n,)
    output: FloatArray  # (n,) polarity 1
    weight: FloatArray  # (n,) 0 or 1
    reference: FloatArray | None = None


@dataclass(frozen=True)
class Bins:
    """How samples are averaged: the bin of every sample of every record, -1 for none."""

    number: tuple[IntArray, ...]
    count: int
    record: IntArray  # (count,) record of each bin
    time_s: FloatArray  # (count,) since the start of its record

    def average(self, signals: Sequence[FloatArray]) -> FloatArray:
        """Averages (count,) of one signal per record."""
        total = np.zeros(self.count)
        for number, one in zip(self.number, signals, strict=True):
            inside = number >= 0
            total += np.bincount(number[inside], weights=one[inside], minlength=self.count)
        return total / self.sizes

    @cached_property
    def sizes(self) -> FloatArray:
        """Samples in each bin (count,)."""
        total = np.zeros(self.count)
        for number in self.number:
            total += np.bincount(number[number >= 0], minlength=self.count)
        return total


def bins_of(records: Sequence[Measured]) -> Bins:
    """Bins over the samples with weight.

    Raises
    ------
    DataError
        Hardly any sample has weight.
    """
    duration = sum(r.input.size * r.dt_s for r in records)
    width = max(_BIN_S, duration / _MOST_ROWS)
    numbers, record, time, count = [], [], [], 0
    for k, r in enumerate(records):
        per_bin = max(1, round(width / r.dt_s))
        raw = np.where(r.weight > 0, np.arange(r.input.size) // per_bin, -1)
        used, inverse = np.unique(raw, return_inverse=True)
        first = int(used[0] == -1)
        numbers.append(np.where(raw >= 0, inverse - first + count, -1).astype(np.int64))
        size = used.size - first
        record.append(np.full(size, k))
        time.append((used[first:] + 0.5) * per_bin * r.dt_s)
        count += size
    if count < 100:
        raise DataError(
            f"only {count} short averages can be made of this data, too few to tell causes apart",
            hint="record longer: pulsetrainer capture diagnostic -o run.h5",
        )
    return Bins(tuple(numbers), count, np.concatenate(record), np.concatenate(time))


@dataclass
class Design:
    """Design rows for given inputs, with their normal matrix and the fit."""

    plane: Plane
    bins: Bins
    matrix: FloatArray  # (count, n_q) centred
    mean: FloatArray  # (n_q,)
    smoothing: float

    @classmethod
    def build(cls, plane: Plane, bins: Bins, inputs: Sequence[FloatArray], smoothing: float) -> Design:
        """Trace the inputs (n,) that the hysteresis sees, one per record."""
        packed = sparse.csr_array((bins.count, plane.n_q))
        for number, u in zip(bins.number, inputs, strict=True):
            path = follow(plane, u, None, "continuous")
            own, base = rows(plane, path)
            inside = np.flatnonzero(number >= 0)
            where = number[inside]
            share = 1.0 / bins.sizes[where]
            shape = (bins.count, own.shape[0])
            packed = packed + sparse.csr_array((share, (where, inside)), shape=shape) @ own
            shape = (bins.count, base.shape[0])
            packed = packed + sparse.csr_array((share, (where, path.anchor[inside])), shape=shape) @ base
        matrix = _to_cells(plane, packed)
        mean = matrix.mean(axis=0)
        matrix -= mean
        return cls(plane, bins, matrix, mean, smoothing)

    @cached_property
    def gram(self) -> FloatArray:
        """D'D + S, (n_q, n_q)."""
        return self.matrix.T @ self.matrix + self.smooth

    @cached_property
    def smooth(self) -> FloatArray:
        """S, (n_q, n_q)."""
        diagonal = np.einsum("ij,ij->j", self.matrix, self.matrix)
        return np.asarray(penalty(self.plane, diagonal, self.smoothing).toarray())

    def fit(self, y: FloatArray, passive: NDArray[np.bool_] | None = None) -> nnls.NonNegative:
        """Non-negative masses for binned outputs (count,)."""
        return nnls.solve(self.gram, self.matrix.T @ (y - y.mean()), passive=passive)

    def offset(self, y: FloatArray, masses: FloatArray) -> float:
        """Offset y0 that belongs to the masses; rows here rise from 0, so W is added back."""
        return float(y.mean() - self.mean @ masses + masses.sum())

    def projector(self, passive: NDArray[np.bool_]) -> Projector:
        """What the positive cells can fit."""
        return Projector(self, np.flatnonzero(passive))


def _to_cells(plane: Plane, packed: sparse.csr_array) -> FloatArray:
    """Rows in node space to rows (count, n_q) in cell space, in pieces that fit the cache."""
    matrix = np.empty(packed.shape)
    for begin in range(0, packed.shape[0], 2000):
        part = slice(begin, begin + 2000)
        matrix[part] = plane.adjoint(packed[part].toarray())
    return matrix


class Projector:
    """Takes off what the positive cells can fit: c - D (D'D + S)^-1 D'c, and the mean."""

    def __init__(self, design: Design, free: IntArray) -> None:
        self.columns = design.matrix[:, free]
        block = design.gram[np.ix_(free, free)].copy()
        block[np.diag_indices_from(block)] += 1e-10 * float(np.diagonal(block).max())
        self.factor = linalg.cho_factor(block, lower=True, check_finite=False)

    def __call__(self, columns: FloatArray) -> FloatArray:
        """Columns (count, k) without their fitted part."""
        centred = columns - columns.mean(axis=0)
        return centred - self.columns @ linalg.cho_solve(
            self.factor, self.columns.T @ centred, check_finite=False
        )


def frames_of(records: Sequence[Measured], span: float, reach: float) -> list[Frame]:
    """One frame per record."""
    return [Frame(r.dt_s, r.input, span, reach, k, len(records)) for k, r in enumerate(records)]
