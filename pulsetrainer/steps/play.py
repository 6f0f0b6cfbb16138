"""Play: press the pulse with the compensated and the scaled current in turn, and record the force."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pulsetrainer.artefacts import DrivePlayback, Playback, Waveform
from pulsetrainer.core.excitations import check_size
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.device.device import Device
from pulsetrainer.device.follower import INTERRUPTED
from pulsetrainer.device.limits import Limits, Rehearsal, check_force, check_peak
from pulsetrainer.device.plausibility import judge_against, judge_repeat
from pulsetrainer.device.trace import Block, Trace
from pulsetrainer.device.wording import FORCE_REMEDY
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.errors import ArgumentError, DataError, DeviceError
from pulsetrainer.steps.heat import Tracked, coil_of
from pulsetrainer.steps.own_device import EXPORT, check_units
from pulsetrainer.steps.progress import Progress, silent
from pulsetrainer.steps.stopped import raise_if_stopped

_LOG = logging.getLogger(__name__)
DRIVES = ("compensated", "scaled")
Watch = Callable[[str, int, IntArray, FloatArray, FloatArray], None]


@dataclass(frozen=True, slots=True)
class Plan:
    """What would be played."""

    samples: int  # of one drive, once
    seconds: float  # both drives, all repeats
    rate_Hz: float
    peak_current_A: float
    rms_current_A: float
    peak_force_N: float  # by the model, in the strokes before the pulse or in it
    pulse_force_N: float  # in the pulse

    @classmethod
    def of(cls, drive: Waveform, currents: FloatArray, plays: int) -> Plan:
        """Plan so many plays on the samples of a drive, with ``currents`` (..., n) in A."""
        return cls(
            samples=drive.time_s.size,
            seconds=drive.time_s.size / drive.rate_Hz * plays,
            rate_Hz=drive.rate_Hz,
            peak_current_A=float(np.abs(currents).max()),
            rms_current_A=root_mean_square(currents),
            peak_force_N=drive.predicted_peak,
            pulse_force_N=drive.full_force,
        )


def plan(
    drive: Waveform, *, repeats: int = 5, track_heat: bool | None = None, limits: Limits | None = None
) -> Plan:
    """Return what ``play`` would play on a device as it is delivered, with a cold coil; fails as ``play``."""
    _check(drive, repeats)
    rehearsal = Rehearsal(limits or Limits())
    drives = np.stack((drive.compensated, drive.scaled))
    check_peak(drives, rehearsal.current_A, hint=_elsewhere(drive))
    if _is_remade(drive, track_heat):
        coil_of(drive.model, asked=track_heat)
    for _ in range(repeats):
        rehearsal.play(drive.compensated, drive.rate_Hz, drive.predicted)
        rehearsal.play(drive.scaled, drive.rate_Hz)
    return Plan.of(drive, drives, repeats * len(DRIVES))


def play(
    drive: Waveform,
    device: Device,
    *,
    repeats: int = 5,
    track_heat: bool | None = None,
    progress: Progress = silent,
    watch: Watch | None = None,
) -> Playback:
    """Play both drives of a waveform alternately, ``repeats`` times each, and return what was measured.

    Arrays of the playback are (repeats, n), in A and N; NaN where the wire lost a block.

    Parameters
    ----------
    drive
        What ``invert`` or ``refine`` made.
    repeats
        How often each of the two drives is played.
    track_heat
        Take the coil's temperature from the duty, before and between the drives, and let the compensated
        drive allow for it; None: where the model has a thermal term and knows the coil.
    progress
        Called with the share of the work done, 0 to 1.
    watch
        Shown what comes back as it comes: name of the drive, number of the repeat, places (m,) on the samples
        of the drive, current and force (m,).

    Raises
    ------
    ArgumentError
        ``repeats`` is below 1 or too large, or the device cannot play the drive.
    DataError
        The drive is not a current in A.
    DeviceError
        A limit would stop the device, or it stopped by itself. The whole repeats so far are in the error's
        ``kept``.
    Interrupted
        Ctrl-C: the output was stopped first; ``kept`` as above.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> drive = pt.load("tests/data/files-0.1/drive.h5")
    >>> with pt.open_device("bench:") as device:
    ...     played = pt.play(drive, device, repeats=1)
    >>> played.complete, played.compensated.output.shape[0]
    (True, 1)
    """
    _check(drive, repeats)
    drives = np.concatenate((drive.compensated, drive.scaled))
    check_peak(drives, device.info.current_limit_A, hint=_elsewhere(drive))
    tracked = Tracked.of(drive, device, track_heat) if _is_remade(drive, track_heat) else None
    check_force(drive.compensated, drive.rate_Hz, device.info.force_limit_N, drive.predicted)
    check_force(drive.scaled, drive.rate_Hz, device.info.force_limit_N)
    currents = {"compensated": drive.compensated, "scaled": drive.scaled}
    kept: dict[str, list[FloatArray]] = {name: [] for name in DRIVES}
    dropped, fault, remedy = 0, "", ""
    for number in range(repeats * len(DRIVES)):
        name = DRIVES[number % len(DRIVES)]
        repeat = number // len(DRIVES) + 1
        _LOG.info("repeat %d of %d, %s drive", repeat, repeats, name)
        try:
            current = currents[name]
            if tracked is not None and name == "compensated":
                current = tracked.current()
            once = play_once(
                drive,
                device,
                current,
                expected=drive.predicted if name == "compensated" else None,
                earlier=[rows[2] for rows in kept[name]],
                watch=None if watch is None else partial(watch, name, repeat),
            )
            dropped += once.dropped_samples
            fault, remedy = once.fault, once.remedy
            if tracked is not None:
                tracked.take(once.rows, once.duty)
            if fault:
                break
            kept[name].append(once.rows)
            progress((number + 1) / (repeats * len(DRIVES)))
        except KeyboardInterrupt:  # between two plays: what was played is kept all the same
            fault = INTERRUPTED
            break
        except DeviceError as error:  # the coil is too hot for the next one, the port is gone
            if not kept["scaled"]:
                raise
            fault, remedy = error.message, error.hint
            break
    whole = min(len(rows) for rows in kept.values())
    known = operator_of(drive.model) if drive.model else None
    playback = Playback(
        time_s=drive.time_s,
        waveform=drive,
        compensated=_playback(kept["compensated"][:whole], drive.time_s.size),
        scaled=_playback(kept["scaled"][:whole], drive.time_s.size),
        input_range=known.high - known.low if known else float(np.ptp(drive.scaled)),
        complete=not fault,
        dropped_samples=dropped,
        fault=fault,
        temperature_K=np.asarray(tracked.temperatures[:whole]) if tracked is not None else None,
    )
    raise_if_stopped(fault, remedy, "the playback", playback if whole else None)
    return playback


def _is_remade(drive: Waveform, asked: bool | None) -> bool:
    """Whether a drive can be made again for another heat; DataError where that is asked for and it cannot."""
    if drive.inversion != "closest-match":
        return True
    if asked:
        raise DataError(
            f"the drive {drive.name} is a closest match, which cannot be computed again for another "
            "temperature",
            hint="invert with `method` continuous or extended",
        )
    return False


def _check(drive: Waveform, repeats: int) -> None:
    """Refuse what no device can play."""
    if repeats < 1:
        raise ArgumentError(f"repeats must be at least 1, got {repeats}", hint="5 is usual")
    check_size(repeats, 2 * drive.compensated.size)
    check_units(drive)


def _elsewhere(drive: Waveform) -> str:
    """Say where a drive for another device is played; empty where it may be for ours."""
    imported = drive.model is not None and not drive.model.captured
    return f"if its model is of another device, play it there: {EXPORT}" if imported else ""


@dataclass(frozen=True, slots=True)
class Once:
    """What one play of a drive brought back."""

    rows: FloatArray  # (3, n) reference and current in A, force in N; NaN where a block was lost
    dropped_samples: int
    fault: str  # why it did not end, or why its force is not to be trusted; empty where neither
    remedy: str
    duty: FloatArray  # (n,) of the coil's voltage; NaN where a block was lost or the device does not tell


def play_once(
    drive: Waveform,
    device: Device,
    current: FloatArray,
    *,
    expected: FloatArray | None,
    earlier: Sequence[FloatArray],
    watch: Callable[[IntArray, FloatArray, FloatArray], None] | None = None,
) -> Once:
    """Play a current (n,) on the samples of a drive, and judge the force that comes back.

    ``expected`` (n,) is the force that is foretold, N; ``earlier`` are the forces of the repeats before.
    """
    decimation = round(device.info.tick_rate_Hz / drive.rate_Hz)

    def show(block: Block) -> None:
        if watch is not None:
            watch(block.tick // decimation, block.current_A, block.force_N)

    recording = device.play(current, drive.rate_Hz, decimation=decimation, on_block=show)
    *measured, duty = _on_grid(recording, drive.time_s.size, decimation)
    rows = np.stack(measured)
    if recording.fault:
        return Once(rows, recording.dropped_samples, recording.fault, recording.remedy, duty)
    fault = "" if expected is None else judge_against(drive.time_s, expected, rows[2])
    if not fault and earlier:
        begun = slice(int(np.argmax(drive.scored)), None)  # the first beat shows what was before
        fault = judge_repeat(drive.time_s[begun], earlier[-1][begun], rows[2][begun])
    return Once(rows, recording.dropped_samples, fault, FORCE_REMEDY, duty)


def _on_grid(recording: Trace, samples: int, decimation: int) -> FloatArray:
    """Lay a recording (4, n) on the waveform's samples by its ticks; NaN where a block was lost."""
    grid = np.full((4, samples), np.nan)
    place = recording.tick // decimation
    inside = place < samples
    told = (recording.reference_A, recording.current_A, recording.force_N, recording.duty)
    grid[:, place[inside]] = np.stack(told)[:, inside]
    return grid


