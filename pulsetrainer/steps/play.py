"""Play: press the pulse with the compensated and the scaled current in turn, and record the force."""

from __future__ import annotations

import logging
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import pulsetrainer.simulation  # noqa: F401 - announces bench: and qemu:
from pulsetrainer.artefacts import DrivePlayback, Playback, Waveform
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.signals import check_size
from pulsetrainer.device.device import DEFAULT_PORT, Limits, open_device
from pulsetrainer.device.schemes import redact
from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.files import atomic_write, provenance, store
from pulsetrainer.steps.recording import check_ended

if TYPE_CHECKING:
    from pulsetrainer.device.device import Device
    from pulsetrainer.device.trace import Trace
    from pulsetrainer.steps.context import Context

_LOG = logging.getLogger(__name__)
DRIVES = ("compensated", "scaled")


@dataclass(frozen=True, slots=True)
class Options:
    """Which drive, where, how often."""

    drive: Path
    output: Path
    port: str | None = None
    repeats: int = 5
    limits: Limits = field(default_factory=Limits)  # put in force on the device before anything is played
    dry_run: bool = False  # plan only
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """What was played."""

    output: Path
    name: str
    inversion: str
    repeats: int
    samples: int
    seconds: float
    dropped_samples: int
    complete: bool
    serial: str
    firmware: str


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be played."""

    name: str
    inversion: str
    repeats: int
    samples: int  # of one drive, once
    seconds: float  # both drives, all repeats
    rate_Hz: float
    peak_current_A: float
    rms_current_A: float
    port: str
    output: Path
    dry_run: bool = True


def plan(options: Options) -> Plan:
    """Return what ``run`` would play; no port is opened and nothing written.

    Raises
    ------
    UsageError, DataError
        As ``run``.
    """
    waveform = _waveform(options)
    drives = np.stack((waveform.compensated, waveform.scaled))
    step = float(np.median(np.diff(waveform.time_s)))
    return Plan(
        name=waveform.name,
        inversion=waveform.inversion,
        repeats=options.repeats,
        samples=waveform.time_s.size,
        seconds=waveform.time_s.size * step * options.repeats * len(DRIVES),
        rate_Hz=1.0 / step,
        peak_current_A=float(np.abs(drives).max()),
        rms_current_A=root_mean_square(drives),
        port=redact(options.port or DEFAULT_PORT),
        output=options.output,
    )


def _waveform(options: Options) -> Waveform:
    """Return the drive to be played, or say why it cannot be."""
    atomic_write.check_output(options.output, options.force)
    waveform = store.read(options.drive, Waveform)
    if options.repeats < 1:
        raise ArgumentError(f"repeats must be at least 1, got {options.repeats}", hint="5 is usual")
    check_size(options.repeats, 2 * waveform.compensated.size)
    if waveform.input_unit != "A":
        raise DataError(
            f"{options.drive} drives in {waveform.input_unit}; the device takes a current in A",
            hint="identify and invert a run that was captured on the device",
        )
    return waveform


def run(options: Options, context: Context) -> Result:
    """Play both drives alternately, ``repeats`` times each, and store what was measured.

    Raises
    ------
    UsageError
        The output exists.
    DataError
        The file holds no waveform, or one that is not a current in A.
    DeviceError
        The device stopped by itself.
    Interrupted
        Ctrl-C: the output was stopped first; whole repeats played until then are kept.
    """
    waveform = _waveform(options)
    with open_device(options.port, limits=options.limits) as device:
        playback, (fault, remedy) = _play(waveform, options.repeats, device, context)
        info = device.info
    header = provenance.make_header(
        f"{waveform.name} by {waveform.inversion} inversion, played on {info.serial}",
        argv=context.argv,
        now=context.now(),
        parameters={"repeats": options.repeats, "limits": asdict(options.limits)},
        inputs=provenance.digests([options.drive]),
        ancestors=[store.read_header(options.drive)],
        device=provenance.Device(info.serial, info.firmware, redact(options.port or "")),
        libraries=provenance.library_versions(),
    )
    played = playback.compensated.output.shape[0]
    if played:
        store.write(options.output, playback, header, overwrite=options.force)
    kept = f"; {played} of {options.repeats} repeats were kept in {options.output}" if played else ""
    check_ended(fault, "the playback", kept, remedy)
    return Result(
        output=options.output,
        name=waveform.name,
        inversion=waveform.inversion,
        repeats=played,
        samples=waveform.time_s.size,
        seconds=float(waveform.time_s[-1]) * played * len(DRIVES),
        dropped_samples=playback.dropped_samples,
        complete=playback.complete,
        serial=info.serial,
        firmware=info.firmware,
    )


def _play(
    waveform: Waveform, repeats: int, device: Device, context: Context
) -> tuple[Playback, tuple[str, str]]:
    """Play the drives alternately; return the whole repeats so far, and a fault with its remedy."""
    rate = 1.0 / float(np.median(np.diff(waveform.time_s)))
    decimation = round(device.info.tick_rate_Hz / rate)
    drives = {"compensated": waveform.compensated, "scaled": waveform.scaled}
    kept: dict[str, list[FloatArray]] = {name: [] for name in DRIVES}
    dropped, fault, remedy = 0, "", ""
    for number in range(repeats * len(DRIVES)):
        name = DRIVES[number % len(DRIVES)]
        _LOG.info("repeat %d of %d, %s drive", number // len(DRIVES) + 1, repeats, name)
        recording = device.play(drives[name], rate, decimation=decimation)
        dropped += recording.dropped_samples
        fault, remedy = recording.fault, recording.remedy
        if fault:
            break
        kept[name].append(_on_grid(recording, waveform.time_s.size, decimation))
        context.progress((number + 1) / (repeats * len(DRIVES)))
    whole = min(len(rows) for rows in kept.values())
    model = waveform.model
    return Playback(
        time_s=waveform.time_s,
        waveform=waveform,
        compensated=_playback(kept["compensated"][:whole], waveform.time_s.size),
        scaled=_playback(kept["scaled"][:whole], waveform.time_s.size),
        input_range=float(np.ptp(model.edges)) if model else float(np.ptp(waveform.scaled)),
        complete=not fault,
        dropped_samples=dropped,
    ), (fault, remedy)


def _on_grid(recording: Trace, samples: int, decimation: int) -> FloatArray:
    """Lay a recording (3, n) on the waveform's samples by its ticks; NaN where a block was lost."""
    grid = np.full((3, samples), np.nan)
    place = recording.tick // decimation
    inside = place < samples
    grid[:, place[inside]] = np.stack((recording.reference_A, recording.current_A, recording.force_N))[
        :, inside
    ]
    return grid


def _playback(rows: list[FloatArray], samples: int) -> DrivePlayback:
    stacked = np.stack(rows) if rows else np.empty((0, 3, samples))
    return DrivePlayback(reference=stacked[:, 0], input=stacked[:, 1], output=stacked[:, 2])
