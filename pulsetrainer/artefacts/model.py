"""A model: the Preisach weights, the offset, and the causes it was extended by."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from importlib import import_module
from math import nan
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.artefacts.data import Attribute, BoolArray, Data, FloatArray, percent
from pulsetrainer.artefacts.run import Coil
from pulsetrainer.artefacts.shown import Shown
from pulsetrainer.errors import DataError

FORMS = ("direct", "dual", "signed")


@dataclass(frozen=True, slots=True)
class Fit:
    """How well the model describes the data it was identified on."""

    rms: Annotated[float, Data("@output_unit", "rms error of the fit")]
    max_abs: Annotated[float, Data("@output_unit", "largest error of the fit")]
    rms_percent: Annotated[float, percent("rms error of the fit, of the output span")]
    coverage_percent: Annotated[float, percent("cells switched on and off by the input")]
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
    max_percent: Annotated[float, percent("largest error of the fit, of the output span")] = nan
    # standard deviation; NaN where the records cannot tell
    input_noise: Annotated[float, Data("@input_unit", "noise of the measured input")] = nan
    false_reversals: int = 0  # taken out of the input before the fit
    # of each run's output against their mean; zeros where one offset serves all
    offsets: tuple[float, ...] = ()
    spacing: str = "even"  # of the levels: "even", or "crowded" where the loop is steep
    stiffness: float = 0.0  # t, how alike the loops are along the diagonal; 0: the density is free
    warning: str = ""  # that this kind of model is the wrong one, in words; empty where it is not
    masked_samples: int = 0  # wild ones, left out of the fit
    # of the identification record: what was measured there
    wild_input: Annotated[FloatArray | None, Data("@input_unit", "input of wild samples", "wild")] = None
    wild_output: Annotated[FloatArray | None, Data("@output_unit", "output of wild samples", "wild")] = None
    # of the cells within the range, told apart by minor loops, and not by the major loop only; NaN: unknown
    minor_percent: float = nan
    # "counterclockwise" | "clockwise" | "butterfly" | "none", of a falling output once it is turned to rise;
    loop: str = ""  # empty in files of 0.1
    notes: tuple[str, ...] = ()  # what a person should know about the fit

    @property
    def output_uncertainty(self) -> float | None:
        """Mean half width of the 90 % band of the predicted output, output unit; None without a bootstrap."""
        if self.predicted_lower is None or self.predicted_upper is None:
            return None
        return 0.5 * float(np.mean(self.predicted_upper - self.predicted_lower))


@dataclass(frozen=True, slots=True)
class Seen:
    """What the records of a model held, and what the model misses of them."""

    rms_percent: Annotated[float, percent("rms error of the model, of the output span")]
    max_percent: Annotated[float, percent("largest error of the model, of the output span")]
    input_low: Annotated[float, Data("@input_unit", "lowest input of the records")]
    input_high: Annotated[float, Data("@input_unit", "highest input of the records")]
    output_low: Annotated[float, Data("@output_unit", "lowest output of the records")]
    output_high: Annotated[float, Data("@output_unit", "highest output of the records")]
    input_unit: str = "A"
    output_unit: str = "N"

    @classmethod
    def of(
        cls, missed: tuple[float, float], inputs: FloatArray, outputs: FloatArray, units: tuple[str, str]
    ) -> Seen:
        """Return what inputs and outputs (n,) hold, beside the rms and the largest error, % of the span."""
        low, high = float(np.nanmin(inputs)), float(np.nanmax(inputs))
        return cls(*missed, low, high, float(np.nanmin(outputs)), float(np.nanmax(outputs)), *units)


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of an extension, with its confidence interval."""

    name: str
    value: float
    unit: str
    lower: float
    upper: float
    meaning: str = ""  # of what it is, in words; empty in files of 0.1

    @property
    def chosen(self) -> bool:
        """Whether it was chosen from a few, such as how many time constants there are: it has no interval."""
        return self.lower == self.upper


@dataclass(frozen=True, slots=True)
class Extension:
    """One named cause with which a model is extended."""

    cause: str
    parameters: tuple[Parameter, ...]


