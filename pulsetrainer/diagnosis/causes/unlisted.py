"""the output depends on something that is in no list: y + sum_j f_j(z_j), each z_j a state of the device.

For some parts the curve is added to the gain instead of the output: y + f_j(z_j) (y - y0), with y0 the output
of empty memory.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Values
from pulsetrainer.diagnosis.causes.frame import Frame

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.finding import Estimate

KNOTS = 8  # of each curve: even between the ends of the state; its first value is 0
_STILL = 0.004  # of the range: an input that stays within it rests
_BACK = 0.02  # of the range: a turn of the input is known once it has come back this far
_STEEPEST = 1.0  # of the span: a curve that exceeds this at a point has no samples there
_SMALL_CHANGE = 1e-4  # of the span: steps of the derivatives, of the curve ...
_SMALL_TIME_S = 1e-3  # ... and of a time constant
_CONSTANTS = 3  # constants of a part: its state, and the two ends of its curve


@dataclass(frozen=True)
class State:
    """One kind of state: its unit, its words, and how it follows from the input and the output."""

    name: str
    unit: str
    words: str  # {tau}, {input} and {output} are put in
    at: Callable[[FloatArray, float, Frame, str], FloatArray]  # y, tau, frame, name of what it remembers
    saturates: bool = False  # 1 - exp(-time / tau) of the time that its words name


def _speed(x: FloatArray, frame: Frame, name: str) -> FloatArray:
    """Absolute rate (n,) of a signal."""
    before = frame.remembered(f"{name} last", x[:1])
    frame.remember(f"{name} last", x[-1:])
    return np.asarray(np.abs(np.diff(x, prepend=before)) / frame.dt_s)


def _above(frame: Frame) -> FloatArray:
    return frame.input - frame.low


def _since(event: FloatArray, frame: Frame, name: str) -> FloatArray:
    """Time (n,) since the last sample with an event (n,)."""
    start = float(frame.remembered(f"{name} since", np.full(1, np.inf))[0])
    place = np.arange(event.size)
    last = np.maximum.accumulate(np.where(event, place, -1))
    since = np.where(last >= 0, (place - last) * frame.dt_s, start + (place + 1) * frame.dt_s)
    frame.remember(f"{name} since", since[-1:])
    return np.asarray(since)


def _moves(frame: Frame) -> FloatArray:
    """Whether the input has left the band that it rested in, at each sample (n,)."""
    if "moves" in frame.kept:
        return frame.kept["moves"]
    at, width = float(frame.remembered("unlisted band", frame.input[:1])[0]), _STILL * frame.reach
    moved = []
    for value in frame.input.tolist():
        moves = abs(value - at) > width
        at = value if moves else at
        moved.append(moves)
    frame.remember("unlisted band", np.asarray([at]))
    return frame.kept.setdefault("moves", np.asarray(moved))


def _turns(frame: Frame) -> tuple[FloatArray, FloatArray]:
    """The last turn of the input (n,) above the low end, and whether there is a new one."""
    if "turns" in frame.kept:
        return frame.kept["turns"], frame.kept["turned"]
    width = _BACK * frame.reach
    first = frame.input[0]
    # as the memory begins: the input came down through all of its range, and then to the first sample
    before = [frame.low, first, 1.0] if first > frame.low + width else [frame.low + frame.reach, first, -1.0]
    turn, extreme, way = frame.remembered("unlisted turn", np.asarray(before)).tolist()
    turns, new = [], []
    for value in frame.input.tolist():
        back = (extreme - value) * way
        if back > width:
            turn, extreme, way = extreme, value, -way
        elif back < 0:
            extreme = value
        turns.append(turn)
        new.append(back > width)
    frame.remember("unlisted turn", np.asarray([turn, extreme, way]))
    frame.kept.update(turns=np.asarray(turns) - frame.low, turned=np.asarray(new))
    return frame.kept["turns"], frame.kept["turned"]


def _reverses(frame: Frame) -> FloatArray:
    """Whether the input moves the other way than when it last moved, at each sample (n,)."""
    before = frame.remembered("unlisted moved", np.append(frame.input[:1], 0.0))
    way = np.sign(np.diff(frame.input, prepend=before[0]))
    last = np.maximum.accumulate(np.where(way != 0.0, np.arange(way.size), -1))
    way = np.where(last >= 0, way[last], before[1])
    frame.remember("unlisted moved", np.append(frame.input[-1:], way[-1:]))
    return np.asarray(way != np.append(before[1], way[:-1]))


def _rate(x: FloatArray, tau: float, frame: Frame, name: str) -> FloatArray:
    return frame.low_pass(_speed(x, frame, name), tau, name)


def _change(x: FloatArray, tau: float, frame: Frame, name: str) -> FloatArray:
    return x - frame.low_pass(x, tau, name)


def _share(x: FloatArray, tau: float) -> FloatArray:
    return 1.0 - np.exp(-x / tau)


STATES: tuple[State, ...] = (
    State("input", "{u}", "the average {input} of the last {tau}",
          lambda _, s, f, n: f.low_pass(_above(f), s, n)),
    State("output", "{y}", "the average {output} of the last {tau}",
          lambda y, s, f, n: f.low_pass(y - f.zero, s, n)),
    State("input squared", "({u})^2",
          "the average square of the {input}, from its low end, of the last {tau}",
          lambda _, s, f, n: f.low_pass(_above(f) ** 2, s, n)),
    State("output squared", "({y})^2",
          "the average square of the {output}, from its lowest, of the last {tau}",
          lambda y, s, f, n: f.low_pass((y - f.zero) ** 2, s, n)),
    State("input rate", "{u}/s", "the average speed of the {input} in the last {tau}",
          lambda _, s, f, n: _rate(f.input, s, f, n)),
    State("output rate", "{y}/s", "the average speed of the {output} in the last {tau}",
          _rate),
    State("input change", "{u}", "the {input} less its average of the last {tau}",
          lambda _, s, f, n: _change(_above(f), s, f, n)),
    State("output change", "{y}", "the {output} less its average of the last {tau}",
          lambda y, s, f, n: _change(y - f.zero, s, f, n)),
    State("way", "{u}", "the distance of the {input} from its last turn, averaged over the last {tau}",
          lambda _, s, f, n: f.low_pass(np.abs(_above(f) - _turns(f)[0]), s, n)),
    State("turn", "{u}", "the {input} at its last turn, averaged over the last {tau}",
          lambda _, s, f, n: f.low_pass(_turns(f)[0], s, n)),
    State("since turn", "1", "the time since the last turn of the {input}",
          lambda _, s, f, n: _share(_since(_turns(f)[1], f, n), s), saturates=True),
    State("rest", "1", "the time that the {input} has rested",
          lambda _, s, f, n: _share(_since(_moves(f), f, n), s), saturates=True),
    # exact, where the one since a turn shrugs off noise
    State("since reversal", "1", "the time since the {input} last changed its direction",
          lambda _, s, f, n: _share(_since(_reverses(f), f, n), s), saturates=True),
)  # fmt: skip


@dataclass(frozen=True)
class Part:
    """One dependence: on which state, between which values the curve is drawn, and what it is added to."""

    state: int
    low: float
    high: float
    gain: bool = False

    @property
    def kind(self) -> State:
        """The kind of its state."""
        return STATES[self.state]

    def at(self, y: FloatArray, tau: float, frame: Frame, number: int = 0) -> FloatArray:
        """The state (n,) for the output ``y`` (n,) before this cause."""
        return self.kind.at(y, tau, frame, f"unlisted {number}")

    def columns(self, z: FloatArray) -> FloatArray:
        """Curves (n, KNOTS - 1) that are 1 at one knot and 0 at the others; constant beyond the ends."""
        return np.asarray(_curves()(self._share(z)))[:, 1:]

    def shown(self, y: FloatArray, z: FloatArray, zero: float, points: Sequence[float]) -> FloatArray:
        """What a curve through ``points`` (KNOTS - 1,) adds to ``y`` (n,): ``added @ points``, quicker."""
        curve = np.asarray(_through(np.append(0.0, points))(self._share(z)))
        return curve * (y - zero) if self.gain else curve

    def _share(self, z: FloatArray) -> FloatArray:
        return np.clip((z - self.low) / (self.high - self.low), 0.0, 1.0)

    def added(self, y: FloatArray, z: FloatArray, zero: float) -> FloatArray:
        """What points of the curve add (n, KNOTS - 1) to an output ``y`` (n,); ``zero`` is empty memory's."""
        columns = self.columns(z)
        return columns * (y - zero)[:, None] if self.gain else columns

    @property
    def coded(self) -> float:
        """Its state as a model keeps it: those of a gain count down from -1."""
        return float(-1 - self.state if self.gain else self.state)

    @classmethod
    def decoded(cls, code: float, low: float, high: float) -> Part:
        """The part that a model keeps as ``coded`` and the ends of its curve."""
        state = int(code)
        return cls(-1 - state, low, high, gain=True) if state < 0 else cls(state, low, high)


