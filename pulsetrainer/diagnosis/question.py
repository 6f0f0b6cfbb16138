"""From runs and a model to the question: records as measured, of polarity 1, in the model's range."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pulsetrainer.artefacts import Model, Run
from pulsetrainer.artefacts.units import counted, in_units, same_units, units_alike, with_unit
from pulsetrainer.core.coverage import covers_range
from pulsetrainer.core.initial_state import first_stroke_words, known_from
from pulsetrainer.core.plane import BoolArray, FloatArray, ends_of
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.diagnosis.state import Given, Question
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.errors import DataError


def question_of(
    runs: Sequence[Run],
    model: Model,
    *,
    rng: np.random.Generator,
    quick: bool,
    progress: Callable[[float], None],
    names: Sequence[str],
    named: bool = False,
) -> Question:
    """Return the question that runs ask of a model; ``names`` of the runs and of the model are for messages.

    Where a person ``named`` the runs, evidence calls the records so too; else they are numbered.

    DataError where runs and model differ in their units or ranges, the model cannot be diagnosed, or a run is
    too short, or has too few samples with a number.
    """
    low, high = range_of(model, runs)
    *called, model_name = names
    records, notes, fingerprints, titles = [], [], [], []
    stamps: list[FloatArray | None] = []
    corrected: list[tuple[str, ...]] = []
    for name, run in zip(called, runs, strict=True):
        _check_fits(name, run, model_name, model)
        parts = list(run.parts(LIMITS.least_samples))
        titles += [name] if len(parts) == 1 else [f"{name}, part {k}" for k in range(1, len(parts) + 1)]
        for part in parts:
            record, times = measured_of(name, part, model.polarity, low, high)
            records.append(record)
            fingerprints.append(part.fingerprint)
            stamps.append(times)
            corrected.append(run.corrected)
            words = first_stroke_words(record.input, record.output, low, high)
            notes += [f"{name}: {words}"] if words else []
        if run.gap_words:
            notes.append(f"{name}: {run.gap_words}")
        if not run.complete:
            notes.append(f"{name} is incomplete; diagnosing the {run.input.size} samples it has")
    if not covers_range([one.input for one in records], low, high):
        notes.append(_outside_words(records, model_name, model.input_unit, low, high))
    ours = all(
        run.reference is not None and (run.input_quantity, run.output_quantity) == ("current", "force")
        for run in runs
    )
    quantities = (runs[0].input_quantity, runs[0].output_quantity)
    given = Given(model, *quantities, ours, tuple(fingerprints), tuple(titles) if named else ())
    return Question(records, low, high, rng, quick, progress, given, tuple(notes), stamps, corrected)


def _outside_words(records: Sequence[Record], model_name: str, unit: str, low: float, high: float) -> str:
    """Say that records leave out a part of a model's range, and what comes of it."""
    ends = (ends_of([one.input for one in records]), (low, high))
    reached, whole = (with_unit(f"{bottom:.4g} .. {top:.4g}", unit) for bottom, top in ends)
    return f"the input covers {reached} of the {whole} of {model_name}, whose weights beyond stay as they are"


def _check_fits(name: str, run: Run, model_name: str, model: Model) -> None:
    """Raise DataError unless run and model can be of one device."""
    if not same_units((run.input_unit, run.output_unit), (model.input_unit, model.output_unit)):
        raise DataError(
            f"{name} {in_units(run)}, but {model_name} {in_units(model)}",
            hint=units_alike(name, run, model_name, model, "give a model of the device of that run")
            or "use a model of the same device; in other units, convert the columns and import again",
        )
    if model.reading != "continuous":
        raise DataError(
            f"{model_name} reads its weights as relays, whose steps would be mistaken for causes",
            hint="identify it with `reading` continuous, which is the default",
        )
    low, high = input_range(model)
    u, slack = run.input[np.isfinite(run.input)], LIMITS.beyond_range * (high - low)
    inside = (u >= low - slack) & (u <= high + slack)
    if u.size == 0 or np.mean(inside) < LIMITS.least_inside:
        span = f"{u.min():.4g} .. {u.max():.4g}" if u.size else "nothing"
        raise DataError(
            f"most of the input of {name} ({span} {run.input_unit}) lies outside the range of {model_name} "
            f"({low:.4g} .. {high:.4g} {model.input_unit})",
            hint="if the model is of another device, identify this one first",
        )


def input_range(model: Model) -> tuple[float, float]:
    """Return the range of the input that was identified; that of a dual operator is only near it."""
    operator, fit = operator_of(model), model.fit
    if model.form != "dual" or fit is None or fit.input.size == 0:
        return operator.low, operator.high
    return min(operator.low, float(fit.input.min())), max(operator.high, float(fit.input.max()))


def range_of(model: Model, runs: Sequence[Run]) -> tuple[float, float]:
    """Return the range between whose ends memory is wiped out: of a dual model where inputs went within it.

    A drift widens its operator, and no input comes near those ends.
    """
    low, high = input_range(model)
    if model.form != "dual" or model.fit is None:
        return low, high
    inputs = [one[np.isfinite(one)] for one in (model.fit.input, *(run.input for run in runs))]
    bottom, top = ends_of([one for one in inputs if one.size])
    return max(low, bottom), min(high, top)


def measured_of(
    name: str, run: Run, polarity: int, low: float, high: float
) -> tuple[Record, FloatArray | None]:
    """Return the samples of a run that are numbers, and their times; None where the steps are even.

    DataError where the run is too short.
    """
    good = told_in(run)
    if good.sum() < LIMITS.least_samples:
        raise DataError(
            f"{name} has only {counted(int(good.sum()), 'sample')} with numbers, "
            "too few to tell causes apart",
            hint="record longer",
        )
    u = run.input[good]
    weight = np.ones(u.size)
    weight[: known_from(u, low, high, run.output[good])] = 0.0
    if run.masked is not None:
        weight[run.masked[good]] = 0.0
    reference = None if run.reference is None else run.reference[good]
    step, stamps = _time_of(run, good)
    return Record(u, polarity * run.output[good], weight, dt_s=step, reference=reference), stamps


def told_in(run: Run) -> BoolArray:
    """Tell which samples (n,) of a run are numbers."""
    good = np.isfinite(run.input) & np.isfinite(run.output)
    return good if run.reference is None else good & np.isfinite(run.reference)


def _time_of(run: Run, good: BoolArray) -> tuple[float | None, FloatArray | None]:
    """Return the usual time step, and the times of the good samples where they are not even."""
    if run.time_s is None or run.dt_s is None:
        return None, None
    stamps = run.time_s[good] - run.time_s[good][0]
    mean = float(stamps[-1]) / (stamps.size - 1)
    even = np.abs(stamps - np.arange(stamps.size) * mean) < LIMITS.even_within * mean
    return (mean, None) if even.all() else (run.dt_s, stamps)
