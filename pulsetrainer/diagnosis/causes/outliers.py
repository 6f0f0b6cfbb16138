"""isolated samples are wrong: found on the raw data."""

from __future__ import annotations

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.plane import BoolArray, FloatArray
from pulsetrainer.core.wild import isolated
from pulsetrainer.diagnosis.causes.base import OfTheRecord
from pulsetrainer.diagnosis.evidence import sentences
from pulsetrainer.diagnosis.raw import Firing, Raw, noise_of, spacing_of
from pulsetrainer.diagnosis.thresholds import TINY

_SIGMAS = 8.0  # of Gaussian noise one sample in 10^15 is farther out
_DIFFERENCE = 2.0**0.5  # the difference of two neighbours has this many times the noise of one
_AROUND = 7  # samples of the median
_FAST = 80.0  # percentile of the steps near by, which three wild samples do not reach
_NEAR = 31  # samples that count as near by
_TIP = 4.0  # times those steps: a tip at full speed stands out from its median by up to three
_STEPS = 2.0  # converter steps: a smaller distance is rounding
_LINE = 5  # samples on one side of a suspect that may explain it
_TAIL = 0.5  # of the samples beyond a limit: if more lie from half of it on, all are a tail of the noise
_HIGHER = 1.25  # factor from one limit to the next that is tried
_BACK = 0.1  # of the range: an input that comes back so far within these samples has turned fast
_STEEP = 4.0  # spans per range: slope of a steep branch, for an input that comes back less far
_ALONE = 3  # samples of a median that removes a single wild one
_LEAST = 3  # wild samples: fewer are not reported as a fault


class Outliers(OfTheRecord):
    """Isolated samples are wrong."""

    id = "outliers"
    title = "isolated samples are wrong"
    formula = "y + wild error"
    signature = "isolated samples far from both neighbours"
    excitation = "any"
    order = 1
    family = "outliers"
    corrects = True
    wild = True
    size = "from the worst sample to those around it"
    texts = sentences(
        "gate: {count:.0f} isolated samples differ from those around them by more than {limit:.3g}{in_y}"
    )

    def gate(self, raw: Raw) -> Firing | None:
        """Samples far from the median around them, farther than fast turns go."""
        y = raw.record.output
        apart = np.abs(y - scipy.ndimage.median_filter(y, _AROUND, mode="nearest"))
        steps = np.abs(np.diff(y, prepend=y[0]))
        usual = _TIP * scipy.ndimage.percentile_filter(steps, _FAST, _NEAR, mode="nearest")
        noise = max(_SIGMAS * _DIFFERENCE * noise_of(y), _STEPS * spacing_of(y), TINY)
        limit = np.maximum(usual, noise)
        own = scipy.ndimage.median_filter(raw.record.input, _ALONE, mode="nearest")  # a wild input is no turn
        back = _comes_back(own) / (raw.high - raw.low)
        told = (back <= _BACK) & (apart > _STEEP * back * float(np.ptp(y)))
        told &= ~_hurries(own) & ~raw.beside_breaks(_AROUND)
        off = np.where((apart > 0.5 * limit) & told, apart, 0.0)
        for at in np.flatnonzero(off):  # where a stroke ends with a jump, its last sample still lies on it
            off[at] = min(off[at], _off_line(y, int(at), -1), _off_line(y, int(at), 1))
        beyond = off / limit
        least = _beyond_the_tail(np.sort(beyond[beyond > 0.5]))
        if least is None:
            return None
        # beside a turn of the input the rules above tell nothing; what is wild elsewhere may be so there too
        wild = (beyond > least) | (isolated(y) & (apart > noise) & ~raw.beside_breaks(_AROUND))
        figures = {"count": float(np.count_nonzero(wild)), "limit": least * float(limit[wild].min())}
        return Firing(self.id, "gate", float(apart[wild].max()), "{y}", figures, wild)


def _beyond_the_tail(beyond: FloatArray) -> float | None:
    """Return the smallest limit from 1 on beyond which samples stand apart; None where there is none.

    ``beyond`` (k,) rises from a half. Heavy tails go on: at half a limit they hold many times more.
    """
    limit = 1.0
    while np.count_nonzero(beyond > limit) >= _LEAST:
        above = np.count_nonzero(beyond > limit)
        below = np.count_nonzero((beyond > 0.5 * limit) & (beyond <= limit))
        if below <= _TAIL * above:
            return limit
        limit *= _HIGHER
    return None


def _comes_back(u: FloatArray) -> FloatArray:
    """How far an input (n,) turns and comes back within the samples that may explain a suspect, (n,).

    There the output turns as fast, and no sample can be told from those beside it.
    """
    width = 2 * _LINE + 1
    way = width * scipy.ndimage.uniform_filter1d(np.abs(np.diff(u, prepend=u[0])), width, mode="nearest")
    swing = scipy.ndimage.maximum_filter1d(u, width, mode="nearest") - scipy.ndimage.minimum_filter1d(
        u, width, mode="nearest"
    )
    return np.asarray(way - swing)


def _hurries(u: FloatArray) -> BoolArray:
    """Whether an input (n,) moves far faster beside a sample than near it: a short ramp between rests.

    A force that follows the speed comes and goes with it.
    """
    steps = np.abs(np.diff(u, prepend=u[0]))
    usual = scipy.ndimage.percentile_filter(steps, _FAST, _NEAR, mode="nearest")
    return np.asarray(scipy.ndimage.maximum_filter1d(steps, 2 * _LINE + 1, mode="nearest") > _TIP * usual)


def _off_line(y: FloatArray, at: int, side: int) -> float:
    """Distance of a sample from the line through those on one side of it, robust against a wild one there."""
    near = y[max(at - _LINE, 0) : at][::-1] if side < 0 else y[at + 1 : at + 1 + _LINE]
    if near.size < _LINE:
        return float("inf")
    steps = np.arange(1, _LINE + 1)
    first, second = np.triu_indices(_LINE, 1)
    slope = np.median((near[second] - near[first]) / (steps[second] - steps[first]))  # Theil and Sen
    return float(abs(y[at] - np.median(near - slope * steps)))
