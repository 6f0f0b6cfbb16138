"""Identify: from one or several runs to a Preisach model, of as many levels as they support."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np

from pulsetrainer.artefacts import LARGEST, BoolArray, Fit, Model, Run, Seen
from pulsetrainer.artefacts.units import (
    counted,
    in_units,
    quantity_in_words,
    same_units,
    shown,
    units_alike,
    with_unit,
)
from pulsetrainer.core import input_noise, metrics, turns, uncertainty, wild
from pulsetrainer.core.coverage import coverage, largest_gap, little_words, minor_coverage
from pulsetrainer.core.dual import exchanged
from pulsetrainer.core.fit import Fitted, fit
from pulsetrainer.core.forms import Form
from pulsetrainer.core.identification import Method, Smoothing
from pulsetrainer.core.loop import loop_of
from pulsetrainer.core.plane import Plane, Reading
from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.steps import fit_notes, left_out
from pulsetrainer.steps.arguments import EXCITATIONS, check_levels, named, several
from pulsetrainer.steps.one_thread import one_thread
from pulsetrainer.steps.progress import Progress, silent

TRACE_SAMPLES = 6000  # of the record and the fit, kept for the figures
SHORTEST_PART = 100  # samples; shorter parts of a run say nothing
LEVELS = 48  # where nothing else is asked for
FEWEST_LEVELS = 4
_FEW_DRAWS = 20  # fewer have no quantiles of 5 and 95 %
_CROWDED = "the loop is steep: the levels lie closer where the output changes"
WELL_COVERED = 0.99  # of the cells; below, a note names what is missing


@one_thread
def identify(
    runs: Run | Sequence[Run],
    *,
    levels: int | None = None,
    form: Form | Literal["auto"] = "auto",
    reading: Reading = "continuous",
    method: Method = "joint",
    smoothing: Smoothing | None = None,
    bootstrap: int = 0,
    seed: int = 0,
    names: Sequence[str] = (),
    progress: Progress = silent,
) -> Model:
    """Fit a Preisach model to one or several runs of one device.

        minimise  sum_t (y_t - y0 - sum_k mu_k A_k r_k(u_0 .. u_t))^2   over mu >= 0 and y0

    That is the direct form, of an output that lags. The dual form exchanges u and y, for an output that
    leads; the signed form allows mu of either sign, for a loop that crosses itself.

    Parameters
    ----------
    runs
        Measured input and output; all in the same units.
    levels
        Number of levels n_h, at most 83 in the signed form; the model has n_h (n_h + 1) / 2 cells. None: 48,
        or one for every two samples of a shorter record.
    form
        "direct", "dual" or "signed"; "auto": the one that predicts blocks that were not fitted, the simplest
        where others are not much better.
    reading
        How the weights are read: "continuous", a piecewise constant density, or "relay", as in the paper.
    method
        "joint", or "alternating" between offset and weights, as in the paper; both end at the same point.
    smoothing
        Length below which the density is smoothed, share of the input's range; "auto" by held-out blocks.
        None: "auto", and 0 for relays.
    bootstrap
        Refits to resampled blocks: 90 % intervals of the weights and the output.
    seed
        Of the resampling.
    names
        Names of the runs, for the notes.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    DataError
        The runs differ in their units, an input does not move, or an output does not vary.
    ArgumentError
        There are too few samples, a parameter is out of its range, or relays, the
        alternating method or a bootstrap are asked for together with another form than the direct one.
    ConvergenceError
        The fit did not settle.

    Source: Carneiro, Abreu, Restivo, Sensors 2018, 18(5), 1631, eq. 2 and section 3.

    Examples
    --------
    >>> import numpy as np, pulsetrainer as pt
    >>> u = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 0, 200)])
    >>> model = pt.identify(pt.Run(time_s=np.arange(400) / 100, input=u, output=2 * u), levels=8)
    >>> model.fit.coverage_percent
    100.0
    """
    check_levels(levels)
    if bootstrap < 0 or bootstrap == 1:
        raise ArgumentError(
            f"`bootstrap` must be 0, or 2 draws or more, got {bootstrap}", hint="200 is usual"
        )
    whole = several(runs)
    titles = named(names, [f"run {number}" for number in range(1, len(whole) + 1)])
    _check_runs(titles, whole)
    notes = _of_runs(titles, whole)
    titles, measured = _with_samples(titles, whole)
    raw = measured
    masked = [~part.counts for part in measured]
    tamed = wild.tame([(p.input, wild.repaired(p.output, m)) for p, m in zip(measured, masked, strict=True)])
    measured = [
        replace(part, input=t.input, output=t.output) for part, t in zip(measured, tamed, strict=True)
    ]
    reach = _reach(titles, measured)
    cleaned = [input_noise.clean(part.input) for part in measured]
    notes += _of_noise(cleaned, measured[0].input_unit)
    measured = to_their_tips(
        [replace(part, input=clean.input) for part, clean in zip(measured, cleaned, strict=True)]
    )
    progress(0.1)
    if smoothing is None:
        smoothing = 0.0 if reading == "relay" else "auto"
    n_h = _levels(measured, notes) if levels is None else levels
    on = partial(
        fit,
        n_h=n_h,
        reading=reading,
        method=method,
        smoothing=smoothing,
        form=form,
        progress=lambda share: progress(0.1 + (0.3 if bootstrap else 0.7) * share),
    )
    sure = [t.wild_input | m for t, m in zip(tamed, masked, strict=True)]
    rest = left_out.fit_to_the_rest(
        on, reach, measured, sure, [t.wild_output for t in tamed], [part.output for part in raw]
    )
    fitted, measured, masks = rest.fitted, rest.runs, rest.wild
    wild_ones = [mask & ~known for mask, known in zip(masks, masked, strict=True)]
    notes += fit_notes.of_wild(wild_ones)
    operator, plane = fitted.operator, fitted.identified.operator.plane
    notes += [*fit_notes.of_form(fitted, measured[0], form), *_of_offsets(titles, fitted, measured)]
    notes += rest.first_strokes_in_words(titles)
    notes += [] if fitted.evenly_spaced else [_CROWDED]
    progress(0.4 if bootstrap else 0.8)
    ensemble = _resampled(fitted, bootstrap, seed, notes)
    if operator.polarity < 0:
        notes.append("the output falls when the input rises: fitted as a falling loop")
    covered, minor_percent = _switched(fitted, measured, cleaned)
    unit = measured[0].output_unit if fitted.form == "dual" else measured[0].input_unit
    notes += _of_gaps(plane, covered, unit)
    warning = fit_notes.warning(fitted, measured, form, minor_percent)
    little = fit_notes.of_no_minor_loops(fitted, measured[0], minor_percent)
    notes += little if warning else [*fit_notes.of_rest(fitted), *little]
    if way := _only_way(measured):
        given = quantity_in_words(measured[0].input_quantity)
        notes.append(f"the {given} only {way}: a loop, if there is one, is not seen")
    elif few := little_words(float(np.mean(covered))):
        notes.append(few)
    progress(1.0)
    notes += fit_notes.of_clipped(fitted, measured)
    first = wild_ones[0]
    said = {
        "notes": tuple(notes),
        "warning": warning,
        "minor_percent": minor_percent,
        "masked_samples": sum(int(mask.sum()) for mask in masks),
        "wild_input": raw[0].input[first] if first.any() else None,
        "wild_output": raw[0].output[first] if first.any() else None,
    }
    return _model(fitted, measured, covered, ensemble, cleaned, said)


def to_their_tips(runs: list[Run]) -> list[Run]:
    """Return runs with turns of the input at their tips between samples, where that fits better."""
    tips = turns.at_their_tips(left_out.signals(runs), [r.time_s for r in runs], [r.counts for r in runs])
    return [replace(run, input=tip) for run, tip in zip(runs, tips, strict=True)]


def _levels(runs: Sequence[Run], notes: list[str]) -> int:
    """Return as many levels as the records support, and say so where they are few."""
    samples = sum(run.input.size for run in runs)
    supported = max(samples // 2, FEWEST_LEVELS)
    if supported < LEVELS:
        notes.append(f"the record is short: {samples} samples support {supported} levels, not {LEVELS}")
    return min(supported, LEVELS)


def _check_runs(names: Sequence[str], runs: Sequence[Run]) -> None:
    """Raise DataError where there is no run, units differ, or values have no squares."""
    if not runs:
        raise DataError("there is no run to identify a model from", hint="give at least one run")
    first = runs[0]
    for name, run in zip(names, runs, strict=True):
        if not same_units((run.input_unit, run.output_unit), (first.input_unit, first.output_unit)):
            raise DataError(
                f"{name} {in_units(run)}, but {names[0]} {in_units(first)}",
                hint=units_alike(name, run, names[0], first, "identify the runs one by one")
                or "identify runs of different devices one by one; of one device, convert the columns of "
                "the tables and import them again",
            )
    for what in ("input", "output"):
        largest = float(max(np.fmax.reduce(np.abs(getattr(run, what)), initial=0.0) for run in runs))
        if 0 < largest < 1.0 / LARGEST:
            raise DataError(
                f"the {what} of {', '.join(dict.fromkeys(names))} is within {largest:g} of zero, closer than "
                f"the limit of {1.0 / LARGEST:g}",
                hint="write it in a smaller unit, and import it again",
            )


def _with_samples(titles: Sequence[str], runs: Sequence[Run]) -> tuple[list[str], list[Run]]:
    """Return the parts of all runs with their runs' names, or DataError where all samples are masked."""
    cut = [
        (title, part)
        for title, run in zip(titles, runs, strict=True)
        for part in run.parts(SHORTEST_PART)
        if np.isfinite(part.output[part.counts]).any()
    ]
    if not cut:
        raise DataError(
            f"all samples of {', '.join(titles)} are masked as wild or lost, so there is nothing to fit",
            hint="check the wiring and the range of the sensor, and record again",
        )
    return [title for title, _ in cut], [part for _, part in cut]


