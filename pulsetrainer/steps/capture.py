"""Capture: play an excitation on the device and record what it measures."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import pulsetrainer.simulation  # noqa: F401 - announces bench: and qemu:
from pulsetrainer.core import signals
from pulsetrainer.core.course import Course
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.signals import Signal
from pulsetrainer.device.codes import TICK_RATE_HZ
from pulsetrainer.device.device import DEFAULT_PORT, Limits, open_device
from pulsetrainer.device.schemes import redact
from pulsetrainer.errors import DataError, DeviceError
from pulsetrainer.files import atomic_write, provenance, run_from_table, table
from pulsetrainer.files.recorder import RunRecorder, interrupted
from pulsetrainer.steps import preflight, recording
from pulsetrainer.steps.recording import Earlier, Tally, check_ended, conditioning_loop

if TYPE_CHECKING:
    from pulsetrainer.artefacts import Run
    from pulsetrainer.device.device import Device
    from pulsetrainer.steps.context import Context


@dataclass(frozen=True, slots=True)
class Options:
    """What to play, where, and how."""

    signal: str  # an excitation's name or a CSV file
    output: Path
    port: str | None = None
    levels: int = 48
    current_max_A: float = 1.5
    speed_A_per_s: float = 0.75
    rate_Hz: float = 1000.0
    condition: bool = True  # one unrecorded major loop first
    repeats: int = 1  # of the signal, without a pause
    resume: bool = False  # go on with the recording into the same output that was interrupted
    limits: Limits = field(default_factory=Limits)  # put in force on the device before anything is played
    dry_run: bool = False  # plan only
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """What was recorded."""

    output: Path
    signal: str
    samples: int
    seconds: float
    rate_Hz: float
    reversals: int
    parts: int  # the device was off in between
    coverage_percent: float
    current_range_A: tuple[float, float]
    force_range_N: tuple[float, float]
    dropped_samples: int
    complete: bool
    serial: str
    firmware: str


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be played."""

    signal: str
    samples: int
    seconds: float  # the conditioning loop included
    rate_Hz: float
    reversals: int
    coverage_percent: float
    peak_current_A: float
    rms_current_A: float
    port: str
    output: Path
    dry_run: bool = True


def plan(options: Options) -> Plan:
    """Return what ``run`` would play; nothing is opened or written.

    Raises
    ------
    UsageError, DataError
        As ``reference``; also when the output exists.
    """
    atomic_write.check_output(options.output, options.force)
    signal = reference(options)
    course = Course(signal, options.repeats)
    top = float(signal.value.max())
    first = conditioning_loop(top, options.rate_Hz).size / options.rate_Hz if options.condition else 0.0
    covered = coverage(Plane.uniform(0.0, top, options.levels), [signal.value]) if top > 0 else np.zeros(1)
    return Plan(
        signal=signal.name,
        samples=course.size,
        seconds=course.duration_s + first,
        rate_Hz=options.rate_Hz,
        reversals=course.reversals,
        coverage_percent=100.0 * float(covered.mean()),
        peak_current_A=float(np.abs(signal.value).max()),
        rms_current_A=root_mean_square(signal.value),
        port=redact(options.port or DEFAULT_PORT),
        output=options.output,
    )


def reference(options: Options) -> Signal:
    """Return the reference to be played.

    Raises
    ------
    UsageError
        The signal is neither an excitation nor a file.
    DataError
        The file cannot be used, or no device samples at that rate.
    """
    path = preflight.signal_file(options.signal)
    recording.decimation_for(TICK_RATE_HZ, options.rate_Hz)
    if path is None and options.signal == "identification":
        return signals.identification(
            0.0,
            options.current_max_A,
            n_h=options.levels,
            speed=options.speed_A_per_s,
            rate_Hz=options.rate_Hz,
        )
    if path is None:
        return signals.diagnostic(0.0, options.current_max_A, rate_Hz=options.rate_Hz)
    return _from_file(path, options.rate_Hz)


def _from_file(path: Path, rate_Hz: float) -> Signal:
    """Read a reference current from the columns ``t_s`` and the one after it."""
    columns = table.read_table(path)
    if len(columns.names) < 2:
        raise DataError(
            f"{path} has {len(columns.names)} column; a reference needs a time and a current",
            hint="write two columns: t_s,current_A",
        )
    time, current = run_from_table.seconds(columns, columns.names[0]), columns.check_finite(columns.names[1])
    seconds = float(time[-1]) - float(time[0])
    lasts = seconds * rate_Hz
    if not lasts <= signals.MOST_SAMPLES:
        raise DataError(
            f"{path} lasts {seconds:g} s, {lasts:.3g} samples at {rate_Hz:g} Hz; "
            f"{signals.MOST_SAMPLES} are the most",
            hint="give its time in s, a lower --rate, or a shorter signal with --repeats",
        )
    count = int(np.floor(lasts + 1e-9)) + 1
    value = np.interp(time[0] + np.arange(count) / rate_Hz, time, current)
    return Signal(value, rate_Hz, path.name)


