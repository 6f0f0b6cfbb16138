"""Inversion: from a wanted output to the input that gives it.

On a monotone branch the output is a continuous, rising, piecewise linear function of the input, so its
inverse is interpolation between a few dozen points. The memory of the wanted output has the same
extremes as the memory of the input, so one trace of the target tells every branch. That is
``invert``, and ``InverseStream`` is the same sample by sample.

``closest_match`` is the method of the original device: step the input level by level until the output is
nearest (Tan, Venkataraman, Krishnaprasad 2001; Tan, Baras, Krishnaprasad 2005); ``smoothed`` is the
spline that takes its steps off.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import UnivariateSpline

from pulsetrainer.core.memory import State, negative_saturation, trace, trace_after
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, finite_vector
from pulsetrainer.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class Inverse:
    """The input that gives the target, and what could not be reached."""

    input: FloatArray  # (n,) input unit
    clipped: int  # targets outside the reachable range, moved to its end
    worst_clip: float  # farthest such target, output unit
    final: State  # memory after the last sample


def _branch(operator: Preisach, origin: float, *, rising: bool) -> tuple[FloatArray, FloatArray]:
    """Inputs and outputs (k,) along the branch that leaves the turning point ``origin``.

    Outputs are those of polarity 1 relative to the turning point; both arrays run away from it. The
    points are the turning point and all levels beyond it, between which the branch is linear.
    """
    plane, grid = operator.plane, operator.grid
    band, fraction = plane.bands(np.asarray([origin]))
    k, t = int(band[0]), float(fraction[0])
    if rising:
        rise = (1.0 - t) * grid[k + 1 :, k] + t * grid[k + 1 :, k + 1]
        return np.append(origin, plane.levels[k + 1 :]), np.append(0.0, 2.0 * rise)
    fall = ((1.0 - t) * grid[k, : k + 1] + t * grid[k + 1, : k + 1])[::-1]
    return np.append(origin, plane.levels[k::-1]), np.append(0.0, -2.0 * fall)


def _on_branch(inputs: FloatArray, outputs: FloatArray, wanted: FloatArray) -> FloatArray:
    """Inputs (n,) at which a branch reaches ``wanted`` (n,); on a flat part the end nearest to the turn.

    ``outputs`` runs away from its first value, rising or falling.
    """
    if outputs[-1] < outputs[0]:
        outputs, wanted = -outputs, -wanted
    k = np.clip(np.searchsorted(outputs, wanted, side="left"), 1, outputs.size - 1)
    before, after = outputs[k - 1], outputs[k]
    gap = after - before
    share = np.divide(wanted - before, gap, out=np.zeros_like(wanted), where=gap > 0)
    return inputs[k - 1] + np.clip(share, 0.0, 1.0) * (inputs[k] - inputs[k - 1])


def invert(operator: Preisach, target: ArrayLike, start: State | None = None) -> Inverse:
    """Return the input whose output is ``target`` (n,), exactly, from ``start``.

    Targets outside the reachable range are clipped to it and counted. Where cells have no weight the
    output does not answer: the input stays where it was until the target moves on, then crosses at once.

    Raises
    ------
    ArgumentError
        The target is not a finite vector, the operator uses the relay reading (its output is a
        staircase: use ``closest_match``), or all its weights are zero.
    """
    wanted = finite_vector("target", target)
    _check_invertible(operator)
    state = start or negative_saturation(operator.plane.low)
    clipped, worst, y = _into_reach(operator, wanted)
    # the memory in terms of outputs: what the operator gives at each remembered extreme
    heights = np.asarray(_heights(operator, state))
    path = trace_after(heights, y, -operator.total, operator.total)
    value = np.empty(path.node_value.size)
    value[0] = operator.plane.low
    branches: dict[int, tuple[FloatArray, FloatArray]] = {}

    def branch(node: int, *, rising: bool) -> tuple[FloatArray, FloatArray]:
        if node not in branches:  # all branches of a turning point leave it in one direction
            inputs, rise = _branch(operator, float(value[node]), rising=rising)
            branches[node] = inputs, path.node_value[node] + rise
        return branches[node]

    for node in range(1, value.size):
        parent = int(path.parent[node])
        height = path.node_value[node]
        inputs, outputs = branch(parent, rising=bool(height > path.node_value[parent]))
        value[node] = _on_branch(inputs, outputs, np.asarray([height]))[0]
    u = value[path.anchor]  # samples that rest on a turning point
    moving = np.flatnonzero(path.value != path.node_value[path.anchor])
    cuts = np.flatnonzero(np.diff(path.anchor[moving])) + 1
    for piece in np.split(moving, cuts) if moving.size else []:
        node = int(path.anchor[piece[0]])
        inputs, outputs = branch(node, rising=bool(path.value[piece[0]] > path.node_value[node]))
        u[piece] = _on_branch(inputs, outputs, path.value[piece])
    # heights that differ by rounding alone may stand for one input: the trace merges them
    final = trace_after(np.asarray(_inputs_of(operator, path.final)), u[-1:], *_range(operator)).final
    return Inverse(u, clipped, worst, final)


def _range(operator: Preisach) -> tuple[float, float]:
    return operator.plane.low, operator.plane.high


def _check_invertible(operator: Preisach) -> None:
    if operator.reading != "continuous":
        raise ArgumentError(
            "the relay reading has no continuous inverse: its output is a staircase",
            hint="use closest_match, or read the weights as continuous",
        )
    if operator.total <= 0:
        raise ArgumentError(
            "a model whose weights are all zero cannot be inverted", hint="identify it on a run that moves"
        )


def _into_reach(operator: Preisach, wanted: FloatArray) -> tuple[int, float, FloatArray]:
    """Count the targets out of reach and return all of them as outputs of polarity 1 without offset."""
    y = operator.polarity * (wanted - operator.offset)
    slack = 1e-9 * operator.total  # rounding of a target that was computed from the range itself
    beyond = np.abs(y) - operator.total
    return (
        int(np.sum(beyond > slack)),
        float(max(beyond.max(), 0.0)),
        np.clip(y, -operator.total, operator.total),
    )


def _heights(operator: Preisach, state: State) -> list[float]:
    """Outputs (polarity 1, no offset) at the remembered extremes of a state."""
    extremes = np.clip(state.extremes, *_range(operator))
    extremes[0] = operator.plane.low
    rise = operator.step(extremes[1:], extremes[:-1]) if extremes.size > 1 else np.zeros(0)
    return (-operator.total + np.append(0.0, np.cumsum(rise))).tolist()


def _inputs_of(operator: Preisach, state: State) -> list[float]:
    """Inputs at the remembered extremes of a memory given as outputs: the inverse of ``_heights``."""
    inputs = [operator.plane.low]
    for before, height in zip(state.extremes, state.extremes[1:], strict=False):
        along, rise = _branch(operator, inputs[-1], rising=height > before)
        inputs.append(float(_on_branch(along, before + rise, np.asarray([height]))[0]))
    return inputs


@dataclass
class InverseStream:
    """The exact inverse one sample at a time, with the same result as ``invert``.

    The stack holds (output, input, branch) of every remembered turning point; each call costs one
    interpolation, plus what the memory pushes or wipes out.
    """

    operator: Preisach
    start: State | None = None
    clipped: int = 0
    _stack: list[tuple[float, float, tuple[FloatArray, FloatArray] | None]] = field(default_factory=list)

    def __post_init__(self) -> None:
        _check_invertible(self.operator)
        state = self.start or negative_saturation(self.operator.plane.low)
        past = np.asarray(_heights(self.operator, state))
        # extremes between which no relay has weight give equal outputs: the trace leaves them out
        memory = trace_after(past, past[-1:], -self.operator.total, self.operator.total).final
        inputs = _inputs_of(self.operator, memory)
        self._stack = [(h, u, None) for h, u in zip(memory.extremes, inputs, strict=True)]

    def step(self, target: float) -> float:
        """Return the input for the next target.

        Raises
        ------
        ArgumentError
            The target is not finite.
        """
        outside, _, wanted = _into_reach(self.operator, finite_vector("target", [target]))
        self.clipped += outside
        height, stack = float(wanted[0]), self._stack
        if (
            len(stack) > 1
            and (height > stack[-1][0]) == (stack[-1][0] > stack[-2][0])
            and height != stack[-1][0]
        ):
            stack.pop()  # going on in the same direction: the present value was no turning point
        rising = height > stack[-1][0]
        while len(stack) > 1 and ((height >= stack[-2][0]) if rising else (height <= stack[-2][0])):
            if height == stack[-1][0]:
                break
            del stack[-2 if len(stack) > 2 else -1 :]
        if height == stack[-1][0]:
            return stack[-1][1]
        origin, value, branch = stack[-1]
        if branch is None:
            along, rise = _branch(self.operator, value, rising=rising)
            branch = along, origin + rise
            stack[-1] = origin, value, branch
        u = float(_on_branch(*branch, np.asarray([height]))[0])
        stack.append((height, u, None))
        return u


def closest_match(operator: Preisach, target: ArrayLike, start: State | None = None) -> Inverse:
    """Return the input levels (n,) whose relay output is nearest to each target (n,) in turn.

    From the present level and memory: while the output is below the target step up one level, keeping
    the memory before the step; at the target, or at saturation, keep the nearer of the last two
    (Tan, Baras, Krishnaprasad 2005, section 4). Mirrored when the output is above the target.

    Raises
    ------
    ArgumentError
        The target is not a finite vector.
    """
    wanted = finite_vector("target", target)
    clipped, worst, y = _into_reach(operator, wanted)
    grid, levels, top = operator.grid, operator.plane.levels, operator.plane.n_h
    state = start or negative_saturation(operator.plane.low)
    rounded = operator.plane.round_to_nodes(np.asarray(state.extremes))
    settled = trace(rounded, negative_saturation(levels[0]), levels[0], levels[-1]).final
    memory = _LevelMemory(grid, [int(k) for k in np.searchsorted(levels, settled.extremes)])
    chosen = np.empty(y.size, dtype=np.int64)
    for n, goal in enumerate(y.tolist()):
        direction = 1 if memory.output < goal else -1
        before = memory
        while direction * (goal - memory.output) > 0 and 0 <= memory.level + direction <= top:
            before, memory = memory, memory.moved(direction)
        if abs(before.output - goal) < abs(memory.output - goal):
            memory = before
        chosen[n] = memory.level
    final = State(tuple(levels[memory.extremes].tolist()))
    return Inverse(levels[chosen], clipped, worst, final)


class _LevelMemory:
    """A relay memory in whole levels: remembered extremes and the output they give."""

    __slots__ = ("extremes", "grid", "output")

    def __init__(self, grid: FloatArray, extremes: list[int], output: float | None = None) -> None:
        self.grid, self.extremes = grid, extremes
        self.output = self._sum() if output is None else output

    @property
    def level(self) -> int:
        return self.extremes[-1]

    def _sum(self) -> float:
        y = -float(self.grid[-1, 0])
        for a, b in zip(self.extremes, self.extremes[1:], strict=False):
            y += 2.0 * float(self.grid[b, a] - self.grid[a, b])  # one of the two is zero
        return y

    def moved(self, direction: int) -> _LevelMemory:
        """Return the memory after one level up or down."""
        stack = list(self.extremes)
        level = stack[-1] + direction
        if len(stack) > 1 and (stack[-1] - stack[-2]) * direction > 0:
            stack.pop()
        while len(stack) > 1 and (level - stack[-2]) * direction >= 0:
            del stack[-2 if len(stack) > 2 else -1 :]
        if level != stack[-1]:
            stack.append(level)
        return _LevelMemory(self.grid, stack)


def smoothed(inputs: FloatArray, time_s: FloatArray, step: float, low: float, high: float) -> FloatArray:
    """Return a staircase of levels ``step`` apart as a cubic smoothing spline, kept within [low, high].

    The spline may differ from the staircase by the rounding error of the levels and no more: its
    residual is allowed the variance of a uniform error, step^2 / 12 per sample.

    Raises
    ------
    ArgumentError
        Fewer than five samples, or time does not increase.
    """
    if inputs.size < 5 or not np.all(np.diff(time_s) > 0):
        raise ArgumentError(
            f"a smoothing spline needs at least 5 samples in increasing time, got {inputs.size}",
            hint="use a longer waveform",
        )
    spline = UnivariateSpline(time_s, inputs, k=3, s=inputs.size * step**2 / 12.0)
    return np.clip(spline(time_s), low, high)


def slew_limited(inputs: FloatArray, rate_Hz: float, slew: float) -> FloatArray:
    """Nearest input (n,) that moves at most ``slew`` input units per second: jumps become ramps.

    Where cells have no weight the exact inverse jumps, and a coil cannot. The mean of the highest
    path below the input and the lowest path above it, both with that slope (McShane 1934), starts a ramp as
    long before a jump as it ends after it, so nothing is delayed.

    Raises
    ------
    ArgumentError
        ``slew`` or ``rate_Hz`` is not positive.
    """
    if not (slew > 0 and rate_Hz > 0):
        raise ArgumentError(
            f"slew and rate must be positive, got {slew:g} and {rate_Hz:g}", hint="30 A/s suits the solenoid"
        )
    u = finite_vector("inputs", inputs)
    ramp = np.arange(u.size) * (slew / rate_Hz)

    def highest_below(path: FloatArray) -> FloatArray:
        left = np.minimum.accumulate(path - ramp) + ramp
        return np.minimum(left, np.minimum.accumulate((path + ramp)[::-1])[::-1] - ramp)

    return 0.5 * (highest_below(u) - highest_below(-u))