@dataclass(frozen=True, slots=True, repr=False)
class Model(Shown):
    """An identified Preisach model: weights mu-hat per cell and offset y0-hat (Carneiro 2018, eq. 2).

    ``form`` says what the weights are of: "direct", y = P[u] with mu >= 0; "dual", u = P[y] with mu >= 0,
    with edges of the output and an offset of the input; "signed", y = P[u] with mu of either sign.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> model = pt.load("tests/data/files-0.1/model.h5")
    >>> model.levels, model.weights.size, model.form
    (8, 36, 'direct')
    >>> model.predict([0.0, 1.0, 0.5], dt_s=1e-3).round(2)
    array([ 0.51, 10.52,  7.85])
    """

    kind: ClassVar[str] = "model"

    # (L,), (q,) in the order of core.plane
    edges: Annotated[
        FloatArray, Data("@edges_unit", "levels: edges of the cells", "level", path="levels", finite=True)
    ]
    weights: Annotated[FloatArray, Data("@weights_unit", "Preisach weights mu", "cell", finite=True)]
    offset: Annotated[float, Data("@offset_unit", "offset y0", finite=True)]
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
    form: str = "direct"  # "direct" | "dual" | "signed"
    as_measured: bool = False  # signs of parameters are those of the output; files of 0.1: of a rising one
    captured: bool = True  # on our own device; files of 0.1 do not say, and were
    serial: str = ""  # serial number of the device that captured all of its runs
    coil: Coil | None = None  # of the first run that has one
    edges_unit: str = ""  # of the input, of a dual model of the output: follows from the form
    offset_unit: str = ""  # of the output, of a dual model of the input: follows from the form
    seen: Seen | None = None  # in all of its records

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise DataError(
                f"the form of a model is one of {', '.join(FORMS)}, this one has {self.form!r}",
                hint="identify the model again, with pulsetrainer identify",
            )
        units = (self.input_unit, self.output_unit)
        edges, offset = units[::-1] if self.form == "dual" else units
        object.__setattr__(self, "edges_unit", edges)
        object.__setattr__(self, "offset_unit", offset)
        n_h = np.size(self.edges) - 1
        if np.size(self.weights) != n_h * (n_h + 1) // 2:
            raise DataError(
                f"a model with {n_h} levels has {n_h * (n_h + 1) // 2} cells, "
                f"but weights holds {np.size(self.weights)}",
                hint="identify the model again, with pulsetrainer identify",
            )

    @property
    def fingerprint(self) -> str:
        """Digest of what it predicts: equal for equal models."""
        said = (self.form, self.reading, self.polarity, self.extensions, self.input_unit, self.output_unit)
        parts = [np.append(one, self.offset).tobytes() for one in (self.edges, self.weights)]
        return hashlib.sha256(b"".join((*parts, repr(said).encode()))).hexdigest()

    @property
    def known(self) -> Seen | None:
        """What its records held, and what it misses of them; of older files what the fit kept, or None."""
        fit = self.fit
        if self.seen or fit is None or not (np.isfinite(fit.input).any() and np.isfinite(fit.output).any()):
            return self.seen
        missed, units = (fit.rms_percent, fit.max_percent), (self.input_unit, self.output_unit)
        return Seen.of(missed, fit.input, fit.output, units)

    @property
    def edges_quantity(self) -> str:
        """Quantity of the edges: the input's; in a dual model, the output's."""
        return self.output_quantity if self.form == "dual" else self.input_quantity

    @property
    def levels(self) -> int:
        """Number of levels n_h of the plane."""
        return int(self.edges.size) - 1

    def predict(self, inputs: ArrayLike, dt_s: float | None = None) -> FloatArray:
        """Output (n,) for an input (n,) at even steps of ``dt_s`` s, from negative saturation.

            y_t = y0 + sum_k mu_k A_k r_k(u_0 .. u_t)    (Carneiro 2018, eq. 2), then the extensions

        Raises
        ------
        DataError
            The model has extensions, which depend on time, and ``dt_s`` is not given.
        ArgumentError
            The input is not a row of finite numbers.

        Examples
        --------
        >>> import numpy as np, pulsetrainer as pt
        >>> edges = np.array([0.0, 0.5, 1.0])
        >>> model = pt.Model(edges=edges, weights=np.ones(3), offset=0.5, covered=np.ones(3, bool))
        >>> model.predict([0.0, 1.0, 0.5, 0.0])
        array([0.  , 1.  , 0.75, 0.  ])
        """
        # what a model predicts is the business of a floor above, which knows the causes
        prediction = import_module("pulsetrainer.diagnosis.prediction")
        return prediction.predict(self, np.asarray(inputs, dtype=np.float64), dt_s)
