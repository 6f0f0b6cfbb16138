"""the recorded input is clipped at the end of its range: found on the raw data.

The device sees the whole input, and its recorder only a part. The record then shows an input that rests at
its largest or smallest value in several places, while the output goes on and comes back: *a hump*. An output
cannot know that its input is about to move. So it comes back before the input does only if the input moved
all the while. A command that is clipped in front of the device rests too, but there the output rests with it,
creeps one way, or rings.

A turn of a sound input is no rest, but coarse steps or noise may make it look like one. So the output must go
further than its input could have gone within a few steps, or unseen in its noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.core.wild import runs_of
from pulsetrainer.diagnosis.causes.base import OfTheRecord
from pulsetrainer.diagnosis.raw import Firing, Raw, noise_of, spacing_of
from pulsetrainer.diagnosis.thresholds import LIMITS

_PARTS = 5  # of a rest, of which means are taken: shorter rests show no course
_PLACES = 3  # rests: fewer may be chance
_AT = 0.5  # steps of the input: a nearer sample is at the end
_SMOOTH = 5  # samples of an input with noise, whose median is at the end where ...
_NEAR = 3.0  # ... it is nearer than this many times the noise
_SHARE = 0.75  # of the rests must have a hump: a hum makes one in a third of them
_SURE = 5.0  # standard errors, both of the rise and of the fall: noise makes neither
_RISE = 0.1  # of what the output does in half as long before the rest: less is no course that goes on
_FALL = 0.025  # ... and after it: just after a turn most devices are slow
_BENT = 0.5  # of the hump: a hum bends the other way before it
_MOST = 3.0  # times what it does before or after: more is the ringing of a device that has stopped
_STILL = 0.25  # of the fall must come at the end of the rest: what rings or relaxes has calmed down
_STEPS = 3.0  # steps of the input: a coarse converter makes a turn look like a rest, with a hump of one
_TURN = 8.0  # times the noise of the input: a turn may look like a rest within it, and so may the way to it
_SMALL = 0.1  # quantile of the moves of the input: those of a coarse converter are a step or more
_OWN = 0.25  # of the way that the output tells: an input with noise may turn by less


@dataclass(frozen=True)
class Rests:
    """What input and output do in each rest of the input at one end, and before and after it."""

    input: FloatArray  # (k, parts) means
    output: FloatArray  # (k, parts) means, in the direction in which it comes to the end
    before: FloatArray  # (k, 2) ways of input and output, in half as long
    after: FloatArray  # (k, 2)
    bent: FloatArray  # (k,) how far the output lies above a straight line just before
    size: FloatArray  # (k,) samples


class ClippedInput(OfTheRecord):
    """The recorded input is clipped at the end of its range."""

    id = "clipped-input"
    title = "the recorded {input} is clipped at the end of its range"
    formula = "min(u, u_max)"
    signature = "the output goes on and comes back while the input rests at its extreme value"
    excitation = "several rests at the end of the range"
    order = -1
    family = "clipped-input"
    size = "{input} at which it is clipped"
    voids = True
    _meanwhile = (
        "in {count:.0f} places, while the {output} goes on and comes back before the {input} moves: the "
        "recorder clips the {input} there. What else the recordings show may come from that, so nothing else "
        "was sought"
    )
    texts: ClassVar[Mapping[str, str]] = {
        "gate": f"the {{input}} rests at {{rail:.4g}}{{in_u}} {_meanwhile}",
        "both": f"the {{input}} rests at {{rail:.4g}} or {{other:.4g}}{{in_u}} {_meanwhile}",
    }

    def gate(self, raw: Raw) -> Firing | None:
        """Rests at an end of the input in which the output goes on and comes back."""
        ends = [end for sign in (1.0, -1.0) if (end := _clipped(sign, raw)) is not None]
        if not ends:
            return None
        (rail, _), (other, _) = ends[0], ends[-1]
        figures = {"count": float(sum(count for _, count in ends)), "rail": rail, "other": other}
        return Firing(self.id, "gate" if len(ends) == 1 else "both", rail, "{u}", figures)


def _clipped(sign: float, raw: Raw) -> tuple[float, int] | None:
    """Return where an input is clipped, at its upper or lower end, and in how many places; None if not."""
    u, y = sign * raw.record.input, raw.calm.output
    step = _STEPS * _step(u)
    for at, unseen in ((_exactly(u), step), (_within_noise(u), step + _TURN * noise_of(u))):
        told = _rests(u, y, at)
        if told is not None and _goes_on(told, unseen, noise_of(y)):
            return sign * float(np.median(u[at])), told.size.size
    return None


def _step(u: FloatArray) -> float:
    """Step of the input's converter, or less: a few equal loops of few samples have few values."""
    moves = np.abs(np.diff(u))
    moves = moves[moves > LIMITS.same_value * np.ptp(u)]
    return min(spacing_of(u), float(np.quantile(moves, _SMALL))) if moves.size else 0.0


