"""the output is clipped at the end of its range: found on the raw data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from scipy import ndimage

from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import Cause
from pulsetrainer.diagnosis.raw import Firing, Raw, noise_of, spacing_of

_LEAST = 20  # samples at the rail: fewer may be chance
_PILE = 1.2  # times the samples just inside: noise makes a tail at the end of a distribution, a rail a pile
_AT = 0.5  # converter steps: nearer than that is at the rail
_INSIDE = 10.5  # converter steps beside the rail that are compared with it ...
_INSIDE_SPAN = 0.02  # ... but no more than this share of the span
_NOISY = 0.7  # converter steps of noise: with less a flat top repeats itself; steps alone look like 0.66
_BESIDE = 3  # samples beside a cut off one, in time: only those with low noise are left there
_AROUND = 9  # samples whose mean is near the rail where ...
_NEAR = 3.0  # ... it is nearer than this many times the noise


class Saturation(Cause):
    """The output is clipped at the end of its range."""

    id = "saturation"
    title = "the {output} is clipped at the end of its range"
    formula = "min(y, y_max)"
    signature = "exactly repeated maxima or minima"
    excitation = "the whole range"
    source = "Isermann, Fault-Diagnosis Systems, 2006, chapter 7: limit and plausibility checks"
    stage = "record"
    order = 0
    family = "saturation"
    lasting = False
    corrects = True
    size = "{output} at which it is clipped"
    texts: ClassVar[Mapping[str, str]] = {
        "gate": "{count:.0f} samples sit at exactly {rail:.4g}{in_y}: the output is clipped there",
        "both": (
            "{count:.0f} samples sit at exactly {rail:.4g} or {other:.4g}{in_y}: the output is clipped there"
        ),
    }

    def gate(self, raw: Raw) -> Firing | None:
        """Extremes that repeat exactly far more often than the values just inside them, at either end."""
        y = raw.calm.output
        step = spacing_of(y)
        if noise_of(y) <= _NOISY * step:
            return None
        rails = [sign for sign in (1.0, -1.0) if _clipped(sign * y, step)]
        if not rails:
            return None
        ends = [float((sign * y).max()) * sign for sign in rails]
        at = np.any([np.abs(y - rail) <= _AT * step for rail in ends], axis=0)
        noise = noise_of(y, np.where(at, 0.0, 1.0))
        mask = ndimage.binary_dilation(at, iterations=_BESIDE)
        mean = ndimage.uniform_filter1d(y, _AROUND)
        for sign, rail in zip(rails, ends, strict=True):
            mask |= sign * mean > sign * rail - _NEAR * noise
        one, other = raw.polarity * ends[0], raw.polarity * ends[-1]
        figures = {"count": float(np.count_nonzero(at)), "rail": one, "other": other}
        kind = "gate" if len(ends) == 1 else "both"
        return Firing(self.id, kind, one, "{y}", figures, mask, spread=step)


def _clipped(y: FloatArray, step: float) -> bool:
    """Whether the largest values of ``y`` (n,) are a rail."""
    below = float(y.max()) - y
    at = below <= _AT * step
    inside = (below <= _INSIDE * step) & ~at & (below < _INSIDE_SPAN * np.ptp(y))
    count = np.count_nonzero(at)
    return bool(count > _LEAST and count > _PILE * np.count_nonzero(inside))