def _reach(names: Sequence[str], runs: Sequence[Run]) -> tuple[float, float]:
    """Range of the input over all runs, or DataError where it does not move, or the output does not vary."""
    ranges = [left_out.input_range(run) for run in runs]
    low, high = min(r[0] for r in ranges), max(r[1] for r in ranges)
    if not high > low:
        listed = ", ".join(dict.fromkeys(names))
        command = ": pulsetrainer capture identification -o run.h5" if _are_ours(runs) else ""
        raise DataError(
            f"the input of {listed} does not move: it is {with_unit(f'{low:g}', runs[0].input_unit)} "
            "in all samples",
            hint=f"record a run that sweeps the range{command}",
        )
    given = np.concatenate([run.output[run.counts] for run in runs])
    given = given[np.isfinite(given)]
    if given.size and np.ptp(given) <= 1e-12 * np.abs(given).max():
        raise DataError(
            f"the {quantity_in_words(runs[0].output_quantity)} of {', '.join(dict.fromkeys(names))} does not "
            f"vary: it is {with_unit(f'{given[0]:g}', runs[0].output_unit)} throughout",
            hint="check the sensor and its wiring, and record again",
        )
    return low, high


def _of_runs(titles: Sequence[str], runs: Sequence[Run]) -> list[str]:
    """Say what of the runs a fit must do without: their ends, one device for all, turns in their gaps."""
    named_runs, notes = list(zip(titles, runs, strict=True)), []
    for title, run in named_runs:
        if not run.complete:
            mended = ": capture --resume would finish it" if run.captured else ""
            notes.append(f"{title} is incomplete; fitting the {run.input.size} samples it has{mended}")
    devices = sorted({run.serial for run in runs} - {""})
    if len(devices) > 1:
        several_of = f"the runs are of several devices, {' and '.join(devices)}"
        notes.append(f"{several_of}: a model is of one device, so identify each by itself")
    return notes + [f"{title}: {run.gap_words}" for title, run in named_runs if run.gap_words]


