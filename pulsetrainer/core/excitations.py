"""Excitations: references that make an actuator show its hysteresis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.core.memory import turning_points
from pulsetrainer.core.plane import FloatArray, Plane, ascending, finite_vector, positive
from pulsetrainer.errors import ArgumentError

MOST_SAMPLES = 100_000_000  # of one signal: a day at 1 kHz

_USUAL_SPEED = 0.75  # A/s: slow against the coil and the lag of the force
_DUST = 1e-12  # of the largest point: closer than this two points are one


@dataclass(frozen=True, slots=True)
class Signal:
    """A reference to be played: even samples at ``rate_Hz``."""

    value: FloatArray  # (n,) input unit
    rate_Hz: float
    name: str
    note: str = ""  # what a person should know of where it was read from

    @property
    def time_s(self) -> FloatArray:
        """Times of the samples (n,)."""
        return np.arange(self.value.size) / self.rate_Hz

    @property
    def reversals(self) -> int:
        """Number of times the signal turns."""
        return turning_points(self.value)[:-1].size


def check_size(times: int, samples: float, most: int = MOST_SAMPLES, what: str = "repeats") -> None:
    """Raise ArgumentError where these ``samples`` so many ``times``, by ``what``, are more than ``most``."""
    if times > most or not times * samples <= most:  # either may be beyond every float
        raise ArgumentError(
            f"`{what}` {str(times)[:20]} times {samples:.6g} samples are too many, expected at most {most:,}",
            hint=f"give at most `{what}` {int(most // samples)}"
            if 0 < samples <= most
            else "give fewer, or shorter ones",
        )


def through(points: ArrayLike, speed: float, rate_Hz: float) -> FloatArray:
    """Samples (n,) of a path that visits ``points`` (k,) in turn at constant ``speed``, input units a second.

        n = ceil(sum |p_(i+1) - p_i| / speed * rate) + 1, more where turns are less than a sample apart

    Each point lies on the nearest sample, each turn on one of its own, so that none is cut short.

    ArgumentError for no points, one that is not finite, a speed or rate that is not positive, or such that
    the path has more than ``MOST_SAMPLES``.
    """
    points = finite_vector("points", points)
    positive(speed=speed, rate=rate_Hz)
    with np.errstate(over="ignore"):
        distance = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(points)))))
        steps = float(distance[-1] / speed * rate_Hz)
    if not steps <= MOST_SAMPLES or not np.isfinite(speed / rate_Hz):
        raise ArgumentError(
            f"at {speed:g} A/s (`speed_A_per_s`) the signal would last {distance[-1] / speed:.3g} s and have "
            f"{steps:.3g} samples, expected at most {MOST_SAMPLES:.3g}",
            hint=f"give a higher `speed_A_per_s` ({_USUAL_SPEED:g} is usual), a lower `rate_Hz`, or a lower "
            "`current_max_A`",
        )
    # a turn between two samples would be cut short: put it on the nearest sample, each turn on one of its own
    apart = np.abs(np.diff(points)) > _DUST * np.abs(points).max()
    turn = np.concatenate(([0], np.cumsum(apart)))
    nearest = np.round(distance / speed * rate_Hz).astype(np.int64)
    at = np.maximum.accumulate(nearest - turn) + turn
    path = np.interp(
        np.arange(max(int(np.ceil(steps)), int(at[-1])) + 1) * (speed / rate_Hz), distance, points
    )
    path[at] = points
    return path


def identification(low: float, high: float, *, n_h: int, speed: float, rate_Hz: float) -> Signal:
    """First-order reversal curves from the top of the range to every level of an ``n_h``-level plane.

    low -> high -> L_n-1 -> high -> L_n-2 -> ... -> L_0: every relay of the plane is switched on and off,
    each by a curve of its own, which fixes the Everett function at every node (Mayergoyz 2003, section
    1.3). The signal has 2 n_h reversals, visits the finest loops first, and begins and ends at ``low``.
    ``speed`` is in input units a second: slow against the actuator's own dynamics.

    ArgumentError if the range is empty, for fewer than 2 levels, a speed or rate that is not positive, or a
    step from one sample to the next that is wider than the range.
    """
    edges = Plane.uniform(low, high, n_h).edges
    step = speed / rate_Hz if rate_Hz > 0 else 0.0
    slower = f"a lower `speed_A_per_s` ({_USUAL_SPEED:g} is usual), or "
    _check_step(step, high - low, slower, f", at {speed:g} A/s (`speed_A_per_s`)")
    bottoms = edges[-2::-1]
    turns = np.empty(2 * n_h + 1)
    turns[0], turns[1::2], turns[2::2] = low, high, bottoms
    return Signal(through(turns, speed, rate_Hz), rate_Hz, "identification")


def _check_step(step: float, reach: float, slower: str, said: str = "") -> None:
    """Raise ArgumentError where the signal would jump over its whole range (``reach``) between samples."""
    if step > reach:
        raise ArgumentError(
            f"between two samples the signal would move by {step:.3g} A, more than its whole range of "
            f"{reach:.3g} A{said}",
            hint=f"give {slower}a higher `rate_Hz`",
        )


def conditioning(low: float, high: float, *, speed: float, rate_Hz: float, rest_s: float) -> FloatArray:
    """Samples (n,) of one major loop low -> high -> low and a rest: it leaves a known memory behind.

    At ``high`` every relay is up, back at ``low`` every relay is down, whatever came before (wiping out,
    Mayergoyz 2003, section 1.2). ``low``, ``high`` and the samples share a unit, ``speed`` is that a second.

    ArgumentError for an empty range, a speed or rate that is not positive, or a negative rest.
    """
    ascending(low, high)
    if not rest_s >= 0:
        raise ArgumentError(
            f"rest must not be negative, got {rest_s:g} s", hint="one second suits the solenoid"
        )
    loop = through(np.asarray([low, high, low]), speed, rate_Hz)
    return np.concatenate((loop, np.full(round(rest_s * rate_Hz), low)))


# Speeds of the diagnostic signal in ranges per second: 14 to 1, so that what grows with rate shows.
_RATES = (0.7, 2.0, 5.0, 10.0)
# The order in which the rates come: not monotone, so that rate and time cannot be taken for one another.
_ORDER = (2, 0, 3, 1, 3, 2, 1, 0, 2, 3)
# Two lists of turning points in shares of the range: nested loops towards the middle, and reversal curves
# from both ends; each begins and ends at the bottom.
_LISTS = (
    (0.0, 0.92, 0.12, 0.81, 0.22, 0.70, 0.33, 0.60, 0.43, 0.54, 0.0),
    (0.0, 1.0, 0.62, 1.0, 0.35, 0.75, 0.0, 0.38, 0.0, 0.55, 0.18, 0.0),
)
_CURVE_RATES = (1, 2, 3, 1, 2, 3, 1, 2, 3, 2)
_HOLD_LEVELS = (0.8, 0.3, 0.6, 0.45, 0.9, 0.2, 0.7, 1.0, 0.0, 0.5)
_HOLD_S = (1.2, 1.2, 2.4, 1.2, 1.2, 2.4, 1.2, 6.0, 6.0, 0.8)
# Equal minor loops, each from two histories: wide enough that a shift of the input shows in their shape.
_BIASES = (0.1, 0.22, 0.34, 0.46)
_LOOP_WIDTH = 0.2
_LOOP_CYCLES = 4
_BIAS_BLOCKS = (3, 7)
_BIAS_RATE = 4.0  # 50 samples each way at 1 kHz: a whole number, so that the loops are equal to the sample
_LOOP_RATE = 2.0  # of the reference loops and of the way to a hold


def diagnostic(low: float, high: float, *, rate_Hz: float) -> Signal:
    """Ninety seconds in which the causes of a model's error look different from one another.

    Ten blocks; each starts with the same major loop (a reference that repeats, and wipes the memory out),
    then plays one of two lists of reversals at one of four rates spanning 14 to 1, in an order that is
    not sorted, then holds: on the way up in even blocks, on the way down in odd ones. In between come
    equal minor loops at four biases reached from below and from above, and twenty equal cycles at two
    rates. Two late holds are a heating at the top and a rest at the bottom. Parts of reversal curves
    between all these fill the plane, so that the weights can be fitted together with a cause.

    The signal begins and ends at ``low``. ArgumentError if the range is empty, or the rate is not positive,
    or so low that a stroke has no sample.
    """
    ascending(low, high)
    positive(rate=rate_Hz)
    _check_step(max(_RATES) / rate_Hz * (high - low), high - low, "")
    parts: list[FloatArray] = []

    def go(points: tuple[float, ...], ranges_per_s: float) -> None:
        parts.append(through(np.asarray(points), ranges_per_s, rate_Hz)[1:])

    def hold(level: float, seconds: float) -> None:
        parts.append(np.full(round(seconds * rate_Hz), level))

    for block, rate in enumerate(_ORDER):
        go((0.0, 1.0, 0.0), _LOOP_RATE)
        go(_LISTS[block % 2], _RATES[rate])
        go(_curves(block), _RATES[_CURVE_RATES[block]])
        level = _HOLD_LEVELS[block]
        approach = (0.0, level) if block % 2 == 0 else (0.0, 1.0, level)
        if block in _BIAS_BLOCKS:
            _bias_loops(go)
        if block == 6:
            go((0.0, *(0.7, 0.3) * 20, 0.0), _RATES[2])
            go((0.0, *(0.7, 0.3) * 20, 0.0), _RATES[3])
        go(approach, _RATES[3] if block % 4 < 2 else _LOOP_RATE)
        hold(level, _HOLD_S[block])
        go((level, 0.0), _LOOP_RATE)
    value = np.concatenate((np.zeros(1), *parts))
    return Signal(low + (high - low) * value, rate_Hz, "diagnostic")


def _curves(block: int) -> tuple[float, ...]:
    """Turning points of some reversal curves, in shares of the range; the ten blocks interleave."""
    down = tuple((block + 0.5) / 10.0 * 0.2 + 0.2 * k for k in range(5))
    turns: list[float] = [0.0]
    for k, bottom in enumerate(down):
        turns += [1.0 if k % 2 == 0 else 0.96 - 0.03 * block, bottom]
    return (*turns, 0.0)


def _bias_loops(go: Callable[[tuple[float, ...], float], None]) -> None:
    """Equal minor loops around several biases, each entered by the same stroke from below and from above."""
    for bottom in _BIASES:
        top = bottom + _LOOP_WIDTH
        loops = (bottom, *(top, bottom) * (_LOOP_CYCLES), top)
        go((0.0, bottom), _RATES[3])
        go(loops, _BIAS_RATE)
        go((top, 1.0, bottom), _RATES[3])
        go(loops, _BIAS_RATE)
        go((top, 0.0), _RATES[3])
