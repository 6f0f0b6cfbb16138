"""One frozen dataclass per artefact kind; ``store`` turns any of them into HDF5 and back.

How a field is stored follows from its type and its ``Data`` annotation:

- an array or a number annotated with ``Data``: a dataset with attributes ``units`` and
  ``quantity``; ``dims`` names its axes, and the axis ``time`` is the dataset ``time`` itself as a
  dimension scale. ``units="@name"`` takes the text of the sibling field ``name`` (units come
  with the data: A and N here, A/m and T for somebody else's bench).
- ``finite``: neither NaN nor infinity is written or read (what drives a device, what a model is).
  In any array, and in numbers but for infinity, what is beyond ``LARGEST`` is refused too; NaN is missing.
- ``path``: the dataset's name in the file where it is not the field's name.
- ``str``, ``int``, ``float``, ``bool``: an attribute.
- a dataclass: a group; a tuple of dataclasses: a group of numbered groups.
- ``None``: nothing is written.

Sizes in the comments: n samples, L = n_h + 1 nodes, q = n_h (n_h + 1) / 2 cells, r repeats.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.errors import DataError

LARGEST = 1e100  # no quantity in any unit is larger, and its squares and sums are numbers still
FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, init=False)
class Data:
    """Marks a field as a dataset: units, quantity in words, axes, path, whether NaN is refused."""

    units: str
    quantity: str
    dims: tuple[str, ...]
    path: str | None
    finite: bool

    def __init__(
        self, units: str, quantity: str, *dims: str, path: str | None = None, finite: bool = False
    ) -> None:
        fields = (
            ("units", units),
            ("quantity", quantity),
            ("dims", dims),
            ("path", path),
            ("finite", finite),
        )
        for name, value in fields:
            object.__setattr__(self, name, value)


def beyond_all_quantities(values: NDArray[Any]) -> str:
    """Say which of the values (...) are beyond ``LARGEST``, nothing where none is; NaN is none of them."""
    if values.dtype.kind != "f":
        return ""
    low, high = np.fmin.reduce(values, None, initial=0.0), np.fmax.reduce(values, None, initial=0.0)
    return "" if max(-low, high) <= LARGEST else f"goes from {low:g} to {high:g}; the limit is {LARGEST:g}"


def _check_equal_length(artefact: Any, names: tuple[str, ...]) -> None:
    """Raise DataError unless the named arrays, where present, share the length of their last axis."""
    sizes = {n: np.shape(getattr(artefact, n))[-1] for n in names if getattr(artefact, n) is not None}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{n} has {k}" for n, k in sizes.items())
        raise DataError(
            f"a {artefact.kind} needs arrays of one length along time: {listed}",
            hint="write the artefact again with the command that made it",
        )


def _check_time(artefact: Any) -> None:
    """Raise DataError unless ``time_s`` is finite and strictly increasing."""
    t = artefact.time_s
    if t is None:
        return
    if not np.all(np.isfinite(t)):
        where = int(np.flatnonzero(~np.isfinite(t))[0])
        raise DataError(
            f"time of this {artefact.kind} is not a number at sample {where}", hint="mend the time column"
        )
    back = np.flatnonzero(t[1:] <= t[:-1])  # no array of differences: the record may be long
    if back.size:
        k = int(back[0])
        raise DataError(
            f"time of this {artefact.kind} does not increase: sample {k + 1} is at {t[k + 1]:g} s, "
            f"the one before it at {t[k]:g} s",
            hint="sort the record, drop repeated rows, or give --rate instead of a time column",
        )


@dataclass(frozen=True, slots=True)
class Run:
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

    def __post_init__(self) -> None:
        _check_equal_length(self, ("time_s", "input", "output", "reference", "seam"))
        _check_time(self)

    def parts(self) -> tuple[Run, ...]:
        """Return the uninterrupted parts, each a run of its own; the run itself where it has no seam."""
        if self.seam is None or not np.any(self.seam):
            return (self,)
        edges = [0, *np.flatnonzero(self.seam[1:]) + 1, self.seam.size]
        arrays = [name for name in _RUN_ARRAYS if getattr(self, name) is not None]
        return tuple(
            replace(self, seam=None, **{name: getattr(self, name)[start:stop] for name in arrays})
            for start, stop in pairwise(edges)
        )


_RUN_ARRAYS = ("time_s", "input", "output", "reference")


@dataclass(frozen=True, slots=True)
class Fit:
    """How well the model describes the data it was identified on."""

    rms: Annotated[float, Data("@output_unit", "rms error of the fit")]
    max_abs: Annotated[float, Data("@output_unit", "largest error of the fit")]
    rms_percent: Annotated[float, Data("percent", "rms error of the fit, of the output span")]
    coverage_percent: Annotated[float, Data("percent", "cells switched on and off by the input")]
    input_unit: str
    output_unit: str
    samples: int
    iterations: int
    method: str  # "joint" | "alternating"
    # the identification record and the fit, thinned for the figures (m samples)
    time_s: Annotated[FloatArray | None, Data("s", "time", "time", path="time")]
    input: Annotated[FloatArray, Data("@input_unit", "input", "time")]
    output: Annotated[FloatArray, Data("@output_unit", "measured output", "time")]
    predicted: Annotated[FloatArray, Data("@output_unit", "predicted output", "time")]
    smoothing: float = 0.0  # length below which the density was smoothed, share of the input's range
    draws: int = 0  # refits of the block bootstrap; 0: none was made
    # 90 % band of the predicted output, without the noise of a measurement
    predicted_lower: Annotated[
        FloatArray | None, Data("@output_unit", "lower end of the predicted output", "time")
    ] = None
    predicted_upper: Annotated[
        FloatArray | None, Data("@output_unit", "upper end of the predicted output", "time")
    ] = None


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of an extension, with its confidence interval."""

    name: str
    value: float
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class Extension:
    """One named cause with which a model is extended."""

    cause: str
    parameters: tuple[Parameter, ...]


