"""The branches of an input between its turns, cut into pieces at each wiping-out.

A branch begins at a turn and moves away from it, until it passes the extreme before that turn: both are
wiped out then, and it moves away from an older extreme. So each piece of a branch has an anchor, the
nearest extreme that is still remembered; the anchor of the last piece is the parent of the turn that ends
the branch. Turns are places in a list: place 0 is the negative saturation, odd places are maxima.

Noise in an input makes many small loops, nearly all of which the very next branch closes. They are set
aside many at a time, until few turns are left to be followed one by one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pulsetrainer.core.plane import FloatArray, IntArray

_FEW = 64  # turns: so many are followed one by one as fast as many at a time
_WORTH = 8  # setting loops aside pays where one turn in so many goes


class Pieces(NamedTuple):
    """The pieces of all branches, in their order; extremes are named by their places."""

    anchor: IntArray  # (p,) of each piece
    last: IntArray  # (m,) number of the last piece of each branch


def pieces(value: FloatArray) -> Pieces:
    """Return the pieces of the branches that end at ``value[1:]`` (m,), from ``value[0]``, the lowest.

    A minimum with all relays down is place 0.
    """
    kept, loops = _less_small_loops(value)
    found = _one_by_one(value[kept].tolist())
    if not loops:
        return found
    place = np.where(value == value[0], 0, np.arange(value.size))
    parent = np.zeros_like(place)
    parent[kept[1:]] = place[kept[found.anchor[found.last]]]
    for before, first, second in reversed(loops):
        parent[second] = place[first]
        for still, anchor in _passed(value, parent, place[before], first):
            parent[first[still]] = anchor
    return _in_order(_passed(value, parent, place[:-1], np.arange(1, value.size)))


def _less_small_loops(value: FloatArray) -> tuple[IntArray, list[tuple[IntArray, IntArray, IntArray]]]:
    """Return the places that stay; of each round of loops, where they begin and their two turns.

    A loop is set aside where the extreme before it is further out, and the branch after it closes it.
    """
    kept, loops = np.arange(value.size), []
    while kept.size > _FEW:
        outwards = value[kept[2:]] - value[kept[:-2]]  # from an extreme to the next one of its kind
        outwards[::2] *= -1.0
        first = np.flatnonzero((outwards[:-1] < 0.0) & (outwards[1:] >= 0.0)) + 1
        if first.size * _WORTH < kept.size:
            break
        stays = np.ones(kept.size, dtype=bool)
        stays[first] = stays[first + 1] = False
        before = kept[stays][np.cumsum(stays)[first] - 1]
        loops.append((before, kept[first], kept[first + 1]))
        kept = kept[stays]
    return kept, loops


def _passed(
    value: FloatArray, parent: IntArray, anchor: IntArray, turn: IntArray
) -> list[tuple[IntArray, IntArray]]:
    """Anchors of branches that end at ``turn`` (k,): round by round, which still go on, and from where.

    Each begins at its ``anchor`` (k,); ``parent`` is known for all that it passes.
    """
    still, rounds = np.arange(turn.size), []
    rising = turn % 2 == 1
    while still.size > 0:
        rounds.append((still, anchor))
        outer = parent[anchor]
        beyond = value[turn] - value[outer]
        goes_on = np.flatnonzero((anchor > 0) & np.where(rising, beyond >= 0.0, beyond <= 0.0))
        anchor = parent[outer[goes_on]]
        still, turn, rising = still[goes_on], turn[goes_on], rising[goes_on]
    return rounds


def _in_order(rounds: list[tuple[IntArray, IntArray]]) -> Pieces:
    """Put the pieces of all branches one after another."""
    count = np.zeros(rounds[0][0].size, dtype=np.int64)
    for still, _ in rounds:
        count[still] += 1
    last = np.cumsum(count) - 1
    anchors = np.empty(int(count.sum()), dtype=np.int64)
    begin = last - count + 1
    for k, (still, anchor) in enumerate(rounds):
        anchors[begin[still] + k] = anchor
    return Pieces(anchors, last)


def _one_by_one(values: list[float]) -> Pieces:
    """Follow the turns with a stack: each is pushed and wiped out at most once."""
    # the remembered places and their values, above a value that no input passes
    stack, height = [-1, 0], [np.inf, values[0]]
    anchors: list[int] = []
    pieces_so_far: list[int] = []
    rising = True
    for place, value in enumerate(values[1:], start=1):
        # wiping-out: pass the older extremes of the same kind, the nearest first
        while (value >= height[-2]) if rising else (value <= height[-2]):
            anchors.append(stack.pop())
            height.pop()
            if len(stack) == 2:  # all relays are down again
                break
            stack.pop()
            height.pop()
        anchors.append(stack[-1])
        pieces_so_far.append(len(anchors))
        if value != height[-1]:
            stack.append(place)
            height.append(value)
        rising = not rising
    return Pieces(np.asarray(anchors, dtype=np.int64), np.asarray(pieces_so_far, dtype=np.int64) - 1)
