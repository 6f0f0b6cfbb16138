"""What a device may play: limits, which can only be lowered; a play too hot for the coil; a rehearsal."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pulsetrainer.device import codes
from pulsetrainer.device.heat import course, in_words, wait_s
from pulsetrainer.device.plausibility import least_force, settled_least
from pulsetrainer.device.trace import FloatArray
from pulsetrainer.errors import ArgumentError, DeviceError

RAMP_S = 0.11  # the device counts its way back to zero as on-time
CURRENT_A = codes.PARAMETER["current_limit"].default * codes.CURRENT_UNIT_A  # of a device as it is delivered
FORCE_N = codes.PARAMETER["force_trip"].default * codes.FORCE_UNIT_N
ON_TIME_S = float(codes.PARAMETER["on_time"].default)


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits that shall be in force; None leaves the device's own. They can only be lowered."""

    current_A: float | None = None
    force_N: float | None = None

    def within(self, current_A: float, force_N: float) -> tuple[float, float]:
        """Return what is in force on a device with these limits of its own, A and N.

        ArgumentError where a limit is not positive, or above the device's own.
        """
        for what, wanted, own, unit in (
            ("current", self.current_A, current_A, "A"),
            ("force", self.force_N, force_N, "N"),
        ):
            if wanted is not None and not 0 < wanted <= own:
                raise ArgumentError(
                    f"a {what} limit of {wanted:g} {unit} (`limit_{what}_{unit}`) was asked for; "
                    f"the device's own is {own:g} {unit}",
                    hint=f"a limit can only be lowered: give `limit_{what}_{unit}` at most {own:g}",
                )
        return (
            current_A if self.current_A is None else self.current_A,
            force_N if self.force_N is None else self.force_N,
        )


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
        are = "is" if out.size == 1 else "are"
        raise ArgumentError(
            f"sample {out[0]} of the reference is {reference[out[0]]:g} A; "
            f"the device plays 0..{limit_A:g} A ({out.size} of {reference.size} samples {are} outside)",
            hint="scale the waveform into the range",
        )
    return np.rint(reference / codes.CURRENT_UNIT_A).astype(np.int16)


def checked_wire(
    reference_A: ArrayLike, rate_Hz: float, *, current_A: float, on_time_s: float, tick_rate_Hz: float
) -> NDArray[np.int16]:
    """Return a reference (n,) in A as it goes over the wire, if a device with these limits can play it.

    ArgumentError where a sample is no number or beyond the current, or all of it takes too long.
    """
    step = ticks_per_sample(rate_Hz, tick_rate_Hz)
    wire = to_wire(reference_A, limit_A=current_A)
    seconds = (wire.size - 1) * step / tick_rate_Hz
    if seconds > on_time_s - RAMP_S:
        raise ArgumentError(
            f"the reference is {seconds:g} s long; the device stays on for at most {on_time_s:g} s",
            hint="play it in several pieces",
        )
    return wire


def check_peak(reference_A: FloatArray, limit_A: float, *, hint: str = "") -> None:
    """Raise ArgumentError where a reference (n,) in A goes beyond the limit in force.

    ``hint`` says what else to play, if it was not made from a model; to raise the limit is a way out only
    where the device allows the current.
    """
    hint = hint or less_current(f"`current_max_A` at most {limit_A:g}")
    peak = float(np.max(reference_A, initial=0.0))
    if limit_A < CURRENT_A and peak <= CURRENT_A + codes.CURRENT_UNIT_A / 2:
        hint = f"raise `limit_current_A` to {peak:.4g}, or leave it out; or {hint}"
    if peak > limit_A + codes.CURRENT_UNIT_A / 2:
        raise ArgumentError(
            f"the current goes up to {peak:.4g} A, but the limit is {limit_A:g} A"
            + " (`limit_current_A`)" * (limit_A < CURRENT_A),
            hint=hint,
        )


def check_force(
    current_A: FloatArray, rate_Hz: float, limit_N: float, foretold_N: FloatArray | None = None
) -> None:
    """Raise DeviceError where a current (n,) in A gives a force beyond the limit in force.

    ``foretold_N`` (n,) is the force that a model predicts, NaN where it is not known; None: no more than that
    a lower force would be implausible.
    """
    if foretold_N is None and np.max(settled_least(current_A), initial=0.0) <= limit_N:
        return  # at once: the filters that tell it sample by sample are slow to load
    expected_N = least_force(current_A, rate_Hz) if foretold_N is None else foretold_N
    most = float(np.fmax.reduce(expected_N, initial=0.0))
    if most > limit_N:
        # a slower stroke creeps higher, and sensors have noise: a tenth of the limit is left to them
        told_A = math.floor(100 * current_A[int(np.argmax(expected_N > 0.9 * limit_N))]) / 100
        known = foretold_N is not None and told_A > 0
        lower = f"`current_max_A` at most {told_A:g}" if known else "a lower `current_max_A`"
        enough = math.ceil(most)
        raised = f"raise `limit_force_N` to {enough} or more; or " if enough <= FORCE_N else ""
        raise DeviceError(
            f"the device would stop: a force of {most:.3g} N is predicted, and the limit is {limit_N:g} N"
            + " (`limit_force_N`)" * (limit_N < FORCE_N),
            hint=raised + less_current(lower),
        )


