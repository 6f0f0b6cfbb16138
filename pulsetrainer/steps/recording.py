"""Recording: play a course on the device, part by part, into whatever keeps it; how far an earlier one came.

Only the part that is being played is held in memory. The device stays on for some minutes at most, so a
long course is played in parts; each begins with the major loop (not recorded) and with the extremes that the
memory held where the part before ended (recorded). Every part is therefore a record of its own that begins
with a known memory, and the run says where each begins: ``Run.seam``.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np

from pulsetrainer.artefacts import Run
from pulsetrainer.artefacts.run import Coil, seam_of
from pulsetrainer.core import excitations
from pulsetrainer.core.course import Course
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.memory import turning_points
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.temperature import Windows, record_of
from pulsetrainer.device.codes import MAX_DECIMATION
from pulsetrainer.device.device import Device
from pulsetrainer.device.limits import check_ever_cool, check_force, check_peak
from pulsetrainer.device.trace import Block
from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.steps.arguments import EXCITATIONS
from pulsetrainer.steps.progress import Progress, silent
from pulsetrainer.steps.stopped import in_part, raise_if_stopped

_LOG = logging.getLogger(__name__)
CONDITIONING_SPEED_A_PER_S = 3.0
CONDITIONING_REST_S = 0.2
PAUSE_S = 1.0  # between two parts, on the time axis; how long it was in truth nobody knows after a crash
_MATCH_A = 1.5e-4  # the device tells the reference in steps of 0.1 mA
_MOST_TURNS = 20_000  # of the reference, kept until the part ends


Watch = Callable[[FloatArray, FloatArray], None]  # current and force, arrays (n,) in A and N


class Sink(Protocol):
    """Where a recording goes while it is made."""

    dropped_samples: int

    @property
    def samples(self) -> int:
        """How many samples it holds."""

    @property
    def end_s(self) -> float:
        """Time of the last sample."""

    def append(self, *columns: FloatArray) -> None:
        """Take in time, reference, current and force, (n,) in s, A, A and N."""

    def begin_part(self) -> None:
        """Say that the device was off since the last sample."""


class InMemory:
    """A sink that keeps the recording in memory."""

    def __init__(self) -> None:
        self.dropped_samples = 0
        self._blocks: list[FloatArray] = []
        self._seams: list[int] = []

    @property
    def samples(self) -> int:
        """How many samples it holds."""
        return sum(block.shape[1] for block in self._blocks)

    @property
    def end_s(self) -> float:
        """Time of the last sample."""
        return float(self._blocks[-1][0, -1])

    def append(self, *columns: FloatArray) -> None:
        """Take in time, reference, current and force, (n,) in s, A, A and N."""
        if np.size(columns[0]):
            self._blocks.append(np.stack(columns))

    def begin_part(self) -> None:
        """Say that the device was off since the last sample."""
        self._seams.append(self.samples)

    def run(self, signal: str, serial: str, *, complete: bool, coil: Coil | None = None) -> Run | None:
        """Return what was recorded; None where that is nothing."""
        if not self._blocks:
            return None
        time_s, reference, current, force = np.concatenate(self._blocks, axis=1)
        return Run(
            time_s=time_s,
            input=current,
            output=force,
            reference=reference,
            seam=seam_of(self._seams, time_s.size),
            signal=signal,
            complete=complete,
            dropped_samples=self.dropped_samples,
            captured=True,
            serial=serial,
            coil=coil,
        )


class Tally:
    """What there is to say about a recording, kept up to date without keeping the recording."""

    def __init__(self, plane: Plane | None) -> None:
        self._plane = plane
        self._covered = np.zeros(1 if plane is None else plane.n_q, dtype=bool)
        self._turns = np.zeros(0)
        self.current_A = (np.inf, -np.inf)
        self.force_N = (np.inf, -np.inf)

    def add(self, reference_A: FloatArray, current_A: FloatArray, force_N: FloatArray) -> None:
        """Take samples in, arrays (n,)."""
        self.current_A = _wider(self.current_A, current_A)
        self.force_N = _wider(self.force_N, force_N)
        path = np.concatenate((self._turns, reference_A))
        self._turns = path[np.append(0, turning_points(path))]
        if self._turns.size > _MOST_TURNS:
            self.end_part()

    def take_over(self, run: Run) -> None:
        """Take in what was recorded before."""
        for part in run.parts():
            assert part.reference is not None
            self.add(part.reference, part.input, part.output)
            self.end_part()

    def end_part(self) -> None:
        """Count the cells that were switched since the part began."""
        if self._plane is not None and self._turns.size:
            self._covered |= coverage(self._plane, [self._turns])
        self._turns = np.zeros(0)

    @property
    def coverage_percent(self) -> float:
        """Cells switched on and off."""
        return 100.0 * float(self._covered.mean())


def _wider(known: tuple[float, float], values: FloatArray) -> tuple[float, float]:
    if values.size == 0:
        return known
    return min(known[0], float(np.nanmin(values))), max(known[1], float(np.nanmax(values)))


@dataclass(frozen=True, slots=True)
class Ending:
    """How a recording ended."""

    complete: bool
    fault: str
    remedy: str
    parts: int
    coil: Coil | None = None  # of a capture that was made in one go


def record(
    course: Course,
    device: Device,
    sink: Sink,
    tally: Tally,
    *,
    at: int = 0,
    condition_first: bool,
    progress: Progress = silent,
    watch: Watch | None = None,
) -> Ending:
    """Play a course from sample ``at`` to its end, or until the device or the user stops it.

    ``watch`` is shown the current and the force as they come.

    ArgumentError where the device cannot play the course; DataError where the disk is full or failed;
    DeviceError, Interrupted where the device could not be conditioned; what was recorded before is kept.
    """
    info, rate_Hz = device.info, course.signal.rate_Hz
    check_top(course.signal, info.current_limit_A)
    decimation = decimation_for(info.tick_rate_Hz, rate_Hz)
    high = float(course.signal.value.max())
    stroke = conditioning_loop(high, rate_Hz) if condition_first else np.zeros(0)
    check_force(stroke if stroke.size else course.signal.value, rate_Hz, info.force_limit_N)
    windows, begun_cold = Windows(), at == 0
    parts, step = 0, info.tick_rate_Hz
    for part in parts_of(course, at, device.longest_play_s):
        check_cooling(part.reference(course), course.signal)  # before the loop, which would be for nothing
        if condition_first:
            _LOG.info("conditioning: once around the major loop")
            condition(device, high, rate_Hz)
        begun_s = sink.end_s + PAUSE_S if sink.samples else 0.0
        if sink.samples:
            sink.begin_part()

        def keep(block: Block, begun_s: float = begun_s, part: Part = part) -> None:
            sink.append(begun_s + block.tick / step, block.reference_A, block.current_A, block.force_N)
            tally.add(block.reference_A, block.current_A, block.force_N)
            windows.add(begun_s + block.tick / step, block.reference_A, block.current_A, block.duty)
            if watch is not None:
                watch(block.current_A, block.force_N)
            played = int(block.tick[-1]) // decimation + 1 - part.lead.size
            progress((part.start + max(played, 0)) / course.size)

        _LOG.info("playing samples %d to %d of %d at %g Hz", part.start, part.end, course.size, rate_Hz)
        before = sink.samples
        played = device.play(
            part.reference(course), rate_Hz, decimation=decimation, on_block=keep, keep=False
        )
        tally.end_part()
        parts += 1
        # a Ctrl-C in the middle of writing costs what was being written: it is counted, not passed over
        sink.dropped_samples += played.dropped_samples + played.samples - (sink.samples - before)
        if played.fault or not played.complete:
            fault = in_part(played.fault, begun_s)
            return Ending(complete=False, fault=fault, remedy=played.remedy, parts=parts)
    told = record_of(windows) if begun_cold and parts == 1 else None
    coil = Coil(**asdict(told)) if told is not None else None
    return Ending(complete=True, fault="", remedy="", parts=parts, coil=coil)


@dataclass(frozen=True, slots=True)
class Part:
    """What is played in one go."""

    lead: FloatArray  # (m,) brings the memory back to where the part before ended
    start: int  # of the course
    end: int

    def reference(self, course: Course) -> FloatArray:
        """Samples (n,) with the lead, A: made when they are played, so that one part at a time is held."""
        values = course.values(self.start, self.end)
        return np.concatenate((self.lead, values)) if self.lead.size else values


def parts_of(course: Course, at: int, longest_s: float) -> Iterator[Part]:
    """Give the parts of a course from sample ``at`` on, each at most ``longest_s`` long.

    ArgumentError where bringing the memory back alone takes longer.
    """
    rate_Hz = course.signal.rate_Hz
    longest = int(longest_s * rate_Hz) + 1
    while at < course.size:
        lead = course.lead_in(at, speed=CONDITIONING_SPEED_A_PER_S, rest_s=CONDITIONING_REST_S)
        if lead.size >= longest:
            raise ArgumentError(
                f"bringing the memory back takes {lead.size / rate_Hz:g} s, the device plays at most "
                f"{longest_s:g} s in one go",
                hint="raise the device's on-time limit",
            )
        end = course.part_end(at, longest - lead.size)
        yield Part(lead, at, end)
        at = end


def check_top(signal: excitations.Signal, limit_A: float) -> None:
    """Raise ArgumentError for a signal that goes beyond the limit in force."""
    ours = signal.name in EXCITATIONS
    lower = (
        f"give `current_max_A` at most {limit_A:g}" if ours else f"scale the table to at most {limit_A:g} A"
    )
    check_peak(signal.value, limit_A, hint=lower)


def check_cooling(reference_A: FloatArray, signal: excitations.Signal) -> None:
    """Raise ArgumentError for a piece (n,) in A of a recording that even a cold coil does not bear."""
    hint = f"play less of {signal.name} at a time, or at a lower current"
    if signal.name in EXCITATIONS:
        hint = "give fewer `levels` or `repeats`, or a lower `current_max_A`; with few levels, a higher "
        hint += "`speed_A_per_s` helps too"
    check_ever_cool(reference_A, signal.rate_Hz, hint)


def decimation_for(tick_rate_Hz: float, rate_Hz: float) -> int:
    """Ticks of the device from one sample to the next; ArgumentError where the rate does not divide them."""
    slowest = tick_rate_Hz / MAX_DECIMATION
    decimation = round(tick_rate_Hz / rate_Hz) if rate_Hz >= slowest else 0
    if decimation < 1 or not np.isclose(decimation * rate_Hz, tick_rate_Hz):
        raise ArgumentError(
            f"the rate must divide the device's {tick_rate_Hz:g} Hz, got {rate_Hz:g} Hz",
            hint=f"use {tick_rate_Hz:g} Hz or a whole fraction of it, such as "
            f"{', '.join(f'{tick_rate_Hz / part:g}' for part in (2, 4, 5, 10))} Hz",
        )
    return decimation


def condition(device: Device, high_A: float, rate_Hz: float) -> None:
    """Take the actuator once around its major loop, so that what came before is forgotten.

    Raises as ``raise_if_stopped`` where the loop could not be completed.
    """
    loop = conditioning_loop(high_A, rate_Hz)
    if loop.size == 0:
        return
    recording = device.play(loop, rate_Hz)
    raise_if_stopped(recording.fault, recording.remedy, "conditioning, the stroke that comes first")


def conditioning_loop(high_A: float, rate_Hz: float) -> FloatArray:
    """Samples (n,) of the major loop that comes first; none for a signal that stays at zero."""
    if high_A <= 0:
        return np.zeros(0)
    return excitations.conditioning(
        0.0, high_A, speed=CONDITIONING_SPEED_A_PER_S, rate_Hz=rate_Hz, rest_s=CONDITIONING_REST_S
    )


def samples_played(run: Run, course: Course) -> int:
    """Return how many samples of the course are in a recording: as far as its reference follows it.

    What follows the course no more is the way down after a fault.

    DataError where the recording has no time or no reference, or it is one of another signal.
    """
    if run.time_s is None or run.reference is None:
        raise DataError(
            "the earlier recording has no time or no reference",
            hint="resume what `pulsetrainer capture` recorded",
        )
    at, begun_s, rate_Hz = 0, 0.0, course.signal.rate_Hz
    for number, part in enumerate(run.parts()):
        assert part.time_s is not None
        assert part.reference is not None
        lead = course.lead_in(at, speed=CONDITIONING_SPEED_A_PER_S, rest_s=CONDITIONING_REST_S)
        index = np.rint((part.time_s - begun_s) * rate_Hz).astype(np.int64)
        last = min(int(index[-1]) + 1, lead.size + course.size - at)
        expected = np.concatenate((lead, course.values(at, at + max(last - lead.size, 0))))
        inside = index < expected.size
        off = np.flatnonzero(np.abs(part.reference[inside] - expected[index[inside]]) > _MATCH_A)
        reached = int(index[off[0]]) if off.size else min(int(index[-1]) + 1, expected.size)
        if number == 0 and reached == 0:
            raise DataError(
                "the reference of the earlier recording is not that of this signal",
                hint="resume with the signal and options that it was recorded with: pulsetrainer show FILE",
            )
        at += max(reached - lead.size, 0)
        begun_s = float(part.time_s[-1]) + PAUSE_S
    return at
