"""Capture: play an excitation on the device and record what it measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pulsetrainer.artefacts import Run
from pulsetrainer.core import excitations
from pulsetrainer.core.course import Course
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.excitations import Signal
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import MOST_LEVELS, Plane
from pulsetrainer.device.codes import TICK_RATE_HZ
from pulsetrainer.device.device import Device
from pulsetrainer.device.limits import ON_TIME_S, RAMP_S, Limits, Rehearsal
from pulsetrainer.errors import DeviceError, Interrupted, UsageError
from pulsetrainer.steps.arguments import EXCITATIONS, check_levels
from pulsetrainer.steps.progress import Progress, silent
from pulsetrainer.steps.recording import (
    InMemory,
    Tally,
    check_cooling,
    check_top,
    conditioning_loop,
    decimation_for,
    parts_of,
    record,
)
from pulsetrainer.steps.stopped import raise_if_stopped

# The bench's current is off by at most 3.5 % of the range on ramps of 100 A/s, by 24 % on ramps of 200 A/s.
COIL_FOLLOWS_A_PER_S = 100.0
_ROUNDING = 1.0 + 1e-6


def capture(
    signal: str | Signal,
    device: Device,
    *,
    levels: int = 48,
    current_max_A: float = 1.5,
    speed_A_per_s: float = 0.75,
    rate_Hz: float = 1000.0,
    condition: bool = True,
    repeats: int = 1,
    progress: Progress = silent,
) -> Run:
    """Play a signal on the device and return the run: time in s, reference and input in A, output in N.

    Parameters
    ----------
    signal
        "identification", "diagnostic", or samples (n,) in A as a ``core.excitations.Signal``.
    levels, current_max_A, speed_A_per_s
        For the identification signal: the levels whose cells it switches, its top, and how fast it moves.
    rate_Hz
        Samples per second.
    condition
        Go around the major loop once before recording, so that what came before is forgotten.
    repeats
        How often the signal is played, without a pause.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    UsageError
        There is no excitation of that name.
    ArgumentError
        The device cannot play the signal, or not at that rate.
    DeviceError
        The device stopped by itself; what was recorded until then is in the error's ``kept``.
    Interrupted
        Ctrl-C: the output was stopped first; ``kept`` as above.

    Source: Mayergoyz, Mathematical Models of Hysteresis, 2003, section 1.4 (first-order reversal curves).

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> with pt.open_device("bench:") as device:
    ...     run = pt.capture("identification", device, levels=4, speed_A_per_s=6.0)
    >>> run.complete, run.input_unit, run.output_unit
    (True, 'A', 'N')
    """
    played = excitation(
        signal, levels=levels, current_max_A=current_max_A, speed_A_per_s=speed_A_per_s, rate_Hz=rate_Hz
    )
    kept, tally = InMemory(), tally_of(played, levels)
    try:
        ending = record(
            Course(played, repeats), device, kept, tally, condition_first=condition, progress=progress
        )
    except (DeviceError, Interrupted) as error:  # between two parts
        error.kept = kept.run(played.name, device.info.serial, complete=False)
        raise
    run = kept.run(played.name, device.info.serial, complete=ending.complete, coil=ending.coil)
    raise_if_stopped(ending.fault, ending.remedy, "the capture", run)
    if run is None:
        raise DeviceError("the device sent no samples", hint="check the line to it")
    return run


def excitation(
    signal: str | Signal, *, levels: int, current_max_A: float, speed_A_per_s: float, rate_Hz: float
) -> Signal:
    """Return the signal that is played.

    UsageError where there is no excitation of that name; ArgumentError where no device samples at that rate,
    or a parameter is out of its range.
    """
    decimation_for(TICK_RATE_HZ, rate_Hz)
    if isinstance(signal, Signal):
        return signal
    if signal == "identification":
        check_levels(levels, MOST_LEVELS)
        return excitations.identification(
            0.0, current_max_A, n_h=levels, speed=speed_A_per_s, rate_Hz=rate_Hz
        )
    if signal == "diagnostic":
        return excitations.diagnostic(0.0, current_max_A, rate_Hz=rate_Hz)
    raise UsageError(
        f"there is no signal {signal!r}; known signals: {', '.join(EXCITATIONS)}",
        hint="give one of them, or the samples of your own",
    )


def remarks(signal: Signal, levels: int) -> list[str]:
    """Return, in words, what a model will miss; ``levels`` are those of the identification signal."""
    range_A = float(np.ptp(signal.value))
    if range_A == 0.0:
        return [
            f"the current stays at {signal.value[0]:g} A: no model can be identified from such a recording"
        ]
    told, level_A = [], range_A / levels
    moves = np.abs(np.diff(signal.value))
    step_A, fastest = float(np.median(moves[moves > 0.0])), float(moves.max()) * signal.rate_Hz
    if signal.name == "identification" and step_A > level_A * _ROUNDING:
        far = f"the current moves {step_A:.3g} A a sample, past a level of {level_A:.3g} A"
        far += f", {step_A / level_A:.0f} at a time, which a model will miss" * (step_A > 2 * level_A)
        told.append(f"{far}: lower `speed`, or raise `rate`")
    if fastest > COIL_FOLLOWS_A_PER_S * _ROUNDING:
        told.append(
            f"the signal moves at up to {fastest:.3g} A/s, and a coil as delivered follows at up to "
            f"{COIL_FOLLOWS_A_PER_S:g} A/s: the current will lag behind it. The recording holds the current "
            "that flowed"
        )
    return told


def tally_of(signal: Signal, levels: int) -> Tally:
    """Return the tally of a recording of a signal, on the plane of its own range."""
    top = float(signal.value.max())
    return Tally(Plane.uniform(0.0, top, levels) if top > 0 else None)


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be played."""

    signal: str
    samples: int  # recorded, what brings the memory back included
    seconds: float  # conditioning loops included
    conditioning_s: float  # of these, which are not recorded
    rate_Hz: float
    reversals: int
    coverage_percent: float
    peak_current_A: float
    rms_current_A: float


def plan(
    signal: Signal,
    *,
    levels: int = 48,
    condition: bool = True,
    repeats: int = 1,
    limits: Limits | None = None,
    at: int = 0,
) -> Plan:
    """Return what a capture would play from sample ``at`` on, on a device as it is delivered and cold.

    ArgumentError or DeviceError where it is longer than anything that can be recorded, or the device would
    refuse it. How large the force will be nobody knows before it is measured.
    """
    course = Course(signal, repeats)
    rehearsal = Rehearsal(limits or Limits())
    check_top(signal, rehearsal.current_A)
    top = float(signal.value.max())
    loop = conditioning_loop(top, signal.rate_Hz) if condition else np.zeros(0)
    played = recorded = 0
    for part in parts_of(course, at, ON_TIME_S - RAMP_S):
        reference = part.reference(course)
        check_cooling(reference, signal)
        for piece in (loop, reference):
            if piece.size:
                rehearsal.play(piece, signal.rate_Hz)
        played += loop.size + reference.size
        recorded += reference.size
    covered = coverage(Plane.uniform(0.0, top, levels), [signal.value]) if top > 0 else np.zeros(1)
    return Plan(
        signal=signal.name,
        samples=recorded,
        seconds=played / signal.rate_Hz,
        conditioning_s=(played - recorded) / signal.rate_Hz,
        rate_Hz=signal.rate_Hz,
        reversals=course.reversals,
        coverage_percent=100.0 * float(covered.mean()),
        peak_current_A=float(np.abs(signal.value).max()),
        rms_current_A=root_mean_square(signal.value),
    )
