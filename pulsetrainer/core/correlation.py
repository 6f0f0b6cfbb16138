"""How long a residual stays correlated with itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.core.plane import FloatArray


def correlation_time(residuals: Sequence[FloatArray]) -> float:
    """Return tau = 1 + 2 sum_k rho_k, samples, up to the first autocorrelation rho_k below 2 / sqrt(n).

    White residuals have 1. Several residuals (n,) are taken together, each about its own mean; lags beyond
    a tenth of all samples are not looked at. A residual that is zero has 1.
    """
    n = sum(r.size for r in residuals)
    lags = max(1, n // 10)
    power = np.zeros(lags)
    for residual in residuals:
        if residual.size == 0:
            continue
        e = residual - residual.mean()
        spectrum = np.fft.rfft(e, 2 * e.size)
        own = np.fft.irfft(np.abs(spectrum) ** 2)[: min(lags, e.size)]
        power[: own.size] += own
    if power[0] <= 0:
        return 1.0
    correlation = power / power[0]
    end = int(np.argmax(np.append(correlation, 0.0) < 2.0 / np.sqrt(n)))
    return 1.0 + 2.0 * float(correlation[1:end].sum())