def _playback(rows: list[FloatArray], samples: int) -> DrivePlayback:
    stacked = np.stack(rows) if rows else np.empty((0, 3, samples))
    return DrivePlayback(reference=stacked[:, 0], input=stacked[:, 1], output=stacked[:, 2])


class ErrorsSoFar:
    """Force errors of each drive as far as it has been played; as text, their mean and maximum."""

    def __init__(self, drive: Waveform) -> None:
        self._drive = drive
        self._total: dict[str, tuple[float, float, int]] = {}  # sum and largest, % of full force; count

    def add(self, name: str, place: IntArray, force: FloatArray) -> None:
        """Take in what was measured (n,) at these samples of a drive; lost samples are NaN."""
        drive = self._drive
        total, most, count = self._total.get(name, (0.0, 0.0, 0))
        counts = place < drive.scored.size
        counts[counts] = drive.scored[place[counts]] & np.isfinite(force[counts])
        error = np.abs(force[counts] - drive.target[place[counts]]) * (100.0 / drive.full_force)
        self._total[name] = (total + error.sum(), max(most, error.max(initial=0.0)), count + error.size)

    def __str__(self) -> str:
        return "; ".join(
            f"{name}: mean {total / max(count, 1):.2f} %, max {most:.1f} %"
            for name, (total, most, count) in self._total.items()
        )
