"""Figures in words: the text alternatives for a reader who does not see them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.artefacts import Fit, Model, ModelEvaluation, WaveformEvaluation
from pulsetrainer.artefacts.units import shown
from pulsetrainer.report.names import digits


def _range(values: NDArray[np.float64], unit: str) -> str:
    known = values[np.isfinite(values)]
    if known.size == 0:
        return "without a single value"
    return f"from {known.min():.3g} to {known.max():.3g} {shown(unit)}".rstrip()


def density(model: Model) -> str:
    """Say where the density is largest and how much of the plane was covered."""
    n_h = model.edges.size - 1
    i, j = np.tril_indices(n_h)
    covered = int(np.count_nonzero(model.covered))
    text = (
        f"Colour map over the half-plane of switching levels, {model.edges_quantity} "
        f"{_range(model.edges, model.edges_unit)}: {n_h} levels, "
        f"{covered} of {model.weights.size} cells switched."
    )
    off_diagonal = np.where((i != j) & model.covered, model.weights, 0.0)
    if off_diagonal.max(initial=0.0) > 0:
        k = int(np.argmax(off_diagonal))
        beta, alpha = model.edges[j[k] : j[k] + 2].mean(), model.edges[i[k] : i[k] + 2].mean()
        text += (
            " Off the diagonal the density is greatest, "
            f"{off_diagonal[k]:.3g} {shown(model.weights_unit)}, for relays that switch up "
            f"at {alpha:.3g} and down at {beta:.3g} {shown(model.edges_unit)}."
        )
    return text


def identification(fit: Fit) -> str:
    """Say what was measured and how far the model is from it."""
    unit = shown(fit.output_unit)
    return (
        f"Above: loops of the measured output, {_range(fit.output, fit.output_unit)}, over the input, "
        f"{_range(fit.input, fit.input_unit)}, with the output of the model laid on them. "
        f"Below: the residual over time, rms {fit.rms:.3g} {unit}, at most {fit.max_abs:.3g} {unit}."
    )


def methods(played: Sequence[WaveformEvaluation]) -> str:
    """Say how large the mean error is without compensation, and by each inversion."""
    first = played[0]
    by = ", ".join(f"{one.inversion} {one.compensated.mean_abs_error_percent:.3g} %" for one in played)
    return (
        f"Above: one beat of the target force, {_range(first.target, first.output_unit)}, with the measured "
        f"force of the scaled drive, mean error {first.scaled.mean_abs_error_percent:.3g} %, and of the "
        f"compensated drive by each inversion: {by} of full force. Below: the error of each over the beat."
    )


def tracking(played: WaveformEvaluation) -> str:
    """Say how far each drive is from the target."""
    return (
        f"Above: target force, {_range(played.target, played.output_unit)}, over time, "
        f"{_range(played.time_s, 's')}, with the measured force of the scaled and of the compensated drive. "
        f"Below: their errors, at most {digits(played.scaled.max_abs_error_percent)} % of full force for "
        f"the scaled and {digits(played.compensated.max_abs_error_percent)} % for the compensated drive."
    )


def loops(played: WaveformEvaluation) -> str:
    """Say how wide each loop is."""
    return (
        "Measured force over target force, beside the diagonal where both are equal. "
        f"The scaled drive makes a loop area of {digits(played.scaled.hysteresis_percent)} % of full force², "
        f"the compensated drive one of {digits(played.compensated.hysteresis_percent)} %."
    )


def prediction(model: ModelEvaluation) -> str:
    """Say how far the prediction is from the measurement."""
    return (
        f"Above: measured output, {_range(model.output, model.output_unit)}, with the prediction of "
        f"{model.name} laid on it. Below: the residual, rms {model.rms:.3g} "
        f"{shown(model.output_unit)}, at most {digits(model.max_percent)} % of the span."
    )