def _only(serials: Iterable[str]) -> str:
    """Return the serial number of all runs, empty where they are of several devices or do not tell it."""
    different = set(serials)
    return different.pop() if len(different) == 1 else ""


def _are_ours(runs: Sequence[Run]) -> bool:
    """Whether all runs were captured on our own device."""
    return all(run.captured or run.signal in EXCITATIONS for run in runs)


def _resampled(fitted: Fitted, draws: int, seed: int, notes: list[str]) -> uncertainty.Ensemble | None:
    """Refit resampled blocks, where that is asked for and the form has intervals."""
    if draws and fitted.form != "direct":
        notes.append(f"the bootstrap is of the direct form; the {fitted.form} form has no intervals")
    if not draws or fitted.form != "direct":
        return None
    if draws < _FEW_DRAWS:
        notes.append(f"a band from {draws} draws says little: `bootstrap` 200 is usual")
    rng = np.random.default_rng(seed)
    return uncertainty.bootstrap(fitted.records, fitted.identified, rng=rng, draws=draws)


def _switched(
    fitted: Fitted, runs: Sequence[Run], cleaned: Sequence[input_noise.Cleaned]
) -> tuple[BoolArray, float]:
    """Cells (n_q,) that what the operator remembers has switched, and those that minor loops tell apart, %.

    A dual operator remembers the outputs. Noise moves the turns of either.
    """
    plane, dual = fitted.identified.operator.plane, fitted.form == "dual"
    remembered = [x for x, _ in (exchanged(left_out.signals(runs)) if dual else left_out.signals(runs))]
    turned = [input_noise.clean(run.output) for run in runs] if dual else cleaned
    noise = max(one.dead_band for one in turned)
    return coverage(plane, remembered), 100.0 * minor_coverage(plane, remembered, noise)


def _of_noise(cleaned: Sequence[input_noise.Cleaned], unit: str) -> list[str]:
    """Say how many reversals of the input were noise."""
    removed = sum(clean.removed for clean in cleaned)
    if not removed:
        return []
    worst = max(cleaned, key=lambda clean: clean.removed)
    sigma, band = with_unit(f"{worst.sigma:.2g}", unit), with_unit(f"{worst.dead_band:.2g}", unit)
    left = counted(sum(clean.kept for clean in cleaned), "real one", "is left", "are left")
    found = f"noise of {sigma} in the measured input"
    return [f"{found} made {removed} false reversals, all below {band}: taken out; {left}"]