@dataclass(frozen=True, slots=True)
class Model:
    """An identified Preisach model: weights mu-hat per cell and offset y0-hat (Carneiro 2018, eq. 2)."""

    kind: ClassVar[str] = "model"

    levels: Annotated[
        FloatArray, Data("@input_unit", "input levels: edges of the cells", "level", finite=True)
    ]  # (L,)
    weights: Annotated[
        FloatArray, Data("@weights_unit", "Preisach weights mu", "cell", finite=True)
    ]  # (q,), order of core.plane
    offset: Annotated[float, Data("@output_unit", "output offset y0", finite=True)]
    covered: Annotated[BoolArray, Data("1", "cell was switched on and off", "cell")]  # (q,)
    weights_unit: str = "N/A^2"
    input_unit: str = "A"
    output_unit: str = "N"
    input_quantity: str = "current"
    output_quantity: str = "force"
    operator: str = "continuous"  # how the weights are read: "continuous" | "relay"
    polarity: int = 1  # -1: the output falls when the input rises
    # 90 % interval of every weight, where a bootstrap was made
    weights_lower: Annotated[
        FloatArray | None, Data("@weights_unit", "lower end of the Preisach weights", "cell")
    ] = None
    weights_upper: Annotated[
        FloatArray | None, Data("@weights_unit", "upper end of the Preisach weights", "cell")
    ] = None
    fit: Fit | None = None
    extensions: tuple[Extension, ...] = ()

    def __post_init__(self) -> None:
        n_h = np.size(self.levels) - 1
        if np.size(self.weights) != n_h * (n_h + 1) // 2:
            raise DataError(
                f"a model with {n_h} levels has {n_h * (n_h + 1) // 2} cells, "
                f"but weights holds {np.size(self.weights)}",
                hint="identify the model again: pulsetrainer identify RUN.h5 -o model.h5",
            )


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
        _check_equal_length(self, ("time_s", "target", "compensated", "scaled", "predicted", "scored"))
        _check_time(self)
        if self.time_s.size < 2:
            raise DataError(
                f"a waveform of {self.time_s.size} samples is none", hint="make it again: pulsetrainer invert"
            )


@dataclass(frozen=True, slots=True)
class DrivePlayback:
    """What the device measured while it played one drive, repeat by repeat; NaN where a block was lost."""

    reference: Annotated[FloatArray, Data("@input_unit", "reference as played", "repeat", "time")]  # (r, n)
    input: Annotated[FloatArray, Data("@input_unit", "measured input", "repeat", "time")]  # (r, n)
    output: Annotated[FloatArray, Data("@output_unit", "measured output", "repeat", "time")]  # (r, n)
    input_unit: str = "A"
    output_unit: str = "N"


@dataclass(frozen=True, slots=True)
class Playback:
    """A waveform and what the device measured for each of its drives."""

    kind: ClassVar[str] = "playback"

    time_s: Annotated[FloatArray, Data("s", "time", "time", path="time")]  # (n,)
    waveform: Waveform
    compensated: DrivePlayback
    scaled: DrivePlayback
    input_range: Annotated[
        float, Data("@input_unit", "full range of the drive current")
    ]  # for tracking in percent
    input_unit: str = "A"
    complete: bool = True
    dropped_samples: int = 0


