"""The one period that a drive repeats: a beat of a recording, or the pulse of an existing drive."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pulsetrainer.artefacts import Waveform
from pulsetrainer.artefacts.units import counted, with_seconds
from pulsetrainer.core.beats import find_beats
from pulsetrainer.core.pulses import Shape
from pulsetrainer.errors import DataError
from pulsetrainer.steps.arguments import check_beat


def shape_of(drive: Waveform) -> Shape:
    """Return the pulse of a drive: one scored period of its target.

    DataError where it was made by a version that did not keep the length of its beats.
    """
    if not np.isfinite(drive.period_s):
        raise DataError(
            f"the drive {drive.name} does not say how long its beats are", hint="make it again from the pulse"
        )
    first = int(np.flatnonzero(drive.scored)[0])
    one = slice(first, first + round(drive.period_s * drive.rate_Hz))
    return Shape(drive.name, drive.time_s[one], drive.target[one], drive.source, unit=drive.output_unit)


def one_beat(recording: Shape, beat: str | int | None, notes: list[str]) -> Shape:
    """Return the beat that is asked for, out of a recording of several."""
    check_beat(beat)
    if beat is None:
        return recording
    found = find_beats(recording)
    lengths = found.periods_s
    notes.append(
        f"{recording.name} holds {counted(found.count, 'whole beat')} of "
        f"{lengths.min():.3f} to {lengths.max():.3f} s ({60.0 / float(np.mean(lengths)):.0f} a minute)"
    )
    return found.mean() if beat == "mean" else found.single(int(beat))


_BY_OPTION = "give `beat` from 1 to {count}, or mean, for a single one"


def notes_of_tables(shapes: Iterable[Shape]) -> list[str]:
    """Say what a session makes of pulses that are none of the library."""
    notes: list[str] = []
    for shape in shapes:
        notes += [shape.note] if shape.note else []
        say_if_several(shape, notes, "write a single beat into a table of its own")
    return notes


def say_if_several(recording: Shape, notes: list[str], remedy: str = _BY_OPTION) -> None:
    """Say it where a recording of several beats is about to be played as one period."""
    if len(recording.feet_s) > 1:  # it says itself where its beats begin
        return
    try:
        count = find_beats(recording).count
    except DataError:  # it holds no whole beat
        return
    if count > 1:
        notes.append(
            f"{recording.name} holds {count} whole beats, and all of it is played as one period of "
            f"{with_seconds(recording.period_s)}: {remedy.format(count=count)}"
        )
