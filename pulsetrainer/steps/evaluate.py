"""Evaluate: the force error of played waveforms, or the prediction error of models on a held-out run."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pulsetrainer.artefacts import (
    DriveError,
    DrivePlayback,
    Evaluation,
    Model,
    ModelEvaluation,
    Playback,
    Run,
    Session,
    WaveformEvaluation,
)
from pulsetrainer.artefacts.units import (
    in_units,
    same_units,
    units_alike,
)
from pulsetrainer.core import metrics
from pulsetrainer.core.initial_state import estimated_start, known_from, left_out_words, second_stroke
from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.prediction import operator_of, predict
from pulsetrainer.diagnosis.question import input_range, range_of
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.steps import run_notes
from pulsetrainer.steps.arguments import check_measured, named, several
from pulsetrainer.steps.identify import SHORTEST_PART, TRACE_SAMPLES, to_their_tips
from pulsetrainer.steps.misfit import misfit_words
from pulsetrainer.steps.one_thread import one_thread

_REPEATED = re.compile(r"#\d+(?=\.)")  # the number of a name that is there again
BEYOND = 0.005  # of the model's range: an input further out than this was never identified
_APART = 1.03  # times the error of the fit: so large a one asks for a reason
_TOLD = 0.1  # % of the samples, in figures


@one_thread
def evaluate(
    measured: Playback | Run | Sequence[Playback | Run | Session],
    models: Model | Sequence[Model] = (),
    *,
    names: Sequence[str] = (),
    model_names: Sequence[str] = (),
) -> Evaluation:
    """Return how large the errors are: of playbacks, or of the predictions of models on one run.

        e = output - target, % of the full force;    e = output - prediction, % of the output's span

    Parameters
    ----------
    measured
        One or several playbacks, or one run that the models were not fitted to.
    models
        Models to compare on the run; improvements are over the first one.
    names, model_names
        Names of what is measured and of the models, for the notes and the table.

    Raises
    ------
    UsageError
        A run without a model, several runs, playbacks with models, or sessions, which keep their own errors.
    DataError
        A playback holds no whole repeat, or a model is in other units than the run.

    Examples
    --------
    >>> import numpy as np, pulsetrainer as pt
    >>> u = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 0, 200)])
    >>> run = pt.Run(time_s=np.arange(400) / 100, input=u, output=2 * u)
    >>> pt.evaluate(run, [pt.identify(run, levels=8)]).models[0].rms_percent < 0.1
    True
    """
    given, tested = several(measured), several(models)
    titles = named(names, [f"{one.kind} {number}" for number, one in enumerate(given, 1)])
    called = named(model_names, [f"model {n}" for n in range(1, len(tested) + 1)], argument="model_names")
    check_measured(titles, given, tested)
    if tested:
        return _of_run(titles[0], given[0], tested, called)
    errors = tuple(_of_playback(name, one) for name, one in zip(titles, given, strict=True))
    return Evaluation(waveforms=errors, model=given[-1].waveform.model)


# --- playbacks ------------------------------------------------------------------------------------------


def _of_playback(name: str, playback: Playback) -> WaveformEvaluation:
    """Return the error figures of one playback over its scored samples, all repeats counted singly."""
    waveform = playback.waveform
    scored = waveform.scored
    repeats = playback.compensated.output.shape[0]
    if repeats == 0 or not scored.any():
        raise DataError(
            f"{name} holds no whole repeat to evaluate", hint="play it again: pulsetrainer play drive.h5"
        )
    scaled = _drive_error(playback, playback.scaled)
    compensated = _drive_error(playback, playback.compensated)
    spread = metrics.repeat_spread(playback.compensated.output[:, scored])
    return WaveformEvaluation(
        name=waveform.name,
        inversion=waveform.inversion,
        repeats=repeats,
        time_s=waveform.time_s[scored],
        target=waveform.target[scored],
        scaled=scaled,
        compensated=compensated,
        mean_error_reduction_percent=_gain_percent(
            compensated.mean_abs_error_percent, scaled.mean_abs_error_percent
        ),
        full_force=waveform.full_force,
        noise_percent=100.0 * spread / waveform.full_force,
        error_spread_percent=max(
            _error_spread(playback, drive) for drive in (playback.scaled, playback.compensated)
        ),
        output_unit=waveform.output_unit,
        temperature_K=playback.temperature_K,
    )


def _error_spread(playback: Playback, drive: DrivePlayback) -> float:
    """Standard deviation of the mean error from repeat to repeat, % of full force; 0 for one repeat."""
    waveform = playback.waveform
    error = np.abs(drive.output - waveform.target)[:, waveform.scored]
    means = 100.0 * np.nanmean(error, axis=1) / waveform.full_force
    return float(np.std(means, ddof=1)) if means.size > 1 else 0.0


def _drive_error(playback: Playback, drive: DrivePlayback) -> DriveError:
    waveform = playback.waveform
    full, scored = waveform.full_force, waveform.scored
    target, output = waveform.target[scored], drive.output[:, scored]
    errors = metrics.tracking(target, output, full)
    mean_output = metrics.mean_over_repeats(output)
    tracking = np.abs(drive.input - drive.reference)
    return DriveError(
        **errors._asdict(),
        hysteresis_percent=100.0 * metrics.loop_area(target, mean_output) / (full**2 * metrics.beats(target)),
        current_tracking_max_percent=100.0 * float(np.nanmax(tracking)) / playback.input_range,
        output=mean_output,
        output_unit=waveform.output_unit,
    )


# --- models on a run --------------------------------------------------------------------------------------


def _of_run(name: str, run: Run, models: Sequence[Model], model_names: Sequence[str]) -> Evaluation:
    if run.input.size < 2:
        raise DataError(f"{name} has one sample, which tells nothing of a model", hint="record a longer run")
    found: list[ModelEvaluation] = []
    notes = [f"{name}: {run.gap_words}"] if run.gap_words else []
    notes += run_notes.of_faults(name, run)
    misfits: list[str] = []
    warnings: list[str] = []
    for title, model in zip(model_names, models, strict=True):
        if not same_units((model.input_unit, model.output_unit), (run.input_unit, run.output_unit)):
            raise DataError(
                f"{title} {in_units(model)}, but {name} {in_units(run)}",
                hint=units_alike(title, model, name, run, "give a model of the device of that run")
                or "use a model of the same device; in other units, convert the columns and import again",
            )
    parts, first_strokes = _parts(name, run, models)
    notes += first_strokes
    for title, model in zip(model_names, models, strict=True):
        one = _of_model(title, model, run, parts, found[0].rms if found else None)
        if model.fit and model.fit.warning:
            warnings.append(f"{title}: {model.fit.warning}")
        if _is_fitted_to(model, run):
            own = ("only another run shows how good it is", beside_its_fit(model, run, one.rms_percent))
            notes.append(f"{title} was fitted to {name}: {'; '.join(filter(None, own))}")
        if one.outside_percent > 0:
            share = f"{one.outside_percent:.1f}" if one.outside_percent >= _TOLD else f"less than {_TOLD}"
            notes.append(
                f"{share} % of the input of {name} is outside the range of {title}, "
                "where it predicts its outermost values"
            )
        if one.start != "known":
            notes.append(f"{name} does not reach the ends of {title}; state before it: {one.start}")
        notes += [] if _is_fitted_to(model, run) else run_notes.of_first_stroke(name, run, one, model, parts)
        notes += run_notes.of_beginning(name, run, title, model)
        misfits += filter(None, [misfit_words(one, name, run)])
        found.append(one)
    return Evaluation(
        models=tuple(found), model=models[-1], notes=tuple(notes), warnings=(*misfits, *warnings)
    )


def beside_its_fit(model: Model, run: Run, rms_percent: float) -> str:
    """Say why a model predicts a run that it was fitted to worse than it fits it; empty where it does not."""
    fit = model.fit
    if fit is None or not _is_fitted_to(model, run) or not fit.false_reversals or fit.masked_samples:
        return ""
    took = f"its fit ({fit.rms_percent:.3g} % of the span) took the noise of the input out"
    return f"{took}, this prediction does not" if rms_percent > _APART * fit.rms_percent else ""


def _is_fitted_to(model: Model, run: Run) -> bool:
    """Whether what a model keeps of its own record stands in a run, sample for sample."""
    fit = model.fit
    if fit is None or fit.time_s is None or run.time_s is None:
        return False
    at = np.searchsorted(run.time_s, fit.time_s).clip(max=run.time_s.size - 1)
    return np.array_equal(run.time_s[at], fit.time_s) and np.array_equal(run.output[at], fit.output)


def _parts(name: str, run: Run, models: Sequence[Model]) -> tuple[list[tuple[Run, BoolArray]], list[str]]:
    """Return the parts of a run with the samples (n,) of each that count, and notes about first strokes.

    All models are compared on the same samples: those at which the memory of each of them is known.
    """
    parts, notes = [], []
    for part in to_their_tips(list(run.parts(SHORTEST_PART))):
        begin, why = _begin(part, run.dt_s, models)
        notes += [f"{name}: {why}"] if why else []
        kept = part.counts
        kept[:begin] = False
        parts.append((part, kept))
    return parts, notes


def _begin(part: Run, dt_s: float | None, models: Sequence[Model]) -> tuple[int, str]:
    """Return the first sample (n,) of a part that counts, and which first stroke is left out, in words."""
    ends = [range_of(model, [part]) for model in models]
    by_input = max(known_from(part.input, low, high) for low, high in ends)
    begin = max(_known_from(part, dt_s, model) for model in models)
    if begin > by_input:
        return begin, left_out_words(begin - by_input)
    second = max(second_stroke(part.input, low, high) for low, high in ends)
    if second > begin and all(_misses(part, begin, second, dt_s, model) for model in models):
        return second, (
            f"the first stroke ({second - begin} samples) is left out: its error is more than "
            f"{LIMITS.first_stroke_missed:g} times that of all that follows, like that of a device "
            "that was never cycled before"
        )
    return begin, ""


def _known_from(part: Run, dt_s: float | None, model: Model) -> int:
    """Return the first sample (n,) at which a model's memory is known.

    A lag or a drift hides that a first stroke is apart from the others. An extended model tells it in the
    output less what its causes add, as a diagnosis does.
    """
    low, high = range_of(model, [part])
    outputs = [part.output]
    if model.extensions:
        outputs.append(part.output - predict(model, part.input, dt_s) + operator_of(model)(part.input))
    return max(known_from(part.input, low, high, one) for one in outputs)


def _misses(part: Run, begin: int, second: int, dt_s: float | None, model: Model) -> bool:
    """Whether a model misses the samples of a part between two far more than those that follow."""
    error = np.where(part.counts, part.output - predict(model, part.input, dt_s), 0.0)
    after = metrics.root_mean_square(error[second:])
    return metrics.root_mean_square(error[begin:second]) > LIMITS.first_stroke_missed * after


def _of_model(
    name: str, model: Model, run: Run, parts: Sequence[tuple[Run, BoolArray]], first_rms: float | None
) -> ModelEvaluation:
    """Return the error of one model on what counts of ``parts``; its gain is over ``first_rms``."""
    operator = operator_of(model)
    low, high = input_range(model)
    records = [Record(part.input, part.output, known.astype(np.float64)) for part, known in parts]
    start, state = estimated_start(operator, records, range_of(model, [part for part, _ in parts]))
    if model.extensions and start is not None:  # these are predicted from rest
        state = "negative saturation, as for every extended model"
    predicted = np.concatenate([predict(model, part.input, run.dt_s, start)[known] for part, known in parts])
    measured = np.concatenate([part.output[known] for part, known in parts])
    times = [part.time_s[known] for part, known in parts if part.time_s is not None]
    errors = metrics.prediction(measured, predicted)
    offset = float(np.mean(measured - predicted))
    outside = (run.input < low - BEYOND * (high - low)) | (run.input > high + BEYOND * (high - low))
    thinned = slice(None, None, max(1, predicted.size // TRACE_SAMPLES))
    return ModelEvaluation(
        name=name,
        rms=errors.rms,
        rms_percent=errors.rms_percent,
        max_percent=errors.max_percent,
        offset=offset,
        shape_rms_percent=metrics.prediction(measured, predicted + offset).rms_percent,
        second_half_percent=_second_half(measured, predicted),
        start=state,
        outside_percent=100.0 * float(np.mean(outside)),
        gain_percent=_gain_percent(errors.rms, errors.rms if first_rms is None else first_rms),
        time_s=np.concatenate(times)[thinned] if times else None,
        output=measured[thinned],
        predicted=predicted[thinned],
        output_unit=run.output_unit,
    )


def _gain_percent(rms: float, first_rms: float) -> float:
    """How much smaller an error is than the first one, percent; NaN where only the first is nothing."""
    if rms == first_rms:
        return 0.0
    return 100.0 * (1.0 - rms / first_rms) if first_rms > 0 else float("nan")


def _second_half(measured: FloatArray, predicted: FloatArray) -> float:
    """Rms error on the second half (n,), with the zero of the first, in percent of the span of all."""
    half = measured.size // 2
    error = measured - predicted
    left = error[half:] - np.mean(error[:half])
    return 100.0 * metrics.root_mean_square(left) / float(np.ptp(measured)) if half else float("nan")


# --- bounds -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Breach:
    """A metric outside its bounds."""

    metric: str  # waveform.inversion.metric
    value: float
    low: float
    high: float


def breaches(evaluation: Evaluation, bounds: Mapping[str, tuple[float, float]]) -> tuple[Breach, ...]:
    """Return the metrics that are outside their two-sided bounds; names as in ``Evaluation.figures``.

    A bound holds for all playbacks of a pulse by an inversion, and all models of a name. UsageError where it
    names a metric that the evaluation does not have.
    """
    figures = evaluation.figures()
    unknown = [name for name in bounds if name not in figures]
    if unknown:
        stems = evaluation.stems
        near = difflib.get_close_matches(unknown[0], figures, n=1)
        own = [name.removeprefix(f"{stems[0]}.") for name in figures if name.startswith(f"{stems[0]}.")]
        raise UsageError(
            f"the bounds have a name that this evaluation does not have: {unknown[0]}",
            hint=(f"did you mean {near[0]}? " if near else "")
            + f"Names here begin with {' or '.join(stems)} and a dot, and end with {', '.join(own)}",
        )
    return tuple(
        Breach(name, value, low, high)
        for bound, (low, high) in bounds.items()
        for name, value in figures.items()
        if bound in (name, _REPEATED.sub("", name)) and not low <= value <= high
    )
