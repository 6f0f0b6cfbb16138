"""Coverage: which relays of the plane a signal has switched, and in words, which it has not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.core.memory import turning_points
from pulsetrainer.core.plane import BoolArray, FloatArray, Plane, ends_of, finite_vector
from pulsetrainer.errors import ArgumentError

_LITTLE = 0.1  # of the cells
_MISSING = 0.05  # of the range: smooth weights go on so far


@dataclass(frozen=True, slots=True)
class Gap:
    """The largest region of the plane that the signal never switched.

    The region is a rectangle cut by the diagonal: relays switching up in ``alpha_low`` .. ``alpha_high`` and
    down in ``beta_low`` .. ``beta_high``, input unit.
    """

    alpha_low: float
    alpha_high: float
    beta_low: float
    beta_high: float
    share: float  # of the area of the plane
    uncovered: float  # share of the area that is uncovered altogether

    def words(self, plane: Plane, unit: str) -> str:
        """Name the region in one line: "never switched: relays with ... (18 % of the plane)"."""
        limits = (
            ("alpha above", self.alpha_low, self.alpha_low > plane.low),
            ("alpha below", self.alpha_high, self.alpha_high < plane.high),
            # beta never exceeds alpha, so a limit at alpha's own end says nothing new
            ("beta above", self.beta_low, self.beta_low > plane.low),
            ("beta below", self.beta_high, self.beta_high < self.alpha_high),
        )
        parts = [f"{which} {at:.3g} {unit}".rstrip() for which, at, told in limits if told]
        which = f"relays with {' and '.join(parts)}" if parts else "all relays"
        rest = self.uncovered - self.share
        more = f"; {100 * rest:.0f} % more is elsewhere" if rest >= 0.005 else ""
        share = f"{100 * self.share:.0f}" if self.share < 0.995 or not parts else f"{100 * self.share:.1f}"
        return f"never switched: {which} ({share} % of the plane{more})"


def little_words(share: float) -> str:
    """Say what a record is good for that switches this share of the cells; empty where it switches more."""
    if share >= _LITTLE:
        return ""
    what = f"only {100 * share:.1f} % of the cells are switched"
    good = "a model of this record holds only for strokes like its own"
    return f"{what}: {good}. Record the whole range down and up, with loops within it"


def covers_range(inputs: Sequence[FloatArray], low: float, high: float) -> bool:
    """Tell whether inputs (n,) together come near both ends of [low, high]: within a twentieth of it."""
    slack = _MISSING * (high - low)
    lowest, highest = ends_of(inputs)
    return lowest <= low + slack and highest >= high - slack


def coverage(plane: Plane, inputs: Sequence[ArrayLike]) -> BoolArray:
    """Tell for every cell (n_q,) whether some input switched it on and, later, off.

    Cell (i, j) is switched on at the first input >= the middle of band i, and off when the input
    then falls below the middle of band j: a_i = (e_i + e_(i+1)) / 2 <= u_s and u_t < a_j for some s < t.
    Inputs (n,) and edges e share a unit.

    Source: Mayergoyz, Mathematical Models of Hysteresis and Their Applications, 2003, section 1.3: what is
    never switched cannot be identified.

    ArgumentError where an input is no finite vector.
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


def minor_coverage(plane: Plane, inputs: Sequence[ArrayLike], noise: float = 0.0) -> float:
    """Share of the cells within the plane that minor loops tell apart; the major loop alone tells none.

    A record tells the weight of a cell where the corner (alpha, beta) of its remembered extremes passes
    through it: from a maximum in band i down to band j, or from a minimum in band j up to band i. Corners on
    the two outer edges of the plane are those of the major loop; their cells are not counted.

    ``noise``, input unit, is how far noise moves a turn. One so near an edge is taken for one on it, with a
    minimum in the band above the edge and a maximum in that below. What lies beyond the plane is at its end.

    ArgumentError where an input is no finite vector.
    """
    passed = np.zeros((plane.n_h, plane.n_h), dtype=bool)
    for values in inputs:
        u = finite_vector("input", values)
        path = np.empty(u.size + 1)
        path[0] = plane.low
        np.clip(u, plane.low, plane.high, out=path[1:])  # in place: the record may be long
        _mark_corners(plane, path[turning_points(path)], noise, passed)
    i, j = plane.cell_indices
    within = (i < plane.n_h - 1) & (j > 0)
    return float(np.mean(passed[i, j][within])) if within.any() else 0.0