def _exactly(u: FloatArray) -> BoolArray:
    """Samples (n,) of an input that are its largest value."""
    return np.asarray(u.max() - u <= _AT * _step(u))


def _within_noise(u: FloatArray) -> BoolArray:
    """Samples (n,) of an input that are its largest value but for noise."""
    middle = scipy.ndimage.median_filter(u, _SMOOTH, mode="nearest")
    noise = noise_of(u)
    rail = float(np.median(middle[middle >= middle.max() - _NEAR * noise]))
    at = scipy.ndimage.binary_closing(middle >= rail - _NEAR * noise, np.ones(_SMOOTH))
    return np.asarray(scipy.ndimage.binary_opening(at, np.ones(_SMOOTH)))


def _rests(u: FloatArray, y: FloatArray, at: BoolArray) -> Rests | None:
    """Return what is told of the rests that are long enough, and no end of the record; None of too few."""
    long = [(b, e) for b, e in runs_of(at) if e - b >= _PARTS and b >= e - b and e + (e - b) <= u.size]
    if len(long) < _PLACES:
        return None
    output = np.asarray([_means(y[b:e]) for b, e in long])
    earlier = np.asarray([_means(y[b - max((e - b) // 2, _PARTS) : b]) for b, e in long])
    way = np.sign(np.sum(output[:, 0] - earlier.mean(axis=1)))
    return Rests(
        np.asarray([_means(u[b:e]) for b, e in long]),
        way * output,
        np.asarray([[np.ptp(x[b - (e - b) // 2 : b + 1]) for x in (u, y)] for b, e in long]),
        np.asarray([[np.ptp(x[e - 1 : e + (e - b) // 2]) for x in (u, y)] for b, e in long]),
        way * _hump(earlier),
        np.asarray([e - b for b, e in long], dtype=np.float64),
    )


def _means(x: FloatArray) -> FloatArray:
    return np.asarray([part.mean() for part in np.array_split(x, _PARTS)])


def _hump(parts: FloatArray) -> FloatArray:
    """How far the middle lies above the line between first and last (k,)."""
    return np.asarray(parts[:, _PARTS // 2] - 0.5 * (parts[:, 0] + parts[:, -1]))


def _goes_on(told: Rests, unseen: float, noise: float) -> bool:
    """Whether the output has a hump in most rests, beyond noise and what the input may have done unseen."""
    output, top = told.output, int(np.argmax(told.output.mean(axis=0)))
    if not _PARTS // 2 <= top < _PARTS - 1:
        return False
    rise, fall, hump = output[:, top] - output[:, 0], output[:, top] - output[:, -1], _hump(output)
    (u_before, before), (_, after) = told.before.mean(axis=0), told.after.mean(axis=0)
    way = hump.mean() * u_before / before if before > 0 else 0.0
    conditions = {
        "in most": np.mean((rise > 0) & (fall > 0) & (told.bent > -_BENT * hump)) >= _SHARE,
        "no noise": min(rise.mean(), fall.mean())
        > _SURE * noise * np.sqrt(np.mean(2.0 * _PARTS / told.size) / told.size.size),
        "goes on": _RISE * before <= rise.mean() <= _MOST * before,
        "comes back": _FALL * after <= fall.mean() <= _MOST * after,
        "under way": np.mean(output[:, -2] - output[:, -1]) >= _STILL * fall.mean(),
        "no step": min(way, u_before) > unseen,
        "no turn": _hump(told.input).mean() < _OWN * way,
    }
    return all(conditions.values())
