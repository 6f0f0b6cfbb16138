"""Iterative learning control around an exact inverse: what to ask for, so that the output is the target.

    r <- r + 0.8 F[y_ref - y(u)],   u <- P^-1(r)

``P^-1`` is an inverse that is nearly right, ``y(u)`` what the input then gives: by a better model, or by the
device itself. ``F`` is a zero-phase low-pass at the band of the reference: what is faster than the reference
asks for cannot be undone, and would make the iteration diverge (the Q filter of Bristow, Tharayil, Alleyne
2006).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.core.inversion import Inverse
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray

STEP = 0.8  # of the error fed back: 1 is the fastest that cannot overshoot
BAND_HZ = 30.0  # an arterial pulse holds little above
PAD = 3.0  # periods of the band that pad the ends of the filter
_WIDE = 0.4  # of the sample rate: a reference that wide is not filtered
_ORDER = 2  # of the low-pass
_SWING = 0.8  # of the error before, on the other side: less is on its way to zero


@dataclass(frozen=True, slots=True)
class Pass:
    """One pass: the inverse that was tried, what it gave, and how far that is from the target."""

    number: int  # 0: before anything is learnt
    inverse: Inverse
    output: FloatArray  # (n,)
    rms: float  # of target less output, output unit


@dataclass(frozen=True, slots=True)
class LowPass:
    """A zero-phase low-pass at ``band_Hz``; none where the band is as wide as the samples allow."""

    band_Hz: float | None
    dt_s: float

    @property
    def period(self) -> int:
        """Samples in a period of the band, 1 where nothing is filtered."""
        if self.band_Hz is None or self.band_Hz * self.dt_s >= _WIDE:
            return 1
        return round(1.0 / (self.band_Hz * self.dt_s))

    def __call__(self, x: FloatArray) -> FloatArray:
        """Return x (n,) without what is faster than the band."""
        if self.period == 1 or self.band_Hz is None:
            return x
        b, a = scipy.signal.butter(_ORDER, 2.0 * self.band_Hz * self.dt_s)
        pad = min(x.size - 1, round(PAD / (self.band_Hz * self.dt_s)))
        return np.asarray(scipy.signal.filtfilt(b, a, x, padlen=pad))


def passes(
    target: FloatArray,
    inverse: Callable[[FloatArray], Inverse],
    respond: Callable[[FloatArray], FloatArray],
    *,
    smooth: LowPass,
    start: FloatArray | None = None,
    careful: bool = False,
) -> Iterator[Pass]:
    """Give one pass after the other, without end; each asks for what the one before it missed as well.

    ``inverse`` leads from a wanted output (n,) to the input that gives it, nearly, ``respond`` from an input
    to the output that it gives; ``smooth`` is the low-pass F. The first pass asks for ``start`` (n,); None:
    for the ``target`` (n,) itself, output unit.

    ``careful`` halves the step where an error swings from one side to the other: there the slope is more
    than twice that of the inverse, as small loops of a device can be. Noise then also counts less from pass
    to pass.
    """
    wanted, number = target if start is None else start, 0
    step, before = np.full(target.size, STEP), np.zeros(target.size)
    while True:
        found = inverse(wanted)
        output = respond(found.input)
        error = target - output
        yield Pass(number, found, output, root_mean_square(error))
        missed = smooth(error)
        if careful:
            least = np.maximum(_SWING * np.abs(before), root_mean_square(missed))
            swung = (missed * before < 0) & (np.abs(missed) > least)
            step, before = np.where(swung, 0.5 * step, step), missed
        # a step that changes abruptly would itself put kinks into what is asked for
        share = smooth(scipy.ndimage.minimum_filter1d(step, 2 * smooth.period + 1)) if careful else step
        wanted, number = wanted + share * missed, number + 1
