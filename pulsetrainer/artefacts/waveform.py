"""A waveform: a target, and the two drives that shall press it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pulsetrainer.artefacts.data import BoolArray, Data, FloatArray, check_equal_length, check_time
from pulsetrainer.artefacts.model import Model
from pulsetrainer.errors import DataError


@dataclass(frozen=True, slots=True)
class Waveform:
    """A target force and the two currents that shall press it: compensated and merely scaled."""

    kind: ClassVar[str] = "waveform"

    time_s: Annotated[FloatArray, Data("s", "time", "time", path="time")]  # (n,) even steps
    target: Annotated[FloatArray, Data("@output_unit", "target", "time", finite=True)]  # (n,)
    compensated: Annotated[
        FloatArray, Data("@input_unit", "compensated drive", "time", path="drive/compensated", finite=True)
    ]  # (n,)
    scaled: Annotated[
        FloatArray, Data("@input_unit", "scaled drive", "time", path="drive/scaled", finite=True)
    ]  # (n,)
    predicted: Annotated[
        FloatArray, Data("@output_unit", "output the model predicts for the compensated drive", "time")
    ]
    scored: Annotated[BoolArray, Data("1", "sample counts in the evaluation", "time")]  # (n,) not the lead-in
    name: str
    source: str  # where the shape comes from, in words
    inversion: str  # "continuous" | "closest-match" | "extended"
    clipped_samples: int  # targets outside the reachable range
    input_unit: str = "A"
    output_unit: str = "N"
    model: Model | None = None

    def __post_init__(self) -> None:
        check_equal_length(self, ("time_s", "target", "compensated", "scaled", "predicted", "scored"))
        check_time(self)
        if self.time_s.size < 2:
            raise DataError(
                f"a waveform of {self.time_s.size} samples is none", hint="make it again: pulsetrainer invert"
            )