@cache
def _curves() -> scipy.interpolate.CubicSpline:
    return _through(np.eye(KNOTS))


def _through(values: FloatArray) -> scipy.interpolate.CubicSpline:
    return scipy.interpolate.CubicSpline(np.linspace(0.0, 1.0, KNOTS), values, bc_type="natural")


class Unlisted(Cause):
    """Learned curves over states of the device."""

    id = "unlisted"
    title = "the {output} also depends on something that is not in the list of causes"
    formula = (
        "y + f(z) or y + f(z) (y - y0), "
        "z a state (filtered input or output, their squares and rates, path, last turn, rest)"
    )
    signature = "a curve over one state that predicts blocks of time that were left out"
    excitation = "the state through its whole range, several times"
    source = "Hastie and Tibshirani, Generalized Additive Models, 1990, chapter 6"
    stage = "output"
    order = 110
    family = "unlisted"
    strengths = 0

    def __init__(self, parts: Sequence[Part] = ()) -> None:
        self.parts = tuple(parts)

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """A constant and the values of the curve, of each part."""
        longest = max(frame.length_s, 2.0 * frame.dt_s)
        tau = Quantity(
            "tau", "s", frame.dt_s, longest, _SMALL_TIME_S, "time over which the state is averaged"
        )
        return tuple(one for part in self.parts for one in (tau, *_points(part, frame)))

    def constants(self) -> tuple[tuple[str, float, str], ...]:
        return tuple(
            one
            for part in self.parts
            for one in (
                ("state", part.coded, "1"),
                ("low", part.low, part.kind.unit),
                ("high", part.high, part.kind.unit),
            )
        )

    def strengths_of(self, parameters: Sequence[Estimate]) -> Sequence[Estimate]:
        """Return none: weights and offset hold what all points have in common, so each of them may be zero.

        What a curve predicts says that it is there: without that it is not found.
        """
        return ()

    def sign(self, name: str, polarity: int) -> int:
        return polarity if name.startswith("f") else 1  # a curve that is added to the output

    def restored(self, values: Values) -> tuple[Cause, Values]:
        count = len(values) // (_CONSTANTS + KNOTS)
        kept = np.reshape(values[: _CONSTANTS * count], (count, _CONSTANTS))
        parts = [Part.decoded(*one) for one in kept.tolist()]
        return Unlisted(parts), values[_CONSTANTS * count :]

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """None: it is learned only when no listed cause explains what is left."""
        return []

    def shapes_strokes(self, values: Values, frames: Sequence[Frame]) -> bool:
        return any(all(one.is_within_stroke(tau) for one in frames) for tau in values[::KNOTS])

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        found = y
        for k, part in enumerate(self.parts):
            tau, *curve = values[k * KNOTS : (k + 1) * KNOTS]
            found = found + part.shown(y, part.at(y, tau, frame, k), frame.zero, curve)
        return found


def _points(part: Part, frame: Frame) -> tuple[Quantity, ...]:
    """The points of a curve: of the output, or of its gain."""
    name, unit, span, of = ("g", "1", 1.0, " of the gain") if part.gain else ("f", "{y}", frame.span, "")
    most, small = _STEEPEST * span, _SMALL_CHANGE * span
    return tuple(
        Quantity(f"{name}{k}", unit, -most, most, small, f"point of the curve{of}")
        for k in range(2, KNOTS + 1)
    )
