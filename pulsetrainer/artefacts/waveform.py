"""A waveform: a target, the two drives that are to press it, and the error that the model expects of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from pulsetrainer.artefacts.data import BoolArray, Data, FloatArray, check_equal_length, check_time, percent
from pulsetrainer.artefacts.model import Model
from pulsetrainer.artefacts.shown import Shown
from pulsetrainer.errors import DataError


@dataclass(frozen=True, slots=True)
class RefinePass:
    """The errors of one pass of refining, in percent of the full force, over all scored samples."""

    repeats: int
    mean_abs_error_percent: Annotated[float, percent("mean absolute error, of full force")]
    max_abs_error_percent: Annotated[float, percent("largest absolute error, of full force")]
    noise_percent: Annotated[float, percent("mean size of what repeats differ by, of full force")]


@dataclass(frozen=True, slots=True, repr=False)
class Waveform(Shown):
    """A target force and the two currents meant to press it: compensated and merely scaled.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> drive = pt.load("tests/data/files-0.1/drive.h5")
    >>> drive.inversion, drive.target.shape == drive.compensated.shape == drive.time_s.shape
    ('continuous', True)
    """

    kind: ClassVar[str] = "waveform"

    time_s: Annotated[FloatArray, Data("s", "time", "time", path="time")]  # (n,) even steps
    target: Annotated[FloatArray, Data("@output_unit", "target", "time", finite=True)]  # (n,)
    compensated: Annotated[  # (n,), as are those that follow
        FloatArray, Data("@input_unit", "compensated drive", "time", path="drive/compensated", finite=True)
    ]
    scaled: Annotated[
        FloatArray, Data("@input_unit", "scaled drive", "time", path="drive/scaled", finite=True)
    ]
    # by the model; of a refined drive what the device gave
    predicted: Annotated[FloatArray, Data("@output_unit", "output expected of the compensated drive", "time")]
    scored: Annotated[BoolArray, Data("1", "sample counts in the evaluation", "time")]  # (n,) not the lead-in
    name: str
    source: str  # where the shape comes from, in words
    inversion: str  # "continuous" | "closest-match" | "extended" | "refined" | "transferred"
    clipped_samples: int  # targets outside the reachable range
    input_unit: str = "A"
    output_unit: str = "N"
    model: Model | None = None
    period_s: float = float("nan")  # of one beat
    notes: tuple[str, ...] = ()  # what a person should know about the inverse
    warnings: tuple[str, ...] = ()  # why it may not press what is asked for
    passes: tuple[RefinePass, ...] = ()  # of refining, in their order
    kept: int = 0  # number of the pass whose drive this is, from 1

    def __post_init__(self) -> None:
        check_equal_length(self, ("time_s", "target", "compensated", "scaled", "predicted", "scored"))
        check_time(self)
        if self.time_s.size < 2:
            raise DataError(
                f"a waveform needs at least 2 samples, this one has {self.time_s.size}",
                hint="make it again from the pulse",
            )

    @property
    def rate_Hz(self) -> float:
        """Samples per second."""
        return 1.0 / float(np.median(np.diff(self.time_s)))

    @property
    def full_force(self) -> float:
        """Largest absolute target that is scored, output unit: errors are percentages of it."""
        return float(np.abs(self.target[self.scored]).max())

    @property
    def predicted_peak(self) -> float:
        """Largest absolute output that the model expects, in the strokes before the pulse or in it."""
        return float(np.abs(self.predicted).max())

    @property
    def predicted_max_error_percent(self) -> float:
        """Largest error that the model expects for the compensated drive, of the full force."""
        error = np.abs(self.predicted - self.target)[self.scored]
        return 100.0 * float(error.max()) / self.full_force