def run(options: Options, context: Context) -> Result:
    """Play and record.

    Raises
    ------
    UsageError
        The output exists, the signal is unknown, or there is nothing to resume.
    DeviceError
        The device stopped by itself; what was recorded until then was kept with ``complete=false``.
    Interrupted
        Ctrl-C: the output was stopped first, then what was recorded was kept.
    """
    if not options.resume:
        atomic_write.check_output(options.output, options.force)
    course = Course(reference(options), options.repeats)
    earlier = None
    if options.resume:
        earlier = recording.earlier_of(options.output, course, _same(options), options.force)
        context.note(
            f"going on with {earlier.path} after {earlier.run.input.size} samples, "
            f"{100.0 * earlier.at / course.size:.0f} % of the signal"
        )
    else:
        _note_leftovers(options.output, context)
    try:
        with open_device(options.port, limits=options.limits) as device:
            return _record(options, course, device, earlier, context)
    finally:
        if earlier is not None:
            earlier.lease.end()


def _note_leftovers(path: Path, context: Context) -> None:
    for left, samples in interrupted(path):
        context.note(
            f"{left} holds {samples} samples of a capture that was cut off: "
            "continue it with --resume, or delete it"
        )


def _record(
    options: Options, course: Course, device: Device, earlier: Earlier | None, context: Context
) -> Result:
    info, signal = device.info, course.signal
    recording.decimation_for(info.tick_rate_Hz, options.rate_Hz)  # before anything is written
    serial = None if earlier is None else earlier.header.provenance.device
    if earlier is not None and serial is not None and serial.serial != info.serial:
        raise DeviceError(
            f"{earlier.path} was recorded on {serial.serial}, this is {info.serial}",
            hint="connect that device, or leave --resume out and name another output",
        )
    header = provenance.make_header(
        f"{signal.name} on {info.serial}",
        argv=context.argv,
        now=context.now(),
        parameters={
            key: value
            for key, value in asdict(options).items()
            if key not in ("port", "output", "force", "dry_run", "resume")
        },
        inputs=_inputs(options) | ({} if earlier is None else provenance.digests([earlier.path])),
        ancestors=[] if earlier is None else [earlier.header],
        device=provenance.Device(info.serial, info.firmware, redact(options.port or "")),
        libraries=provenance.library_versions(),
    )
    top = float(signal.value.max())
    tally = Tally(Plane.uniform(0.0, top, options.levels) if top > 0 else None)
    with RunRecorder(
        options.output,
        header,
        signal=signal.name,
        overwrite=options.force or (earlier is not None and earlier.contains_final),
        earlier=None if earlier is None else (earlier.path, earlier.run),
    ) as recorder:
        if earlier is not None:
            _count(tally, earlier.run)
        ending = recording.record(
            course,
            device,
            recorder,
            tally,
            at=0 if earlier is None else earlier.at,
            condition_first=options.condition,
            progress=context.progress,
        )
        recorder.finish(complete=ending.complete)
    kept = f"; {recorder.samples} samples were kept in {options.output} (complete=false)"
    check_ended(ending.fault, "the capture", kept, ending.remedy)
    return Result(
        output=options.output,
        signal=signal.name,
        samples=recorder.samples,
        seconds=recorder.end_s,
        rate_Hz=options.rate_Hz,
        reversals=course.reversals,
        parts=ending.parts + (0 if earlier is None else len(earlier.run.parts())),
        coverage_percent=tally.coverage_percent,
        current_range_A=tally.current_A,
        force_range_N=tally.force_N,
        dropped_samples=recorder.dropped_samples,
        complete=ending.complete,
        serial=info.serial,
        firmware=info.firmware,
    )


def _count(tally: Tally, run: Run) -> None:
    """Take in what was recorded before."""
    for part in run.parts():
        assert part.reference is not None
        tally.add(part.reference, part.input, part.output)
        tally.end_part()


def _inputs(options: Options) -> dict[str, str]:
    path = preflight.signal_file(options.signal)
    return provenance.digests([] if path is None else [path])


def _same(options: Options) -> dict[str, object]:
    """What must be the same when a capture is resumed."""
    names = ("signal", "levels", "current_max_A", "speed_A_per_s", "rate_Hz", "condition", "repeats")
    return {name: getattr(options, name) for name in names}
