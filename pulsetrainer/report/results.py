"""What a command says of its result: what a script gets under its keys, a title, and lines for a person."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from pulsetrainer.artefacts import Evaluation, Model, Playback, Run, Waveform
from pulsetrainer.artefacts.evaluation import METRICS, MODEL_METRICS, ModelEvaluation
from pulsetrainer.artefacts.units import counted, quantity_in_words, with_seconds, with_unit
from pulsetrainer.core.metrics import lacking
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.report.facts import coil_words, loop_words, minor_words, run_facts, span_digits, span_words
from pulsetrainer.report.names import digits, split, told
from pulsetrainer.report.tables import picked
from pulsetrainer.report.tables import text as shown

_MORE_BEFORE = 1.05  # times the full force, in the strokes before the pulse: said
_SMALL = 0.1  # of a unit: three decimals would not tell a range of less
_ROUNDING = 1e-6  # of the highest current
_SHORT = 0.01  # of the full force: what a warm coil lacks at the top of a pulse is said
_SURELY = 0.98  # of the force at the highest current: a coil warms on
_WORSE = 1.0  # per cent of the rms error of the first model: the figures of the table do not show less
_LARGE = 100.0  # of a unit: of more, three decimals tell what no sensor does

_VERDICT: Final = {True: "better", False: "worse", None: ""}

Said = tuple[dict[str, Any], str, dict[str, Any]]

_MOVED: Final = {
    "true": "still true",
    "shifted": "shifted (zero, gain or temperature)",
    "changed": "changed (the hysteresis has another shape)",
}
_TOLD_PERCENT: Final = 0.001  # of an expected error: less is not told in figures
_OF_A_FIT: Final = (
    "coverage_percent", "minor_percent", "smoothing", "input_noise", "false_reversals",
    "output_uncertainty", "offsets", "spacing", "stiffness", "loop", "masked_samples", "warning",
    "iterations",
)  # fmt: skip


def identified(out: Path, model: Model, seconds: float) -> Said:
    """Say what came out of a fit that took so many seconds."""
    fit, unit = model.fit, model.output_unit
    assert fit is not None
    payload = {
        "output": out,
        "cells": model.weights.size,
        **picked(model, "levels", "offset", "output_unit", "polarity", "form"),
        "fit_rms": fit.rms,
        "fit_rms_percent": fit.rms_percent,
        "fit_max_percent": fit.max_percent,
        **picked(fit, *_OF_A_FIT),
        "seconds": seconds,
    }
    share, band = fit.smoothing, fit.output_uncertainty
    edges = quantity_in_words(model.edges_quantity)
    rows = {
        "fit": f"{fit.rms_percent:.3f} % rms, {fit.max_percent:.2f} % max, of the span",
        "fit rms": with_unit(f"{fit.rms:.4g}", unit),
        "offset y0": with_unit(f"{model.offset:.4g}", model.offset_unit),
        "cells switched": f"{fit.coverage_percent:.1f} %",
        "told apart by minor loops": minor_words(fit.minor_percent, fit.coverage_percent)
        + f", on the plane of the {edges}" * (model.form == "dual"),
        "smoothing": f"{share:.3g} of the range of the {edges}" if share else "none",
        "loop": loop_words(model),
        "form": model.form,
        **({"output known within": with_unit(f"{band:.2g}", unit) + " (90 % band)"} if band else {}),
        "took": f"{seconds:.2f} s, {counted(fit.iterations, 'iteration')}",
    }
    return payload, f"{out}: Preisach model of {model.levels} levels, {model.weights.size} cells", rows


def captured(out: Path, signal: str, got: Any, info: Any) -> Said:
    """Say what a device recorded."""
    payload = {"output": out, "signal": signal, **got._asdict(), **picked(info, "serial", "firmware")}
    several = got.parts > 1  # a new stroke leads to where each goes on, so the file holds more reversals
    rows = {
        "samples": f"{got.samples} in {got.seconds:.1f} s, {got.rate_Hz:g} a second"
        + ", pauses between its parts included" * several,
        "current": "{:.3f} .. {:.3f} A".format(*got.current_range_A),
        "force": "{:.3f} .. {:.3f} N".format(*got.force_range_N),
        "reversals": f"{got.reversals} of the signal itself" if several else got.reversals,
        **({"parts": got.parts} if several else {}),
        "cells switched": f"{got.coverage_percent:.1f} %",
    }
    return payload, f"{out}: {signal} on {info.serial}, firmware {info.firmware}", rows


def drive_title(drive: Waveform) -> str:
    """Name a drive by its pulse and its inversion."""
    return f"{drive.name} by {drive.inversion} inversion"


def _range_words(ends: tuple[float, float], unit: str, peak: float = 0.0) -> tuple[str, str]:
    """Return a range, and a ``peak`` beside it, with three decimals, or with the digits that tell enough."""
    if ends[1] - ends[0] < _SMALL or max(map(abs, (*ends, peak))) >= _LARGE:
        return span_words(np.asarray(ends), unit), with_unit(f"{peak:.{span_digits(*ends)}g}", unit)
    return with_unit(f"{ends[0]:.3f} .. {ends[1]:.3f}", unit), with_unit(f"{peak:.3f}", unit)


def inverted(out: Path, drive: Waveform) -> Said:
    """Say what drive was found for a pulse."""
    force = float(drive.target[drive.scored].min()), float(drive.target[drive.scored].max())
    current = float(drive.compensated.min()), float(drive.compensated.max())
    model = drive.model
    given, made = (model.input_quantity, model.output_quantity) if model else ("current", "force")
    seconds = drive.time_s.size / drive.rate_Hz
    length = f"{seconds:.2f} s" if seconds >= 1 else with_seconds(seconds)
    seen = model.known if model else None
    rms, largest = (seen.rms_percent, seen.max_percent) if seen else (math.nan, math.nan)
    payload = {
        "output": out,
        **picked(drive, "name", "inversion"),
        "samples": drive.time_s.size,
        "seconds": seconds,
        "force_range": force,
        "current_range": current,
        **picked(drive, "clipped_samples", "predicted_max_error_percent", "predicted_peak"),
        "fit_rms_percent": rms,
        "fit_max_percent": largest,
        **picked(drive, "input_unit", "output_unit"),
    }
    more = drive.predicted_peak > _MORE_BEFORE * drive.full_force
    made_words, peak = _range_words(force, drive.output_unit, drive.predicted_peak if more else 0.0)
    before = f"; up to {peak} in the strokes before the pulse, by the model" if more else ""
    error = drive.predicted_max_error_percent
    most = f"at most {error:.3f}" if error >= _TOLD_PERCENT else f"under {_TOLD_PERCENT:g}"
    but = ", which lacks what was learnt" if drive.inversion == "transferred" else ""
    rows = {
        "length": f"{length}, {drive.time_s.size} samples",
        made: made_words + before,
        given: _range_words(current, drive.input_unit)[0],
        "out of reach": counted(drive.clipped_samples, "sample"),
        "expected error": f"{most} % of full {made}, by the model{but}",
        **_misses(rms, largest),
    }
    return payload, f"{out}: {drive_title(drive)}", rows


def _misses(rms: float, largest: float) -> dict[str, str]:
    """Say what a model missed of its own record, per cent of the span: a drive may miss as much."""
    if not math.isfinite(rms):
        return {}
    most = f", {largest:.2f} % max" if math.isfinite(largest) else ""
    return {"the model itself": f"missed its record by {rms:.3f} % rms{most}, of the span"}


def played(out: Path, made: Playback, serial: str, firmware: str) -> Said:
    """Say what was played on a device."""
    drive, repeats, kelvin = made.waveform, made.compensated.output.shape[0], made.temperature_K
    seconds = float(drive.time_s[-1]) * repeats * 2
    payload = {
        "output": out,
        **picked(drive, "name", "inversion"),
        "repeats": repeats,
        "samples": drive.time_s.size,
        "seconds": seconds,
        **picked(made, "dropped_samples", "complete", "temperature_K"),
        "serial": serial,
        "firmware": firmware,
    }
    rows = {
        "repeats": f"{repeats} of each drive, {seconds:.1f} s in all",
        "samples": f"{drive.time_s.size} a repeat",
        "lost": counted(made.dropped_samples, "sample"),
        **coil_words(kelvin),
        **_too_warm(made),
    }
    return payload, f"{out}: {drive_title(drive)} on {serial}", rows


def _too_warm(made: Playback) -> dict[str, str]:
    """Say what force a warm coil reaches, where that is less than the top of the pulse."""
    drive, model, sent = made.waveform, made.waveform.model, made.compensated.reference
    if made.temperature_K is None or model is None or not sent.size:
        return {}
    highest = operator_of(model).high
    nearly = (1.0 - _ROUNDING) * highest
    short = drive.scored & np.any(sent >= nearly, axis=0) & (drive.compensated < nearly)
    lack = lacking(drive.target, made.compensated.output, short)
    if not lack > _SHORT * drive.full_force:
        return {}
    wanted = float(drive.target[short].max())
    top = wanted - lack
    told = f"{top:.1f} of {wanted:.1f} {drive.output_unit} at {highest:g} {drive.input_unit}"
    return {"too warm": f"{told}, the highest current: invert with --force-max {_SURELY * top:.3g}"}


def refined(out: Path, made: Waveform, info: Any) -> Said:
    """Say what each pass on a device gave."""
    rows = {
        f"pass {number}{', kept' if number == made.kept else ''}": (
            f"mean {one.mean_abs_error_percent:.3f} %, max {one.max_abs_error_percent:.2f} % of full force, "
            + counted(one.repeats, "repeat")
        )
        for number, one in enumerate(made.passes, 1)
    }
    payload = {"output": out, **picked(made, "name", "passes", "kept"), "serial": info.serial}
    return payload, f"{out}: {made.name} refined on {info.serial}", rows


def tuned(
    out: Path | None, found: Any, gains: Mapping[str, str], *, supply: str
) -> tuple[str, dict[str, Any]]:
    """Say how a coil was measured, and which ``gains`` suit it; ``supply``: how its voltage is known."""
    before, after = found.tracking_percent.before, found.tracking_percent.after
    rows = {
        "coil": f"{found.resistance_ohm:.2f} ohm, {1e3 * found.inductance_H:.1f} mH, supply "
        f"{found.supply_V:.1f} V {supply}",
        **gains,
        "margins": f"gain {found.margins.gain:.1f}, phase {found.margins.phase_deg:.0f} degrees",
        "tracking": f"{after:.2f} % of the range at worst"
        + ("" if before is None else f", {before:.2f} % before"),
        "step": f"settled after {found.settle_ms:.1f} ms, overshoot {found.overshoot_percent:.1f} %; "
        "no pulse has such a step",
    }
    return f"{out}: {found.serial}" if out else f"{found.serial} (gains not kept)", rows


def checked(found: Any, *, limit_N: float, limit_gain: float) -> tuple[str, dict[str, Any]]:
    """Say whether a model is still true of its device, and what moved; less than the limits is nothing."""
    kelvin, error = found.temperature_K, found.error_percent
    unknown = f"not known: {found.temperature_unknown}"
    return _MOVED[found.verdict], {
        "offset": _estimated(found.offset, "N", 3) + f"; {limit_N:g} N either way is still true",
        "gain": _estimated(found.gain, "", 4) + f"; {limit_gain:g} either way is still true",
        "shape": _estimated(found.shape_percent, "% of the span", 2),
        "temperature": unknown if kelvin is None else _estimated(kelvin, "K against calibration", 1),
        "error": f"{error.before:.2f} % of the span, {error.after:.2f} % with this offset and gain",
        **{f"reason {number}": reason for number, reason in enumerate(found.reasons, 1)},
    }


def _estimated(estimate: Any, unit: str, digits: int) -> str:
    low, high = estimate.interval
    return f"{estimate.value:.{digits}f} {unit}".rstrip() + f" ({low:.{digits}f} to {high:.{digits}f})"


def pressed(out: Path, done: Any, info: Any) -> Said:
    """Say what a session pressed on a device."""
    figures, beats, kelvin = done.figures, int(done.beats.start_s.size), done.temperature_K
    payload = {
        "output": out,
        "beats": beats,
        **figures,
        **picked(done, "underruns", "parts"),
        "force_range_N": (done.reach.low, done.reach.high),
        **picked(done, "clipped_samples", "dropped_samples"),
        "temperature_K": kelvin if kelvin is not None and kelvin.size else None,
        **picked(info, "serial", "firmware"),
    }
    spread = [
        f"{what} within {figures[name]:.2g} %"
        for what, name in (("rate", "rate_cv_percent"), ("height", "amplitude_cv_percent"))
        if math.isfinite(figures[name])  # one beat alone tells nothing
    ]
    error = (
        f"{figures['mean_abs_error_percent']:.2f} % mean, {figures['max_abs_error_percent']:.2f} % at most"
    )
    rows = {
        "beats": f"{beats} in {counted(done.parts, 'part')}",
        "force": f"{done.reach.low:.2f} .. {done.reach.high:.2f} N at full amplitude",
        "error": f"{error}, of full force ({done.full_force:.2f} N)",
        "timing": f"beats begin within {figures['beat_timing_max_ms']:.2g} ms of their time",
        **({"as asked": f"{', '.join(spread)} (standard deviation)"} if spread else {}),
        **coil_words(kelvin),
        "underruns": done.underruns,
    }
    return payload, f"{out}: a session on {info.serial}", rows


def evaluated(evaluation: Evaluation) -> dict[str, Any]:
    """Return the errors of played waveforms or of models for a script."""
    waveforms = [
        {
            **picked(w, "name", "inversion", "repeats", "full_force"),
            "unit": w.output_unit,
            "scaled": picked(w.scaled, *METRICS),
            "compensated": picked(w.compensated, *METRICS),
            **picked(w, "mean_error_reduction_percent", "noise_percent"),
        }
        for w in evaluation.waveforms
    ]
    models = [picked(m, "name", *MODEL_METRICS, "start", "outside_percent") for m in evaluation.models]
    return ({"waveforms": waveforms} if waveforms else {}) | ({"models": models} if models else {})


def worse(evaluation: Evaluation) -> list[str]:
    """Say which models predict the run worse than the first one: a negative improvement is easily missed."""
    first = evaluation.models[:1]
    return [
        f"{m.name} predicts it worse than {one.name}: its rms error is {digits(-m.gain_percent)} % larger"
        + _but_for_an_offset(m, one)
        for one in first
        for m in evaluation.models
        if m.gain_percent < -_WORSE
    ]


def _but_for_an_offset(model: ModelEvaluation, first: ModelEvaluation) -> str:
    """Say how much better a model is where only a constant makes it the worse one: its zero moved."""
    own, other = model.shape_rms_percent, first.shape_rms_percent
    if not 100.0 * (other - own) > _WORSE * other:
        return ""
    return f", but less a constant offset {digits(100.0 * (1.0 - own / other))} % smaller"


def full_force(evaluation: Evaluation) -> str:
    """Say what errors of played waveforms are given in percent of; empty where there are none."""
    named: dict[str, str] = {}
    for w in evaluation.told_apart().waveforms:  # the first that has it
        named.setdefault(with_unit(f"{w.full_force:.4g}", w.output_unit), f"{w.name}, {w.inversion}")
    told = named if len(named) == 1 else [f"{value} ({name})" for value, name in named.items()]
    return f"{', '.join(told)}, the top of the pulse that was asked for" if named else ""


def as_csv(files: Sequence[Path], metrics: Mapping[str, Sequence[float | None]]) -> str:
    """Return a tidy table: a row for each file, a column for each figure."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["file", *metrics])
    writer.writerows([str(file), *(values[k] for values in metrics.values())] for k, file in enumerate(files))
    return text.getvalue()


