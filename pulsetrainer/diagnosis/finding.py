"""What a diagnosis finds: parameters with their intervals, and what speaks for each cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.evidence import Evidence

AT_BOUND, A_FAULT, MAY_BE_WEAR, NOT_ADDED = "at bound", "may be a fault", "may be wear", "not added"
TOLD_BESIDE = (AT_BOUND, A_FAULT, MAY_BE_WEAR, NOT_ADDED)  # doubts with which the name stands


@dataclass(frozen=True)
class Estimate:
    """One parameter with its interval."""

    name: str
    value: float
    unit: str
    lower: float
    upper: float


def may_be_nothing(strengths: Sequence[Estimate]) -> bool:
    """Tell whether the intervals of all strengths of a cause span zero."""
    return bool(strengths) and all(one.lower <= 0 <= one.upper for one in strengths)


@dataclass(frozen=True)
class Finding:
    """What the data say about one cause."""

    cause: Cause
    found: bool
    p_value: float | None = None  # None: no null was drawn for it
    explains_percent: float = 0.0  # of the reducible part of the baseline's error
    parameters: tuple[Estimate, ...] = ()
    confounded_with: tuple[str, ...] = ()
    held_out_gain_percent: float = 0.0  # of the reducible part; NaN where it was not measured
    doubts: tuple[str, ...] = ()  # what speaks against it: see ``wording.DOUBTS``
    seen: Evidence | None = None  # on the raw data, or in what the model as given leaves

    @property
    def in_doubt(self) -> bool:
        """Whether any doubt speaks against it but those of ``TOLD_BESIDE``."""
        return any(one not in TOLD_BESIDE for one in self.doubts)
