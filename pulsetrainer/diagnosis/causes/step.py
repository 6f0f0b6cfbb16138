"""the offset or the gain changed suddenly: y + b + g (y - y0) after t0, y0 the output of empty memory.

It may have changed several times (`several_steps`): what each moment adds stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause, Quantity, Taken, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.evidence import sentences

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.finding import Estimate

_TRIED = 0.003  # of the span, and of the gain
_MOMENTS = (0.05, 0.95, 25)  # of the record: from, to, how many; nearer to an end no loops can be compared
_LOOP = 1.5  # ranges of path on either side: otherwise a first stroke would look like a step
_SIDE = 0.25  # of the whole path: neither side needs more than this
_BESIDE = 1.5  # distances between moments, on either side: a refit must begin near, as it moves little
_SHARED = 20.0  # samples that the change is spread over, so that the error varies smoothly with its time
_EDGE = 20  # parts of a window: splits in its first and last part are not tried
_LEAST = 4  # times such a part: a shorter window is split at its beginning


class Step(Cause):
    """A sudden change of offset and gain."""

    id = "step"
    title = "the offset or the gain changed suddenly"
    formula = "y + b + g (y - y0) after t0"
    signature = "all loops after one moment differ from those before by one gain and offset"
    excitation = "the same loop in every tenth of the record"
    source = "Basseville and Nikiforov, Detection of Abrupt Changes, 1993, chapter 2"
    stage = "output"
    order = 120
    family = "drift"
    drifts = True
    needs_time = False
    strengths = 2
    parameters = (
        Quantity(
            "offset",
            "{y}",
            -1e6,
            1e6,
            1e-4,
            "by which the {output} is higher from that time on, where it was {empty}",
        ),
        Quantity(
            "gain",
            "1",
            -0.9,
            0.9,
            1e-4,
            "change of the gain: away from {empty}, this share of the distance comes on top",
        ),
        Quantity("time", "s", 0.0, 1e6, 0.01, "at which it changed, since the first sample"),
    )
    moves_zero = True
    lasting = False
    corrects = True
    texts = sentences("""
        against given: relative to the model as given, the {output} moves by {moved:+.2g}{in_y} at one moment;
            apart from that, the model leaves {left:.2g}{in_y} (rms). Weights refitted to these recordings
            hide some of the step
        against given, nothing left: relative to the model as given, the {output} moves by {moved:+.2g}{in_y}
            at one moment; apart from that, the model leaves no more than noise. Weights refitted to these
            recordings hide some of the step
    """)

    def __init__(self, shared: float = _SHARED, count: int = 1) -> None:
        self._shared = shared
        self._count = count  # of moments
        self.sudden = count == 1  # else its last parameter says little
        self.by_pieces = count > 1  # a half may lack what lies between two moments

    def several(self, count: int) -> Cause:
        """The same at several moments."""
        return Step(self._shared, count)

    @staticmethod
    def each(values: Values) -> list[Values]:
        """Offset, gain and moment of each change."""
        per = len(Step.parameters)
        return [values[k : k + per] for k in range(0, len(values), per)]

    def quantities(self, frame: Frame) -> tuple[Quantity, ...]:
        """Return offset, gain and moment, then those of each later moment, by its number."""
        more = [replace(q, name=f"{q.name} {k}") for k in range(2, self._count + 1) for q in self.parameters]
        return (*self.parameters, *more)

    def strengths_of(self, parameters: Sequence[Estimate]) -> Sequence[Estimate]:
        """Return all but the moments."""
        return [one for one in parameters if not one.name.startswith("time")]

    @cached_property
    def sharp(self) -> Cause:
        """The same at one sample."""
        return Step(1.0)

    @property
    def wears_about(self) -> float:
        """What settles from the beginning looks like a step, about empty memory as that."""
        return 0.0

    def starts(self, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> list[list[Values]]:
        """Blocks of parameter values to try: the same moments, whatever the residual."""
        first, last = _sides(frames)
        return [self.at(t, frames) for t in np.linspace(first, last, _MOMENTS[2]).tolist()]

    def at(self, moment: float, frames: Sequence[Frame]) -> list[Values]:
        return [(_TRIED * frames[0].span, 0.0, moment), (0.0, _TRIED, moment)]

    def sharpened(self, values: Values, frames: Sequence[Frame], residual: Sequence[FloatArray]) -> Values:
        """Return the moment around that of ``values`` where the residual on both sides differs most."""
        one = max((f for f in frames if f.begin_s <= values[2]), key=lambda f: f.begin_s, default=frames[0])
        left = residual[one.record]
        first, last = _sides(frames)
        near = _BESIDE * (last - first) / (_MOMENTS[2] - 1)
        begin, end = (
            int(min(max((at - one.begin_s) / one.dt_s, 0.0), left.size))
            for at in (max(values[2] - near, first), min(values[2] + near, last))
        )
        split = _split(left, begin, end)
        return (*values[:2], one.begin_s + split * one.dt_s)

    def on_output(self, y: FloatArray, values: Values, frame: Frame) -> FloatArray:
        shown = y
        for offset, gain, moment in self.each(values):
            since = (frame.begin_s + frame.time_s - moment) / (self._shared * frame.dt_s)
            shown = shown + np.clip(since + 0.5, 0.0, 1.0) * (offset + gain * (y - frame.zero))
        return shown

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) as before the first step; a moment is not known better than it was shared out."""
        time_s, unsure = taken.begin_s + taken.time_s, np.zeros(y.size, dtype=bool)
        offset, gain = np.zeros(y.size), np.zeros(y.size)
        for one_offset, one_gain, moment in self.each(values):
            offset += one_offset * (time_s > moment)
            gain += one_gain * (time_s > moment)
            unsure |= np.abs(time_s - moment) < 0.5 * self._shared * taken.step_s
        return np.where(unsure, np.nan, (y - offset + gain * taken.empty) / (1.0 + gain))


def _sides(frames: Sequence[Frame]) -> tuple[float, float]:
    """First and last moment (s) with enough of the records, and a loop, before and after it."""
    time = np.concatenate([frame.begin_s + frame.time_s for frame in frames])
    begun = np.cumsum([0.0, *(frame.path[-1] for frame in frames[:-1])])
    path = np.concatenate([frame.path + b for frame, b in zip(frames, begun, strict=True)])
    least = min(_LOOP * frames[0].reach, _SIDE * path[-1])
    first = float(time[np.searchsorted(path, least)])
    last = float(time[np.searchsorted(path, path[-1] - least, side="right") - 1])
    end = frames[-1].begin_s + frames[-1].input.size * frames[-1].dt_s
    return max(first, _MOMENTS[0] * end), min(last, _MOMENTS[1] * end)


def _split(residual: FloatArray, begin: int, end: int) -> int:
    """Place within a window where the means on both sides differ most (a refit cannot move far from it)."""
    window = residual[begin:end]
    edge = window.size // _EDGE + 1
    if window.size <= _LEAST * edge:
        return begin + edge
    count = np.arange(1, window.size)
    apart = np.cumsum(window - window.mean())[:-1] ** 2 / (count * (window.size - count))
    return begin + edge + 1 + int(np.argmax(apart[edge:-edge]))
