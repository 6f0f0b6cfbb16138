"""Artefacts for the tests of figures and report: a made-up device with hysteresis, all from a seed."""

from __future__ import annotations

import numpy as np

from pulsetrainer.artefacts import (
    DriveError,
    DrivePlayback,
    Evaluation,
    Extension,
    Fit,
    Model,
    ModelEvaluation,
    Parameter,
    Playback,
    Run,
    Waveform,
    WaveformEvaluation,
)
from pulsetrainer.resources import waveforms_dir

FULL_CURRENT = 1.5
FULL_FORCE = 14.0


def device(current):
    """Return the force of a sum of play operators: rises with the current, wider when large."""
    force = 4.0 * current + 1.5 * current**2
    for width, weight in ((0.06, 1.5), (0.15, 1.8), (0.3, 1.2)):
        play = np.empty_like(current)
        state = 0.0
        for k, u in enumerate(current):
            state = min(max(state, u - width), u + width)
            play[k] = state
        force += weight * play
    return force


def pulse(name="normal", beats=3, dt_s=0.004):
    """Return (time, p) of a library pulse."""
    rows = np.loadtxt(waveforms_dir() / f"{name}.csv", delimiter=",", skiprows=7)
    step = round(dt_s / 0.001)
    p = np.tile(rows[::step, 1], beats)
    return np.arange(p.size) * dt_s, p


def identification_current(n=4000):
    """Return a decaying triangle, as an identification drives it."""
    phase = np.linspace(0, 40, n)
    triangle = 2 * np.abs(phase % 1 - 0.5)
    return 0.75 + (triangle - 0.5) * np.linspace(1.5, 0.05, n)


def run(n=4000, *, time=True, seed=1):
    """Return a captured run."""
    rng = np.random.default_rng(seed)
    current = identification_current(n)
    measured = current + rng.normal(0, 0.002, n)
    return Run(
        time_s=np.arange(n) * 0.01 if time else None,
        input=measured,
        output=device(current) + rng.normal(0, 0.04, n),
        reference=current,
        signal="identification",
    )


def fit(n=2000, *, time=True, seed=2):
    """Return the record of a fit with a small residual."""
    record = run(n, time=time, seed=seed)
    error = 0.08 * np.sin(np.linspace(0, 60, n)) + np.random.default_rng(seed).normal(0, 0.04, n)
    return Fit(
        rms=float(np.sqrt(np.mean(error**2))),
        max_abs=float(np.max(np.abs(error))),
        rms_percent=0.61,
        coverage_percent=96.4,
        input_unit="A",
        output_unit="N",
        samples=40000,
        iterations=31,
        method="joint",
        time_s=record.time_s,
        input=record.input,
        output=record.output,
        predicted=record.output - error,
    )


def model(n_h=48, *, with_fit=True, seed=3, extensions=()):
    """Return a model: a ridge near the diagonal, a reversible part on it, a corner that was not covered."""
    rng = np.random.default_rng(seed)
    edges = np.linspace(0.0, FULL_CURRENT, n_h + 1)
    i, j = np.tril_indices(n_h)
    alpha, beta = (edges[i] + edges[i + 1]) / 2, (edges[j] + edges[j + 1]) / 2
    weights = 9.0 * np.exp(-(((alpha - beta - 0.15) / 0.12) ** 2) - ((alpha + beta - 1.8) / 0.9) ** 2)
    weights += np.where(i == j, 60.0, 0.0)
    weights = np.maximum(weights + rng.normal(0, 0.6, weights.size), 0.0)
    return Model(
        edges=edges,
        weights=weights,
        offset=0.213,
        covered=~((i > 0.9 * n_h) & (j < 0.12 * n_h)),
        fit=fit() if with_fit else None,
        extensions=extensions,
    )


def extended_model():
    """Return a model with a creep extension."""
    creep = Extension("creep", (Parameter("amplitude", 0.051, "1", 0.047, 0.055),))
    return model(n_h=12, with_fit=False, extensions=(creep,))


def waveform(name="normal", inversion="continuous"):
    """Return a waveform with its drives."""
    time_s, p = pulse(name)
    target = 2.0 + 10.0 * p
    scaled = 0.3 + 1.0 * p
    return Waveform(
        time_s=time_s,
        target=target,
        compensated=scaled - 0.12 * np.gradient(p, time_s) / 20,
        scaled=scaled,
        predicted=target + 0.02 * np.sin(40 * time_s),
        scored=time_s >= 0.8,
        name=name,
        source="drawn",
        inversion=inversion,
        clipped_samples=0,
    )