class Rehearsal:
    """A device as it is delivered, with a cold coil: it plays nothing, and refuses what the device would."""

    def __init__(self, limits: Limits) -> None:
        self.current_A, self.force_N = limits.within(CURRENT_A, FORCE_N)
        self._heat = 0.0
        self.most_heat = 0.0  # so far, of the heat at which the device stops

    def play(self, reference_A: FloatArray, rate_Hz: float, expected_N: FloatArray | None = None) -> None:
        """Take a reference (n,) in A as played, and the force (n,) in N that it is foretold to give.

        None: no more than that a lower force would be implausible.

        ArgumentError where the device would not play it; DeviceError where it would stop: the coil becomes
        too hot by then, or the force too high.
        """
        check_force(reference_A, rate_Hz, self.force_N, expected_N)
        wire = checked_wire(
            reference_A,
            rate_Hz,
            current_A=self.current_A,
            on_time_s=ON_TIME_S,
            tick_rate_Hz=codes.TICK_RATE_HZ,
        )
        current = codes.CURRENT_UNIT_A * wire.astype(float)
        if _bearable_wait_s(self._heat, current, rate_Hz) > 0:
            raise DeviceError(
                f"the coil would be too hot: at {100 * self._heat:.0f} % of its limit by then",
                hint="play fewer repeats, or at a lower current",
            )
        self._warm(current, rate_Hz)

    def stream(self, reference_A: FloatArray, rate_Hz: float, expected_N: FloatArray) -> None:
        """Take the next piece (n,) of a reference without a known end as played; otherwise as ``play``."""
        current = codes.CURRENT_UNIT_A * to_wire(reference_A, limit_A=self.current_A).astype(float)
        check_force(current, rate_Hz, self.force_N, expected_N)
        if self._warm(current, rate_Hz) > 1.0:
            raise DeviceError(
                "the device would stop: the coil becomes too hot in the middle of a beat",
                hint="press pulses at a lower amplitude, or shorter beats",
            )

    def _warm(self, current_A: FloatArray, rate_Hz: float) -> float:
        """Add the heat of a current (n,), and return the most that there is meanwhile."""
        heat = course(self._heat, current_A, rate_Hz)
        self._heat, most = float(heat[-1]), float(heat.max())
        self.most_heat = max(self.most_heat, most)
        return most


def less_current(than: str) -> str:
    """Say how less is pressed in all that is made from a model: a lower pulse does not do it."""
    return (
        f"capture again with {than}, then identify and invert that run: a lower pulse alone does not help, "
        "as every drive begins with a stroke over the whole range of its model"
    )


def _bearable_wait_s(
    heat: float,
    reference_A: FloatArray,
    rate_Hz: float,
    hint: str = "play less of it at a time, or at a lower current; a drive of fewer periods is shorter",
) -> float:
    """Return ``heat.wait_s``; ArgumentError for a reference (n,) that even a cold coil does not bear."""
    seconds = wait_s(heat, reference_A, rate_Hz)
    if math.isinf(seconds):
        share = 100.0 * float(course(0.0, reference_A, rate_Hz).max())
        raise ArgumentError(
            f"playing this would heat the coil to {math.ceil(share)} % of its limit, even from cold",
            hint=hint,
        )
    return seconds


def check_ever_cool(reference_A: FloatArray, rate_Hz: float, hint: str) -> None:
    """Raise ArgumentError, with this hint, for a reference (n,) in A that even a cold coil does not bear."""
    _bearable_wait_s(0.0, reference_A, rate_Hz, hint)


def check_cool(heat: float, reference_A: FloatArray, rate_Hz: float, *, assumed: bool) -> None:
    """Refuse a reference (n,) in A that the heat of the coil would cut off, and say how long to wait.

    ArgumentError where even a cold coil would be too hot; DeviceError where this one is, as far as is known
    where that is ``assumed``.
    """
    seconds = _bearable_wait_s(heat, reference_A, rate_Hz)
    if seconds > 0:
        raise DeviceError(
            f"the coil is too hot for this: it is at {100 * heat:.0f} % of its limit"
            + (", as far as is known: no program has seen this device cool" if assumed else ""),
            hint=f"wait {in_words(seconds)}, then run the command again",
        )
