"""Identify: from one or several runs to a Preisach model."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import BoolArray, Fit, Model, Run
from pulsetrainer.core import input_noise, metrics, uncertainty
from pulsetrainer.core.coverage import coverage, largest_gap
from pulsetrainer.core.edges import plane_for
from pulsetrainer.core.identification import (
    Identified,
    Method,
    Smoothing,
    identify,
    offsets_between,
)
from pulsetrainer.core.plane import FloatArray, Plane, Reading
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis import velocity
from pulsetrainer.errors import DataError
from pulsetrainer.files import atomic_write, provenance, store
from pulsetrainer.steps.modelling import known_from, parts_of, record_of, step_of
from pulsetrainer.steps.show import shown as shown_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pulsetrainer.steps.context import Context

_TRACE_SAMPLES = 6000  # of the record and the fit, kept for the figures
_CROWDED_MISFIT = 0.02  # of the span, rms: beyond it levels do not crowd
_WELL_COVERED = 0.99  # of the cells; below, a note names what is missing


@dataclass(frozen=True, slots=True)
class Options:
    """Which runs to fit, and how."""

    runs: tuple[Path, ...]
    output: Path
    levels: int = 48
    reading: Reading = "continuous"
    method: Method = "joint"
    smoothing: Smoothing | None = None  # None: "auto", or 0 for relays, as in the paper
    bootstrap: int = 0  # refits to resampled blocks
    seed: int = 0  # of the resampling
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """How the model came out."""

    output: Path
    levels: int
    cells: int
    offset: float
    output_unit: str
    fit_rms: float
    fit_rms_percent: float
    fit_max_percent: float
    coverage_percent: float
    smoothing: float  # share of the input's range
    input_noise: float | None  # standard deviation, input unit; None where the records cannot tell
    false_reversals: int  # taken out of the input before the fit
    output_uncertainty: float | None  # mean half width of the 90 % band of the output; None without bootstrap
    polarity: int
    offsets: tuple[float, ...]  # of each run's output against their mean; zeros where one offset serves all
    spacing: str  # of the levels: "even", or "crowded" where the loop is steep
    stiffness: float  # t; 0: the density is free
    warning: str  # that this kind of model is the wrong one; empty where it is not
    iterations: int
    seconds: float


def run(options: Options, context: Context) -> Result:
    """Fit the runs and store the model.

    Raises
    ------
    UsageError
        The output exists.
    DataError
        A file is no run, the runs differ in their units, or an input or output does not vary.
    ConvergenceError
        The fit did not settle.
    """
    atomic_write.check_output(options.output, options.force)
    begun = time.perf_counter()
    runs = [store.read(path, Run) for path in options.runs]
    _check_units(options.runs, runs)
    for path, one in zip(options.runs, runs, strict=True):
        if not one.complete:
            context.note(f"{path} is incomplete; fitting the {one.input.size} samples it has")
    cut = [parts_of(one) for one in runs]
    names = [path.stem for path, parts in zip(options.runs, cut, strict=True) for _ in parts]
    runs = [part for parts in cut for part in parts]
    ranges = [input_range(one) for one in runs]
    low, high = min(r[0] for r in ranges), max(r[1] for r in ranges)
    _check_range(options.runs, low, high, runs[0].input_unit)
    cleaned = [input_noise.clean(one.input) for one in runs]
    _note_noise(cleaned, runs[0].input_unit, context)
    runs = [replace(one, input=clean.input) for one, clean in zip(runs, cleaned, strict=True)]
    context.progress(0.1)
    records, found, shifts = _fitted(runs, names, (low, high), options, context)
    plane = found.operator.plane
    context.progress(0.4 if options.bootstrap else 0.8)
    ensemble = None
    if options.bootstrap:
        ensemble = uncertainty.bootstrap(
            records, found, rng=np.random.default_rng(options.seed), draws=options.bootstrap
        )
        context.progress(0.8)
    if found.operator.polarity < 0:
        context.note("the output falls when the input rises: fitted as a falling loop")
    covered = coverage(plane, [one.input for one in runs])
    gap = largest_gap(plane, covered)
    if gap is not None and float(np.mean(covered)) < _WELL_COVERED:
        context.note(gap.words(plane, runs[0].input_unit))
    model = _model(runs, records, found, covered, ensemble)
    warning = _warned(runs, records, found, context)
    context.progress(0.9)
    header = provenance.make_header(
        f"Preisach model of {', '.join(path.stem for path in options.runs)}",
        argv=context.argv,
        now=context.now(),
        parameters={k: v for k, v in asdict(options).items() if k not in ("runs", "output", "force")},
        inputs=provenance.digests(options.runs),
        ancestors=[store.read_header(path) for path in options.runs],
        libraries=provenance.library_versions(),
    )
    store.write(options.output, model, header, overwrite=options.force)
    context.progress(1.0)
    assert model.fit is not None
    return Result(
        output=options.output,
        levels=plane.n_h,
        cells=plane.n_q,
        offset=model.offset,
        output_unit=model.output_unit,
        fit_rms=model.fit.rms,
        fit_rms_percent=model.fit.rms_percent,
        fit_max_percent=100.0 * model.fit.max_abs / float(np.ptp(np.concatenate([r.output for r in runs]))),
        coverage_percent=model.fit.coverage_percent,
        smoothing=found.smoothing,
        input_noise=_largest_noise(cleaned),
        false_reversals=sum(clean.removed for clean in cleaned),
        output_uncertainty=_half_width(model.fit),
        polarity=model.polarity,
        offsets=tuple(float(shift) for shift in shifts),
        spacing="even" if _is_even(plane) else "crowded",
        stiffness=found.stiffness,
        warning=warning,
        iterations=model.fit.iterations,
        seconds=time.perf_counter() - begun,
    )


def _fitted(
    runs: Sequence[Run],
    names: Sequence[str],
    reach: tuple[float, float],
    options: Options,
    context: Context,
) -> tuple[list[Record], Identified, FloatArray]:
    """Return the records as fitted, the operator, and the offset of each record against their mean."""
    low, high = reach
    records = [record_of(one, low, high) for one in runs]
    plane = _plane(records, low, high, options)
    shifts = offsets_between(records, plane, options.reading)
    if np.any(shifts):
        _note_shifts(names, shifts, runs, context)
        records = [record_of(one, low, high, shift) for one, shift in zip(runs, shifts, strict=True)]
    smoothing = options.smoothing
    if smoothing is None:
        smoothing = 0.0 if options.reading == "relay" else "auto"
    found = identify(records, plane, reading=options.reading, method=options.method, smoothing=smoothing)
    if not _is_even(plane) and _misfit(records, found) > _CROWDED_MISFIT:
        # what is steep here is nothing that the operator can follow: closer levels would learn it by heart
        plane = Plane.uniform(low, high, options.levels)
        found = identify(records, plane, reading=options.reading, method=options.method, smoothing=smoothing)
    if not _is_even(plane):
        context.note("the loop is steep: the levels lie closer where the output changes")
    return records, found, shifts


def _warned(runs: Sequence[Run], records: Sequence[Record], found: Identified, context: Context) -> str:
    """Say where the output follows the velocity of the input, not the input."""
    compared = velocity.compare(records, [step_of(one) for one in runs], _residuals(records, found))
    warning = velocity.warning(compared, runs[0].input_quantity, runs[0].output_quantity)
    if warning:
        context.note(warning)
    return warning


def _largest_noise(cleaned: Sequence[input_noise.Cleaned]) -> float | None:
    """Noise of the noisiest input, as far as the records can tell."""
    known = [clean.sigma for clean in cleaned if np.isfinite(clean.sigma)]
    return max(known) if known else None


def _note_noise(cleaned: Sequence[input_noise.Cleaned], unit: str, context: Context) -> None:
    """Say how many reversals were noise."""
    removed = sum(clean.removed for clean in cleaned)
    unit = f" {unit}" if shown_unit(unit) else ""
    if removed:
        worst = max(cleaned, key=lambda clean: clean.removed)
        context.note(
            f"the measured input has noise of {worst.sigma:.2g}{unit}: {removed} false reversals below "
            f"{worst.dead_band:.2g}{unit} taken out, {sum(clean.kept for clean in cleaned)} left"
        )


def input_range(one: Run) -> tuple[float, float]:
    """Range of the input of a run; what noise adds beyond the reference does not count."""
    low, high = float(np.min(one.input)), float(np.max(one.input))
    if one.reference is not None:
        low, high = max(low, float(np.min(one.reference))), min(high, float(np.max(one.reference)))
    return low, high


def _check_units(paths: Sequence[Path], runs: Sequence[Run]) -> None:
    """Raise DataError unless all runs measure in the same units."""
    first = runs[0]
    for path, one in zip(paths, runs, strict=True):
        if (one.input_unit, one.output_unit) != (first.input_unit, first.output_unit):
            raise DataError(
                f"{path} is in {one.input_unit} and {one.output_unit}, "
                f"but {paths[0]} is in {first.input_unit} and {first.output_unit}",
                hint="import the runs again with the same --input-unit and --output-unit",
            )


def _check_range(paths: Sequence[Path], low: float, high: float, unit: str) -> None:
    """Raise DataError when the input does not move."""
    if not high > low:
        names = ", ".join(str(path) for path in paths)
        value = f"{low:g} {shown_unit(unit)}".rstrip()
        raise DataError(
            f"the input of {names} does not move: it is {value} in all samples",
            hint="record a run that sweeps the range: pulsetrainer capture identification -o run.h5",
        )


def _half_width(fit: Fit) -> float | None:
    """Mean half width of the band of the predicted output."""
    if fit.predicted_lower is None or fit.predicted_upper is None:
        return None
    return 0.5 * float(np.mean(fit.predicted_upper - fit.predicted_lower))


def _plane(records: Sequence[Record], low: float, high: float, options: Options) -> Plane:
    """Return the levels: even for relays, as in the paper, else where the output changes."""
    if options.reading == "relay":
        return Plane.uniform(low, high, options.levels)
    return plane_for(records, low, high, options.levels)


def _is_even(plane: Plane) -> bool:
    return bool(np.allclose(np.diff(plane.edges), np.diff(plane.edges)[0]))


def _misfit(records: Sequence[Record], found: Identified) -> float:
    """Rms error of the fit as a share of the output's span."""
    left = [e[r.sample_weight > 0] for e, r in zip(_residuals(records, found), records, strict=True)]
    span = float(np.ptp(np.concatenate([r.output[r.sample_weight > 0] for r in records])))
    return metrics.root_mean_square(np.concatenate(left)) / span


