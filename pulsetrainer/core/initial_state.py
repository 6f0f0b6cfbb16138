"""The state before a record: how it is assumed or estimated, and from which sample it no longer matters.

A fit leaves out what comes before the memory is known (``record_of``). A prediction of a record that never
makes the memory known tries several states and takes the one that predicts best (``estimated_start``).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from pulsetrainer.core.dual import Dual
from pulsetrainer.core.memory import State, demagnetised, negative_saturation, positive_saturation
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import BoolArray, FloatArray, IntArray
from pulsetrainer.core.record import Record

NEAR = 0.01  # of the range: a noisy record touches its extreme only once, late
_LATE = 0.5  # of the samples: an end that is reached later than that costs more than it tells, where ...
_ALMOST = 0.1  # ... an end was almost reached before, to within so much of the range
_APART = 0.005  # of the output's span: a first stroke that runs so far from the later ones is another ...
_TIMES = 2.0  # ... if these run nearer to each other by this factor
_MET = 0.5  # of how far they lie apart: strokes that differ by no more at the other end have met there
_LEFT = 2.0  # times ``NEAR``: so far away the end is left, for noise crosses a single limit again and again
_CLOSING = 0.02  # of the output's span: a first stroke with one later one must begin so far apart
_COMPARED = 0.2  # of the range: shorter strokes are not compared ...
_PLACES = 20  # ... nor those of fewer samples; and at so many places
_THIRDS = 3  # of a stroke: the first and the last are compared
_FEWEST = 2  # strokes that should be alike: one alone says nothing of how alike


def known_from(inputs: FloatArray, low: float, high: float, outputs: FloatArray | None = None) -> int:
    """First sample (n,) at which the memory is known, whatever came before the record.

    Where the input reaches an end of [low, high], every remembered extreme is wiped out. Reached means within
    ``NEAR`` of the range. An input that never gets there is known, up to a constant, from where it first
    reaches an end of its own range: see ``start_of``.

    A device that begins at an end may never have come there: then its first stroke differs from all later
    ones from that end, which wiping-out makes alike (Mayergoyz 2003, section 1.2). With the ``outputs`` (n,)
    this is seen, and the memory is known from where it next reaches an end. The same goes for an end of the
    input's own range, where what lies beyond may be switched by the first stroke alone.
    """
    ends = near_ends(inputs, low, high)
    begin = int(ends[0]) if ends.size else first_extreme(inputs)[0]
    if outputs is None or (ends.size and begin > 0):
        return begin
    return begin + _past_a_first_stroke(inputs[begin:], outputs[begin:], *_reached(inputs, low, high))


def _reached(inputs: FloatArray, low: float, high: float) -> tuple[float, float]:
    """Ends between which strokes run: where an input (n,) never comes near one, it turns before it.

    What lies beyond is never switched, and adds a constant.
    """
    near, bottom, top = NEAR * (high - low), float(inputs.min()), float(inputs.max())
    return bottom if bottom > low + near else low, top if top < high - near else high


def counts_from(inputs: FloatArray, low: float, high: float, outputs: FloatArray | None = None) -> int:
    """First sample (n,) that a fit counts: where the memory is known, or nearly so where that is late.

    An input that reaches an end late but came almost as near before counts from there: a drift moves the
    extremes of an output, which the dual form takes for its input. Only what lies between the two stays open.
    """
    known = known_from(inputs, low, high, outputs)
    if known < _LATE * inputs.size:
        return known
    away = np.minimum(inputs - low, high - inputs)[: round(_LATE * inputs.size)]
    nearest, reach = float(away.min()), high - low
    return int(np.argmax(away <= nearest + NEAR * reach)) if nearest <= _ALMOST * reach else known


def first_stroke_words(inputs: FloatArray, outputs: FloatArray, low: float, high: float) -> str:
    """Say what of a record (n,) is left out as it lies apart from all later strokes; empty: nothing."""
    left = known_from(inputs, low, high, outputs) - known_from(inputs, low, high)
    return left_out_words(left) if left > 0 else ""


def left_out_words(samples: int) -> str:
    """Say that a first stroke of so many samples is left out."""
    why = "it differs from all later ones, like that of a device that was never cycled before"
    return f"the first stroke ({samples} samples) is left out: {why}"


def _past_a_first_stroke(inputs: FloatArray, outputs: FloatArray, low: float, high: float) -> int:
    """First sample that counts of a record that begins at an end: 0, or the next end after a stroke apart."""
    away, back, reach = _from_its_end(inputs, low, high)
    all_strokes = _strokes(away, outputs, reach)
    first, later = all_strokes[:1], [one for one in all_strokes[1:] if _told(one, reach)]
    others = [one for one in _strokes(back, outputs, reach) if _told(one, reach)]
    if not (first and _told(first[0], reach) and later):
        return 0
    differs = _is_apart(first + later, later if len(later) > 1 else others, float(np.ptp(outputs)), reach)
    return _second_stroke(away, back, reach) if differs else 0


def _is_apart(
    strokes: Sequence[tuple[FloatArray, FloatArray]],
    known: Sequence[tuple[FloatArray, FloatArray]],
    span: float,
    reach: float,
) -> bool:
    """Whether the first of the strokes from one end differs from the later ones, as no drift or step does.

    How far apart strokes lie that should be alike is read off the ``known`` ones: the later ones from the
    same end; where there is but one, those from the other end. At the other end all memory is wiped out: what
    still differs there is no matter of what came before. Where too few are known, strokes must begin far
    apart, and come together on the way.
    """
    own, *usual = _side_by_side(strokes, reach)
    gap = own - np.median(usual, axis=0)
    if len(known) < _FEWEST:
        begins, ends = (abs(float(np.mean(part))) for part in np.array_split(gap, _THIRDS)[:: _THIRDS - 1])
        return begins > _CLOSING * span and ends <= _MET * begins
    apart = root_mean_square(gap)
    beside = _side_by_side(known, reach)
    alike = max(root_mean_square(one - np.median(beside, axis=0)) for one in beside)
    if apart <= max(_APART * span, _TIMES * alike):
        return False
    return _apart_at_the_far_end(strokes, reach) <= _MET * apart  # a step, heat or creep would still differ


def second_stroke(inputs: FloatArray, low: float, high: float) -> int:
    """First sample (n,) at an end of [low, high] again, after the first stroke from one; 0 for none."""
    begin = known_from(inputs, low, high)
    away, back, reach = _from_its_end(inputs[begin:], *_reached(inputs, low, high))
    second = _second_stroke(away, back, reach)
    return begin + second if second else 0


def _from_its_end(inputs: FloatArray, low: float, high: float) -> tuple[FloatArray, FloatArray, float]:
    """How far an input (n,) is from the end that it begins at, and from the other; how far they are apart."""
    away, back = inputs - low, high - inputs
    return (away, back, high - low) if away[0] <= back[0] else (back, away, high - low)


def _second_stroke(away: FloatArray, back: FloatArray, reach: float) -> int:
    """Where the second stroke begins at the latest; 0 where there is none."""
    at_end = _at_end(away, NEAR * reach)
    left = np.flatnonzero(at_end[:-1] & ~at_end[1:])
    ends = np.flatnonzero((at_end | (back <= NEAR * reach))[left[0] + 1 :]) if left.size else left
    return int(left[0]) + 1 + int(ends[0]) if ends.size else 0


def _apart_at_the_far_end(strokes: Sequence[tuple[FloatArray, FloatArray]], reach: float) -> float:
    """How far from the later strokes the first one ends, at the other end; 0 where it does not get there."""
    ends = [
        float(np.mean(y[way >= (1.0 - _LEFT * NEAR) * reach])) if way[-1] >= (1.0 - NEAR) * reach else np.nan
        for way, y in strokes
    ]
    apart = np.abs(ends[0] - np.asarray(ends[1:]))
    return float(np.median(apart[np.isfinite(apart)])) if np.isfinite(apart).any() else 0.0


def _strokes(away: FloatArray, outputs: FloatArray, reach: float) -> list[tuple[FloatArray, FloatArray]]:
    """Strokes of an input that lies so far ``away`` (n,) from an end, from each time that it leaves it."""
    at_end = _at_end(away, NEAR * reach)
    leaves = np.flatnonzero(at_end[:-1] & ~at_end[1:])
    return [
        _stroke(away[at:until], outputs[at:until], reach)
        for at, until in pairwise([*leaves.tolist(), away.size])
    ]


def _told(stroke: tuple[FloatArray, FloatArray], reach: float) -> bool:
    """Whether a stroke is long enough to be compared."""
    way, _ = stroke
    return way.size >= _PLACES and float(way[-1]) >= _COMPARED * reach


def _side_by_side(strokes: Sequence[tuple[FloatArray, FloatArray]], reach: float) -> FloatArray:
    """Outputs (k, places) of strokes at the same places, as far as the shortest goes."""
    top = min(float(way[-1]) for way, _ in strokes)
    places = np.linspace(_LEFT * NEAR * reach, top, _PLACES)
    return np.stack([np.interp(places, way, y) for way, y in strokes])


def _at_end(away: FloatArray, near: float) -> BoolArray:
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
    at = int(near_ends(inputs, bottom, top)[0])
    return at, bool(inputs[at] >= top - NEAR * (top - bottom))


def reaches_an_end(inputs: FloatArray, low: float, high: float) -> bool:
    """Tell whether an input (n,) comes ``NEAR`` an end of [low, high], so that its memory becomes known."""
    return near_ends(inputs, low, high).size > 0


def near_ends(inputs: FloatArray, low: float, high: float) -> IntArray:
    """Samples (k,) at which an input (n,) is ``NEAR`` an end of [low, high]."""
    near = NEAR * (high - low)
    return np.flatnonzero((inputs <= low + near) | (inputs >= high - near))


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
    """Return measured input and output (n,) as a record to fit, which ``counts_from`` some sample on.

    ArgumentError where there are too few samples, or NaN or infinity.
    """
    counts = np.ones(inputs.size)
    counts[: counts_from(inputs, low, high, outputs)] = 0.0
    return Record(inputs, outputs, counts, start_of(inputs, low, high))


def estimated_start(
    operator: Preisach | Dual, records: Sequence[Record], ends: tuple[float, float] | None = None
) -> tuple[State | None, str]:
    """Return the state from which records are followed, whatever ``start`` they have, and its name.

    Records that never reach one of the ``ends`` (None: those of the operator's range) leave open what came
    before them. Tried are both saturations and the demagnetised state; the one with the least sum of squared
    errors is taken.
    """
    low, high = operator.low, operator.high
    if any(reaches_an_end(r.input, *(ends or (low, high))) for r in records):
        return None, "known"
    states = {
        "negative saturation": negative_saturation(low),
        "demagnetised": demagnetised(low, high),
        "positive saturation": positive_saturation(low, high),
    }
    left = {name: sum(_squares(operator, r, state) for r in records) for name, state in states.items()}
    best = min(left, key=left.__getitem__)
    return states[best], f"{best}, estimated"


def _squares(operator: Preisach | Dual, record: Record, state: State) -> float:
    """Weighted sum of squared errors from a state."""
    return float(record.sample_weight @ (operator(record.input, state) - record.fitted_output) ** 2)