def playback(name="normal", inversion="continuous", repeats=3):
    """Return a playback; one block of the last repeat was lost."""
    asked = waveform(name, inversion)
    rng = np.random.default_rng(5)

    def played(current, force):
        shape = (repeats, current.size)
        output = force + rng.normal(0, 0.05, shape)
        output[-1, 200:240] = np.nan
        return DrivePlayback(
            reference=np.tile(current, (repeats, 1)),
            input=current + rng.normal(0, 0.003, shape),
            output=output,
        )

    return Playback(
        time_s=asked.time_s,
        waveform=asked,
        compensated=played(asked.compensated, asked.target + 0.3 * np.sin(9 * asked.time_s)),
        scaled=played(asked.scaled, asked.target + 1.4 * np.gradient(asked.target, asked.time_s) / 30),
        input_range=FULL_CURRENT,
    )


def drive_error(target, error, tracking, hysteresis):
    """Return the errors of one drive, computed from the error as the evaluation does."""
    percent = 100.0 * np.abs(error) / target.max()
    return DriveError(
        mean_abs_error_percent=float(percent.mean()),
        max_abs_error_percent=float(percent.max()),
        rms_error_percent=float(np.sqrt(np.mean(percent**2))),
        hysteresis_percent=hysteresis,
        current_tracking_max_percent=tracking,
        output=target + error,
    )


def waveform_evaluation(name="normal", inversion="continuous", quality=1.0, seed=7):
    """Return the evaluation of one played waveform; a smaller ``quality`` is a worse inverse."""
    rng = np.random.default_rng(seed)
    time_s, p = pulse(name, beats=2)
    target = 2.0 + 10.0 * p
    lag = np.gradient(p, time_s)
    error = 0.16 * lag + 0.9 * np.sin(np.pi * p)
    left = 0.07 / quality * np.sin(7 * time_s) + 0.015 / quality * lag
    noise = rng.normal(0, 0.03, (2, time_s.size))
    scaled = drive_error(target, error + noise[0], 0.2871, 18.345678)
    compensated = drive_error(target, left + noise[1], 0.3123, 1.9876 / quality)
    return WaveformEvaluation(
        name=name,
        inversion=inversion,
        repeats=5,
        time_s=time_s + 0.8,
        target=target,
        scaled=scaled,
        compensated=compensated,
        mean_error_reduction_percent=100
        * (1 - compensated.mean_abs_error_percent / scaled.mean_abs_error_percent),
        full_force=12.0,
        noise_percent=0.2534,
    )


def model_evaluation(name="model", size=0.2, gain=0.0, *, time=True):
    """Return the prediction error of a model."""
    n = 1500
    rng = np.random.default_rng(11)
    current = identification_current(n)
    output = device(current) + rng.normal(0, 0.03, n)
    error = size * np.sin(np.linspace(0, 25, n)) + rng.normal(0, 0.03, n)
    rms = float(np.sqrt(np.mean(error**2)))
    return ModelEvaluation(
        name=name,
        rms=rms,
        rms_percent=100 * rms / float(np.ptp(output)),
        max_percent=100 * float(np.abs(error).max() / np.ptp(output)),
        gain_percent=gain,
        time_s=np.arange(n) * 0.01 if time else None,
        output=output,
        predicted=output - error,
        offset=float(error.mean()),
        shape_rms_percent=100 * float(error.std() / np.ptp(output)),
    )


def evaluation():
    """Return what the demo makes: two waveforms by two inverses, and the model."""
    return Evaluation(
        waveforms=tuple(
            waveform_evaluation(name, inversion, quality, seed)
            for name, inversion, quality, seed in (
                ("normal", "closest-match", 0.5, 1),
                ("normal", "continuous", 1.0, 2),
                ("bifid", "closest-match", 0.45, 3),
                ("bifid", "continuous", 0.9, 4),
            )
        ),
        model=model(),
    )


def model_comparison():
    """Return an evaluation of two models on a held-out run."""
    return Evaluation(
        models=(model_evaluation("static.h5", 0.25), model_evaluation("extended.h5", 0.05, gain=72.5)),
        model=model(n_h=12),
    )
