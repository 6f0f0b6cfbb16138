"""What a command says of its result: what a script gets under its keys, a title, and lines for a person."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Evaluation, Model, ModelEvaluation, Playback, Run, Waveform
from pulsetrainer.artefacts.evaluation import METRICS, MODEL_METRICS
from pulsetrainer.artefacts.units import counted, quantity_in_words, with_seconds, with_unit
from pulsetrainer.report.facts import loop_words, minor_words, run_facts, span_words, warmth_words
from pulsetrainer.report.names import digits, split, told
from pulsetrainer.report.tables import picked
from pulsetrainer.report.tables import text as shown

_MORE_BEFORE = 1.05  # times the full force, in the strokes before the pulse: said
_SMALL = 0.1  # of a unit: three decimals would not tell a range of less
_LARGE = 100.0  # of a unit: of more, three decimals tell what no sensor does

_VERDICT: Final = {True: "better", False: "worse", None: ""}

Said = tuple[dict[str, Any], str, dict[str, Any]]

_TOLD_PERCENT: Final = 0.001  # of an expected error: less is not told in figures
_OF_A_FIT: Final = (
    "coverage_percent", "minor_percent", "smoothing", "input_noise", "false_reversals",
    "output_uncertainty", "offsets", "spacing", "stiffness", "loop", "masked_samples", "warning",
    "iterations",
)  # fmt: skip
_OF_A_CAUSE: Final = (
    "found", "p_value", "explains_percent", "confounded_with", "held_out_gain_percent",
    "detectable_from_percent", "text", "doubts",
)  # fmt: skip
_BASELINE: Final = (
    "rms", "rms_percent", "noise_percent", "extended_rms_percent", "static_percent", "extended_percent",
    "floor_percent",
)  # fmt: skip
_EXTENDED: Final = (
    "rms_percent", "extended_rms_percent", "static_percent", "extended_percent", "held_out_gain_percent",
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


def _range_words(ends: tuple[float, float], unit: str) -> str:
    """Return a range with three decimals; with other digits where these tell too much or too little."""
    if ends[1] - ends[0] < _SMALL or max(map(abs, ends)) >= _LARGE:
        return span_words(np.asarray(ends), unit)
    return with_unit(f"{ends[0]:.3f} .. {ends[1]:.3f}", unit)


def inverted(out: Path, drive: Waveform) -> Said:
    """Say what drive was found for a pulse."""
    force = float(drive.target[drive.scored].min()), float(drive.target[drive.scored].max())
    current = float(drive.compensated.min()), float(drive.compensated.max())
    model = drive.model
    given, made = (model.input_quantity, model.output_quantity) if model else ("current", "force")
    seconds = drive.time_s.size / drive.rate_Hz
    length = f"{seconds:.2f} s" if seconds >= 1 else with_seconds(seconds)
    payload = {
        "output": out,
        **picked(drive, "name", "inversion"),
        "samples": drive.time_s.size,
        "seconds": seconds,
        "force_range": force,
        "current_range": current,
        **picked(drive, "clipped_samples", "predicted_max_error_percent", "predicted_peak"),
        **picked(drive, "input_unit", "output_unit"),
    }
    before = ""
    if drive.predicted_peak > _MORE_BEFORE * drive.full_force:
        peak = f"{drive.predicted_peak:.3f} {drive.output_unit}"
        before = f"; up to {peak} in the strokes before the pulse, by the model"
    error = drive.predicted_max_error_percent
    most = f"at most {error:.3f}" if error >= _TOLD_PERCENT else f"under {_TOLD_PERCENT:g}"
    but = ", which lacks what was learnt" if drive.inversion == "transferred" else ""
    rows = {
        "length": f"{length}, {drive.time_s.size} samples",
        made: _range_words(force, drive.output_unit) + before,
        given: _range_words(current, drive.input_unit),
        "out of reach": counted(drive.clipped_samples, "sample"),
        "expected error": f"{most} % of full {made}, by the model{but}",
    }
    return payload, f"{out}: {drive_title(drive)}", rows


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
        **({"coil": warmth_words(kelvin)} if kelvin is not None and kelvin.size else {}),
    }
    return payload, f"{out}: {drive_title(drive)} on {serial}", rows


def pressed(
    figures: Mapping[str, float], beats: int, parts: int, reach_N: tuple[float, float], warmth_K: list[float]
) -> dict[str, Any]:
    """Say what a session pressed, by figures with its full force; no ``warmth_K``: heat was not tracked."""
    spread = [
        f"{what} within {figures[name]:.2g} %"
        for what, name in (("rate", "rate_cv_percent"), ("height", "amplitude_cv_percent"))
        if math.isfinite(figures[name])  # one beat alone tells nothing
    ]
    error = (
        f"{figures['mean_abs_error_percent']:.2f} % mean, {figures['max_abs_error_percent']:.2f} % at most"
    )
    return {
        "beats": f"{beats} in {counted(parts, 'part')}",
        "force": f"{reach_N[0]:.2f} .. {reach_N[1]:.2f} N at full amplitude",
        "error": f"{error}, of full force ({figures['full_force']:.2f} N)",
        "timing": f"beats begin within {figures['beat_timing_max_ms']:.2g} ms of their time",
        **({"as asked": f"{', '.join(spread)} (standard deviation)"} if spread else {}),
        **({"coil": warmth_words(warmth_K)} if warmth_K else {}),
    }


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
        for one in first
        for m in evaluation.models
        if m.gain_percent < 0
    ]


def full_force(evaluation: Evaluation) -> str:
    """Say what errors of played waveforms are given in percent of; empty where there are none."""
    rows = [
        (w.full_force, w.output_unit, f"{w.name}, {w.inversion}") for w in evaluation.told_apart().waveforms
    ]
    named: dict[str, str] = {}
    for force, unit, name in rows:  # the first that has it
        named.setdefault(with_unit(f"{force:.4g}", unit), name)
    told = named if len(named) == 1 else [f"{value} ({name})" for value, name in named.items()]
    return f"{', '.join(told)}, the top of the pulse that was asked for" if named else ""


def as_csv(files: Sequence[Path], metrics: Mapping[str, Sequence[float | None]]) -> str:
    """Return a tidy table: a row for each file, a column for each figure."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["file", *metrics])
    writer.writerows([str(file), *(values[k] for values in metrics.values())] for k, file in enumerate(files))
    return text.getvalue()


