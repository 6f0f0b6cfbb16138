"""From records of one device to one operator, of as many levels as asked: form, edges, offsets, weights.

``identification`` solves for weights on given levels. This module decides what it is given: the form that the
records ask for (``forms``), levels that lie evenly or closer where the loop is steep (``edges``), and an
offset for each record where their outputs differ by a constant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from pulsetrainer.core.dual import Dual, exchanged
from pulsetrainer.core.dual_fit import in_output
from pulsetrainer.core.edges import plane_for
from pulsetrainer.core.forms import BETTER, Form, Kept, Signals, Static, asked_forms, records_of
from pulsetrainer.core.identification import Identified, Method, Smoothing, identify, offsets_between
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray, Plane, Reading, ends_of
from pulsetrainer.core.record import Record, counted_output

CROWDED_MISFIT = 0.02  # of the span, rms: above it, what looks steep is nothing that the operator can follow


@dataclass(frozen=True)
class Fitted:
    """An operator, the records as they were fitted, and the offset of each record (k,) against their mean."""

    identified: Identified  # of the dual form: from the output to the input
    records: tuple[Record, ...]  # from input to output, in every form
    offsets: FloatArray
    form: Form = "direct"

    @cached_property
    def operator(self) -> Static:
        """The operator from input to output."""
        found = self.identified.operator
        return Dual(found) if self.form == "dual" else found

    @cached_property
    def predicted(self) -> list[FloatArray]:
        """Fitted output (n,) of each record."""
        return [self.operator(r.input, r.start) for r in self.records]

    @property
    def residuals(self) -> list[FloatArray]:
        """Measured less fitted output (n,) of each record."""
        return [r.output - y for r, y in zip(self.records, self.predicted, strict=True)]

    def counted(self, values: Sequence[FloatArray]) -> list[FloatArray]:
        """Those of the values (n,) of each record whose samples count in the fit."""
        return [x[r.counts] for x, r in zip(values, self.records, strict=True)]

    @property
    def counted_output(self) -> FloatArray:
        """Measured outputs (k,) of all records that count in the fit."""
        return counted_output(self.records)

    @property
    def misfit(self) -> float:
        """Rms error of the fit as a share of the output's span."""
        left = np.concatenate(self.counted(self.residuals))
        return root_mean_square(left) / float(np.ptp(self.counted_output))

    @property
    def evenly_spaced(self) -> bool:
        """True where the levels lie evenly."""
        steps = np.diff(self.identified.operator.plane.edges)
        return bool(np.allclose(steps, steps[0], atol=0.0))  # in whatever unit


def fit(
    signals: Signals,
    low: float,
    high: float,
    n_h: int,
    *,
    reading: Reading = "continuous",
    method: Method = "joint",
    smoothing: Smoothing = "auto",
    form: Form | Literal["auto"] = "direct",
    kept: Kept = None,
    levels: Plane | None = None,
    progress: Callable[[float], None] | None = None,
) -> Fitted:
    """Fit one operator with ``n_h`` levels on [low, high] to measured inputs and outputs, pairs of (n,).

    For relays the levels lie evenly, as in the paper. The levels of the dual form lie on the output. They are
    chosen by the records, unless the ``levels`` are given. ``progress`` is told how far a large fit is, 0..1.

    Errors are those of ``identification.identify``; ArgumentError also for relays, or the alternating method,
    with another form than direct.
    """
    forms = asked_forms(form, signals, low, high, kept, plain=reading == "continuous" and method == "joint")
    records = records_of(signals, low, high, kept)
    if "direct" not in forms:
        fits = [
            _signed(records, levels or plane_for(records, low, high, n_h), smoothing)
            if one == "signed"
            else _dual(records, _swapped(signals, n_h, smoothing, kept, levels))
            for one in forms
        ]
        return fits[-1] if fits[-1].misfit < BETTER * fits[0].misfit else fits[0]
    even = Plane.uniform(low, high, n_h)
    plane = levels or (even if reading == "relay" else plane_for(records, low, high, n_h))
    offsets = offsets_between(records, plane, reading)
    if np.any(offsets):
        moved = [(u, y - shift) for (u, y), shift in zip(signals, offsets, strict=True)]
        records = records_of(moved, low, high, kept)

    def on(levels: Plane) -> Fitted:
        found = identify(
            records, levels, reading=reading, method=method, smoothing=smoothing, progress=progress
        )
        return Fitted(found, tuple(records), offsets)

    fitted = on(plane)
    if levels is None and not fitted.evenly_spaced and fitted.misfit > CROWDED_MISFIT:
        return on(even)
    return fitted


def _signed(records: Sequence[Record], plane: Plane, smoothing: Smoothing) -> Fitted:
    """Fit weights of either sign."""
    found = identify(records, plane, smoothing=smoothing, signed=True)
    return Fitted(found, tuple(records), np.zeros(len(records)), "signed")


def _swapped(
    signals: Signals, n_h: int, smoothing: Smoothing, kept: Kept, levels: Plane | None
) -> Identified:
    """Fit the operator from output to input, to the input."""
    swapped = exchanged(signals)
    ends = ends_of([y for y, _ in swapped])
    return fit(swapped, *ends, n_h, smoothing=smoothing, kept=kept, levels=levels).identified


def _dual(records: Sequence[Record], found: Identified) -> Fitted:
    """Return the dual form of an operator from output to input, fitted again where the noise is."""
    if not found.stiffness:  # else it describes the record poorly, in whatever variable
        found = replace(found, operator=in_output(found.operator, records, found.smoothing))
    return Fitted(found, tuple(records), np.zeros(len(records)), "dual")
