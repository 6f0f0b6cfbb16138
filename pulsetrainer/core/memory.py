"""The memory of a Preisach operator: an alternating stack of past extremes, with wiping-out.

A state is the list [low, M1, m1, M2, m2, ..., u]: the negative saturation, then maxima and minima that
the input has not passed again, then the present input. Each step of the list is one term of
the output (Mayergoyz 2003, eq. 1.23). When the input passes an extreme, that extreme and the one
before it are forgotten (wiping-out).

``trace`` follows a whole input at once. The stacks of all times form a tree whose nodes are turning
points; a sample needs to know only the node it moves away from, its anchor.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class State:
    """The remembered extremes, from the negative saturation to the present input, input unit."""

    extremes: tuple[float, ...]  # alternating: low, max, min, max, ...; the last one is the present input

    def __post_init__(self) -> None:
        path = np.asarray(self.extremes, dtype=np.float64)
        if path.ndim != 1 or path.size < 1 or not np.all(np.isfinite(path)):
            raise ArgumentError(
                f"a memory state needs at least one finite extreme, got {self.extremes}",
                hint="start from negative_saturation(low)",
            )
        # compare the extremes, not their distances: close to zero the distances round to the same number
        lowest, highest = path[::2], path[1::2]
        closing = np.all(np.diff(lowest) > 0) and np.all(np.diff(highest) < 0)
        if not closing or (highest.size > 0 and lowest[-1] >= highest[-1]):
            raise ArgumentError(
                f"extremes of a memory state must alternate and close in on each other, got {self.extremes}",
                hint="start from a state that this package returned",
            )

    @property
    def present(self) -> float:
        """The input now."""
        return self.extremes[-1]


def negative_saturation(low: float) -> State:
    """Return the state in which every relay is down and the input is ``low``."""
    return State((float(low),))


def positive_saturation(low: float, high: float) -> State:
    """Return the state in which every relay is up and the input is ``high``."""
    return State((float(low), float(high)))


def demagnetised(low: float, high: float, swings: int = 200) -> State:
    """Return the state after ``swings`` ever smaller swings around the middle of [low, high]."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    shrink = 1.0 - np.arange(swings) / swings
    turns = middle + half * shrink * np.where(np.arange(swings) % 2 == 0, 1.0, -1.0)
    return State((float(low), *np.minimum(turns, high).tolist()))


@dataclass(frozen=True, slots=True)
class Trace:
    """An input resolved into turning points and anchors.

    ``node_value``/``parent`` (m,) describe the tree of turning points, node 0 is the negative
    saturation and parents come before children. Sample t, at input ``value[t]``, moves away from node
    ``anchor[t]``; y[t] = y(anchor) + 2 sign(value - node_value[anchor]) E(...).
    """

    value: FloatArray  # (n,) the input, clipped to the range
    anchor: IntArray  # (n,) node numbers
    node_value: FloatArray  # (m,)
    parent: IntArray  # (m,)
    final: State

    def along_tree(self, steps: FloatArray) -> FloatArray:
        """Sum ``steps`` (m, ...) from the root to each node, in log2(depth) vectorised passes."""
        total = steps.copy()
        jump = self.parent.copy()
        while np.any(jump != 0):
            total += total[jump]
            jump = jump[jump]
        return total


def turning_points(path: FloatArray) -> IntArray:
    """Return the places in ``path`` where it turns, and its last place; runs of equal values count once.

    A turn is placed on the first sample of the extreme value.
    """
    moves = np.flatnonzero(np.diff(path) != 0)  # path[k + 1] differs from path[k]
    if moves.size == 0:
        return np.zeros(0, dtype=np.int64)
    rising = path[moves + 1] > path[moves]
    turn = np.flatnonzero(rising[1:] != rising[:-1])
    return np.append(moves[turn] + 1, moves[-1] + 1).astype(np.int64)


def trace(values: FloatArray, start: State, low: float, high: float) -> Trace:
    """Follow ``values`` (n,), clipped to [low, high], from ``start``.

    One pass over the turning points, each of which is pushed and wiped out at most once: linear in n.
    """
    u = np.clip(values, low, high)
    past = np.clip(start.extremes, low, high)
    past[0] = low  # whatever plane the state came from, it begins with every relay down
    path = np.concatenate((past, u))
    node_value, parent, stack = [low], [0], [0]
    piece_end: list[int] = []  # index into path one past the last sample of a piece
    piece_anchor: list[int] = []
    turns = turning_points(path)
    samples = path.tolist() if turns.size * 8 > path.size else path  # element access: lists are faster
    begin = 1
    for end, value in zip(turns.tolist(), path[turns].tolist(), strict=True):
        anchor = stack[-1]
        rising = value > node_value[anchor]
        # wiping-out: pass the older extremes of the same kind, the nearest first
        while len(stack) > 1:
            older = node_value[stack[-2]]
            if (value < older) if rising else (value > older):
                break
            cut = _first_past(samples, older, begin, end + 1, rising)
            piece_end.append(cut)
            piece_anchor.append(anchor)
            begin = cut
            stack.pop()
            if len(stack) > 1:
                stack.pop()
            anchor = stack[-1]
        piece_end.append(end + 1)
        piece_anchor.append(anchor)
        begin = end + 1
        if value != node_value[anchor]:
            node_value.append(value)
            parent.append(anchor)
            stack.append(len(node_value) - 1)
    piece_end.append(path.size)  # samples that rest at the last value
    piece_anchor.append(stack[-1])
    begins = np.asarray([1, *piece_end], dtype=np.int64)
    anchor_of = np.repeat(np.asarray(piece_anchor, dtype=np.int64), begins[1:] - begins[:-1])[past.size - 1 :]
    final = State(tuple(node_value[k] for k in stack))
    return Trace(u, anchor_of, np.asarray(node_value), np.asarray(parent, dtype=np.int64), final)


def _first_past(samples: FloatArray | list[float], level: float, begin: int, end: int, rising: bool) -> int:
    """Return the first index in [begin, end) of a monotone branch whose sample has reached ``level``."""
    if rising:
        return bisect_left(samples, level, begin, end)
    return bisect_left(samples, -level, begin, end, key=lambda v: -v)
