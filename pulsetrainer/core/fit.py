"""From the records of one device to one operator: levels placed for them, offsets between them, the weights.

``identification`` solves for weights on given levels. Here it is decided what it is given: the levels lie
evenly, or closer where the loop is steep (``levels``), and records whose outputs are shifted against each
other get an offset each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pulsetrainer.core.edges import plane_for
from pulsetrainer.core.identification import Identified, Method, Smoothing, identify, offsets_between
from pulsetrainer.core.initial_state import record_of
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray, Plane, Reading
from pulsetrainer.core.record import Record

CROWDED_MISFIT = 0.02  # of the span, rms: above it, what looks steep is nothing that the operator can follow


@dataclass(frozen=True, slots=True)
class Fitted:
    """An operator, the records as they were fitted, and the offset of each record (k,) against their mean."""

    identified: Identified
    records: tuple[Record, ...]
    offsets: FloatArray

    @property
    def residuals(self) -> list[FloatArray]:
        """Measured less fitted output (n,) of each record."""
        operator = self.identified.operator
        return [r.output - operator(r.input, r.start) for r in self.records]

    @property
    def misfit(self) -> float:
        """Rms error of the fit as a share of the output's span."""
        counted = [r.sample_weight > 0 for r in self.records]
        left = np.concatenate([e[c] for e, c in zip(self.residuals, counted, strict=True)])
        output = np.concatenate([r.output[c] for r, c in zip(self.records, counted, strict=True)])
        return root_mean_square(left) / float(np.ptp(output))

    @property
    def evenly_spaced(self) -> bool:
        """True where the levels lie evenly."""
        steps = np.diff(self.identified.operator.plane.edges)
        return bool(np.allclose(steps, steps[0]))


def fit(
    signals: Sequence[tuple[FloatArray, FloatArray]],
    low: float,
    high: float,
    n_h: int,
    *,
    reading: Reading = "continuous",
    method: Method = "joint",
    smoothing: Smoothing = "auto",
) -> Fitted:
    """Fit one operator with ``n_h`` levels on [low, high] to measured inputs and outputs, pairs of (n,).

    For relays the levels lie evenly, as in the paper.

    Raises
    ------
    ArgumentError, ConvergenceError
        As ``identification.identify``.
    """
    records = [record_of(u, y, low, high) for u, y in signals]
    even = Plane.uniform(low, high, n_h)
    plane = even if reading == "relay" else plane_for(records, low, high, n_h)
    offsets = offsets_between(records, plane, reading)
    if np.any(offsets):
        records = [record_of(u, y - shift, low, high) for (u, y), shift in zip(signals, offsets, strict=True)]

    def on(levels: Plane) -> Fitted:
        found = identify(records, levels, reading=reading, method=method, smoothing=smoothing)
        return Fitted(found, tuple(records), offsets)

    fitted = on(plane)
    if not fitted.evenly_spaced and fitted.misfit > CROWDED_MISFIT:
        return on(even)
    return fitted
