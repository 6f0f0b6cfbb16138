"""Evaluate: the force error of played waveforms, or the prediction error of models on a held-out run."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import (
    DriveError,
    DrivePlayback,
    Evaluation,
    Model,
    ModelEvaluation,
    Playback,
    Run,
    WaveformEvaluation,
)
from pulsetrainer.core import metrics
from pulsetrainer.core.memory import State, demagnetised, negative_saturation, positive_saturation
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.errors import DataError, QualityError, UsageError
from pulsetrainer.files import atomic_write, provenance, store
from pulsetrainer.steps.modelling import known_from, operator_of, parts_of, predict, step_of

if TYPE_CHECKING:
    from pulsetrainer.steps.context import Context

# Carneiro, Abreu, Restivo, Sensors 2018, 18(5), 1631: the published device. The maxima are given for the
# device as a whole, so they stand beside both pulses.
_PUBLISHED_MAXIMA = {"scaled.max_abs_error_percent": 28.7, "compensated.max_abs_error_percent": 7.8}
PUBLISHED: dict[str, dict[str, float]] = {
    "normal": {"mean_error_reduction_percent": 73.9, **_PUBLISHED_MAXIMA},
    "bifid": {"mean_error_reduction_percent": 70.3, **_PUBLISHED_MAXIMA},
}
METRICS = ("mean_abs_error_percent", "max_abs_error_percent", "rms_error_percent", "hysteresis_percent",
           "current_tracking_max_percent")  # fmt: skip
MODEL_METRICS = (
    "rms", "rms_percent", "max_percent", "gain_percent", "offset", "shape_rms_percent", "second_half_percent",
)  # fmt: skip
_TRACE_SAMPLES = 6000
_BEYOND = 0.005  # of the model's range: an input further out than this was never identified


@dataclass(frozen=True, slots=True)
class Options:
    """What to evaluate, against what."""

    inputs: tuple[Path, ...]  # playbacks, or one run
    models: tuple[Path, ...] = ()
    output: Path | None = None
    html: Path | None = None
    bounds: Path | None = None
    force: bool = False


@dataclass(frozen=True, slots=True)
class Breach:
    """A metric outside its bounds."""

    metric: str  # waveform.inversion.metric
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Result:
    """The evaluation, and the bounds it broke."""

    evaluation: Evaluation
    breaches: tuple[Breach, ...]
    checked: int
    output: Path | None
    html: Path | None


def run(options: Options, context: Context) -> Result:
    """Compute the error figures, store them, render the report, check the bounds.

    Raises
    ------
    UsageError
        An output exists, a run without a model, or playbacks with models.
    DataError
        A file is of the wrong kind or cannot be used.
    """
    for path in (options.output, options.html):
        if path is not None:
            atomic_write.check_output(path, options.force)
    bounds = read_bounds(options.bounds) if options.bounds else {}
    artefacts = [store.read_one_of(path, Playback, Run) for path in options.inputs]
    context.progress(0.2)
    if all(isinstance(one, Playback) for one in artefacts):
        if options.models:
            raise UsageError("--model goes with a run, not with a playback", hint="leave --model out")
        evaluation = Evaluation(
            waveforms=tuple(
                _of_playback(path, one) for path, one in zip(options.inputs, artefacts, strict=True)
            ),
            model=artefacts[-1].waveform.model,
        )
    elif len(artefacts) == 1 and options.models:
        evaluation = _of_run(options.inputs[0], artefacts[0], options.models)
        _note_limits(options.inputs[0], evaluation, context)
    else:
        raise UsageError(
            "evaluate takes playbacks, or one run together with the models to compare on it",
            hint="pulsetrainer evaluate run.h5 --model model.h5",
        )
    context.progress(0.6)
    header = _header(options, evaluation, context)
    if options.output is not None:
        store.write(options.output, evaluation, header, overwrite=options.force)
    if options.html is not None:
        from pulsetrainer.report import html  # draws: half a second that nobody else has to wait

        page = html.render_evaluation(
            evaluation,
            title=header.title,
            created=header.created,
            provenance_json=header.provenance.to_json(),
            published=PUBLISHED,
            history=header.history,
        )
        with atomic_write.replacing(options.html, overwrite=options.force) as temporary:
            temporary.write_text(page, encoding="utf-8")
    context.progress(1.0)
    breaches, checked = _check_bounds(evaluation, bounds)
    return Result(evaluation, breaches, checked, options.output, options.html)


def _header(options: Options, evaluation: Evaluation, context: Context) -> provenance.Header:
    sources = [*options.inputs, *options.models]
    names = dict.fromkeys(w.name for w in evaluation.waveforms) or [path.name for path in options.inputs]
    return provenance.make_header(
        f"Evaluation of {', '.join(names)}",
        argv=context.argv,
        now=context.now(),
        inputs=provenance.digests(sources),
        ancestors=[store.read_header(path) for path in sources],
        libraries=provenance.library_versions(),
    )


def _of_playback(path: Path, playback: Playback) -> WaveformEvaluation:
    """Return the error figures of one playback over its scored samples, all repeats counted singly."""
    waveform = playback.waveform
    scored = waveform.scored
    repeats = playback.compensated.output.shape[0]
    if repeats == 0 or not scored.any():
        raise DataError(
            f"{path} holds no whole repeat to evaluate", hint="play it again: pulsetrainer play drive.h5"
        )
    target = waveform.target[scored]
    full = float(np.abs(target).max())
    scaled = _drive_error(playback, playback.scaled, full)
    compensated = _drive_error(playback, playback.compensated, full)
    return WaveformEvaluation(
        name=waveform.name,
        inversion=waveform.inversion,
        repeats=repeats,
        time_s=waveform.time_s[scored],
        target=target,
        scaled=scaled,
        compensated=compensated,
        mean_error_reduction_percent=100.0
        * (1.0 - compensated.mean_abs_error_percent / scaled.mean_abs_error_percent),
        full_force=full,
        noise_percent=100.0 * metrics.repeat_spread(playback.compensated.output[:, scored]) / full,
        output_unit=waveform.output_unit,
    )


def _drive_error(playback: Playback, drive: DrivePlayback, full: float) -> DriveError:
    waveform = playback.waveform
    target, scored = waveform.target, waveform.scored
    errors = metrics.tracking(target[scored], drive.output[:, scored], full)
    mean_output = _mean_over_repeats(drive.output[:, scored])
    tracking = np.abs(drive.input - drive.reference)
    return DriveError(
        mean_abs_error_percent=errors.mean_abs_percent,
        max_abs_error_percent=errors.max_abs_percent,
        rms_error_percent=errors.rms_percent,
        hysteresis_percent=100.0
        * metrics.loop_area(target[scored], mean_output)
        / (full**2 * _beats(target[scored])),
        current_tracking_max_percent=100.0 * float(np.nanmax(tracking)) / playback.input_range,
        output=mean_output,
        output_unit=waveform.output_unit,
    )


def _mean_over_repeats(measured: FloatArray) -> FloatArray:
    """Mean (n,) over repeats (r, n); a sample that no repeat has is taken between its neighbours."""
    present = np.isfinite(measured)
    count = present.sum(axis=0)
    total = np.where(present, measured, 0.0).sum(axis=0)
    known = np.flatnonzero(count)
    return np.interp(np.arange(count.size), known, total[known] / count[known])


def _beats(target: FloatArray) -> int:
    """Number of times a target that starts a period at its first sample comes round."""
    middle = 0.5 * (target.max() + target.min())
    return max(int(np.sum((target[1:] >= middle) & (target[:-1] < middle))), 1)


def _of_run(path: Path, one: Run, models: Sequence[Path]) -> Evaluation:
    """Return the prediction error of each model on a run."""
    found: list[ModelEvaluation] = []
    for name in models:
        model = store.read(name, Model)
        if (model.input_unit, model.output_unit) != (one.input_unit, one.output_unit):
            raise DataError(
                f"{name} was identified in {model.input_unit} and {model.output_unit}, "
                f"but {path} is in {one.input_unit} and {one.output_unit}",
                hint="use a model of the same device, in the same units",
            )
        operator = operator_of(model)
        low, high = operator.plane.low, operator.plane.high
        parts = parts_of(one)
        known = [known_from(part.input, low, high) for part in parts]
        step_s = step_of(one)
        start, state = _start(model, parts, known)
        predicted = np.concatenate(
            [predict(model, part.input, step_s, start)[k:] for part, k in zip(parts, known, strict=True)]
        )
        measured = np.concatenate([part.output[k:] for part, k in zip(parts, known, strict=True)])
        errors = metrics.prediction(measured, predicted)
        shift = float(np.mean(measured - predicted))
        own = metrics.prediction(measured, predicted + shift)
        outside = (one.input < low - _BEYOND * (high - low)) | (one.input > high + _BEYOND * (high - low))
        thin = slice(None, None, max(1, predicted.size // _TRACE_SAMPLES))
        found.append(
            ModelEvaluation(
                name=str(name),
                rms=errors.rms,
                rms_percent=errors.rms_percent,
                max_percent=errors.max_percent,
                offset=shift,
                shape_rms_percent=own.rms_percent,
                second_half_percent=_second_half(measured, predicted),
                start=state,
                outside_percent=100.0 * float(np.mean(outside)),
                gain_percent=100.0 * (1.0 - errors.rms / found[0].rms) if found else 0.0,
                time_s=_times(parts, known, thin),
                output=measured[thin],
                predicted=predicted[thin],
                output_unit=one.output_unit,
            )
        )
    return Evaluation(models=tuple(found), model=model)


def _second_half(measured: FloatArray, predicted: FloatArray) -> float:
    """Rms error on the second half (n,), with the zero of the first, in percent of the span of all."""
    half = measured.size // 2
    error = measured - predicted
    left = error[half:] - np.mean(error[:half])
    return 100.0 * metrics.root_mean_square(left) / float(np.ptp(measured)) if half else float("nan")


def _times(parts: Sequence[Run], known: Sequence[int], thin: slice) -> FloatArray | None:
    """Times of the samples after ``known`` of each part, thinned; None where the run has no time."""
    times = [part.time_s[k:] for part, k in zip(parts, known, strict=True) if part.time_s is not None]
    return np.concatenate(times)[thin] if times else None


def _note_limits(path: Path, evaluation: Evaluation, context: Context) -> None:
    """Say where a run leaves the range of a model, and which state before the run was assumed."""
    for found in evaluation.models:
        if found.outside_percent > 0:
            context.note(
                f"{found.outside_percent:.1f} % of the input of {path} is outside the range of {found.name}, "
                "where it predicts its outermost values"
            )
        if found.start != "known":
            context.note(f"{path} does not reach the ends of {found.name}; state before it: {found.start}")


def _start(model: Model, parts: Sequence[Run], known: Sequence[int]) -> tuple[State | None, str]:
    """Return the state from which a run is followed, and what it is called.

    A run that never reaches an end of the model's range leaves open what came before it. Tried are both
    saturations and the demagnetised state; the one that predicts best is taken.
    """
    low, high = float(model.edges[0]), float(model.edges[-1])
    near = 0.01 * (high - low)
    if any(np.any((one.input <= low + near) | (one.input >= high - near)) for one in parts):
        return None, "known"
    states = {
        "negative saturation": negative_saturation(low),
        "demagnetised": demagnetised(low, high),
        "positive saturation": positive_saturation(low, high),
    }
    operator = operator_of(model)
    left = {
        name: sum(
            float(np.sum((operator(one.input, state)[k:] - one.output[k:]) ** 2))
            for one, k in zip(parts, known, strict=True)
        )
        for name, state in states.items()
    }
    best = min(left, key=left.__getitem__)
    return states[best], f"{best}, estimated"


def metrics_of(evaluation: Evaluation) -> dict[str, float]:
    """All figures of an evaluation by dotted name: ``normal.continuous.scaled.max_abs_error_percent``."""
    named: dict[str, float] = {}
    for waveform in evaluation.waveforms:
        stem = f"{waveform.name}.{waveform.inversion}"
        named[f"{stem}.mean_error_reduction_percent"] = waveform.mean_error_reduction_percent
        for drive, errors in (("scaled", waveform.scaled), ("compensated", waveform.compensated)):
            for metric in METRICS:
                named[f"{stem}.{drive}.{metric}"] = getattr(errors, metric)
    for model in evaluation.models:
        for metric in MODEL_METRICS:
            named[f"{Path(model.name).stem}.{metric}"] = getattr(model, metric)
    return named


def read_bounds(path: Path) -> dict[str, tuple[float, float]]:
    """Return the two-sided bounds of a TOML file: dotted metric name = [low, high].

    Raises
    ------
    DataError
        The file cannot be read, is no TOML, or a bound is not a pair low <= high.
    """
    try:
        tree = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"the bounds file {path} cannot be read: {error}", hint="check its name") from error
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"the bounds file {path} is not TOML: {error}", hint="mend that line") from error
    flat: dict[str, tuple[float, float]] = {}

    def descend(prefix: str, node: object) -> None:
        if isinstance(node, dict):
            for key, value in node.items():
                descend(f"{prefix}.{key}" if prefix else key, value)
            return
        pair = node if isinstance(node, list) else []
        numbers = [v for v in pair if isinstance(v, int | float) and not isinstance(v, bool)]
        if len(pair) != 2 or len(numbers) != 2 or numbers[0] > numbers[1]:
            raise DataError(
                f"the bound {prefix} in {path} must be a pair [low, high], got {node!r}",
                hint=f"write {prefix.rpartition('.')[2]} = [0.0, 1.0]",
            )
        flat[prefix] = (float(numbers[0]), float(numbers[1]))

    descend("", tree)
    return flat


def _check_bounds(
    evaluation: Evaluation, bounds: dict[str, tuple[float, float]]
) -> tuple[tuple[Breach, ...], int]:
    """Return the metrics outside their bounds, and how many were checked.

    Raises
    ------
    QualityError
        A bound names a metric that the evaluation does not have.
    """
    figures = metrics_of(evaluation)
    unknown = [name for name in bounds if name not in figures]
    if unknown:
        raise QualityError(
            f"the bounds name {unknown[0]}, which this evaluation does not have",
            hint=f"it has {', '.join(sorted(figures)[:4])}, ...",
        )
    broken = tuple(
        Breach(name, figures[name], low, high)
        for name, (low, high) in bounds.items()
        if not low <= figures[name] <= high
    )
    return broken, len(bounds)
