"""Inversion: from a wanted output to the input that gives it.

On a monotone branch the output is a continuous, rising, piecewise linear function of the input, so its
inverse is interpolation between a few dozen points. The memory of the wanted output has the same
extremes as the memory of the input, so one trace of the target tells every branch. That is ``invert``.

``closest_match`` is the method of the original device: step the input edge by edge until the output is
nearest (Tan, Venkataraman, Krishnaprasad 2001; Tan, Baras, Krishnaprasad 2005); ``smoothed`` is the
spline that takes its steps off. The inverse of a model with extensions iterates around ``invert``:
``diagnosis.extended``.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy  # its parts load when they are first used
from numpy.typing import ArrayLike

from pulsetrainer.core.memory import State, Trace, remembered_at, trace_after
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray, ascending, finite_vector, positive
from pulsetrainer.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class Inverse:
    """The input that gives the target, and what could not be reached."""

    input: FloatArray  # (n,) input unit
    clipped: int  # targets outside the reachable range, moved to its end
    final: State  # memory after the last sample


class _Branches:
    """How far the input must go from a turning point until the output has moved by so much.

    Along a branch the rise at edge l is (1 - t) R[k, l] + t R[k + 1, l], for a turn at the fraction t
    of band k, with R twice the Everett function, continued symmetrically. It never falls (sums of masses,
    rounded monotonically), and is linear between edges.
    """

    def __init__(self, operator: Preisach) -> None:
        self.plane = operator.plane
        self.rises = 2.0 * (operator.grid + operator.grid.T)
        if operator.signed:  # branches that turn back a little stay where they are
            for k, row in enumerate(self.rises):
                row[k:] = np.maximum.accumulate(row[k:])
                row[k::-1] = np.maximum.accumulate(row[k::-1])

    def reach(self, origin: FloatArray, need: FloatArray, rising: BoolArray) -> FloatArray:
        """Inputs (n,) at which branches from ``origin`` have moved by ``need``; where flat, the nearest."""
        edges, n_h = self.plane.edges, self.plane.n_h
        k, t = self.plane.bands(origin)
        near = self.rises.ravel()
        far = self.rises[1:].ravel()
        up = rising.astype(np.int64)
        first, step = k + up, 2 * up - 1
        row = k * (n_h + 1) + first
        begin, end = np.zeros_like(k), np.where(rising, n_h - k - 1, k)

        def rise(steps: IntArray) -> FloatArray:
            edge = row + step * steps
            return (1.0 - t) * near.take(edge) + t * far.take(edge)

        need = np.minimum(need, rise(end))
        while np.any(begin < end):
            middle = (begin + end) // 2
            enough = rise(middle) >= need
            end = np.where(enough, middle, end)
            begin = np.where(enough, begin, np.minimum(middle + 1, end))
        inside = begin > 0
        after, beyond = rise(begin), edges[first + step * begin]
        previous = np.where(inside, begin - 1, 0)
        before = np.where(inside, rise(previous), 0.0)
        u = np.where(inside, edges[first + step * previous], origin)
        gap = after - before
        u += np.divide(need - before, gap, out=np.zeros_like(u), where=gap > 0) * (beyond - u)
        return np.where(rising, np.minimum(u, beyond), np.maximum(u, beyond))


def invert(
    operator: Preisach, target: ArrayLike, start: State | None = None, *, monotone: bool = False
) -> Inverse:
    """Return the input whose output is ``target`` (n,), exactly, from ``start``.

    On a branch from a turn at u_t with the output y_t, u solves |y - y_t| = 2 E(max(u, u_t), min(u, u_t)),
    with the Everett function E. Targets outside the reachable range are clipped to it and counted. Where
    cells have no weight the output does not answer: the input stays where it was until the target moves on,
    then crosses at once.

    ``start`` is the memory before the first target; default: negative saturation. With ``monotone`` weights
    of either sign are allowed: the caller knows that all branches are monotone.

    ArgumentError if the target is not a finite vector, the operator uses the relay reading (its output is a
    staircase: use ``closest_match``), all its weights are zero, or some are negative.

    Source: own; the memory that it rests on is that of Mayergoyz 2003, chapter 1 (wiping out).
    """
    wanted = finite_vector("target", target)
    if operator.reading != "continuous":
        raise ArgumentError(
            "the relay reading has no continuous inverse: its output is a staircase",
            hint="use closest_match, or read the weights as continuous",
        )
    if operator.signed and not monotone:
        raise ArgumentError(
            "an operator with weights of either sign has no inverse over its whole range",
            hint="invert it where its branches are monotone: core.monotone",
        )
    _check_not_empty(operator)
    clipped, y = _into_reach(operator, wanted)
    # the memory in terms of outputs turns where the memory of inputs turns
    path = trace_after(_heights(operator, start), y, -operator.total, operator.total)
    branches = _Branches(operator)
    nodes = np.full(path.parent.size, operator.plane.low)
    rises = path.node_value - path.node_value[path.parent]
    for level in _levels(path):  # parents first
        nodes[level] = branches.reach(nodes[path.parent[level]], np.abs(rises[level]), rises[level] > 0)
    rise = path.value - path.node_value[path.anchor]
    u = branches.reach(nodes[path.anchor], np.abs(rise), rise > 0)
    # an extreme that the output has not passed the input must not pass by rounding: that would wipe it out
    extreme, inner = nodes[path.parent[path.anchor]], path.anchor > 0
    u = np.where(inner & (rise > 0), np.minimum(u, extreme), u)
    u = np.where(inner & (rise < 0), np.maximum(u, extreme), u)
    turns = nodes[remembered_at(int(path.anchor[-1]), path.parent)]
    final = trace_after(turns, u[-1:], operator.plane.low, operator.plane.high).final
    return Inverse(u, clipped, final)


def _levels(path: Trace) -> list[IntArray]:
    """Turning points by how many lie before them in the memory: those after one, then after two, ..."""
    depth = path.along_tree((np.arange(path.parent.size) > 0).astype(np.float64))
    order = np.argsort(depth, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(depth[order])) + 1)[1:]


def _check_not_empty(operator: Preisach) -> None:
    if operator.total <= 0:
        raise ArgumentError(
            "a model whose weights are all zero cannot be inverted", hint="identify it on a run that moves"
        )


def _into_reach(operator: Preisach, wanted: FloatArray) -> tuple[int, FloatArray]:
    """Count the targets out of reach and return all of them as outputs of polarity 1 without offset."""
    y = operator.polarity * (wanted - operator.offset)
    slack = 1e-9 * operator.total  # rounding of a target that was computed from the range itself
    clipped = int(np.sum(np.abs(y) - operator.total > slack))
    return clipped, np.clip(y, -operator.total, operator.total)


def _heights(operator: Preisach, start: State | None) -> FloatArray:
    """Outputs (polarity 1, no offset) at the remembered extremes of a state; equal ones where it is flat."""
    plane = operator.plane
    extremes = np.clip((plane.low,) if start is None else start.extremes, plane.low, plane.high)
    extremes[0] = plane.low
    rise = operator.step(extremes[1:], extremes[:-1])
    return np.append(0.0, np.cumsum(rise)) - operator.total


def closest_match(operator: Preisach, target: ArrayLike) -> Inverse:
    """Return the edges (n,), input unit, whose relay output is nearest to each target (n,) in turn.

    It begins at negative saturation. From the present edge and memory: while the output is below the target
    step up one edge, keeping the memory before the step; at the target, or at saturation, keep the nearer of
    the last two (Tan, Baras, Krishnaprasad 2005, section 4). Mirrored when the output is above the target.

    ArgumentError where the target is not a finite vector, or all weights are zero.
    """
    wanted = finite_vector("target", target)
    _check_not_empty(operator)
    clipped, y = _into_reach(operator, wanted)
    grid, edges, top = operator.grid, operator.plane.edges, operator.plane.n_h
    memory = _EdgeMemory(grid, [0])
    chosen = np.empty(y.size, dtype=np.int64)
    for n, goal in enumerate(y.tolist()):
        direction = 1 if memory.output < goal else -1
        before = memory
        while direction * (goal - memory.output) > 0 and 0 <= memory.edge + direction <= top:
            before, memory = memory, memory.moved(direction)
        if abs(before.output - goal) < abs(memory.output - goal):
            memory = before
        chosen[n] = memory.edge
    final = State(tuple(edges[memory.extremes].tolist()))
    return Inverse(edges[chosen], clipped, final)


class _EdgeMemory:
    """A relay memory in numbers of edges: remembered extremes and the output they give."""

    __slots__ = ("extremes", "grid", "output")

    def __init__(self, grid: FloatArray, extremes: list[int]) -> None:
        self.grid, self.extremes = grid, extremes
        self.output = -float(grid[-1, 0])
        for a, b in pairwise(extremes):
            self.output += 2.0 * float(grid[b, a] - grid[a, b])  # one of the two is zero

    @property
    def edge(self) -> int:
        return self.extremes[-1]

    def moved(self, direction: int) -> _EdgeMemory:
        """Return the memory after one edge up or down."""
        stack = list(self.extremes)
        edge = stack[-1] + direction
        if len(stack) > 1 and (stack[-1] - stack[-2]) * direction > 0:
            stack.pop()
        while len(stack) > 1 and (edge - stack[-2]) * direction >= 0:
            del stack[-2 if len(stack) > 2 else -1 :]
        if edge != stack[-1]:
            stack.append(edge)
        return _EdgeMemory(self.grid, stack)


def smoothed(inputs: ArrayLike, time_s: ArrayLike, step: float, low: float, high: float) -> FloatArray:
    """Return a staircase (n,) of edges ``step`` apart as a cubic smoothing spline (n,), within [low, high].

    The spline may differ from the staircase by the rounding error of the edges and no more: its
    residual is allowed the variance of a uniform error, sum (u_k - spline(t_k))^2 <= n step^2 / 12. Inputs,
    step and range are in the input unit, times in s.

    ArgumentError for fewer than five samples, one that is not finite, times that do not increase, a step
    that is not positive, or an empty range.

    Source: Reinsch 1967, Smoothing by spline functions (the condition on the residual).
    """
    u, t = finite_vector("inputs", inputs, at_least=5), finite_vector("time", time_s)
    if t.shape != u.shape or not np.all(np.diff(t) > 0):
        raise ArgumentError(
            f"time must increase from input to input, got times of shape {t.shape} for inputs of {u.shape}",
            hint="give one time for each input, in order",
        )
    positive(step=step)
    ascending(low, high)
    spline = scipy.interpolate.UnivariateSpline(t, u, k=3, s=u.size * step**2 / 12.0)
    return np.clip(spline(t), low, high)


def slew_limited(inputs: ArrayLike, rate_Hz: float, slew: float) -> FloatArray:
    """Nearest input (n,), input unit, that moves at most ``slew`` input units per second: jumps become ramps.

    |v_k+1 - v_k| <= slew / rate, v = (max{w <= u} + min{w >= u}) / 2 over the paths w with that slope.

    Where cells have no weight the exact inverse jumps, and a coil cannot. The mean of the highest
    path below the input and the lowest path above it, both with that slope (McShane 1934), starts a ramp as
    long before a jump as it ends after it, so nothing is delayed.

    ArgumentError where ``slew`` or ``rate_Hz`` is not positive, or an input is not finite.
    """
    positive(slew=slew, rate=rate_Hz)
    u = finite_vector("inputs", inputs)
    if slew / rate_Hz >= np.ptp(u):  # it limits nothing, and beside a huge ramp digits of the input were lost
        return u.copy()
    ramp = np.arange(u.size) * (slew / rate_Hz)

    def highest_below(path: FloatArray) -> FloatArray:
        left = np.minimum.accumulate(path - ramp) + ramp
        return np.minimum(left, np.minimum.accumulate((path + ramp)[::-1])[::-1] - ramp)

    return 0.5 * (highest_below(u) - highest_below(-u))
