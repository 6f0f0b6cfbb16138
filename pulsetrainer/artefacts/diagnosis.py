"""A diagnosis: what a model gets wrong on some runs, and why."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import Annotated, ClassVar, NamedTuple

from pulsetrainer.artefacts.data import Data, FloatArray, percent
from pulsetrainer.artefacts.model import Model, Parameter
from pulsetrainer.artefacts.shown import Shown


@dataclass(frozen=True, slots=True)
class Cause:
    """What a diagnosis says about one cause."""

    cause: str
    found: bool
    p_value: float | None  # over the whole library; None where no null was drawn
    explains_percent: float  # of the reducible part of the baseline's squared error
    held_out_gain_percent: float  # of the reducible part; NaN where it was not measured
    parameters: tuple[Parameter, ...] = ()
    confounded_with: tuple[str, ...] = ()
    text: str = ""  # in words
    doubts: tuple[str, ...] = ()  # what speaks against a cause that was found, in words
    detectable_from_percent: float = nan  # smallest effect that would have shown, rms, of the span


@dataclass(frozen=True, slots=True)
class Profile:
    """The rms residual against one quantity, before and after the extension (k groups)."""

    name: str  # "rate" | "level" | "direction" | "time" | "frequency"
    unit: str
    at: Annotated[FloatArray, Data("@unit", "middle of the group", "group")]  # (k,)
    before: Annotated[FloatArray, Data("@output_unit", "rms residual of the static refit", "group")]  # (k,)
    after: Annotated[FloatArray, Data("@output_unit", "rms residual of the extended refit", "group")]  # (k,)
    output_unit: str = "N"


@dataclass(frozen=True, slots=True)
class Dependence:
    """A learned dependence of the output on a state that is not in the list of causes (k places)."""

    text: str  # in words
    state: str  # in words
    unit: str
    tau_s: float  # time constant of the state
    at: Annotated[FloatArray, Data("@unit", "state", "place")]  # (k,)
    value: Annotated[FloatArray, Data("@output_unit", "change of the output", "place")]  # (k,)
    half: Annotated[FloatArray, Data("@output_unit", "half width of its 95 % band", "place")]  # (k,)
    output_unit: str = "N"


class Left(NamedTuple):
    """The rms residual of averages, per cent of the span, and what it would be if nothing were wrong."""

    percent: float
    floor_percent: float
    whole: bool = True  # False while what is left is more than noise: something else is missing


@dataclass(frozen=True, slots=True)
class Recorded:
    """One uninterrupted part of a run that was diagnosed."""

    fingerprint: str  # of its samples
    step_s: float  # of the averages that causes were sought in; NaN where the run has no time
    begin_s: float = 0.0  # since the first one began, as if they had been made one after another


@dataclass(frozen=True, slots=True, repr=False)
class Diagnosis(Shown):
    """What a model gets wrong on some runs, why, and the model extended by the causes found.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> found = pt.load("tests/data/files-0.1/diagnosis.h5")
    >>> found.verdict, [one.cause for one in found.causes if one.found]
    ('accommodation', ['accommodation'])
    """

    kind: ClassVar[str] = "diagnosis"

    verdict: str  # a cause's id, "none", "inconclusive", "unknown" or "unlisted"
    quick: bool  # screened only: figures are those of linearised scores
    rms: Annotated[float, Data("@output_unit", "rms error of the model as it was given")]
    rms_percent: Annotated[float, percent("rms error of the model as it was given, of the span")]
    noise_percent: Annotated[float, percent("white noise of single samples, rms, of the span")]
    static_percent: Annotated[float, percent("rms residual of averages, weights refitted, of the span")]
    extended_percent: Annotated[float, percent("rms residual of averages, extended, of the span")]
    floor_percent: Annotated[float, percent("rms residual of averages when nothing is wrong, of the span")]
    causes: tuple[Cause, ...]
    evidence: tuple[str, ...]
    next_experiment: str
    profiles: tuple[Profile, ...]
    # the runs one after another, thinned for the figures (m averages)
    time_s: Annotated[FloatArray, Data("s", "time, runs one after another", "time", path="time")]
    input: Annotated[FloatArray, Data("@input_unit", "input", "time")]
    output: Annotated[FloatArray, Data("@output_unit", "measured output", "time")]
    before: Annotated[FloatArray, Data("@output_unit", "static refit", "time")]
    after: Annotated[FloatArray, Data("@output_unit", "extended refit", "time")]
    extended: Model | None = None  # weights refitted together with the causes found
    input_unit: str = "A"
    output_unit: str = "N"
    input_quantity: str = ""  # of the model; empty in files of 0.1
    output_quantity: str = ""
    held_out_gain_percent: float = nan  # of all causes together; NaN where it was not measured
    lacks: tuple[str, ...] = ()  # what the records do not have: rates, holds, length
    notes: tuple[str, ...] = ()  # what a person should know about the records
    whole: bool = True  # False while what is left is more than noise
    dependences: tuple[Dependence, ...] = ()  # of the cause `unlisted`, one for each that was found
    # what `correct` and `extend` need; empty in files of 0.1
    model: str = ""  # fingerprint of the model
    records: tuple[Recorded, ...] = ()
    correctable: tuple[str, ...] = ()  # faults of the measurement that were found, and can be taken out
    extended_rms_percent: Annotated[
        float, percent("rms error of the extended model over single samples, of the span")
    ] = nan  # NaN where nothing was extended
    polarity: int = 1  # of the model
    as_measured: bool = False  # signs of parameters are those of the output; False: of output times polarity
    empty: Annotated[float, Data("@output_unit", "output of the empty memory, times the polarity")] = nan
    in_model: tuple[str, ...] = ()  # causes found that the model as given contains already

    @property
    def found(self) -> tuple[Cause, ...]:
        """The causes that were found, the verdict first."""
        return tuple(one for one in self.causes if one.found)

    @property
    def advice(self) -> list[str]:
        """Paragraphs of ``next_experiment``: what to do, and what to record if more should be seen."""
        return self.next_experiment.split("\n")

    @property
    def next_command(self) -> str:
        """What to do about it: "correct" the run, "extend" the model, or empty where neither helps."""
        if self.correctable and (self.verdict in self.correctable or self.extended is None):
            return "correct"
        return "extend" if self.extended is not None else ""

    @property
    def left(self) -> Left:
        """What is left with the causes found."""
        return Left(self.extended_percent, self.floor_percent, self.whole)
