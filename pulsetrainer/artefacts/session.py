"""A session: what a trainer pressed for minutes, beat by beat, and what a learner said it was."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pulsetrainer.artefacts.data import Data, FloatArray, check_equal_length, check_time, percent
from pulsetrainer.artefacts.shown import Shown

# A finger tells two forces apart that differ by 7 %: X. D. Pang, H. Z. Tan, N. I. Durlach, Manual
# discrimination of force using active finger motion, Perception & Psychophysics 1991, 49, 531-540.
WEBER_FRACTION = 0.07
FIGURES = (
    "rate_cv_percent", "amplitude_cv_percent", "beat_timing_max_ms", "mean_abs_error_percent",
    "max_abs_error_percent", "nrmse", "augmentation_index_error_percent",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Beats:
    """Every beat as it was asked for, and how it was pressed; NaN where too many samples were lost."""

    start_s: Annotated[FloatArray, Data("s", "start", "beat")]  # (b,)
    interval_s: Annotated[FloatArray, Data("s", "time to the next beat", "beat")]
    pulse: Annotated[NDArray[np.int64], Data("1", "number of the pulse, from 0", "beat")]
    amplitude: Annotated[FloatArray, percent("amplitude, of the reach", "beat")]
    gain: Annotated[FloatArray, Data("1", "height pressed, of that asked for", "beat")]
    late: Annotated[FloatArray, Data("s", "start pressed, after that asked for", "beat")]
    mean_error: Annotated[FloatArray, Data("@output_unit", "mean absolute error", "beat")]
    max_error: Annotated[FloatArray, Data("@output_unit", "largest absolute error", "beat")]
    output_unit: str = "N"

    @classmethod
    def of(cls, columns: ArrayLike, output_unit: str = "N") -> Self:
        """Return the beats of some columns (``BEAT_COLUMNS``, b) of numbers."""
        told: dict[str, Any] = dict(zip(BEAT_COLUMNS, np.asarray(columns, dtype=np.float64), strict=True))
        return cls(**told | {"pulse": told["pulse"].astype(np.int64)}, output_unit=output_unit)

    @property
    def columns(self) -> FloatArray:
        """All but the unit, shape (``BEAT_COLUMNS``, b)."""
        return np.stack([getattr(self, name) for name in BEAT_COLUMNS])


BEAT_COLUMNS = tuple(field.name for field in fields(Beats) if field.name != "output_unit")


@dataclass(frozen=True, slots=True)
class Quiz:
    """What was asked blind, and what was answered."""

    choices: tuple[str, ...]
    asked: tuple[str, ...]
    answered: tuple[str, ...]
    # (q,) NaN: the answer came from a file
    response_s: Annotated[FloatArray, Data("s", "time from the first beat to the answer", "question")]
    learner: str = ""

    @property
    def right(self) -> int:
        """How many answers are right."""
        return sum(a == b for a, b in zip(self.asked, self.answered, strict=True))

    @property
    def confusion(self) -> dict[str, dict[str, int]]:
        """Asked name, then answered name: how often."""
        pairs = list(zip(self.asked, self.answered, strict=True))
        return {asked: {said: pairs.count((asked, said)) for said in self.choices} for asked in self.choices}


@dataclass(frozen=True, slots=True)
class Score:
    """What a quiz says about a learner."""

    asked: int
    right: int
    share: float
    interval: tuple[float, float]  # of the share, 95 %
    chance: float  # share right of who guesses
    p_value: float  # of as many right by guessing
    response_s: float  # median; NaN where no time is known


@dataclass(frozen=True, slots=True, repr=False)
class Session(Shown):
    """Pulses pressed without a fixed end: what was asked, what was measured, how true every beat was.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> model = pt.load("tests/data/files-0.1/model.h5")
    >>> with pt.open_device("bench:") as device:
    ...     pressed = pt.session(model, device, beats=2)
    >>> pressed.pulses, pressed.beats.start_s.size, pressed.quiz
    (('normal',), 2, None)
    """

    kind: ClassVar[str] = "session"

    time_s: Annotated[FloatArray, Data("s", "time", "time", path="time")]  # (n,) with gaps where it was off
    target: Annotated[FloatArray, Data("@output_unit", "target", "time")]  # (n,)
    reference: Annotated[FloatArray, Data("@input_unit", "reference as played", "time")]  # (n,)
    input: Annotated[FloatArray, Data("@input_unit", "measured input", "time")]  # (n,)
    output: Annotated[FloatArray, Data("@output_unit", "measured output", "time")]  # (n,)
    beats: Beats
    pulses: tuple[str, ...]
    full_force: Annotated[float, Data("@output_unit", "largest target: what errors are given in percent of")]
    rate_cv_percent: Annotated[
        float, percent("coefficient of variation of the rate pressed, of that asked for")
    ]
    amplitude_cv_percent: Annotated[
        float, percent("coefficient of variation of the height pressed, of that asked for")
    ]
    beat_timing_max_ms: Annotated[float, Data("ms", "farthest that a beat began from its time")]
    mean_abs_error_percent: Annotated[float, percent("mean absolute error, of full force")]
    max_abs_error_percent: Annotated[float, percent("largest absolute error, of full force")]
    nrmse: Annotated[float, Data("1", "rms error, of the range of the target")]
    augmentation_index_error_percent: Annotated[
        float, percent("largest error of the augmentation index of a pulse, of the index")
    ]
    mean_force: Annotated[float, Data("@output_unit", "mean target")]
    quiz: Quiz | None = None
    input_unit: str = "A"
    output_unit: str = "N"
    complete: bool = True
    dropped_samples: int = 0
    underruns: int = 0
    clipped_samples: int = 0
    fault: str = ""
    notes: tuple[str, ...] = ()
    stopped_by_key: str = ""  # where, in words
    # where heat was tracked: a reading every second
    temperature_s: Annotated[FloatArray | None, Data("s", "time of the temperature", "window")] = None
    temperature_K: Annotated[
        FloatArray | None, Data("K", "copper warmer than at calibration", "window", path="temperature")
    ] = None

    def __post_init__(self) -> None:
        check_equal_length(self, ("time_s", "target", "reference", "input", "output"))
        check_time(self)

    @property
    def error_jnd(self) -> float:
        """Mean absolute error in just-noticeable differences of the mean force."""
        return self.mean_abs_error_percent / 100.0 * self.full_force / (WEBER_FRACTION * self.mean_force)

    @property
    def ended_early(self) -> str:
        """Why it ended before its time: the fault, or where it was stopped by key; empty: it did not."""
        return self.fault or self.stopped_by_key

    def figures(self) -> dict[str, float]:
        """Main figures by name."""
        return {name: float(getattr(self, name)) for name in FIGURES}
