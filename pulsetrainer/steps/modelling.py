"""Between artefacts and the core: a stored model as an operator, a stored run as a record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import Model, Run
from pulsetrainer.core.memory import State, positive_saturation
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.record import Record
from pulsetrainer.errors import DataError

if TYPE_CHECKING:
    from pulsetrainer.diagnosis.extended import Extended

_SHORTEST_PART = 100  # samples


def extended_of(model: Model) -> Extended:
    """Return a stored model with its extensions, ready to predict and to be inverted.

    Raises
    ------
    ArgumentError
        Edges or weights are not those of a Preisach plane.
    DataError
        The model was extended by causes that this version does not know.
    """
    from pulsetrainer.diagnosis.extended import Extended  # and with it scipy.signal and scipy.stats

    named = [(one.cause, tuple(p.value for p in one.parameters)) for one in model.extensions]
    return Extended.of(operator_of(model), named)


def predict(model: Model, inputs: FloatArray, dt_s: float | None, start: State | None = None) -> FloatArray:
    """Output (n,) that a stored model predicts for an input (n,) at even steps, from ``start``.

    Raises
    ------
    DataError
        The model has extensions, but the time step is unknown; or as ``extended_of``.
    """
    if not model.extensions:
        return operator_of(model)(inputs, start)
    if dt_s is None:
        raise DataError(
            f"the model is extended by {', '.join(e.cause for e in model.extensions)}, which need to know "
            "the time, and the run has none",
            hint="import the run again with --time COLUMN or --rate HZ",
        )
    return extended_of(model)(inputs, dt_s)


def step_of(run: Run) -> float | None:
    """Time step of a run, s; None where it has no time."""
    if run.time_s is None or run.time_s.size < 2:
        return None
    return float(np.median(np.diff(run.time_s)))


def operator_of(model: Model) -> Preisach:
    """Return the static Preisach operator of a stored model, without its extensions.

    Raises
    ------
    ArgumentError
        Edges or weights are not those of a Preisach plane.
    DataError
        The model's reading is unknown.
    """
    if model.reading not in ("continuous", "relay"):
        raise DataError(
            f"the model's reading must be 'continuous' or 'relay', got {model.reading!r}",
            hint="identify the model again",
        )
    return Preisach(
        Plane(model.edges),
        model.weights,
        model.offset,
        "relay" if model.reading == "relay" else "continuous",
        model.polarity,
    )


def parts_of(run: Run) -> tuple[Run, ...]:
    """Return the parts of a run that are long enough to say something: each is a record of its own.

    After a seam the device had been off: what is slow in it (heat, creep) does not go on where it was. Each
    part begins at the low end of the input, so that its memory is known.
    """
    parts = run.parts()
    return tuple(part for part in parts if part.input.size >= _SHORTEST_PART) or (run,)


def known_from(inputs: FloatArray, low: float, high: float) -> int:
    """First sample (n,) at which the memory is known, whatever came before the record.

    Where the input reaches an end of [low, high], every remembered extreme is wiped out. Reached means within
    1 % of the range: a noisy record touches its extreme only once, late. An input that never gets there is
    known, up to a constant, from where it first reaches an end of its own range: see ``start_of``.
    """
    near = 0.01 * (high - low)
    ends = np.flatnonzero((inputs <= low + near) | (inputs >= high - near))
    return int(ends[0]) if ends.size else first_extreme(inputs)[0]


def first_extreme(inputs: FloatArray) -> tuple[int, bool]:
    """First sample (n,) within 1 % of an end of the input's own range, and whether that is the top."""
    bottom, top = float(inputs.min()), float(inputs.max())
    near = 0.01 * (top - bottom)
    at = int(np.flatnonzero((inputs <= bottom + near) | (inputs >= top - near))[0])
    return at, bool(inputs[at] >= top - near)


def start_of(inputs: FloatArray, low: float, high: float) -> State | None:
    """State from which a record is followed; None is negative saturation.

    A record that swings within [low, high] and never reaches its ends leaves the relays outside its own
    range as they were. Once it has visited both of its own extremes they add a constant, whatever they are
    (congruency, Mayergoyz 2003, section 1.2). So that its first branch already is that of its closed loop,
    it is started from the saturation opposite to the extreme it visits first.
    """
    near = 0.01 * (high - low)
    if np.any((inputs <= low + near) | (inputs >= high - near)) or first_extreme(inputs)[1]:
        return None
    return positive_saturation(low, high)


def record_of(run: Run, low: float, high: float, shift: float = 0.0) -> Record:
    """Return a run as a record to fit; samples before the memory is known have no weight.

    ``shift`` is the offset of this run's output against that of the others, output unit: it is taken out.

    Raises
    ------
    ArgumentError
        The run holds too few samples, or NaN or infinity.
    """
    weight = np.ones(run.input.size)
    weight[: known_from(run.input, low, high)] = 0.0
    return Record(run.input, run.output - shift, weight, start_of(run.input, low, high))