def _mark_corners(plane: Plane, turns: FloatArray, noise: float, passed: BoolArray) -> None:
    """Mark the cells (n_h, n_h) that corners of the memory pass, rising first, from negative saturation."""
    inwards = min(noise, 0.5 * float(np.diff(plane.edges).min())) * np.where(np.arange(turns.size) % 2, 1, -1)
    bands = np.searchsorted(plane.edges[1:-1], turns + inwards, side="right").tolist()
    # remembered extremes and their bands; the outermost of both kinds are those of saturation
    maxima, minima = [(np.inf, plane.n_h - 1)], [(-np.inf, 0)]
    at = 0  # band that has been reached
    for k, one in enumerate(zip(turns.tolist(), bands, strict=True)):
        if k % 2 == 0:
            while one >= maxima[-1] and len(maxima) > 1:  # wiped out, with the minimum after it
                passed[at : maxima[-1][1] + 1, minima[-1][1]] = True
                at = maxima.pop()[1]
                minima.pop()
            passed[at : one[1] + 1, minima[-1][1]] = True
            maxima.append(one)
        else:
            while one <= minima[-1] and len(minima) > 1:
                passed[maxima[-1][1], minima[-1][1] : at + 1] = True
                at = minima.pop()[1]
                maxima.pop()
            passed[maxima[-1][1], one[1] : at + 1] = True
            minima.append(one)
        at = one[1]


def largest_gap(plane: Plane, covered: BoolArray) -> Gap | None:
    """Return the largest rectangle, cut by the diagonal, of cells that are not ``covered`` (n_q,).

    Every rectangle of bands is tried whose cells below the diagonal are all uncovered; the one of the
    largest area, input unit squared, is named, and of equal ones the first. None when all cells are covered.

    ArgumentError where ``covered`` has not one entry for each cell.
    """
    if covered.shape != (plane.n_q,):
        raise ArgumentError(
            f"covered must have shape ({plane.n_q},), got {covered.shape}",
            hint="coverage and edges must come from the same model",
        )
    if np.all(covered):
        return None
    n, whole = plane.n_h, float(plane.areas.sum())
    bad = np.zeros((n + 1, n + 1))
    bad[1:, 1:] = np.cumsum(np.cumsum(plane.unpack(covered.astype(np.float64)), axis=0), axis=1)
    area = np.zeros((n + 1, n + 1))
    area[1:, 1:] = np.cumsum(np.cumsum(plane.unpack(plane.areas), axis=0), axis=1)
    best, where = -1.0, (0, 0, 0, 0)
    for low in range(n):  # first band of alpha
        for high in range(low + 1, n + 1):  # one past its last band
            # blank cells above the diagonal count as free, so a beta range may run past them
            inside = bad[high] - bad[low]
            sizes = area[high] - area[low]
            left = np.searchsorted(inside, inside, side="left")  # where the free bands begin, for each end
            size = sizes - sizes[left]
            right = int(np.argmax(size))
            if size[right] > best * (1 + 1e-12):
                best, where = float(size[right]), (low, high, int(left[right]), right)
    low, high, left_band, right_band = where
    edges = plane.edges
    return Gap(
        alpha_low=float(edges[max(low, left_band)]),
        alpha_high=float(edges[high]),
        beta_low=float(edges[left_band]),
        beta_high=float(edges[right_band]),
        share=best / whole,
        uncovered=float(plane.areas[~covered].sum()) / whole,
    )