def _note_shifts(names: Sequence[str], shifts: FloatArray, runs: Sequence[Run], context: Context) -> None:
    """Say how far the outputs of the runs are shifted against each other."""
    span = float(np.ptp(np.concatenate([one.output for one in runs])))
    listed = ", ".join(f"{name} {shift:+.3g}" for name, shift in zip(names, shifts, strict=True))
    context.note(
        f"the outputs of the runs are shifted against each other by up to {np.ptp(shifts):.3g} "
        f"{shown_unit(runs[0].output_unit)} ({100 * np.ptp(shifts) / span:.2f} % of the span): each was "
        f"fitted with an offset of its own ({listed}); the model has their mean"
    )


def _residuals(records: Sequence[Record], found: Identified) -> list[FloatArray]:
    """Measured less fitted output (n,) of each record."""
    return [r.output - found.operator(r.input, r.start) for r in records]


def _model(
    runs: Sequence[Run],
    records: Sequence[Record],
    found: Identified,
    covered: BoolArray,
    ensemble: uncertainty.Ensemble | None,
) -> Model:
    """Return the stored form of an identified operator, with its fit."""
    operator, first = found.operator, runs[0]
    plane = operator.plane
    measured, predicted = [], []
    for record in records:
        known = record.sample_weight > 0
        measured.append(record.output[known])
        predicted.append(operator(record.input, record.start)[known])
    errors = metrics.prediction(np.concatenate(measured), np.concatenate(predicted))
    shown = slice(
        known_from(first.input, plane.low, plane.high), None, max(1, first.input.size // _TRACE_SAMPLES)
    )
    band = None if ensemble is None else ensemble.output_band(first.input)
    weights = None if ensemble is None else ensemble.weight_interval()
    fit = Fit(
        rms=errors.rms,
        max_abs=errors.max_abs,
        rms_percent=errors.rms_percent,
        coverage_percent=100.0 * float(np.mean(covered)),
        input_unit=first.input_unit,
        output_unit=first.output_unit,
        samples=sum(part.size for part in measured),
        iterations=found.iterations,
        method=found.method,
        time_s=None if first.time_s is None else first.time_s[shown],
        input=first.input[shown],
        output=records[0].output[shown],
        predicted=operator(records[0].input, records[0].start)[shown],
        smoothing=found.smoothing,
        draws=0 if ensemble is None else len(ensemble.weights),
        predicted_lower=None if band is None else band.lower[shown],
        predicted_upper=None if band is None else band.upper[shown],
    )
    return Model(
        edges=plane.edges,
        weights=operator.weights,
        offset=operator.offset,
        covered=covered,
        weights_unit=f"{first.output_unit}/({first.input_unit})^2",
        input_unit=first.input_unit,
        output_unit=first.output_unit,
        input_quantity=first.input_quantity,
        output_quantity=first.output_quantity,
        reading=operator.reading,
        polarity=operator.polarity,
        weights_lower=None if weights is None else weights.lower,
        weights_upper=None if weights is None else weights.upper,
        fit=fit,
    )