@dataclass(frozen=True, slots=True)
class DriveError:
    """Errors of one drive, in percent of the full applied force, over all scored samples of all repeats."""

    mean_abs_error_percent: Annotated[float, Data("percent", "mean absolute error, of full force")]
    max_abs_error_percent: Annotated[float, Data("percent", "largest absolute error, of full force")]
    rms_error_percent: Annotated[float, Data("percent", "rms error, of full force")]
    hysteresis_percent: Annotated[
        float, Data("percent", "loop area of force against target, of full force squared, per beat")
    ]
    current_tracking_max_percent: Annotated[
        float, Data("percent", "largest current tracking error, of the range")
    ]
    output: Annotated[
        FloatArray, Data("@output_unit", "mean measured output over the repeats", "time")
    ]  # (n,)
    output_unit: str = "N"


@dataclass(frozen=True, slots=True)
class WaveformEvaluation:
    """The figures of one played waveform."""

    name: str
    inversion: str
    repeats: int
    time_s: Annotated[FloatArray, Data("s", "time", "time", path="time")]  # (n,) scored samples only
    target: Annotated[FloatArray, Data("@output_unit", "target", "time")]  # (n,)
    scaled: DriveError
    compensated: DriveError
    mean_error_reduction_percent: Annotated[float, Data("percent", "reduction of the mean absolute error")]
    full_force: Annotated[float, Data("@output_unit", "full applied force")]
    noise_percent: Annotated[float, Data("percent", "spread between repeats, of full force")]
    output_unit: str = "N"


@dataclass(frozen=True, slots=True)
class ModelEvaluation:
    """The prediction error of one model on a held-out run."""

    name: str
    rms: Annotated[float, Data("@output_unit", "rms prediction error")]
    rms_percent: Annotated[float, Data("percent", "rms prediction error, of the output span")]
    max_percent: Annotated[float, Data("percent", "largest prediction error, of the output span")]
    gain_percent: Annotated[float, Data("percent", "reduction of the rms against the first model")]
    time_s: Annotated[FloatArray | None, Data("s", "time", "time", path="time")]  # thinned for the figures
    output: Annotated[FloatArray, Data("@output_unit", "measured output", "time")]
    predicted: Annotated[FloatArray, Data("@output_unit", "predicted output", "time")]
    output_unit: str = "N"
    # how far the measured output lies above the predicted one, and what is left when that is taken out
    offset: Annotated[float, Data("@output_unit", "offset of the run against the model")] = float("nan")
    shape_rms_percent: Annotated[
        float, Data("percent", "rms prediction error with the run's own offset, of the output span")
    ] = float("nan")
    # what a user has who sets the zero first: nothing of the half that is scored was known
    second_half_percent: Annotated[
        float, Data("percent", "rms prediction error of the second half, with the zero of the first half")
    ] = float("nan")
    start: str = "known"  # the state before the run: known, or which one was estimated
    outside_percent: Annotated[float, Data("percent", "samples outside the range of the model")] = 0.0


@dataclass(frozen=True, slots=True)
class Evaluation:
    """An error report: of played waveforms, or of models on a held-out run."""

    kind: ClassVar[str] = "evaluation"

    waveforms: tuple[WaveformEvaluation, ...] = ()
    models: tuple[ModelEvaluation, ...] = ()
    model: Model | None = None  # the model behind the first waveform, for the figures


@dataclass(frozen=True, slots=True)
class Cause:
    """What a diagnosis says about one cause."""

    cause: str
    found: bool
    p_value: float  # over the whole library; 0 for what is read off the raw data
    explains_percent: float  # of the reducible part of the baseline's squared error
    held_out_gain_percent: float  # of the reducible part; NaN where it was not measured
    parameters: tuple[Parameter, ...] = ()
    confounded_with: tuple[str, ...] = ()
    text: str = ""  # in words


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
class Diagnosis:
    """What a model gets wrong on some runs, why, and the model extended by the causes found."""

    kind: ClassVar[str] = "diagnosis"

    verdict: str  # a cause's id, "none" or "unknown"
    quick: bool  # screened only: figures are those of linearised scores
    rms: Annotated[float, Data("@output_unit", "rms error of the model as it was given")]
    rms_percent: Annotated[float, Data("percent", "rms error of the model as it was given, of the span")]
    noise_percent: Annotated[float, Data("percent", "white noise of single samples, rms, of the span")]
    static_percent: Annotated[
        float, Data("percent", "rms residual of averages, weights refitted, of the span")
    ]
    extended_percent: Annotated[float, Data("percent", "rms residual of averages, extended, of the span")]
    floor_percent: Annotated[
        float, Data("percent", "rms residual of averages when nothing is wrong, of the span")
    ]
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


KINDS: dict[str, type] = {k.kind: k for k in (Run, Model, Waveform, Playback, Evaluation, Diagnosis)}
