"""A reference current on its way into the device: checked, and in the wire's units."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pulsetrainer.device import codes
from pulsetrainer.errors import ArgumentError


def ticks_per_sample(rate_Hz: float, tick_rate_Hz: float) -> int:
    """Return how many ticks of the device lie between two samples of a reference at ``rate_Hz``.

    ArgumentError where that is not a whole number, or more than the device can count.
    """
    if not (np.isfinite(rate_Hz) and rate_Hz > 0):
        raise ArgumentError(f"a sample rate of {rate_Hz} Hz is not possible", hint="1000 Hz is usual")
    most = codes.MAX_TICKS_PER_SAMPLE
    exact = min(tick_rate_Hz / rate_Hz, most + 1.0)
    ticks = round(exact)
    if not 1 <= ticks <= most or abs(exact - ticks) > 1e-9 * exact:
        nearest = tick_rate_Hz / min(max(ticks, 1), most)
        raise ArgumentError(
            f"the reference's rate of {rate_Hz:g} Hz does not divide the device's {tick_rate_Hz:g} Hz "
            f"by a whole number up to {most}",
            hint=f"resample it to {nearest:g} Hz",
        )
    return ticks


def to_wire(reference_A: ArrayLike, *, limit_A: float) -> NDArray[np.int16]:
    """Return a reference, shape (n,) in A, in units of 0.1 mA.

    ArgumentError where a sample is not a number, or outside 0 to ``limit_A``.
    """
    reference = np.asarray(reference_A, dtype=np.float64)
    if reference.ndim != 1 or reference.size == 0:
        raise ArgumentError(
            f"a reference is a row of samples, got an array of shape {reference.shape}",
            hint="one current in A per sample",
        )
    bad = np.flatnonzero(~np.isfinite(reference))
    if bad.size:
        raise ArgumentError(f"sample {bad[0]} of the reference is not a number", hint="correct the waveform")
    # Half a wire unit of tolerance: rounding must not refuse a waveform that uses the whole range.
    half = codes.CURRENT_UNIT_A / 2
    out = np.flatnonzero((reference < -half) | (reference > limit_A + half))
    if out.size:
        raise ArgumentError(
            f"sample {out[0]} of the reference is {reference[out[0]]:g} A; "
            f"the device plays 0..{limit_A:g} A ({out.size} of {reference.size} samples are outside)",
            hint="scale the waveform into the range",
        )
    return np.rint(reference / codes.CURRENT_UNIT_A).astype(np.int16)
