"""A playback: what the device measured while it played a waveform."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pulsetrainer.artefacts.data import Data, FloatArray
from pulsetrainer.artefacts.shown import Shown
from pulsetrainer.artefacts.waveform import Waveform


@dataclass(frozen=True, slots=True)
class DrivePlayback:
    """What the device measured while it played one drive, repeat by repeat; NaN where a block was lost."""

    reference: Annotated[FloatArray, Data("@input_unit", "reference as played", "repeat time")]  # (r, n)
    input: Annotated[FloatArray, Data("@input_unit", "measured input", "repeat time")]  # (r, n)
    output: Annotated[FloatArray, Data("@output_unit", "measured output", "repeat time")]  # (r, n)
    input_unit: str = "A"
    output_unit: str = "N"


@dataclass(frozen=True, slots=True, repr=False)
class Playback(Shown):
    """A waveform and what the device measured for each of its drives.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> played = pt.load("tests/data/files-0.1/played.h5")
    >>> played.complete, played.compensated.output.shape  # repeats, samples
    (True, (1, 6042))
    """

    kind: ClassVar[str] = "playback"

    time_s: Annotated[FloatArray, Data("s", "time", "time", path="time")]  # (n,)
    waveform: Waveform
    compensated: DrivePlayback
    scaled: DrivePlayback
    # for tracking in percent
    input_range: Annotated[float, Data("@input_unit", "full range of the drive current")]
    input_unit: str = "A"
    complete: bool = True
    dropped_samples: int = 0
    # (r,) before each compensated drive, where the heat was tracked
    temperature_K: Annotated[
        FloatArray | None, Data("K", "copper warmer than at calibration", "repeat", path="temperature")
    ] = None
    fault: str = ""  # why the device stopped early; empty where it did not
