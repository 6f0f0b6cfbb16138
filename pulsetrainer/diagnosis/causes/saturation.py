"""the output is clipped at the end of its range: found on the raw data.

A *rail* is the value at which the output is clipped. If noise enters before the clipping, one value is
repeated exactly. Where there is hardly any noise a flat top repeats its value too. It is a rail if the output
stops at once on its way, and stays while the input goes on and comes back. If noise enters after the
clipping, the output stays at one level within its noise, while the model as given says that it goes on.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.censored import beyond_rails
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.core.wild import runs_of
from pulsetrainer.diagnosis.causes.base import OfTheRecord, Taken, Values
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.raw import Firing, Raw, noise_of, spacing_of
from pulsetrainer.diagnosis.thresholds import LIMITS, UNIFORM

_LEAST = 20  # samples at the rail: fewer may be chance
_PILE = 1.2  # times the samples just inside: at its end, noise makes a tail, a rail makes a pile
_TOWERS = 4.0  # times any single value just inside: the turn of a smooth signal reaches 2.4
_AT = 0.5  # converter steps: a nearer sample is at the rail
_ENTERING = 30  # samples before and after the rail: is their noise large enough to move those at it?
_INSIDE = 10.5  # converter steps beside the rail that are compared with it ...
_INSIDE_SPAN = 0.02  # ... but no more than this share of the span
_NOISY = 0.7  # converter steps: with less noise a flat top repeats itself; steps alone look like 0.66
_BESIDE = 3  # samples on each side of a clipped one, left out too: those not clipped have low noise
_AROUND = 9  # samples whose mean is near the rail where ...
_NEAR = 3.0  # ... it is nearer than this many times the noise
# A rail where there is hardly any noise
_TRAVEL = 0.01  # of the range: the input must go on by this much while the output stays ...
_BACK = 0.25  # ... and come back by this share of it: at a turn, sliding friction falls at once
_BEFORE = 0.25  # of that travel, just before the output stops: with its slope there it would go on ...
_STEPS = 10.0  # ... by this many steps of the output: a device that saturates slows down first
# A rail in front of the noise, against what the model as given says
_BEYOND = 0.01  # of the span: the model must go this far beyond the rail ...
_BEYOND_NOISE = 10.0  # ... and this many times the noise
_FLAT = 1.3  # times the noise: an output that varies more is not held ...
_FOLLOWS = 0.1  # ... nor is one that follows the model by more than this share
_BELOW = 0.5  # of the model's error on the whole record: below the rail its error must be smaller


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
    texts = sentences("""
        gate: {count:.0f} samples sit at exactly {rail:.4g}{in_y}: the output is clipped there
        held: {count:.0f} samples stay within their noise at {rail:.4g}{in_y} where the model as given goes on
            to {said:.4g}{in_y}: the output is clipped there, before it is digitised
        both: {count:.0f} samples sit at exactly {rail:.4g} or {other:.4g}{in_y}: the output is clipped there
    """)

    def gate(self, raw: Raw) -> Firing | None:
        """Extremes that repeat exactly far more often than the values just inside them, at either end."""
        y = raw.calm.output
        rails = _rails(raw)
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
        rails = _rails(taken.raw)
        if not rails:  # only the model as given could tell
            sign = 1.0 if rail > measured.mean() else -1.0
            return np.where(_near(sign * measured, sign * rail, noise_of(measured)), np.nan, y)
        nowhere = np.zeros(y.size, dtype=np.bool_)
        up, down = (rails.get(sign, nowhere) for sign in (1.0, -1.0))
        noise = noise_of(measured, np.where(up | down, 0.0, 1.0))
        whole = beyond_rails(*taken.known(y), up, down, noise)
        return super().undo(y, values, taken) if whole is None else np.where(np.isfinite(y), whole, np.nan)


def _rails(raw: Raw) -> dict[float, BoolArray]:
    """Samples (n,) at the upper (1) and at the lower (-1) rail; nothing where nothing tells one."""
    y = raw.calm.output
    step = spacing_of(y)
    rails = {
        sign: np.max(sign * y) - sign * y <= _AT * step for sign in (1.0, -1.0) if _clipped(sign * y, step)
    }
    return {
        sign: at
        for sign, at in rails.items()
        if noise_of(y, _beside(at)) > _NOISY * step or _stops_at_once(raw, sign * y, at, step)
    }


def _beside(at: BoolArray) -> FloatArray:
    """Weight (n,) of the samples just before and after those at a rail: there noise must be, if anywhere."""
    return (scipy.ndimage.binary_dilation(at, iterations=_ENTERING) & ~at).astype(np.float64)


def _stops_at_once(raw: Raw, y: FloatArray, at: BoolArray, step: float) -> bool:
    """Whether an output (n,) runs into its upper end in most of the strokes that leave it there."""
    u, told = raw.record.input, []
    for begin, end in runs_of(at):
        on = u[begin:end] - u[begin]
        way = np.sign(u[begin] - u[max(begin - _LEAST, 0)])
        travel = float((way * on).max())
        if travel <= _TRAVEL * raw.reach:
            continue
        back = travel - float(way * on[-1])
        before = np.flatnonzero(way * (u[begin] - u[:begin]) >= _BEFORE * travel)
        rise = float(y[begin] - y[before[-1]]) / _BEFORE if before.size else 0.0
        told.append(back >= _BACK * travel and rise >= max(_STEPS * step, _BEYOND * float(np.ptp(y))))
    return bool(told) and float(np.mean(told)) > 0.5  # of those strokes


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
