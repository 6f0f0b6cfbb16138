"""The problem that is fitted: records, the plane on which weights live, and how samples are averaged."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.record import Record, counted, counted_output
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.design import Bins, Followed, bins_of
from pulsetrainer.diagnosis.extended import Term, seen_input
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.errors import DataError

Static = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Problem:
    """The data, the plane on which the weights live, and how they are averaged."""

    records: tuple[Record, ...]
    frames: tuple[Frame, ...]
    plane: Plane
    bins: Bins
    measured: FloatArray  # (count,) averaged output
    smoothing: float
    signed: bool = False  # weights of either sign
    base: Static | None = None  # what the weights only correct, input to output; None: they are all there is
    _followed: OrderedDict[tuple[Term, ...], list[Followed]] = field(default_factory=OrderedDict, repr=False)

    def paths(self, terms: tuple[Term, ...]) -> list[Followed]:
        """Follow what the hysteresis sees of each record behind some input causes; the last few are kept."""
        if terms not in self._followed:
            self._followed[terms] = [
                Followed.along(self.plane, seen_input(terms, record.output, frame), self.base)
                for record, frame in zip(self.records, self.frames, strict=True)
            ]
            if len(self._followed) > LIMITS.followed_kept:
                self._followed.popitem(last=False)
        self._followed.move_to_end(terms)
        return self._followed[terms]

    def of(self, records: Sequence[Record]) -> Problem:
        """Return the same of other records."""
        plane = self.plane
        return problem_for(records, plane.low, plane.high, plane.n_h, signed=self.signed, base=self.base)

    @property
    def time_s(self) -> FloatArray:
        """Times of the averages (count,), records one after another."""
        return self.bins.time_s + np.asarray([frame.begin_s for frame in self.frames])[self.bins.record]

    def coarser(self) -> Problem:
        """Return the same on fewer levels."""
        plane = Plane.uniform(self.plane.low, self.plane.high, LIMITS.coarse_levels)
        return replace(self, plane=plane, _followed=OrderedDict())


def problem_for(
    records: Sequence[Record],
    low: float,
    high: float,
    levels: int = LIMITS.levels,
    *,
    signed: bool = False,
    base: Static | None = None,
) -> Problem:
    """The records with masks applied, ready to be fitted.

    DataError where input or output does not vary, or too few samples are left.
    """
    bins = bins_of(records)
    measured = bins.average([r.output for r in records])
    moved = np.clip(counted(records, [r.input for r in records]), low, high)
    if np.ptp(measured) == 0 or np.ptp(moved) == 0:
        what = "output" if np.ptp(measured) == 0 else "input"
        raise DataError(
            f"the {what} does not vary, so it shows no cause",
            hint="record a signal that sweeps the range: pulsetrainer capture diagnostic -o diagnostic.h5",
        )
    span, reach = float(np.ptp(measured)), high - low
    ends = _ends(records, low, high)
    longest = max(r.input.size * r.step for r in records)
    begins = np.cumsum([0.0] + [r.input.size * r.step for r in records]).tolist()
    frames = tuple(
        Frame(
            r.step,
            r.input,
            span,
            reach,
            k,
            len(records),
            low,
            ends,
            begin_s=begins[k],
            longest_s=longest,
            averaged=r.averaged,
        )
        for k, r in enumerate(records)
    )
    plane = Plane.uniform(low, high, levels)
    return Problem(tuple(records), frames, plane, bins, measured, LIMITS.smoothing, signed, base)


def _ends(records: Sequence[Record], low: float, high: float) -> tuple[float, float]:
    """Mean outputs near both ends of the input's range, or as near as the records come to them."""
    u, y = counted(records, [r.input for r in records]), counted_output(records)
    near = LIMITS.near_end * (high - low)
    bottom = y[u <= max(low, float(u.min())) + near]
    top = y[u >= min(high, float(u.max())) - near]
    return float(bottom.mean()), float(top.mean())
