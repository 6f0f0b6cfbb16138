"""A run: what a device, or a table from any bench, reported."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np

from pulsetrainer.artefacts.data import BoolArray, Data, FloatArray, check_equal_length, check_time
from pulsetrainer.artefacts.shown import Shown
from pulsetrainer.artefacts.time_steps import behind_turns
from pulsetrainer.artefacts.units import counted


@dataclass(frozen=True, slots=True)
class Coil:
    """What the duty showed of the coil while the device recorded: see ``core.temperature``."""

    duty_per_A: Annotated[float, Data("1/A", "duty for a current, cold coil")]
    duty_offset: Annotated[float, Data("1", "duty for the free-wheeling diode")]
    duty_s_per_A: Annotated[float, Data("s/A", "duty for a rate of the current")]
    rise_per_A2: Annotated[float, Data("1/A^2", "rise of the resistance by the heat of the current")]
    rise_error_per_A2: Annotated[float, Data("1/A^2", "standard deviation of that")]
    rise_tau_s: Annotated[float, Data("s", "time constant of that heat")]


@dataclass(frozen=True, slots=True, repr=False)
class Run(Shown):
    """What a device, or a table from any bench, reported: only what a real device can know.

    Examples
    --------
    >>> import numpy as np, pulsetrainer as pt
    >>> t = np.arange(100) / 1000
    >>> run = pt.Run(time_s=t, input=np.sin(t), output=2 * np.sin(t), input_unit="A", output_unit="N")
    >>> run.input.size, run.output_unit, run.complete
    (100, 'N', True)
    """

    kind: ClassVar[str] = "run"

    time_s: Annotated[FloatArray | None, Data("s", "time", "time", path="time")]  # (n,), None: index only
    input: Annotated[FloatArray, Data("@input_unit", "@input_quantity", "time")]  # (n,) what was measured
    output: Annotated[FloatArray, Data("@output_unit", "@output_quantity", "time")]  # (n,) what was measured
    # (n,) what was asked for
    reference: Annotated[FloatArray | None, Data("@input_unit", "reference", "time")] = None
    # (n,) true at the first sample of each part but the first: before it the device was off, for a time that
    # the record does not tell, and then replayed the extremes that its memory should hold. None: one part
    seam: Annotated[BoolArray | None, Data("1", "first sample after a pause", "time")] = None
    input_unit: str = "A"
    output_unit: str = "N"
    input_quantity: str = ""  # current where it is not said and the unit is A, else input ...
    output_quantity: str = ""  # ... force where the unit is N, else output
    signal: str = ""  # name of the excitation, or the imported file
    complete: bool = True
    dropped_samples: int = 0  # lost on the wire; the samples that are here are right
    captured: bool = False  # on our own device; files of 0.1 do not say
    serial: str = ""  # serial number of the device that captured it
    # (n,) true where the output is no measurement: left out of every fit and every error. None: all count
    masked: Annotated[BoolArray | None, Data("1", "sample is left out", "time")] = None
    corrected: tuple[str, ...] = ()  # causes that were taken out of it
    coil: Coil | None = None  # of a device that tells the duty
    left_out_rows: int = 0  # of the table that it was imported from: they lacked a number

    def __post_init__(self) -> None:
        if not self.input_quantity:
            object.__setattr__(self, "input_quantity", "current" if self.input_unit == "A" else "input")
        if not self.output_quantity:
            object.__setattr__(self, "output_quantity", "force" if self.output_unit == "N" else "output")
        check_equal_length(self, ("time_s", "input", "output", "reference", "seam", "masked"))
        check_time(self)

    @property
    def dt_s(self) -> float | None:
        """Time step, s: the median; None where the run has no time."""
        if self.time_s is None or self.time_s.size < 2:
            return None
        return float(np.median(np.diff(self.time_s)))

    @property
    def counts(self) -> BoolArray:
        """Samples (n,) whose output is a measurement: all that are not masked."""
        return np.ones(self.input.size, dtype=np.bool_) if self.masked is None else ~self.masked

    @property
    def fingerprint(self) -> str:
        """Digest of what was measured: equal for runs of equal samples."""
        measured = [self.input, self.output, *([] if self.time_s is None else [self.time_s])]
        return hashlib.sha256(b"".join(np.asarray(one, "<f8").tobytes() for one in measured)).hexdigest()

    @property
    def unseen_turns(self) -> list[int]:
        """Samples before which the input may have turned, in a gap of the time stamps within a part."""
        if self.time_s is None:
            return []
        parts = pairwise([0, *self._seams, self.input.size])
        return [k + at for k, end in parts for at in behind_turns(self.time_s[k:end], self.input[k:end])]

    @property
    def _seams(self) -> list[int]:
        return [] if self.seam is None else (np.flatnonzero(self.seam[1:]) + 1).tolist()

    @property
    def gap_words(self) -> str:
        """Say in how many gaps the input may have turned, and what follows; empty: in none."""
        number = len(self.unseen_turns)
        if not number:
            return ""
        return (
            f"the input may have turned unseen in {counted(number, 'gap')} of the time stamps: what follows "
            "counts only from where the input next reaches an end, since its memory is known there"
        )

    @property
    def slices(self) -> tuple[slice, ...]:
        """The uninterrupted parts, as slices of the samples: a seam parts them, and an unseen turn."""
        edges = sorted([*self._seams, *self.unseen_turns])
        if not edges:
            return (slice(None),)
        return tuple(slice(start, stop) for start, stop in pairwise([0, *edges, self.input.size]))

    def cut(self, part: slice) -> Run:
        """Return one uninterrupted part as a run."""
        arrays = [name for name in _RUN_ARRAYS if getattr(self, name) is not None]
        return replace(self, seam=None, **{name: getattr(self, name)[part] for name in arrays})

    def parts(self, at_least: int = 1) -> tuple[Run, ...]:
        """Return the uninterrupted parts of ``at_least`` samples or more; the run itself where there is none.

        Before a seam the device was off, so what is slow in it (heat, creep) does not continue across it.
        Each such part begins at the low end of the input, so that its memory is known; after an unseen turn
        it is known from where the input next reaches an end.
        """
        slices = self.slices
        if len(slices) == 1:
            return (self,)
        parts = map(self.cut, slices)
        return tuple(one for one in parts if one.input.size >= at_least) or (self,)


def seam_of(starts: Sequence[int], samples: int) -> BoolArray | None:
    """Return which samples (n,) come first after a pause, by their numbers; None where there was no pause."""
    seam = np.zeros(samples, dtype=np.bool_)
    seam[[start for start in starts if start < samples]] = True
    return seam if seam.any() else None


_RUN_ARRAYS = ("time_s", "input", "output", "reference", "masked")