def _of_offsets(names: Sequence[str], fitted: Fitted, runs: Sequence[Run]) -> list[str]:
    """Say how far the outputs of the runs are shifted against each other."""
    if not np.any(fitted.offsets):
        return []
    span = float(np.ptp(np.concatenate([run.output for run in runs])))
    apart = float(np.ptp(fitted.offsets))
    listed = ", ".join(f"{name} {shift:+.3g}" for name, shift in zip(names, fitted.offsets, strict=True))
    shift = f"{with_unit(f'{apart:.3g}', runs[0].output_unit)} ({100 * apart / span:.2f} % of the span)"
    found = f"the outputs of the runs are shifted against each other by up to {shift}"
    return [f"{found}: each was fitted with an offset of its own ({listed}); the model has their mean"]


def _of_gaps(plane: Plane, covered: BoolArray, unit: str) -> list[str]:
    """Name the largest part of the plane that the runs never reached."""
    gap = largest_gap(plane, covered)
    return [] if gap is None or float(np.mean(covered)) >= WELL_COVERED else [gap.words(plane, shown(unit))]


def _only_way(runs: Sequence[Run]) -> str:
    """Say which way the input goes where it never turns back; empty where it does."""
    steps = np.concatenate([np.diff(run.input) for run in runs])
    if steps.min() < 0 < steps.max():
        return ""
    return "rises" if steps.max() > 0 else "falls"


def _model(
    fitted: Fitted,
    runs: Sequence[Run],
    covered: BoolArray,
    ensemble: uncertainty.Ensemble | None,
    cleaned: Sequence[input_noise.Cleaned],
    said: Mapping[str, Any],
) -> Model:
    """Return the model with its fit, of which some fields are ``said``."""
    found, first, record = fitted.identified, runs[0], fitted.records[0]
    inner, operator = found.operator, fitted.operator
    measured = fitted.counted_output
    errors = metrics.prediction(measured, np.concatenate(fitted.counted(fitted.predicted)))
    thinned = slice(
        int(np.argmax(record.counts)),
        None,
        max(1, first.input.size // TRACE_SAMPLES),
    )
    band = None if ensemble is None else ensemble.output_band(first.input, start=record.start)
    weights = None if ensemble is None else ensemble.weight_interval()
    sigmas = [clean.sigma for clean in cleaned if np.isfinite(clean.sigma)]
    units = (first.output_unit, first.input_unit)
    above, below = units[::-1] if fitted.form == "dual" else units
    max_percent = 100.0 * errors.max_abs / float(np.ptp(np.concatenate([r.output for r in runs])))
    inputs = np.concatenate(fitted.counted([run.input for run in runs]))
    return Model(
        edges=inner.plane.edges,
        weights=inner.weights,
        offset=inner.offset,
        covered=covered,
        weights_unit=f"{above}/({below})^2",
        input_unit=first.input_unit,
        output_unit=first.output_unit,
        input_quantity=first.input_quantity,
        output_quantity=first.output_quantity,
        reading=inner.reading,
        polarity=inner.polarity,
        form=fitted.form,
        # files of 0.1 do not say where a run is from; these names only captures had
        coil=next((run.coil for run in runs if run.coil is not None), None),
        captured=_are_ours(runs),
        serial=_only(run.serial for run in runs),
        weights_lower=None if weights is None else weights.lower,
        weights_upper=None if weights is None else weights.upper,
        seen=Seen.of((errors.rms_percent, max_percent), inputs, measured, units[::-1]),
        fit=Fit(
            rms=errors.rms,
            max_abs=errors.max_abs,
            rms_percent=errors.rms_percent,
            max_percent=max_percent,
            coverage_percent=100.0 * float(np.mean(covered)),
            input_unit=first.input_unit,
            output_unit=first.output_unit,
            samples=measured.size,
            iterations=found.iterations,
            method=found.method,
            time_s=None if first.time_s is None else first.time_s[thinned],
            input=first.input[thinned],
            output=record.output[thinned],
            predicted=fitted.predicted[0][thinned],
            smoothing=found.smoothing,
            draws=0 if ensemble is None else len(ensemble.weights),
            predicted_lower=None if band is None else band.lower[thinned],
            predicted_upper=None if band is None else band.upper[thinned],
            input_noise=max(sigmas, default=float("nan")),
            false_reversals=sum(clean.removed for clean in cleaned),
            offsets=tuple(float(shift) for shift in fitted.offsets),
            spacing="even" if fitted.evenly_spaced else "crowded",
            stiffness=found.stiffness,
            loop="none" if _only_way(runs) else loop_of(operator, errors.rms),
            **said,
        ),
    )