def side_by_side(
    metrics: Sequence[Any], labels: Sequence[str], *, learners: bool
) -> tuple[list[str], list[list[Any]]]:
    """Return heads, and a row for each figure of ``compare``: name, unit, values, the change, and a verdict.

    A unit that is not the same everywhere stands behind each value. ``learners`` get no verdict, and their
    difference only where they are two: of a class it would say nothing.
    """
    behind = ["difference"] * (len(labels) == 2) if learners else ["change", ""]
    rows = []
    for m in metrics:
        owner, named = split(m.name)
        values: list[Any] = [told(m.name, value) for value in m.values]
        unit = m.units[0] if len(set(m.units)) == 1 else named.unit
        if len(set(m.units)) > 1:
            values = [f"{shown(v)} {u}".rstrip() for v, u in zip(values, m.units, strict=True)]
        row = [f"{owner.removeprefix('session.')}: {named.words}", unit, *values]
        rows.append(row + [_change(m), _VERDICT[m.better]][: len(behind)])
    return ["", "unit", *labels, *behind], rows


def _change(metric: Any) -> str:
    """Return a change with its sign; one that two decimals cannot show only where a unit is small."""
    by = told(metric.name, metric.change)
    if by is None:
        return "-"
    small = digits(abs(by)) if metric.units and metric.better is not None else f"{abs(by):.2f}"
    return f"{'-' if by < 0 else '+'}{small}" if float(small) else "0.00"


