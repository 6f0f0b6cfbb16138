"""Facts: the main figures of an artefact, by name, in the order in which a person would ask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Evaluation, Model, Playback, Run, Session, Waveform
from pulsetrainer.artefacts.model import Extension
from pulsetrainer.artefacts.time_steps import gaps_of, steps_of
from pulsetrainer.artefacts.units import counted, with_unit
from pulsetrainer.core import input_noise
from pulsetrainer.core.loop import drawn
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.report.diagnosis_text import parameters
from pulsetrainer.report.tables import picked


def facts(artefact: Any) -> dict[str, Any]:
    """Return the main figures of an artefact."""
    summaries: dict[type, Callable[[Any], dict[str, Any]]] = {
        Run: run_facts,
        Model: _model,
        Waveform: _waveform,
        Playback: _playback,
        Evaluation: Evaluation.figures,
        Diagnosis: _diagnosis,
        Session: _session,
    }
    return dict(summaries[type(artefact)](artefact))


def _playback(played: Playback) -> dict[str, Any]:
    return _waveform(played.waveform) | {
        "repeats": played.compensated.output.shape[0],
        **picked(played, "complete", "dropped_samples"),
        **coil_words(played.temperature_K),
    }


def span_words(values: FloatArray, unit: str) -> str:
    """Return the least and the greatest of values (n,) with as many digits as tell them apart."""
    values = values[np.isfinite(values)]  # a lost sample is none
    if values.size == 0:
        return "no samples"
    low, high = float(np.min(values)), float(np.max(values))
    digits = span_digits(low, high)
    return with_unit(f"{low:.{digits}g} .. {high:.{digits}g}", unit)


def span_digits(low: float, high: float) -> int:
    """Return how many digits tell the ends of a range apart: four, or more of a small swing about much."""
    share = (high - low) / max(abs(low), abs(high)) if high > low else 1.0
    return min(4 + max(0, int(-np.log10(share))), 12)


def run_facts(run: Run, reversals: int | None = None) -> dict[str, Any]:
    """Return the main figures of a run; its ``reversals`` are counted unless they are given."""
    steps = steps_of(run.time_s) if run.time_s is not None and run.time_s.size > 1 else None
    if reversals is None:
        turned = run.input if run.reference is None else run.reference
        reversals = input_noise.clean(turned[:: max(input_noise.every(turned.size), 1)]).kept
    parts = run.parts()
    return {
        "signal": run.signal,
        "samples": run.input.size,
        "seconds": float(run.time_s[-1] - run.time_s[0]) if run.time_s is not None and steps else None,
        "rate_Hz": 1.0 / steps.median if steps else None,
        "gaps": gaps_of(run.time_s, run.seam).number if steps else None,
        **({"parts": len(parts)} if len(parts) > 1 else {}),
        f"input ({run.input_quantity})": span_words(run.input, run.input_unit),
        f"output ({run.output_quantity})": span_words(run.output, run.output_unit),
        "reversals": reversals,
        **picked(run, "complete", "dropped_samples"),
        **(picked(run, "left_out_rows") if run.left_out_rows else {}),
    }


_HARDLY = 50.0  # % of the cells: with fewer a person should know what the coverage does not say
_ALL = 99.95  # % of the cells: what is printed as 100.0
_LOOPS = {
    "counterclockwise": "{}, the output lags",
    "clockwise": "{}, the output leads",
    "butterfly": "a {}, it crosses itself",
    "none": "no loop, the output follows the input",
}


def loop_drawn(model: Model) -> str:
    """Return which way the loop of a model runs in a drawing; empty where nobody knows."""
    return drawn(model.fit.loop, model.polarity) if model.fit else ""


def loop_words(model: Model) -> str:
    """Say which way the loop of a model runs: "rising, counterclockwise, the output lags"."""
    trend = "falling" if model.polarity < 0 else "rising"
    turns = _LOOPS.get(model.fit.loop, "").format(loop_drawn(model)) if model.fit else ""
    if model.form == "signed":  # no loop of one direction fits
        return f"mostly {turns}" if turns[:1] == "c" else turns or "of either direction"
    return f"{trend}, {turns}" if turns else trend


def minor_words(percent: float, switched_percent: float) -> str:
    """Say how many cells minor loops tell apart, and what of the others is known."""
    by = "only the major loop" if switched_percent >= _ALL else "only the major loop, or nothing,"
    rest = (
        f"; {by if switched_percent > 0 else 'nothing'} switched the rest: "
        f"smaller loops within {'it' if switched_percent > 0 else 'the range'} would tell them apart"
        if percent < _HARDLY
        else ""
    )
    return f"{percent:.0f} % of the cells{rest}"


def _model(model: Model) -> dict[str, Any]:
    fit = model.fit
    return {
        **({"warning": fit.warning} if fit and fit.warning else {}),
        "levels": model.levels,
        "cells": model.weights.size,
        **picked(model, "reading", "polarity", "form"),
        "loop": loop_drawn(model) or None,
        f"{'output' if model.form == 'dual' else 'input'} ({model.edges_quantity})": span_words(
            model.edges, model.edges_unit
        ),
        "offset": with_unit(f"{model.offset:.4g}", model.offset_unit),
        "positive weights": int(np.sum(model.weights > 0)),
        "fit_rms_percent": fit.rms_percent if fit else None,
        "coverage_percent": fit.coverage_percent if fit else None,
        **({"masked_samples": fit.masked_samples} if fit and fit.masked_samples else {}),
        "extensions": [extension.cause for extension in model.extensions],
        **{f"with {extension.cause}": _with(extension) for extension in model.extensions},
    }


def extension_words(one: Extension) -> dict[str, str]:
    """Return the parameters of an extension by name; of a single time constant without a word of several."""
    alone = [p for p in one.parameters if p.meaning.endswith("(1: it is the only one)") and p.value == 1.0]
    shown = [
        replace(p, meaning=p.meaning.removesuffix("; of several, the middle one")) if alone else p
        for p in one.parameters
        if p not in alone
    ]
    return parameters(shown)


def _with(one: Extension) -> str:
    plain = replace(one, parameters=tuple(replace(p, meaning="") for p in one.parameters if not p.chosen))
    return ", ".join(map(" ".join, extension_words(plain).items()))


def _waveform(waveform: Waveform) -> dict[str, Any]:
    return {
        "waveform": waveform.name,
        "inversion": waveform.inversion,
        "samples": waveform.time_s.size,
        "seconds": float(waveform.time_s[-1]),
        "target": span_words(waveform.target[waveform.scored], waveform.output_unit),
        "compensated drive": span_words(waveform.compensated, waveform.input_unit),
        "clipped_samples": waveform.clipped_samples,
        **(_refined(waveform) if waveform.passes else picked(waveform, "predicted_max_error_percent")),
        "source": waveform.source,
    }


def _refined(waveform: Waveform) -> dict[str, Any]:
    kept = waveform.passes[waveform.kept - 1]
    return {
        "refined": f"pass {waveform.kept} of {len(waveform.passes)}, {counted(kept.repeats, 'repeat')}",
        **picked(kept, "mean_abs_error_percent", "max_abs_error_percent"),
    }


def _diagnosis(found: Diagnosis) -> dict[str, Any]:
    return {
        **picked(found, "verdict", "quick"),
        "found": [
            f"{one.cause} ({', '.join(map(' '.join, parameters(one.parameters).items()))})"
            for one in found.found
        ],
        **picked(found, "rms_percent", "noise_percent"),
        **picked(found, "static_percent", "extended_percent", "floor_percent"),
        "next": " ".join(found.advice),
    }


def _session(session: Session) -> dict[str, Any]:
    quiz = session.quiz
    return {
        "pulses": list(session.pulses),
        "beats": session.beats.start_s.size,
        "seconds": float(np.ptp(session.time_s)) if session.time_s.size else 0.0,
        **session.figures(),
        "error in just noticeable differences": session.error_jnd,
        **coil_words(session.temperature_K),
        **picked(session, "underruns", "complete"),
        **({"ended early": session.ended_early} if session.ended_early else {}),
        "dropped_samples": session.dropped_samples,
        "right": None if quiz is None else f"{quiz.right} of {len(quiz.asked)}",
    }


def coil_words(kelvin: FloatArray | None) -> dict[str, str]:
    """Say between which temperatures the coil was, K (n,), where heat was tracked."""
    if kelvin is None or not kelvin.size:
        return {}
    low, high = (round(float(k), 1) + 0.0 for k in (min(kelvin), max(kelvin)))  # no -0.0
    return {"coil": f"{low:+.1f} to {high:+.1f} K against calibration, made up for"}
