"""the output is clipped at the end of its range: found on the raw data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from scipy import ndimage

from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.raw import Firing, Raw, noise_of, spacing_of

_LEAST = 20  # samples at the rail: fewer may be chance
_PILE = 2.0  # times the samples just inside: noise makes a tail at the end of a distribution, a rail a pile
_AT = 0.5  # converter steps: nearer than that is at the rail
_INSIDE = 10.5  # converter steps beside the rail that are compared with it ...
_INSIDE_SPAN = 0.02  # ... but no more than this share of the span
_NOISY = 0.5  # converter steps of noise: with less a flat top repeats its value by itself
_BESIDE = 3  # samples beside a cut off one, in time: only those with low noise are left there
_AROUND = 9  # samples whose mean is near the rail where ...
_NEAR = 3.0  # ... it is nearer than this many times the noise


class Saturation(Cause):
    """The output is clipped at the end of its range."""

    id = "saturation"
    title = "the {output} is clipped at the end of its range"
    formula = "min(y, y_max)"
    signature = "exactly repeated maxima, on one side"
    excitation = "the whole range"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 0
    family = "saturation"
    lasting = False
    texts: ClassVar[Mapping[str, str]] = {
        "gate": "{count:.0f} samples sit at exactly {rail:.4g}: the output is clipped there"
    }

    def gate(self, raw: Raw) -> Firing | None:
        """Maxima that repeat exactly far more often than the values just inside them."""
        y = raw.calm.output
        step, rail = spacing_of(y), float(y.max())
        at = np.abs(y - rail) <= _AT * step
        inside = (np.abs(y - rail) <= _INSIDE * step) & ~at & (np.abs(y - rail) < _INSIDE_SPAN * np.ptp(y))
        count = np.count_nonzero(at)
        if count <= _LEAST or count <= _PILE * np.count_nonzero(inside) or noise_of(y) <= _NOISY * step:
            return None
        noise = noise_of(y, np.where(at, 0.0, 1.0))
        mask = ndimage.binary_dilation(at, iterations=_BESIDE)
        mask |= ndimage.uniform_filter1d(y, _AROUND) > rail - _NEAR * noise
        figures = {"count": float(count), "rail": rail}
        return Firing(self.id, "gate", rail, "{y}", figures, mask, spread=step)
