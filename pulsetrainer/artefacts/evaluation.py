"""An evaluation: the errors of played waveforms, or of models on a run they were not fitted to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import Annotated, ClassVar

from pulsetrainer.artefacts.data import Data, FloatArray, percent
from pulsetrainer.artefacts.model import Model
from pulsetrainer.artefacts.shown import Shown

METRICS = ("mean_abs_error_percent", "max_abs_error_percent", "rms_error_percent", "hysteresis_percent",
           "current_tracking_max_percent")  # fmt: skip
MODEL_METRICS = (
    "rms", "rms_percent", "max_percent", "gain_percent", "offset", "shape_rms_percent", "second_half_percent",
)  # fmt: skip
# What a person wants to see first of evaluations and sessions side by side; the others on request.
HEADLINES = (
    "mean_error_reduction_percent", "compensated.mean_abs_error_percent", "compensated.max_abs_error_percent",
    "rms_percent", "max_percent", "right_percent", "right_from_percent", "right_to_percent", "response_s",
    "pressed.mean_abs_error_percent",
)  # fmt: skip
# Carneiro, Abreu, Restivo, Sensors 2018, 18(5), 1631: the published device. The maxima are given for the
# device as a whole, so they stand beside both pulses.
_PUBLISHED_MAXIMA = {"scaled.max_abs_error_percent": 28.7, "compensated.max_abs_error_percent": 7.8}
PUBLISHED: dict[str, dict[str, float]] = {
    "normal": {"mean_error_reduction_percent": 73.9, **_PUBLISHED_MAXIMA},
    "bifid": {"mean_error_reduction_percent": 70.3, **_PUBLISHED_MAXIMA},
}


@dataclass(frozen=True, slots=True)
class DriveError:
    """Errors of one drive, in percent of the full applied force, over all scored samples of all repeats."""

    mean_abs_error_percent: Annotated[float, percent("mean absolute error, of full force")]
    max_abs_error_percent: Annotated[float, percent("largest absolute error, of full force")]
    rms_error_percent: Annotated[float, percent("rms error, of full force")]
    hysteresis_percent: Annotated[
        float, percent("loop area of force against target, of full force squared, per beat")
    ]
    current_tracking_max_percent: Annotated[float, percent("largest current tracking error, of the range")]
    # (n,)
    output: Annotated[FloatArray, Data("@output_unit", "mean measured output over the repeats", "time")]
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
    mean_error_reduction_percent: Annotated[float, percent("reduction of the mean absolute error")]
    full_force: Annotated[float, Data("@output_unit", "full applied force")]
    noise_percent: Annotated[float, percent("spread between repeats, of full force")]
    output_unit: str = "N"
    # of the drive of which it is larger
    error_spread_percent: Annotated[
        float, percent("standard deviation of the mean error from repeat to repeat, of full force")
    ] = nan
    # (r,) before each compensated drive, where the heat was tracked
    temperature_K: Annotated[
        FloatArray | None, Data("K", "copper warmer than at calibration", "repeat", path="temperature")
    ] = None

    def figures(self) -> dict[str, float]:
        """Figures by dotted name within the waveform: ``scaled.max_abs_error_percent``."""
        drives = (("scaled", self.scaled), ("compensated", self.compensated))
        errors = {f"{name}.{metric}": getattr(drive, metric) for name, drive in drives for metric in METRICS}
        return {"mean_error_reduction_percent": self.mean_error_reduction_percent, **errors}


@dataclass(frozen=True, slots=True)
class ModelEvaluation:
    """The prediction error of one model on a held-out run."""

    name: str
    rms: Annotated[float, Data("@output_unit", "rms prediction error")]
    rms_percent: Annotated[float, percent("rms prediction error, of the output span")]
    max_percent: Annotated[float, percent("largest prediction error, of the output span")]
    gain_percent: Annotated[float, percent("reduction of the rms against the first model")]
    time_s: Annotated[FloatArray | None, Data("s", "time", "time", path="time")]  # thinned for the figures
    output: Annotated[FloatArray, Data("@output_unit", "measured output", "time")]
    predicted: Annotated[FloatArray, Data("@output_unit", "predicted output", "time")]
    output_unit: str = "N"
    # how far the measured output lies above the predicted one, and what is left when that is taken out
    offset: Annotated[float, Data("@output_unit", "offset of the run against the model")] = nan
    shape_rms_percent: Annotated[
        float, percent("rms prediction error with the run's own offset, of the output span")
    ] = nan
    # what a user has who sets the zero first: nothing of the half that is scored was known
    second_half_percent: Annotated[
        float, percent("rms prediction error of the second half, with the zero of the first half")
    ] = nan
    start: str = "known"  # the state before the run: known, or which one was estimated
    outside_percent: Annotated[float, percent("samples outside the range of the model")] = 0.0

    @property
    def short_name(self) -> str:
        """Name of the model without the folder and the ending of its file."""
        return self.name.replace("\\", "/").rpartition("/")[2].removesuffix(".h5")

    def figures(self) -> dict[str, float]:
        """Figures by name."""
        return {metric: getattr(self, metric) for metric in MODEL_METRICS}


@dataclass(frozen=True, slots=True, repr=False)
class Evaluation(Shown):
    """An error report: of played waveforms, or of models on a held-out run.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> report = pt.load("tests/data/files-0.1/evaluation.h5")
    >>> figures = report.figures()
    >>> figures["pulse.continuous.mean_error_reduction_percent"] > 0
    True
    """

    kind: ClassVar[str] = "evaluation"

    waveforms: tuple[WaveformEvaluation, ...] = ()
    models: tuple[ModelEvaluation, ...] = ()
    model: Model | None = None  # the model behind the last waveform, for the figures
    notes: tuple[str, ...] = ()  # what a person should know about the comparison
    warnings: tuple[str, ...] = ()  # why the models may be the wrong ones for it

    def figures(self) -> dict[str, float]:
        """All figures by dotted name: ``normal.continuous.scaled.max_abs_error_percent``."""
        parts = [*(w.figures() for w in self.waveforms), *(m.figures() for m in self.models)]
        return {
            f"{stem}.{name}": value
            for stem, figures in zip(self.stems, parts, strict=True)
            for name, value in figures.items()
        }

    @property
    def stems(self) -> tuple[str, ...]:
        """What the figures of each waveform, then of each model, begin with; a repeated one has a number.

        ``normal.continuous``, ``normal.continuous#2``, ``bifid.continuous``.
        """
        names = [*(f"{w.name}.{w.inversion}" for w in self.waveforms), *(m.short_name for m in self.models)]
        before = [names[:k].count(name) for k, name in enumerate(names)]
        return tuple(f"{name}#{n + 1}" if n else name for name, n in zip(names, before, strict=True))

    def told_apart(self) -> Evaluation:
        """Return the evaluation with a number in each repeated inversion of a pulse, as in ``stems``."""
        pairs = zip(self.waveforms, self.stems, strict=False)
        return replace(
            self, waveforms=tuple(replace(w, inversion=stem.removeprefix(f"{w.name}.")) for w, stem in pairs)
        )
