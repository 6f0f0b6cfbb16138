"""What a cause may know of a record besides the signal that passes it, and of the piece before."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import FloatArray

_NO_LAG = 1e-7  # of a time step: a shorter time constant is none
_WITHIN_STROKE = (0.02, 0.5)  # ranges that the input moves in a time: a level of the plane; a long stroke
_NO_PATH = 0.004  # of the range: smaller wiggles of the input are noise and no path
_NEAR = 0.02  # of a record: a change of rate so near to a moment is at that moment ...
_SIDE = 0.05  # ... if on so much of the record before and after it ...
_MOVES = 0.2  # ... of which the input moves in this share at least ...
_FASTER = 1.5  # ... it moves so many times as fast; ...
_LOOKS = 20  # ... looked for at so many places to either side
_STEPPED = 30.0  # time steps: to a longer lag it does not matter what is between two samples


@dataclass
class Past:
    """What the causes of a chain remember, by name: of the piece before, and as it is after this one.

    A chain that feeds its output back passes a piece several times: each time from ``before``, and the last
    time counts.
    """

    before: dict[str, FloatArray] = field(default_factory=dict)
    after: dict[str, FloatArray] = field(default_factory=dict)

    def next(self) -> Past:
        """Return what the piece that follows begins with."""
        return Past(before={**self.before, **self.after})


@dataclass(frozen=True)
class Frame:
    """What a cause may know of a record besides the signal that passes it."""

    dt_s: float
    input: FloatArray  # (n,) measured input
    span: float  # of the output, output unit
    reach: float  # range of the input, input unit
    record: int = 0  # which record of how many
    records: int = 1
    low: float = 0.0  # end of the input's range
    ends: tuple[float, float] = (0.0, 1.0)  # output at both ends of the input's range
    zero: float = 0.0  # output of the hysteresis where its memory is empty: gains are about it
    begin_s: float = 0.0  # since the first record began, as if they had been made one after another
    longest_s: float = 0.0  # of the records, the longest; 0: this one
    averaged: int = 1  # samples as measured, of which each of these is the mean
    past: Past | None = None  # what the causes remember of the piece before; None: there was none
    kept: dict[str, FloatArray] = field(default_factory=dict, repr=False, compare=False)  # of the input alone

    @property
    def length_s(self) -> float:
        """Length of the longest record."""
        return self.longest_s or self.input.size * self.dt_s

    @property
    def time_s(self) -> FloatArray:
        """Time since the first sample (n,)."""
        return np.asarray(np.arange(self.input.size) * self.dt_s, dtype=np.float64)

    @cached_property
    def path(self) -> FloatArray:
        """Length of the input's path at each sample (n,), wiggles of noise left out."""
        before = self.remembered("path", self.input[:1])
        turned = settled(self.input, _NO_PATH * self.reach, float(before[0]))
        self.remember("path", turned[-1:])
        return np.cumsum(np.abs(np.diff(turned, prepend=before[0])))

    def is_within_stroke(self, time_s: float) -> bool:
        """Whether the input moves, on average, by more than a level in such a time, but within one stroke."""
        ranges = float(self.path[-1]) / self.reach * time_s / (self.input.size * self.dt_s)
        return _WITHIN_STROKE[0] < ranges < _WITHIN_STROKE[1]

    def changes_rate(self, time_s: float) -> bool:
        """Whether the input moves at another speed after a time since its first sample than before it."""
        count, at = self.input.size, round(time_s / self.dt_s)
        near, side = round(_NEAR * count), round(_SIDE * count)
        speed = np.abs(np.diff(self.input))
        at_rest = _NO_PATH * self.reach * self.dt_s / self.length_s

        def usual(part: FloatArray) -> float:
            moving = part[part > at_rest]
            return float(np.median(moving)) if moving.size >= _MOVES * side else np.nan

        turns = range(max(at - near, side), min(at + near, count - side), max(near // _LOOKS, 1))
        pairs = ((usual(speed[k - side : k]), usual(speed[k : k + side])) for k in turns)
        return any(max(one, other) > _FASTER * min(one, other) for one, other in pairs)

    def shows_between(self, time_s: float) -> bool:
        """Whether what is between two samples matters to a time constant, s; averages do not show it."""
        return self.averaged == 1 and time_s <= _STEPPED * self.dt_s

    def about(self, zero: float) -> Frame:
        """Return the frame with another zero of the output; the path is followed once for all of them."""
        one = replace(self, zero=zero)
        one.__dict__["path"] = self.path
        return one

    @property
    def is_first(self) -> bool:
        """Whether nothing is remembered of a piece before."""
        return self.past is None or not self.past.before

    def remembered(self, name: str, at_first: FloatArray) -> FloatArray:
        """Return what the piece before kept under a name; ``at_first`` where there was none."""
        return at_first if self.past is None else self.past.before.get(name, at_first)

    def remember(self, name: str, values: FloatArray) -> None:
        """Keep something for the piece that follows."""
        if self.past is not None:
            self.past.after[name] = values

    def low_pass(self, x: FloatArray, tau_s: float, name: str, between: float = 0.0) -> FloatArray:
        """Return x (n,) behind a lag, going on from where the piece before, of the same name, ended."""
        last = self.remembered(f"lag {name}", np.repeat(x[:1], 2))
        filtered = low_pass(x, tau_s, self.dt_s, last, between)
        self.remember(f"lag {name}", np.asarray([x[-1], filtered[-1]]))
        return filtered


def low_pass(
    x: FloatArray, tau_s: float, dt_s: float, last: FloatArray | None = None, between: float = 0.0
) -> FloatArray:
    """Solve tau x' + x = input for an input that is straight between samples, from rest at x[0].

    ``last`` (2,) is the last input and output before, where it does not begin at rest. ``between`` is what
    the input is between two samples: 0 straight, 1 the later one, -1 the earlier one.

    Exact: y+ = a y + (1 - a) u + b (u+ - u) with a = exp(-dt/tau) and b = 1 - (tau/dt)(1 - a) of a straight
    input, 1 - a of one that is the later sample, 0 of one that is the earlier one.
    """
    if tau_s <= _NO_LAG * dt_s:
        return x
    a = np.exp(-dt_s / tau_s)
    slope = 1.0 - tau_s / dt_s * (1.0 - a)
    slope += max(between, 0.0) * (1.0 - a - slope) + min(between, 0.0) * slope
    b = np.asarray([slope, 1.0 - a - slope])
    # the filter's first step must see the first value as its past
    last_in, last_out = np.repeat(x[:1], 2) if last is None else last
    state = scipy.signal.lfiltic(b, np.asarray([1.0, -a]), y=[last_out], x=[last_in])
    return np.asarray(scipy.signal.lfilter(b, np.asarray([1.0, -a]), x, zi=state)[0])


def settled(values: FloatArray, width: float, at: float | None = None) -> FloatArray:
    """Path (n,) of a point dragged by ``values`` with play ``width``: wiggles smaller than it are no path."""
    at = float(values[0]) if at is None else at
    path = []
    for value in values.tolist():
        at = min(max(at, value - width), value + width)
        path.append(at)
    return np.asarray(path)
