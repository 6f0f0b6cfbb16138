"""the output is clipped at the end of its range: found on the raw data.

A rail behind the converter's noise repeats one value exactly. One in front of it is a level at which the
output stays, within its noise, while the model as given says that it goes on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.censored import beyond_rails
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import OfTheRecord, Taken, Values
from pulsetrainer.diagnosis.raw import BoolArray, Firing, Raw, noise_of, spacing_of
from pulsetrainer.diagnosis.thresholds import LIMITS, UNIFORM

_LEAST = 20  # samples at the rail: fewer may be chance
_PILE = 1.2  # times the samples just inside: noise makes a tail at the end of a distribution, a rail a pile
_TOWERS = 4.0  # times any single value just inside: the turn of a smooth signal reaches 2.4
_AT = 0.5  # converter steps: nearer than that is at the rail
_INSIDE = 10.5  # converter steps beside the rail that are compared with it ...
_INSIDE_SPAN = 0.02  # ... but no more than this share of the span
_NOISY = 0.7  # converter steps of noise: with less a flat top repeats itself; steps alone look like 0.66
_BESIDE = 3  # samples beside a cut off one, in time: only those with low noise are left there
_AROUND = 9  # samples whose mean is near the rail where ...
_NEAR = 3.0  # ... it is nearer than this many times the noise
# A rail in front of the noise, against what the model as given says
_BEYOND = 0.01  # of the span: so far beyond the rail must the model go ...
_BEYOND_NOISE = 10.0  # ... and so many times the noise
_FLAT = 1.3  # times the noise: an output that varies more is not held ...
_FOLLOWS = 0.1  # ... nor is one that follows the model by more than this share
_BELOW = 0.5  # of the model's error on the whole record: below the rail it must be nearer


class Saturation(OfTheRecord):
    """The output is clipped at the end of its range."""

    id = "saturation"
    title = "the {output} is clipped at the end of its range"
    formula = "min(y, y_max)"
    signature = "exactly repeated maxima or minima"
    excitation = "the whole range"
    order = 0
    family = "saturation"
    corrects = True
    size = "{output} at which it is clipped"
    texts: ClassVar[Mapping[str, str]] = {
        "gate": "{count:.0f} samples sit at exactly {rail:.4g}{in_y}: the output is clipped there",
        "held": (
            "{count:.0f} samples stay within their noise at {rail:.4g}{in_y} where the model as given goes on"
            " to {said:.4g}{in_y}: the output is clipped there, before it is digitised"
        ),
        "both": (
            "{count:.0f} samples sit at exactly {rail:.4g} or {other:.4g}{in_y}: the output is clipped there"
        ),
    }

    def gate(self, raw: Raw) -> Firing | None:
        """Extremes that repeat exactly far more often than the values just inside them, at either end."""
        y = raw.calm.output
        rails = _rails(y)
        if not rails:
            return _held(raw)
        at = np.any(list(rails.values()), axis=0)
        noise = noise_of(y, np.where(at, 0.0, 1.0))
        mask = scipy.ndimage.binary_dilation(at, iterations=_BESIDE)
        ends = [float((sign * y).max()) * sign for sign in rails]
        for sign, rail in zip(rails, ends, strict=True):
            mask |= _near(sign * y, sign * rail, noise)
        one, other = raw.polarity * ends[0], raw.polarity * ends[-1]
        figures = {"count": float(np.count_nonzero(at)), "rail": one, "other": other}
        kind = "gate" if len(ends) == 1 else "both"
        return Firing(self.id, kind, one, "{y}", figures, mask, spread=spacing_of(y))

    def undo(self, y: FloatArray, values: Values, taken: Taken) -> FloatArray:
        """Output (n,) as the hysteresis expects it just beyond a rail; NaN where nothing tells it.

        Where no hysteresis describes the record, what is near the rail is lost too: only low noise is left
        there.
        """
        rail, measured = taken.raw.polarity * values[0], taken.raw.calm.output
        rails = _rails(measured)
        if not rails:  # only the model as given could tell
            sign = 1.0 if rail > measured.mean() else -1.0
            return np.where(_near(sign * measured, sign * rail, noise_of(measured)), np.nan, y)
        nowhere = np.zeros(y.size, dtype=np.bool_)
        up, down = (rails.get(sign, nowhere) for sign in (1.0, -1.0))
        noise = noise_of(measured, np.where(up | down, 0.0, 1.0))
        whole = beyond_rails(*taken.known(y), up, down, noise)
        return super().undo(y, values, taken) if whole is None else np.where(np.isfinite(y), whole, np.nan)


def _rails(y: FloatArray) -> dict[float, BoolArray]:
    """Samples (n,) at the upper (1) and at the lower (-1) rail; nothing where noise does not tell one."""
    step = spacing_of(y)
    signs = [sign for sign in (1.0, -1.0) if _clipped(sign * y, step)]
    if not signs or noise_of(y) <= _NOISY * step:
        return {}
    return {sign: np.max(sign * y) - sign * y <= _AT * step for sign in signs}


def _held(raw: Raw) -> Firing | None:
    """Return the end at which the output is held while the model as given goes on; None where it is not."""
    if raw.said is None:
        return None
    found = [one for sign in (1.0, -1.0) if (one := _held_at(sign, raw.said, raw)) is not None]
    return max(found, key=lambda one: one.figures["count"], default=None)


def _held_at(sign: float, said: FloatArray, raw: Raw) -> Firing | None:
    y, model = sign * raw.calm.output, sign * said
    noise, span = max(noise_of(y), spacing_of(y) / np.sqrt(UNIFORM)), float(np.ptp(y))
    counts = raw.record.counts & np.isfinite(model)
    beyond = counts & (model > float(y[counts].max(initial=-np.inf)))
    if np.count_nonzero(beyond) <= _LEAST:
        return None
    rail = float(np.median(y[beyond]))
    over = counts & (model > rail + _NEAR * noise)
    held, goes = y[over], model[over]
    if (
        not held.size
        or goes.max() - rail < max(_BEYOND * span, _BEYOND_NOISE * noise)
        or held.std() > _FLAT * noise
    ):
        return None
    below = counts & (model < rail - _NEAR * noise)
    error = root_mean_square((y - model)[below]) if below.any() else np.inf
    if np.polyfit(goes, held, 1)[0] > _FOLLOWS or error > _BELOW * root_mean_square((y - model)[counts]):
        return None
    mask = _near(y, rail, noise) | (model > rail - _NEAR * noise)
    rail, back = float(held.mean()), sign * raw.polarity
    figures = {"count": float(held.size), "rail": back * rail, "said": back * float(goes.max())}
    sure = LIMITS.normal * noise / np.sqrt(held.size)
    return Firing("saturation", "held", back * rail, "{y}", figures, mask, spread=sure)


def _near(y: FloatArray, rail: float, noise: float) -> BoolArray:
    """Tell which samples (n,) of an output are at its upper rail, alone or on average, or just below it."""
    return np.asarray(np.maximum(y, scipy.ndimage.uniform_filter1d(y, _AROUND)) > rail - _NEAR * noise)


def _clipped(y: FloatArray, step: float) -> bool:
    """Whether the largest values of ``y`` (n,) are a rail."""
    below = float(y.max()) - y
    at = below <= _AT * step
    inside = below[(below <= _INSIDE * step) & ~at & (below < _INSIDE_SPAN * np.ptp(y))]
    count, most = np.count_nonzero(at), np.bincount(np.rint(inside / step).astype(int), minlength=1).max()
    return bool(count > _LEAST and (count > _PILE * inside.size or count > _TOWERS * most))
