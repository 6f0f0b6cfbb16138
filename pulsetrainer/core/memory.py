"""The memory of a Preisach operator: an alternating stack of past extremes, with wiping-out.

A state is the list [low, M1, m1, M2, m2, ..., u]: the negative saturation, then maxima and minima that
the input has not passed again, then the present input. Each step of the list is one term of
the output (Mayergoyz 2003, eq. 1.23). When the input passes an extreme, that extreme and the one
before it are forgotten (wiping-out).

``trace`` follows a whole input at once. The stacks of all times form a tree whose nodes are turning
points; a sample needs to know only the node it moves away from, its anchor.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from pulsetrainer.core.branches import pieces
from pulsetrainer.core.plane import FloatArray, IntArray, ascending, float_array
from pulsetrainer.errors import ArgumentError

_SWINGS = 200  # of a demagnetisation
_Steps = TypeVar("_Steps")  # an array, or a sparse one


@dataclass(frozen=True, slots=True)
class State:
    """The remembered extremes, from the negative saturation to the present input, input unit."""

    extremes: tuple[float, ...]  # alternating: low, max, min, max, ...; the last one is the present input

    def __post_init__(self) -> None:
        path = float_array("extremes of a memory state", self.extremes)
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


def negative_saturation(low: float) -> State:
    """Return the state in which every relay is down and the input is ``low``, input unit.

    ArgumentError where ``low`` is not finite.
    """
    return State((float(low),))


def positive_saturation(low: float, high: float) -> State:
    """Return the state in which every relay is up and the input is ``high``, input unit.

    ArgumentError where ``low`` is not below ``high``, or one of them is not finite.
    """
    return State((float(low), float(high)))


def demagnetised(low: float, high: float) -> State:
    """Return the state after many ever smaller swings around the middle of [low, high].

    ArgumentError for an empty range.
    """
    ascending(low, high)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    shrink = 1.0 - np.arange(_SWINGS) / _SWINGS
    turns = middle + half * shrink * np.where(np.arange(_SWINGS) % 2 == 0, 1.0, -1.0)
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

    def along_tree(self, steps: _Steps) -> _Steps:
        """Sum ``steps`` (m, ...) from the root, whose own is zero, to each node, in log2(depth) passes."""
        total: Any = copy(steps)
        jump = self.parent
        while jump.any():
            total = total + total[jump]
            jump = jump[jump]
        return total


def turning_points(path: FloatArray) -> IntArray:
    """Return the places in ``path`` where it turns, and its last place; runs of equal values count once.

    A turn is placed on the first sample of the extreme value.
    """
    rising = path[1:] > path[:-1]
    moving = rising | (path[1:] < path[:-1])
    moves = None if moving.all() else np.flatnonzero(moving)  # path[k + 1] differs from path[k]
    if moves is not None:
        rising = rising[moves]
    if rising.size == 0:
        return np.zeros(0, dtype=np.int64)
    turn = np.append(np.flatnonzero(rising[1:] != rising[:-1]), rising.size - 1)
    return (turn if moves is None else moves[turn]) + 1


def trace(values: FloatArray, start: State, low: float, high: float) -> Trace:
    """Follow an input (n,), clipped to [low, high], from a state: see ``trace_after``."""
    return trace_after(np.asarray(start.extremes), values, low, high)


def trace_after(past: FloatArray, values: FloatArray, low: float, high: float) -> Trace:
    """Follow an input (n,), clipped to [low, high], after a ``past`` (p,) that begins with all relays down.

    The memory is the alternating sequence of dominant extremes (Mayergoyz 2003, section 1.2). ``past``
    and ``values`` are finite and not empty, in the unit of ``low`` and ``high``; nothing is checked here.
    """
    path = np.concatenate((past, values))
    np.clip(path, low, high, out=path)
    path[0] = low  # whatever plane the past came from, it begins with every relay down
    turns = turning_points(path)
    turn_value = path[turns]
    anchor, last = pieces(np.append(low, turn_value))
    pushed = turn_value != low
    node_value = np.append(low, turn_value[pushed])
    node = np.append(0, np.where(pushed, np.cumsum(pushed), 0))  # of each turn
    anchor = node[anchor]
    parent = np.append(0, anchor[last[pushed]])
    level = node_value[parent[anchor]]  # that ends a piece: the extreme before its anchor is passed
    ends = _piece_ends(path, turns, level, last)
    length = np.diff(np.concatenate(([1], ends, [path.size])))  # at last, samples that rest
    of_sample = np.repeat(np.append(anchor, node[-1]), length)[past.size - 1 :]
    final = State(tuple(node_value[remembered_at(int(node[-1]), parent)].tolist()))
    return Trace(path[past.size :], of_sample, node_value, parent, final)


def remembered_at(node: int, parent: IntArray) -> list[int]:
    """Return the turning points that are remembered at one of them: from the negative saturation to it."""
    chain = [node]
    while chain[-1] > 0:
        chain.append(int(parent[chain[-1]]))
    return chain[::-1]


def _piece_ends(path: FloatArray, turns: IntArray, level: FloatArray, last: IntArray) -> IntArray:
    """Index into ``path`` of the first sample, on each piece's branch, that has reached its ``level``.

    Branches are monotone, the even ones rising: bisection of all pieces at once. The last ends at the turn.
    """
    branch = np.repeat(np.arange(turns.size), np.diff(last, prepend=-1))
    ends = turns[branch] + 1
    inner = np.ones(branch.size, dtype=bool)
    inner[last] = False
    piece = np.flatnonzero(inner)
    begin, end = np.concatenate(([1], turns + 1))[branch[piece]], ends[piece]
    direction = np.where(branch[piece] % 2 == 0, 1.0, -1.0)
    level = direction * level[piece]
    while piece.size > 0:
        middle = (begin + end) // 2
        reached = direction * path[middle] >= level
        begin, end = np.where(reached, begin, middle + 1), np.where(reached, middle, end)
        ends[piece] = end
        still = begin < end
        piece, begin, end = piece[still], begin[still], end[still]
        direction, level = direction[still], level[still]
    return ends
