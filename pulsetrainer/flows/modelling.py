"""Between artefacts and the core: a stored model as an operator, a stored run as a record."""

from __future__ import annotations

import numpy as np

from pulsetrainer.artefacts.kinds import Model, Run
from pulsetrainer.core.identification import Record
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.errors import DataError


def operator_of(model: Model) -> Preisach:
    """Return the Preisach operator of a stored model.

    Raises
    ------
    ArgumentError
        Levels or weights are not those of a Preisach plane.
    DataError
        The model was extended by causes that this version cannot compute.
    """
    if model.operator not in ("continuous", "relay"):
        raise DataError(
            f"the model's operator must be 'continuous' or 'relay', got {model.operator!r}",
            hint="identify the model again",
        )
    return Preisach(
        Plane(model.levels),
        model.weights,
        model.offset,
        "relay" if model.operator == "relay" else "continuous",
        model.polarity,
    )


def known_from(inputs: FloatArray, low: float, high: float) -> int:
    """First sample at which the memory is known: where the input first reaches an end of [low, high].

    At an end every remembered extreme has been wiped out, whatever came before. Reached means within
    1 % of the range: a noisy record touches its extreme only once, late.
    """
    near = 0.01 * (high - low)
    ends = np.flatnonzero((inputs <= low + near) | (inputs >= high - near))
    return int(ends[0]) if ends.size else 0


def record_of(run: Run, low: float, high: float) -> Record:
    """Return a run as a record to fit or predict; samples before the memory is known have no weight.

    Raises
    ------
    ArgumentError
        The run holds too few samples, or NaN or infinity.
    """
    weight = np.ones(run.input.size)
    weight[: known_from(run.input, low, high)] = 0.0
    return Record(run.input, run.output, weight)
