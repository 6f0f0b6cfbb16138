"""The fit's view of the data: design rows of short averages, and everything projected off them.

Rows are made at the full sample rate, so that no tip of a fast loop is lost, and then averaged over
bins of a few milliseconds together with the output: some 20 000 rows whatever the record's length. With
S the smoothing of ``core.smoothing``, the fitted part of any signal c is D (D'D + S)^-1 D'c.

D is never made. With A from the masses of the cells to the Everett function at the nodes, F the orthonormal
columns of offset and start, and B the rows in node space, which have some seven entries each,

    D = B A - F F'B A.

The after-effects of what the device did before a record decay in it: a finger that was pressed relaxes for
seconds. No record shows how large they are. So a few exponential decays from its first sample are fitted
freely, as the offset is, and projected off everything else. (Without them the time constant of a creep came
out 15 % too short.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core import nnls
from pulsetrainer.core.memory import Trace
from pulsetrainer.core.operator import Preisach, base_rows, follow, steps
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, Plane
from pulsetrainer.core.record import Record
from pulsetrainer.core.smoothing import penalty
from pulsetrainer.diagnosis.raw import as_fast_as_its_hum, hums
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.errors import DataError


@dataclass(frozen=True)
class Bins:
    """How samples are averaged: the bin of every sample of every record, -1 for none."""

    number: tuple[IntArray, ...]
    count: int
    record: IntArray  # (count,) record of each bin
    time_s: FloatArray  # (count,) since the start of its record
    width: tuple[int, ...]  # samples a bin has when all have weight, of each record
    begins_free: bool = True  # decays from the first sample of each record are fitted

    def average(self, signals: Sequence[FloatArray]) -> FloatArray:
        """Averages (count,) of one signal per record."""
        total = np.empty(self.count)
        for (inside, first, own), one in zip(self._runs, signals, strict=True):
            total[own] = np.add.reduceat(one if inside is None else one[inside], first)
        return total / self.sizes

    @cached_property
    def _runs(self) -> list[tuple[IntArray | None, IntArray, IntArray]]:
        """For each record its samples with weight (None: all), where a bin begins in them, and its bins."""
        found = []
        for number in self.number:
            counts = number >= 0
            inside = None if np.all(counts) else np.flatnonzero(counts)
            used = number if inside is None else number[inside]
            first = np.flatnonzero(np.diff(used, prepend=-1))
            found.append((inside, first, used[first]))
        return found

    @cached_property
    def free(self) -> FloatArray:
        """Orthonormal columns (count, k) of what is fitted freely: one offset, the start of each record."""
        return np.asarray(scipy.linalg.qr(self._starts, mode="economic", check_finite=False)[0])

    @cached_property
    def _starts(self) -> FloatArray:
        """The offset and the decays themselves (count, k)."""
        columns = [np.ones(self.count)]
        for k in np.unique(self.record) if self.begins_free else ():
            own = self.record == k
            since = self.time_s - self.time_s[own][0]
            longest = float(since[own][-1]) / LIMITS.start_share
            # decays far in the past would be zero, and exp would overflow before the record
            columns += [
                np.where(own, np.exp(-np.maximum(since, 0.0) / tau), 0.0)
                for tau in LIMITS.start_tau_s
                if tau < longest
            ]
        return np.stack(columns, axis=1)

    @cached_property
    def places(self) -> list[tuple[IntArray, IntArray]]:
        """For each record its bins (k,), and their places (k,) among even steps."""
        found = []
        for k in range(len(self.number)):
            own = np.flatnonzero(self.record == k)
            if own.size == 0:
                continue
            time = self.time_s[own] - self.time_s[own[0]]
            step = float(np.diff(time).min()) if own.size > 1 else 1.0
            found.append((own, np.round(time / step).astype(np.int64)))
        return found

    def even(self, values: FloatArray, k: int) -> FloatArray:
        """Values (count,) of record ``k`` at even steps of its bins, zero where there is no bin."""
        number = self.number[k]
        used, first = np.unique(number, return_index=True)
        start = int(used[0] == -1)
        spread = np.zeros(-(-number.size // self.width[k]))
        spread[first[start:] // self.width[k]] = values[used[start:]]
        return spread

    def filtered(
        self,
        columns: FloatArray,
        through: Callable[[FloatArray, int, float], FloatArray],
        dt_s: Sequence[float],
    ) -> FloatArray:
        """Columns (count, m) after ``through(even columns, record, step)``; holes keep the last value."""
        result = np.empty_like(columns)
        for k, (width, step) in enumerate(zip(self.width, dt_s, strict=True)):
            own = np.flatnonzero(self.record == k)
            if own.size == 0:
                continue
            at = np.floor(self.time_s[own] / (width * step)).astype(np.int64)
            if own.size == self.count == at[-1] + 1:  # one record without a hole: nothing is copied
                return through(columns, k, width * step)
            last = np.maximum(np.searchsorted(at, np.arange(at[-1] + 1), side="right") - 1, 0)
            result[own] = through(columns[own[last]], k, width * step)[at]
        return result

    def short(
        self, through: Callable[[FloatArray, int, float], FloatArray], dt_s: Sequence[float]
    ) -> scipy.sparse.csr_array | None:
        """Return ``filtered`` as a matrix (count, count), where the filter forgets within a few averages.

        Its answer to an impulse, from rest at the first value and before rest at the last: a fault of the
        input looks ahead. None where the answer is long, or a bin is missing.
        """
        blocks = []
        for k, (width, step) in enumerate(zip(self.width, dt_s, strict=True)):
            size, at = int(np.count_nonzero(self.record == k)), LIMITS.short_filter + 1
            impulse = np.zeros((2 * at + 1, 1))
            impulse[at] = 1.0
            answer = through(impulse, k, width * step)[:, 0]
            heard = np.flatnonzero(np.abs(answer) > LIMITS.rounding * np.abs(answer).max())
            # of a long delay nothing is heard yet
            lasts = heard.size == 0 or heard[0] <= 1 or heard[-1] >= 2 * at - 1
            if lasts or size <= heard[-1] - heard[0] + 1 or not self._is_even(k, width * step):
                return None
            lag = np.arange(min(heard[0], at), max(heard[-1], at) + 1) - at
            blocks.append(_of_answer(answer[lag + at], lag, size))
        return scipy.sparse.block_diag(blocks, format="csr")

    def _is_even(self, k: int, step_s: float) -> bool:
        """Whether a record has a bin at every step from its first one on, where a filter begins at rest."""
        at = np.floor(self.time_s[self.record == k] / step_s)
        return bool(np.array_equal(at - at[:1], np.arange(at.size)))

    def constant(self, along: FloatArray) -> float:
        """Return the offset that belongs to coordinates (k,) along ``free``."""
        upper = self.free.T @ self._starts
        return float(scipy.linalg.solve_triangular(upper, along, check_finite=False)[0])

    def settled(self, columns: FloatArray) -> FloatArray:
        """Signals (count,) or (count, m) without their offset and start."""
        return columns - self.free @ (self.free.T @ columns)

    @cached_property
    def sizes(self) -> FloatArray:
        """Samples in each bin (count,)."""
        total = np.zeros(self.count)
        for number in self.number:
            total += np.bincount(number[number >= 0], minlength=self.count)
        return total


def _of_answer(answer: FloatArray, lag: IntArray, size: int) -> scipy.sparse.csr_array:
    """Return the filter (size, size) of an answer (m,) at lags (m,); beyond both ends signals are still."""
    whole = scipy.sparse.diags_array(answer, offsets=-lag, shape=(size, size), format="csr")
    late, early = np.arange(lag[-1]), np.arange(-lag[0])
    heard = np.cumsum(answer)
    # what the answer has from before the first value, and from beyond the last one
    before = (1.0 - heard[late - lag[0]], (late, np.zeros_like(late)))
    beyond = (heard[early], (size - early.size + early, np.full_like(early, size - 1)))
    ends = [scipy.sparse.csr_array(one, shape=(size, size)) for one in (before, beyond)]
    return whole + ends[0] + ends[1]


def _hums_within(record: Record, per_bin: int) -> bool:
    """Whether averages of so many samples would hide a hum that is larger than the noise."""
    fewer = as_fast_as_its_hum(record, per_bin, 1.0) < per_bin
    return fewer or hums(record.output, record.sample_weight)


def bins_of(records: Sequence[Record]) -> Bins:
    """Bins over the samples with weight; DataError where hardly any sample has weight.

    A hum has the finest: slow records have averages of several of its periods, in which it would be noise.
    """
    duration = sum(r.input.size * r.step for r in records)
    width, finest = min(LIMITS.bin_s, duration / LIMITS.enough_rows), duration / LIMITS.most_rows
    if width <= finest or any(_hums_within(r, max(1, round(width / r.step))) for r in records):
        width = finest
    numbers, record, time, widths, count = [], [], [], [], 0
    for k, r in enumerate(records):
        per_bin = max(1, round(width / r.step))
        raw = np.where(r.counts, np.arange(r.input.size) // per_bin, -1)
        used, inverse = np.unique(raw, return_inverse=True)
        first = int(used[0] == -1)
        numbers.append(np.where(raw >= 0, inverse - first + count, -1).astype(np.int64))
        size = used.size - first
        record.append(np.full(size, k))
        time.append((used[first:] + 0.5) * per_bin * r.step)
        widths.append(per_bin)
        count += size
    if count < LIMITS.least_rows:
        raise DataError(
            f"only {count} short averages can be made of this data, too few to tell causes apart",
            hint="record longer: pulsetrainer capture diagnostic -o diagnostic.h5",
        )
    return Bins(tuple(numbers), count, np.concatenate(record), np.concatenate(time), tuple(widths))


@dataclass
class Design:
    """Design rows D for given inputs, without offset and start, with their normal matrix and the fit."""

    plane: Plane
    bins: Bins
    nodes: scipy.sparse.csr_array | FloatArray  # B (count, n_q) in nodes; B A in cells where causes filter it
    smoothing: float

    @classmethod
    def build(
        cls,
        plane: Plane,
        bins: Bins,
        paths: Sequence[Followed],
        smoothing: float,
        shown: Callable[[FloatArray], FloatArray] | scipy.sparse.csr_array | None = None,
    ) -> Design:
        """Average the rows of the inputs that the hysteresis sees, one per record; ``shown`` filters them.

        As a matrix (count, count) it leaves them sparse.
        """
        packed = scipy.sparse.csr_array((bins.count, plane.n_q))
        for number, path in zip(bins.number, paths, strict=True):
            inside = np.flatnonzero(number >= 0)
            where = number[inside]
            share = 1.0 / bins.sizes[where]
            way = path.trace
            own, base = steps(plane, way.value, way.node_value[way.anchor]), base_rows(plane, way)
            of_samples = scipy.sparse.csr_array((share, (where, inside)), shape=(bins.count, own.shape[0]))
            anchor = way.anchor[inside]
            of_nodes = scipy.sparse.csr_array((share, (where, anchor)), shape=(bins.count, base.shape[0]))
            packed = packed + of_samples @ own + of_nodes @ base
        if shown is None:
            return cls(plane, bins, packed, smoothing)
        if not callable(shown):
            return cls(plane, bins, shown @ packed, smoothing)
        dense = shown(packed.toarray())
        for first in range(0, bins.count, LIMITS.rows_at_once):
            part = slice(first, first + LIMITS.rows_at_once)
            dense[part] = plane.adjoint(dense[part])
        return cls(plane, bins, dense, smoothing)

    @cached_property
    def taken(self) -> FloatArray:
        """Coordinates F'B A (k, n_q) of offset and start."""
        return self._summed(self.bins.free).T

    def output(self, masses: FloatArray) -> FloatArray:
        """Averaged outputs B A m (count, ...) of masses (n_q, ...); all rise from 0."""
        if isinstance(self.nodes, np.ndarray):
            return np.asarray(self.nodes @ masses)
        return np.asarray(self.nodes @ self.plane.everett_nodes(masses.T).T)

    def across(self, columns: FloatArray) -> FloatArray:
        """Products D'c (n_q, m) with columns (count, m)."""
        return self._summed(columns) - self.taken.T @ (self.bins.free.T @ columns)

    def _summed(self, columns: FloatArray) -> FloatArray:
        """Products (B A)'c (n_q, m) with columns (count, m)."""
        if isinstance(self.nodes, np.ndarray):
            return np.asarray(self.nodes.T @ columns)
        return self.plane.adjoint((self.nodes.T @ columns).T).T

    def products(self, own: BoolArray, cells: IntArray, beside: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Products (k, k) and (k, m) of the cells' columns, offset and start not taken off, over some rows.

        The first with themselves, the second with columns ``beside`` (own rows, m).
        """
        nodes = self.nodes[own]
        if isinstance(nodes, np.ndarray):
            nodes = nodes[:, cells]
            return nodes.T @ nodes, nodes.T @ beside
        plane = self.plane
        # symmetric: the cells of one side may be chosen before the other side is summed
        half = plane.adjoint((nodes.T @ nodes).toarray())[:, cells]
        return plane.adjoint(half.T)[:, cells], plane.adjoint((nodes.T @ beside).T).T[cells]

    @cached_property
    def squares(self) -> FloatArray:
        """Products D'D (n_q, n_q); zero for cells that only offset and start see."""
        if isinstance(self.nodes, np.ndarray):
            whole = self.nodes.T @ self.nodes
        else:
            whole = self.plane.adjoint(self.plane.adjoint((self.nodes.T @ self.nodes).toarray()).T)
        found = whole - self.taken.T @ self.taken
        still = np.diagonal(found) <= LIMITS.rounding * np.sum(self.taken**2, axis=0)
        found[still], found[:, still] = 0.0, 0.0
        return found

    @cached_property
    def gram(self) -> FloatArray:
        """D'D + S, (n_q, n_q)."""
        return self.squares + self.smooth

    @cached_property
    def _solver(self) -> nnls.Gram:
        return nnls.Gram(self.gram)

    @cached_property
    def smooth(self) -> FloatArray:
        """S, (n_q, n_q)."""
        return np.asarray(penalty(self.plane, np.diagonal(self.squares), self.smoothing).toarray())

    def fit(
        self, y: FloatArray, passive: BoolArray | None = None, *, signed: bool = False
    ) -> nnls.NonNegative:
        """Masses for binned outputs (count,), non-negative unless ``signed``."""
        rhs = self.across(self.bins.settled(y))
        if not signed:
            return self._solver.solve(rhs, passive=passive)
        masses = self._solver.minimise(rhs, self._solver.usable)
        return nnls.NonNegative(masses, masses != 0, 1)

    def offset(self, y: FloatArray, masses: FloatArray) -> float:
        """Offset y0 that belongs to the masses; rows here rise from 0, so W is added back."""
        along = self.bins.free.T @ y - self.taken @ masses
        return self.bins.constant(along) + float(masses.sum())

    def shown(self, operator: Preisach) -> FloatArray:
        """Averaged output (count,) of an operator on the inputs of the rows."""
        return self.output(operator.masses) + operator.offset - float(operator.masses.sum())

    def projector(self, passive: BoolArray) -> Projector:
        """What the positive cells can fit."""
        return Projector(self, np.flatnonzero(passive))


@dataclass(frozen=True)
class Followed:
    """An input followed through the plane's memory once, for any weights."""

    trace: Trace
    bands: tuple[IntArray, FloatArray]  # of the samples (n,): see ``Plane.bands``
    base: FloatArray | None = None  # (n,) output of what the weights only correct

    @classmethod
    def along(
        cls, plane: Plane, u: FloatArray, base: Callable[[FloatArray], FloatArray] | None = None
    ) -> Followed:
        """Follow an input (n,) from negative saturation."""
        path = follow(plane, u, None, "continuous")
        return cls(path, plane.bands(path.value), None if base is None else base(u))

    def output(self, operator: Preisach) -> FloatArray:
        """Output (n,), polarity 1."""
        y = operator.traced(self.trace, self.bands)
        return y if self.base is None else y + self.base


class Projector:
    """Takes off what offset, start and the positive cells can fit: c - D (D'D + S)^-1 D'c."""

    def __init__(self, design: Design, free: IntArray) -> None:
        # where a cause explains all, no cell is left: an unused one stands in, whose mass is close to nothing
        if free.size == 0:
            free = np.asarray([int(np.argmax(np.diagonal(design.gram)))], dtype=np.int64)
        self.design, self.cells = design, free
        # filtered nodes are not sparse: then the columns of the few positive cells are faster than all
        nodes = design.nodes
        self._columns = nodes[:, free] if isinstance(nodes, np.ndarray) else None
        block = design.gram[np.ix_(free, free)]
        # where no cell is seen at all, any ridge does
        block[np.diag_indices_from(block)] += LIMITS.ridge * float(np.diagonal(block).max()) or 1.0
        self.factor = scipy.linalg.cho_factor(block, lower=True, overwrite_a=True, check_finite=False)

    def __call__(self, columns: FloatArray) -> FloatArray:
        """Columns (count, k) without their fitted part."""
        bins, design = self.design.bins, self.design
        settled = bins.settled(columns)
        if self._columns is not None:
            along = scipy.linalg.cho_solve(self.factor, self._columns.T @ settled, check_finite=False)
            return np.asarray(settled - bins.settled(self._columns @ along))
        masses = np.zeros((design.plane.n_q, columns.shape[1]))
        masses[self.cells] = scipy.linalg.cho_solve(
            self.factor, design.across(settled)[self.cells], check_finite=False
        )
        return settled - bins.settled(design.output(masses))
