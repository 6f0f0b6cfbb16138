"""Capture: play an excitation on the device and record what it measures."""

from __future__ import annotations

import logging
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pulsetrainer.artefacts import output, provenance, table
from pulsetrainer.artefacts.recorder import RunRecorder
from pulsetrainer.core import signals
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.plane import FloatArray, Plane
from pulsetrainer.core.signals import Signal
from pulsetrainer.errors import ArgumentError, DataError, DeviceError, Interrupted, UsageError
from pulsetrainer.link import DEFAULT_PORT, Limits, open_device, redact

if TYPE_CHECKING:
    from pulsetrainer.flows.context import Context
    from pulsetrainer.link import Block, Device

_LOG = logging.getLogger(__name__)
EXCITATIONS = ("identification", "diagnostic")
CONDITIONING_SPEED_A_PER_S = 3.0
CONDITIONING_REST_S = 0.2


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
    output.check_output(options.output, options.force)
    signal = reference(options)
    top = float(signal.value.max())
    first = conditioning_loop(top, options.rate_Hz).size / options.rate_Hz if options.condition else 0.0
    covered = coverage(Plane.uniform(0.0, top, options.levels), [signal.value]) if top > 0 else np.zeros(1)
    return Plan(
        signal=signal.name,
        samples=signal.value.size,
        seconds=signal.duration_s + first,
        rate_Hz=options.rate_Hz,
        reversals=signal.reversals,
        coverage_percent=100.0 * float(covered.mean()),
        peak_current_A=float(np.abs(signal.value).max()),
        rms_current_A=float(np.sqrt(np.mean(signal.value**2))),
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
        The file cannot be used.
    """
    if options.signal == "identification":
        return signals.identification(
            0.0,
            options.current_max_A,
            n_h=options.levels,
            speed=options.speed_A_per_s,
            rate_Hz=options.rate_Hz,
        )
    if options.signal == "diagnostic":
        return signals.diagnostic(0.0, options.current_max_A, rate_Hz=options.rate_Hz)
    path = Path(options.signal)
    if path.suffix.lower() != ".csv" and not path.exists():
        raise UsageError(
            f"there is no signal {options.signal!r}; known signals: {', '.join(EXCITATIONS)}, or a CSV file",
            hint="pulsetrainer capture identification -o run.h5",
        )
    return _from_file(path, options.rate_Hz)


def _from_file(path: Path, rate_Hz: float) -> Signal:
    """Read a reference current from the columns ``t_s`` and the one after it."""
    columns = table.read_table(path)
    if len(columns.names) < 2:
        raise DataError(
            f"{path} has {len(columns.names)} column; a reference needs a time and a current",
            hint="write two columns: t_s,current_A",
        )
    time, current = columns.column(columns.names[0]), columns.column(columns.names[1])
    if not np.all(np.diff(time) > 0):
        row = int(np.flatnonzero(np.diff(time) <= 0)[0]) + 1
        raise DataError(
            f"the time in {path} does not increase at row {row + 1}: {time[row]:g} after {time[row - 1]:g}",
            hint="sort the rows by time and drop repeated ones",
        )
    count = int(np.floor((time[-1] - time[0]) * rate_Hz + 1e-9)) + 1
    value = np.interp(time[0] + np.arange(count) / rate_Hz, time, current)
    return Signal(value, rate_Hz, path.name)


def run(options: Options, context: Context) -> Result:
    """Play and record.

    Raises
    ------
    UsageError
        The output exists, or the signal is unknown.
    DeviceError
        The device stopped by itself; what was recorded until then was kept with ``complete=false``.
    Interrupted
        Ctrl-C: the output was stopped first, then what was recorded was kept.
    """
    output.check_output(options.output, options.force)
    signal = reference(options)
    with open_device(options.port, limits=options.limits) as device:
        if options.condition:
            _LOG.info("conditioning: once around the major loop")
            condition(device, float(signal.value.max()), options.rate_Hz)
        return _record(options, signal, device, context)


def condition(device: Device, high_A: float, rate_Hz: float) -> None:
    """Take the actuator once around its major loop, so that what came before is forgotten.

    Raises
    ------
    DeviceError, Interrupted
        The loop could not be completed.
    """
    loop = conditioning_loop(high_A, rate_Hz)
    if loop.size == 0:
        return
    recording = device.play(loop, rate_Hz)
    check_ended(recording.fault, "conditioning", "", recording.remedy)


def conditioning_loop(high_A: float, rate_Hz: float) -> FloatArray:
    """Samples (n,) of the major loop that comes first; none for a signal that stays at zero."""
    if high_A <= 0:
        return np.zeros(0)
    return signals.conditioning(
        0.0, high_A, speed=CONDITIONING_SPEED_A_PER_S, rate_Hz=rate_Hz, rest_s=CONDITIONING_REST_S
    )


def check_ended(fault: str, what: str, kept: str, remedy: str) -> None:
    """Raise what a play that did not reach its end has to say.

    Raises
    ------
    DeviceError, Interrupted
        ``fault`` is not empty.
    """
    if fault == "interrupted":
        raise Interrupted(f"stopped by you during {what}; the output was switched off first{kept}")
    if fault:
        raise DeviceError(
            f"the device stopped during {what}: {fault}{kept}",
            hint=remedy or "remove the cause; the next command clears the fault",
        )


def _record(options: Options, signal: Signal, device: Device, context: Context) -> Result:
    info = device.info
    decimation = round(info.tick_rate_Hz / options.rate_Hz)
    if decimation < 1 or not np.isclose(decimation * options.rate_Hz, info.tick_rate_Hz):
        raise ArgumentError(
            f"the rate must divide the device's {info.tick_rate_Hz:g} Hz, got {options.rate_Hz:g} Hz",
            hint="use 1000, 2000 or 5000 Hz",
        )
    header = provenance.make_header(
        f"{signal.name} on {info.serial}",
        argv=context.argv,
        now=context.now(),
        parameters={
            key: value
            for key, value in asdict(options).items()
            if key not in ("port", "output", "force", "dry_run")
        },
        inputs=provenance.digests([] if signal.name in EXCITATIONS else [options.signal]),
        device=provenance.Device(info.serial, info.firmware, redact(options.port or "")),
        libraries=provenance.library_versions(),
    )
    measured: list[Block] = []
    with RunRecorder(options.output, header, signal=signal.name, force=options.force) as recorder:

        def keep(block: Block) -> None:
            recorder.append(block.tick / info.tick_rate_Hz, block.reference_A, block.current_A, block.force_N)
            measured.append(block)
            context.progress(float(block.tick[-1]) / info.tick_rate_Hz / signal.duration_s)

        _LOG.info("playing %d samples at %g Hz", signal.value.size, options.rate_Hz)
        recording = device.play(signal.value, options.rate_Hz, decimation=decimation, on_block=keep)
        recorder.finish(complete=recording.complete, dropped_samples=recording.dropped_samples)
    kept = f"; {recording.tick.size} samples were kept in {options.output} (complete=false)"
    check_ended(recording.fault, "the capture", kept, recording.remedy)
    current, force = recording.current_A, recording.force_N
    plane = Plane.uniform(0.0, float(signal.value.max()), options.levels)
    covered = coverage(plane, [recording.reference_A])
    return Result(
        output=options.output,
        signal=signal.name,
        samples=recording.tick.size,
        seconds=float(recording.time_s[-1]),
        rate_Hz=options.rate_Hz,
        reversals=signal.reversals,
        coverage_percent=100.0 * float(covered.mean()),
        current_range_A=(float(current.min()), float(current.max())),
        force_range_N=(float(force.min()), float(force.max())),
        dropped_samples=recording.dropped_samples,
        complete=recording.complete,
        serial=info.serial,
        firmware=info.firmware,
    )
