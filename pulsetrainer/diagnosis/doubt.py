"""How far the sums of squares of two fits may differ although neither fit is better."""

from __future__ import annotations

import numpy as np

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.fitting import Fitted
from pulsetrainer.diagnosis.noise import Noise
from pulsetrainer.diagnosis.thresholds import LIMITS


def doubt(fitted: Fitted, other: Fitted, noise: Noise | None) -> float:
    """Difference of squares of two fits that tells nothing: of noise, and of what lies between samples."""
    if noise is None:
        return 0.0
    apart = fitted.projector((other.simulated - fitted.simulated)[:, None])
    return _by_chance(noise, apart) + _between_samples(fitted, apart[:, 0])


def _by_chance(noise: Noise, apart: FloatArray) -> float:
    """Difference of squares of two models that noise exceeds once in twenty, if neither is better.

    Of squares |e + d|^2 - |e|^2 with e noise and d (count, 1) the difference of the models, 2 d'e is chance.
    """
    return 2.0 * LIMITS.once_in_twenty * float(np.sqrt(noise.covariance(apart)[0, 0]))


def _between_samples(fitted: Fitted, apart: FloatArray) -> float:
    """Difference of squares of two models, ``apart`` (count,), that what happens between samples can make.

    A turn of the input lies anywhere between two samples, and what is cut off there looks like a share of the
    second difference of the output: the formulas of short lags differ by just that (decision 101).
    """
    bent = [np.diff(y, 2, prepend=y[:1], append=y[-1:]) for y in fitted.simulator.full(fitted.terms)]
    cut = fitted.projector(fitted.problem.bins.average(bent)[:, None])[:, 0]
    return 2.0 * LIMITS.cut_turns * abs(float(apart @ cut))
