"""The state before a record: from which sample on it does not matter, which one is assumed, or estimated.

A fit leaves out what comes before the memory is known (``record_of``). A prediction of a record that never
makes the memory known tries several states and takes the one that predicts best (``estimated_start``).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.core.dual import Dual
from pulsetrainer.core.memory import State, demagnetised, negative_saturation, positive_saturation
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record

NEAR = 0.01  # of the range: a noisy record touches its extreme only once, late
_APART = 0.03  # of the span of the output: a first stroke that runs so far from the later ones is another ...
_TIMES = 4.0  # ... if these run nearer to each other by this factor
_LEFT = 2.0  # times ``NEAR``: so far away the end is left, for noise crosses a single limit again and again
_COMPARED = 0.2  # of the range: shorter strokes are not compared ...
_PLACES = 20  # ... nor those of fewer samples; and at so many places
_STROKES = 3  # of two nobody knows which is the odd one


def known_from(inputs: FloatArray, low: float, high: float, outputs: FloatArray | None = None) -> int:
    """First sample (n,) at which the memory is known, whatever came before the record.

    Where the input reaches an end of [low, high], every remembered extreme is wiped out. Reached means within
    ``NEAR`` of the range. An input that never gets there is known, up to a constant, from where it first
    reaches an end of its own range: see ``start_of``.

    A device that begins at an end may never have come there: then its first stroke is another than all later
    ones from that end, which wiping-out makes alike (Mayergoyz 2003, section 1.2). With the ``outputs`` (n,)
    this is seen, and the memory is known from where it next reaches an end.
    """
    near = NEAR * (high - low)
    ends = np.flatnonzero((inputs <= low + near) | (inputs >= high - near))
    if not ends.size:
        return first_extreme(inputs)[0]
    if outputs is None or ends[0] > 0:
        return int(ends[0])
    return _past_a_first_stroke(inputs, outputs, low, high)


def first_stroke_words(inputs: FloatArray, outputs: FloatArray, low: float, high: float) -> str:
    """Say what of a record (n,) is left out as it lies apart from all later strokes; empty: nothing."""
    left = known_from(inputs, low, high, outputs) - known_from(inputs, low, high)
    if left <= 0:
        return ""
    return (
        f"the first stroke runs elsewhere than the later ones from there: its {left} samples are left out "
        "(cycle the device once before a recording)"
    )


def _past_a_first_stroke(inputs: FloatArray, outputs: FloatArray, low: float, high: float) -> int:
    """First sample that counts of a record that begins at an end: 0, or the next end after a stroke apart."""
    reach = high - low
    away = inputs - low if inputs[0] <= low + NEAR * reach else high - inputs
    at_end = _at_end(away, NEAR * reach)
    leaves = np.flatnonzero(at_end[:-1] & ~at_end[1:])
    strokes = [
        _stroke(away[at:until], outputs[at:until], reach)
        for at, until in pairwise([*leaves.tolist(), away.size])
    ]
    told = [way.size >= _PLACES and float(way[-1]) >= _COMPARED * reach for way, _ in strokes]
    if sum(told) < _STROKES or not told[0]:
        return 0
    strokes = [one for one, enough in zip(strokes, told, strict=True) if enough]
    top = min(float(way[-1]) for way, _ in strokes)
    places = np.linspace(_LEFT * NEAR * reach, top, _PLACES)
    first, *later = (np.interp(places, way, y) for way, y in strokes)
    usual = np.median(later, axis=0)
    apart = float(np.sqrt(np.mean((first - usual) ** 2)))
    alike = max(float(np.sqrt(np.mean((one - usual) ** 2))) for one in later)
    if apart <= max(_APART * float(np.ptp(outputs)), _TIMES * alike):
        return 0
    back = np.flatnonzero((at_end | (away >= reach - NEAR * reach))[leaves[0] + 1 :])
    return int(leaves[0] + 1 + back[0])  # where the second stroke begins at the latest


def _at_end(away: FloatArray, near: float) -> NDArray[np.bool_]:
    """Whether an input so far ``away`` (n,) from an end has come ``near`` it, and not left it since."""
    told = np.flatnonzero((away <= near) | (away > _LEFT * near))
    last = np.maximum(np.searchsorted(told, np.arange(away.size), side="right") - 1, 0)
    return np.asarray(away[told[last]] <= near)


def _stroke(away: FloatArray, outputs: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
    """Way (k,) from an end up to the first turn, rising, and the output (k,) on it."""
    farthest = np.maximum.accumulate(away)
    turned = np.flatnonzero(away < farthest - NEAR * reach)
    until = int(turned[0]) if turned.size else away.size
    rising = np.concatenate(([True], np.diff(farthest[:until]) > 0))
    return farthest[:until][rising], outputs[:until][rising]


def first_extreme(inputs: FloatArray) -> tuple[int, bool]:
    """First sample (n,) that is ``NEAR`` an end of the input's own range, and whether that is the top."""
    bottom, top = float(inputs.min()), float(inputs.max())
    near = NEAR * (top - bottom)
    at = int(np.flatnonzero((inputs <= bottom + near) | (inputs >= top - near))[0])
    return at, bool(inputs[at] >= top - near)


def reaches_an_end(inputs: FloatArray, low: float, high: float) -> bool:
    """Tell whether an input (n,) comes ``NEAR`` an end of [low, high], so that its memory becomes known."""
    near = NEAR * (high - low)
    return bool(np.any((inputs <= low + near) | (inputs >= high - near)))


def start_of(inputs: FloatArray, low: float, high: float) -> State | None:
    """State from which a record is followed; None is negative saturation.

    A record that swings within [low, high] and never reaches its ends leaves the relays outside its own
    range as they were. Once it has visited both of its own extremes they add a constant, whatever they are
    (congruency, Mayergoyz 2003, section 1.2). So that its first branch already is that of its closed loop,
    it is started from the saturation opposite to the extreme it visits first.
    """
    if reaches_an_end(inputs, low, high) or first_extreme(inputs)[1]:
        return None
    return positive_saturation(low, high)


def record_of(inputs: FloatArray, outputs: FloatArray, low: float, high: float) -> Record:
    """Return measured input and output (n,) as a record to fit; it counts from where the memory is known.

    Raises
    ------
    ArgumentError
        There are too few samples, or NaN or infinity.
    """
    counts = np.ones(inputs.size)
    counts[: known_from(inputs, low, high, outputs)] = 0.0
    return Record(inputs, outputs, counts, start_of(inputs, low, high))


def estimated_start(
    operator: Preisach | Dual, records: Sequence[tuple[FloatArray, FloatArray]]
) -> tuple[State | None, str]:
    """Return the state from which records, pairs of input and output (n,), are followed, and its name.

    Records that never reach an end of the operator's range leave open what came before them. Tried are both
    saturations and the demagnetised state; the one with the least sum of squared errors is taken.
    """
    low, high = operator.low, operator.high
    if any(reaches_an_end(u, low, high) for u, _ in records):
        return None, "known"
    states = {
        "negative saturation": negative_saturation(low),
        "demagnetised": demagnetised(low, high),
        "positive saturation": positive_saturation(low, high),
    }
    left = {
        name: sum(
            float(np.sum((operator(u, state) - y)[known_from(u, low, high) :] ** 2)) for u, y in records
        )
        for name, state in states.items()
    }
    best = min(left, key=left.__getitem__)
    return states[best], f"{best}, estimated"