def side_by_side(metrics: Sequence[Any], *, verdicts: bool, change: bool) -> list[list[Any]]:
    """Return a row for each figure of ``compare``: name, unit, values; as wanted the change, and a verdict.

    A unit that is not the same everywhere stands behind each value.
    """
    rows = []
    for m in metrics:
        owner, named = split(m.name)
        values: list[Any] = [told(m.name, value) for value in m.values]
        unit = m.units[0] if len(set(m.units)) == 1 else named.unit
        if len(set(m.units)) > 1:
            values = [f"{shown(v)} {u}".rstrip() for v, u in zip(values, m.units, strict=True)]
        row = [f"{owner.removeprefix('session.')}: {named.words}", unit, *values]
        rows.append(row + [_change(m)] * change + [_VERDICT[m.better]] * verdicts)
    return rows


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


def diagnosed(found: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis for a script."""
    return {
        **picked(found, "verdict", "quick"),
        "baseline": picked(found, *_BASELINE),
        "left": found.left._asdict(),
        "causes": [
            {
                "id": one.cause,
                **picked(one, *_OF_A_CAUSE),
                "parameters": {
                    p.name: picked(p, "value", "unit", "meaning") | {"interval": (p.lower, p.upper)}
                    for p in one.parameters
                },
            }
            for one in found.causes
        ],
        **picked(found, "in_model", "lacks", "evidence", "next_experiment"),
    }


def extended(
    out: Path, model: Model, found: Diagnosis, run: Path | None, proof: Sequence[ModelEvaluation]
) -> Said:
    """Say what a diagnosed model was extended by; ``proof`` has the errors without and with it on ``run``."""
    payload = {
        "output": out,
        "added": [one.cause for one in model.extensions],
        "extensions": model.extensions,
        "levels": model.levels,
        **picked(found, *_EXTENDED),
    }
    rows = _left(found, model) | _apart(found, model)
    if proof:
        before, after = (one.rms_percent for one in proof)
        payload["verified"] = {"without_percent": before, "with_percent": after}
        rows["verified"] = (
            f"{run} is predicted to {after:.3f} % of its span (rms), by the model as it was to {before:.3f} %"
        )
    return payload, f"{out}: extended model of {model.levels} levels", rows


def _apart(found: Diagnosis, model: Model) -> dict[str, str]:
    """Say how the extended model differs from what the diagnosis told."""
    added = {one.cause: {p.name: p.value for p in one.parameters} for one in model.extensions}
    rows = {
        f"left out {one.cause}": "comes from the measurement: pulsetrainer correct"
        if one.cause in found.correctable
        else "; ".join(one.doubts) or "does not last"
        for one in found.found
        if one.cause not in added
    }
    told = {(one.cause, p.name): p.value for one in found.found for p in one.parameters}
    now = {(cause, name): value for cause, several in added.items() for name, value in several.items()}
    if any(told.get(which, value) != value for which, value in now.items()):
        rows["parameters"] = (
            "fitted again as the model is used, from rest; the intervals hold this fit and that of the "
            "diagnosis"
        )
    return rows


def _left(found: Diagnosis, model: Model) -> dict[str, str]:
    """Say what both models leave of the recordings, rms of single samples."""
    assert found.extended is not None
    if not math.isfinite(found.extended_rms_percent) or found.extended.extensions != model.extensions:
        return {}  # a file of 0.1; or --verify took a cause out
    return {
        "error before": f"{found.rms_percent:.3f} % of the span, rms of single samples",
        "error now": f"{found.extended_rms_percent:.3f} %; noise alone is {found.noise_percent:.3f} %",
    }


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
