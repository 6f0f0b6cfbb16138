"""From runs and a model to the question: records on even time steps, of polarity 1, in the model's range."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pulsetrainer.artefacts import Model, Run
from pulsetrainer.core.initial_state import known_from
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.record import Record
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
    names: Sequence[str] = (),
) -> Question:
    """Return the question that runs ask of a model; ``names`` of the runs and of the model are for messages.

    Raises
    ------
    DataError
        Runs and model differ in their units or ranges, the model cannot be diagnosed, or a run is too
        short, or has too many gaps or samples without a number.
    """
    low, high = float(model.edges[0]), float(model.edges[-1])
    *called, model_name = names or (*(f"run {k}" for k in range(1, len(runs) + 1)), "the model")
    records, notes = [], []
    for name, run in zip(called, runs, strict=True):
        _check_fits(name, run, model_name, model)
        parts = run.parts(LIMITS.least_samples)
        records += [measured_of(name, part, model.polarity, low, high) for part in parts]
        if not run.complete:
            notes.append(f"{name} is incomplete; diagnosing the {run.input.size} samples it has")
    given = Given(model, runs[0].input_quantity, runs[0].output_quantity)
    return Question(records, low, high, rng, quick, progress, given, tuple(notes))


def _check_fits(name: str, run: Run, model_name: str, model: Model) -> None:
    """Raise DataError unless run and model can be of one device."""
    if (run.input_unit, run.output_unit) != (model.input_unit, model.output_unit):
        raise DataError(
            f"{name} is in {run.input_unit} and {run.output_unit}, but {model_name} was identified in "
            f"{model.input_unit} and {model.output_unit}",
            hint="use a model of the same device, in the same units",
        )
    if model.reading != "continuous":
        raise DataError(
            f"{model_name} reads its weights as relays, whose steps would be mistaken for causes",
            hint="identify it with the continuous operator: pulsetrainer identify RUN.h5 -o model.h5",
        )
    low, high = float(model.edges[0]), float(model.edges[-1])
    u, slack = run.input[np.isfinite(run.input)], LIMITS.beyond_range * (high - low)
    inside = (u >= low - slack) & (u <= high + slack)
    if u.size == 0 or np.mean(inside) < LIMITS.least_inside:
        span = f"{u.min():.4g} .. {u.max():.4g}" if u.size else "nothing"
        raise DataError(
            f"most of the input of {name} ({span} {run.input_unit}) lies outside the range of {model_name} "
            f"({low:.4g} .. {high:.4g} {model.input_unit})",
            hint="if the model is of another device, identify this one first",
        )


def measured_of(name: str, run: Run, polarity: int, low: float, high: float) -> Record:
    """Return a run on even time steps; filled gaps and samples that are not numbers have no weight.

    Raises
    ------
    DataError
        The run is too short, or has more gaps than samples.
    """
    if run.input.size < LIMITS.least_samples:
        raise DataError(
            f"{name} has only {run.input.size} samples, too few to tell causes apart", hint="record longer"
        )
    step = run.dt_s
    if step is None or run.time_s is None:
        return _untimed(name, run, polarity, low, high)
    t = run.time_s - run.time_s[0]
    count = round(float(t[-1]) / step) + 1
    if count * LIMITS.least_present > t.size:
        raise DataError(
            f"{name} has {t.size} samples where even steps of {step:.4g} s would have {count}: "
            "most of it is gaps",
            hint="cut it into several runs at the gaps",
        )
    good = np.isfinite(run.input) & np.isfinite(run.output)
    if good.sum() < LIMITS.least_samples:
        raise DataError(f"{name} has only {good.sum()} samples with numbers in them", hint="record it again")
    grid = np.arange(count) * step
    following = np.clip(np.searchsorted(t[good], grid), 1, int(good.sum()) - 1)
    hole = t[good][following] - t[good][following - 1] > LIMITS.gap_steps * step
    u, y = np.interp(grid, t[good], run.input[good]), np.interp(grid, t[good], run.output[good])
    reference = None if run.reference is None else np.interp(grid, t, run.reference)
    weight = np.where(hole, 0.0, 1.0)
    weight[: known_from(u, low, high)] = 0.0
    return _slower(Record(u, polarity * y, weight, dt_s=step, reference=reference))


def _slower(record: Record) -> Record:
    """Return a record that is no faster than causes need, averaged down."""
    per = max(1, round(1.0 / (LIMITS.fastest_Hz * record.step)))
    if per == 1:
        return record
    cut = record.input.size // per * per

    def averaged(x: FloatArray) -> FloatArray:
        return np.asarray(x[:cut].reshape(-1, per).mean(axis=1))

    return Record(
        averaged(record.input),
        averaged(record.output),
        np.where(averaged(record.sample_weight) < 1.0, 0.0, 1.0),
        dt_s=record.step * per,
        reference=None if record.reference is None else averaged(record.reference),
    )


def _untimed(name: str, run: Run, polarity: int, low: float, high: float) -> Record:
    """Return a run of which only the order of the samples is known."""
    if not (np.isfinite(run.input).all() and np.isfinite(run.output).all()):
        raise DataError(f"{name} has samples without a number", hint="record it again")
    weight = np.ones(run.input.size)
    weight[: known_from(run.input, low, high)] = 0.0
    return Record(run.input, polarity * run.output, weight, reference=run.reference)
