"""A model: the Preisach weights, the offset, and the causes it was extended by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from pulsetrainer.artefacts.data import Attribute, BoolArray, Data, FloatArray
from pulsetrainer.errors import DataError


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

    edges: Annotated[
        FloatArray,
        Data("@input_unit", "input levels: edges of the cells", "level", path="levels", finite=True),
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
    reading: Annotated[str, Attribute("operator")] = "continuous"  # of the weights: "continuous" | "relay"
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
        n_h = np.size(self.edges) - 1
        if np.size(self.weights) != n_h * (n_h + 1) // 2:
            raise DataError(
                f"a model with {n_h} levels has {n_h * (n_h + 1) // 2} cells, "
                f"but weights holds {np.size(self.weights)}",
                hint="identify the model again: pulsetrainer identify RUN.h5 -o model.h5",
            )