def labels_of(files: Sequence[Path]) -> list[str]:
    """Return short names of files that still tell them apart: the parts of their paths that differ."""
    parts = [path.with_suffix("").parts for path in files]
    if len({p[-1] for p in parts}) == len(parts):
        return [p[-1] for p in parts]
    if len({p[:-1] for p in parts}) == len(parts) and len({p[-1] for p in parts}) == 1:
        return [Path(*p[:-1]).name or str(path) for p, path in zip(parts, files, strict=True)]
    return [str(path) for path in files]


def imported(run: Run, report: Any) -> dict[str, Any]:
    """Say what is in a run that was measured elsewhere."""
    shown = run_facts(run, report.reversals)
    if report.false_reversals:
        noise = with_unit(f"{report.input_noise:.2g}", report.input_unit)
        more = counted(report.false_reversals, "more reversal", "is", "are")
        shown["noise in the input"] = f"{noise}; {more} noise"
    direction = "unclear, identify tries both" if report.polarity == "unclear" else report.polarity
    shown["loop"] = f"{direction} (correlation {report.correlation:+.2f})"
    shown["coverage_percent"] = report.coverage_percent
    low, high = report.input_range
    apart = minor_words(report.minor_percent, report.coverage_percent)
    shown["told apart by minor loops"] = apart if high > low else "none"
    even = f"even but for the gap{'s' if report.gaps > 1 else ''}" if report.gaps else "even"
    stamps = {True: even, False: "uneven", None: "none: only the order counts"}[report.even]
    shown["time stamps"] = f"{stamps}, made even" if report.resampled else stamps
    for name in ("signal", "complete", "dropped_samples"):  # the title; of a device, not of a file
        shown.pop(name, None)
    return shown
