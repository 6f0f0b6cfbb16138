"""A run: what a device, or a table from any bench, reported."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np

from pulsetrainer.artefacts.data import BoolArray, Data, FloatArray, check_equal_length, check_time
from pulsetrainer.artefacts.shown import Shown


@dataclass(frozen=True, slots=True, repr=False)
class Run(Shown):
    """What a device, or a table from any bench, reported: nothing that a real device does not know."""

    kind: ClassVar[str] = "run"

    time_s: Annotated[FloatArray | None, Data("s", "time", "time", path="time")]  # (n,), None: index only
    input: Annotated[FloatArray, Data("@input_unit", "@input_quantity", "time")]  # (n,) what was measured
    output: Annotated[FloatArray, Data("@output_unit", "@output_quantity", "time")]  # (n,) what was measured
    reference: Annotated[FloatArray | None, Data("@input_unit", "reference", "time")] = (
        None  # (n,) what was asked
    )
    # (n,) true at the first sample of each part but the first: before it the device was off, for a time that
    # the record does not tell, and then replayed the extremes that its memory should hold. None: one part
    seam: Annotated[BoolArray | None, Data("1", "first sample after a pause", "time")] = None
    input_unit: str = "A"
    output_unit: str = "N"
    input_quantity: str = "current"
    output_quantity: str = "force"
    signal: str = ""  # name of the excitation, or the imported file
    complete: bool = True
    dropped_samples: int = 0  # lost on the wire; the samples that are here are right
    captured: bool = False  # on our own device; files of 0.1 do not say

    def __post_init__(self) -> None:
        check_equal_length(self, ("time_s", "input", "output", "reference", "seam"))
        check_time(self)

    @property
    def dt_s(self) -> float | None:
        """Time step, s: the median; None where the run has no time."""
        if self.time_s is None or self.time_s.size < 2:
            return None
        return float(np.median(np.diff(self.time_s)))

    def parts(self, at_least: int = 1) -> tuple[Run, ...]:
        """Return the uninterrupted parts of ``at_least`` so many samples; the run itself where there is none.

        After a seam the device had been off: what is slow in it (heat, creep) does not go on where it was.
        Each part begins at the low end of the input, so that its memory is known.
        """
        if self.seam is None or not np.any(self.seam):
            return (self,)
        edges = [0, *np.flatnonzero(self.seam[1:]) + 1, self.seam.size]
        arrays = [name for name in _RUN_ARRAYS if getattr(self, name) is not None]
        parts = (
            replace(self, seam=None, **{name: getattr(self, name)[start:stop] for name in arrays})
            for start, stop in pairwise(edges)
            if stop - start >= at_least
        )
        return tuple(parts) or (self,)


_RUN_ARRAYS = ("time_s", "input", "output", "reference")
