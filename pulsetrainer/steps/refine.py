"""Refine: play a drive with the force sensor in place, and learn from what it still gets wrong."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from pulsetrainer.artefacts import BoolArray, Model, RefinePass, Waveform
from pulsetrainer.core import inversion, learning, metrics
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.device.device import Device
from pulsetrainer.device.limits import Limits, Rehearsal, check_force, check_peak
from pulsetrainer.errors import ArgumentError, DataError, Interrupted
from pulsetrainer.steps.invert import slew_limit
from pulsetrainer.steps.invertible import Invertible, invertible
from pulsetrainer.steps.own_device import check_units
from pulsetrainer.steps.play import Plan, play_once
from pulsetrainer.steps.progress import Progress, silent
from pulsetrainer.steps.stopped import raise_if_stopped

_LOG = logging.getLogger(__name__)
FEWEST, MOST = 2, 5  # repeats of a pass: two tell noise from error
_SHARE = 0.25  # of the error: noise that is left in the band of the correction, at most
_ENOUGH = 1.05  # times the noise: an error that small is noise
MEAN_OF_NORMAL = float(np.sqrt(2.0 / np.pi))  # mean size of a normal variable of deviation 1
_PATIENCE = 2  # passes without gain that end it


@dataclass(frozen=True, slots=True)
class _Pressed:
    """What one pass gave."""

    current: FloatArray  # (n,) as asked for, A
    output: FloatArray  # (n,) mean over the repeats, N
    asks_for: int  # repeats of the next pass
    errors: RefinePass


def refine(
    drive: Waveform,
    device: Device,
    *,
    passes: int = 5,
    slew: float | None = None,
    progress: Progress = silent,
) -> Waveform:
    """Return the drive that a device follows best, after learning from a few passes with the force sensor.

        r <- r + 0.8 F[target - force(u)],   u <- P^-1(r),   from the drive as it is

    The iteration of the extended inverse with the device itself in the model's place, so it also takes out
    what no cause of the list explains. Each pass is repeated so often that noise stays below a quarter of the
    error; the best pass is kept, and it ends as soon as only noise is left. The result is a waveform like any
    other: the refined drive, the scaled one as it was, what the device pressed in ``predicted``, and
    ``passes``.

    Parameters
    ----------
    drive
        The waveform to begin with, which ``invert`` made.
    device
        The device, with its force sensor.
    passes
        Most passes; the first one plays the drive as it is.
    slew
        Fastest the current may move, A/s; None: as ``invert``.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    ArgumentError
        ``passes`` is below 1, or the device cannot play the drive.
    DataError
        The drive is not a current in A, has no model, or has one without an inverse.
    DeviceError
        The device stopped by itself, or its force reading cannot be trusted. Nothing is kept.
    Interrupted
        Ctrl-C: the output was stopped first. From the second pass on ``kept`` is the drive of the best one.

    Source: Bristow, Tharayil, Alleyne 2006 (iterative learning control); docs/theory.md.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> drive = pt.load("tests/data/files-0.1/drive.h5")
    >>> with pt.open_device("bench:") as device:
    ...     refined = pt.refine(drive, device, passes=2)
    >>> refined.passes[1].mean_abs_error_percent < refined.passes[0].mean_abs_error_percent
    True
    """
    model = check(drive, passes)
    check_peak(drive.compensated, device.info.current_limit_A)
    check_force(drive.compensated, drive.rate_Hz, device.info.force_limit_N, drive.predicted)
    part = invertible(model, drive.rate_Hz)
    middle = slice(part.lead.size, drive.time_s.size - part.tail.size)
    limit = slew_limit(slew, model)
    start = part.whole(drive.compensated)
    smooth = learning.LowPass(learning.BAND_HZ, 1.0 / drive.rate_Hz)
    in_beats = beats(drive)[middle]
    tried: list[_Pressed] = []

    def inverse(wanted: FloatArray) -> inversion.Inverse:
        found = part.inverse(np.where(in_beats, wanted, start[middle]))
        # the inverse of what a drive gives need not be the drive: branches can be flat
        return found if tried else replace(found, input=drive.compensated[middle])

    def respond(current: FloatArray) -> FloatArray:
        whole = whole_current(drive, part, current, limit if tried else None)
        if tried:  # what is learnt may ask for more than the drive did
            whole = np.minimum(whole, device.info.current_limit_A)
        pressed = _press(drive, device, whole, tried, smooth)
        tried.append(pressed)
        progress(len(tried) / passes)
        return pressed.output[middle]

    learnt = learning.passes(
        drive.target[middle], inverse, respond, smooth=smooth, start=start[middle], careful=True
    )
    try:
        for one in learnt:
            last, best = tried[-1].errors, _best(tried)
            only_noise = last.mean_abs_error_percent <= _ENOUGH * last.noise_percent
            if len(tried) == passes or only_noise or one.number - best >= _PATIENCE:
                break
    except Interrupted as error:
        error.kept = _so_far(drive, tried)
        raise
    except KeyboardInterrupt:  # between two plays
        said = f"stopped by you after pass {len(tried)}"
        raise Interrupted(said, kept=_so_far(drive, tried)) from None
    return _refined(drive, tried)


def _best(tried: list[_Pressed]) -> int:
    return int(np.argmin([pressed.errors.mean_abs_error_percent for pressed in tried]))


def _so_far(drive: Waveform, tried: list[_Pressed]) -> Waveform | None:
    """Return what was learnt until now; None where that is nothing."""
    return _refined(drive, tried) if len(tried) > 1 else None


def _refined(drive: Waveform, tried: list[_Pressed]) -> Waveform:
    """Return the drive of the best pass."""
    best = _best(tried)
    kept = tried[best]
    return replace(
        drive,
        compensated=kept.current,
        predicted=kept.output,
        inversion="refined",
        passes=tuple(pressed.errors for pressed in tried),
        kept=best + 1,
        notes=(*drive.notes, _note(tried, best)),
    )


def plan(drive: Waveform, *, passes: int = 5, limits: Limits | None = None) -> Plan:
    """Return what ``refine`` would play at most, on a cold device as it is delivered; fails as it.

    Its first pass is rehearsed, and its currents are those of the drive: what is learnt nobody knows before.
    """
    invertible(check(drive, passes), drive.rate_Hz)
    rehearsal = Rehearsal(limits or Limits())
    check_peak(drive.compensated, rehearsal.current_A)
    for _ in range(FEWEST):
        rehearsal.play(drive.compensated, drive.rate_Hz, drive.predicted)
    return Plan.of(drive, drive.compensated, FEWEST + MOST * (passes - 1))


def check(drive: Waveform, passes: int) -> Model:
    """Return the model of a drive; refuse what ``refine`` cannot take, before any device is opened."""
    if passes < 1:
        raise ArgumentError(f"passes must be at least 1, got {passes}", hint="5 is usual")
    check_units(drive)
    if drive.model is None:
        raise DataError(
            f"the drive {drive.name} does not say what model it was made with",
            hint="make it again: pulsetrainer invert normal --model model.h5 -o drive.h5",
        )
    if drive.model.reading == "relay":
        raise DataError(
            f"the weights of the model of {drive.name} are read as relays, which have no continuous inverse",
            hint="identify with `reading` continuous, invert again and refine that drive",
        )
    return drive.model


def beats(drive: Waveform) -> BoolArray:
    """True (n,) in the beats: at rest there is only noise to learn."""
    scored = np.flatnonzero(drive.scored)
    first = scored[0] - (round(drive.period_s * drive.rate_Hz) if np.isfinite(drive.period_s) else scored[0])
    at = np.arange(drive.time_s.size)
    return (at >= first) & (at <= scored[-1])


def whole_current(drive: Waveform, part: Invertible, current: FloatArray, limit: float | None) -> FloatArray:
    """Current (n,) of the whole drive: major loop and tail as they were, and what is learnt between."""
    end = drive.time_s.size - part.tail.size
    whole = np.concatenate((drive.compensated[: part.lead.size], current, drive.compensated[end:]))
    return whole if limit is None else inversion.slew_limited(whole, drive.rate_Hz, limit)


def _press(
    drive: Waveform, device: Device, current: FloatArray, tried: list[_Pressed], smooth: learning.LowPass
) -> _Pressed:
    """Play a current as often as the noise asks for, and return what it gave."""
    expected = tried[-1].output if tried else drive.predicted
    repeats = tried[-1].asks_for if tried else FEWEST
    forces: list[FloatArray] = []
    for number in range(repeats):
        _LOG.info("pass %d, repeat %d of %d", len(tried) + 1, number + 1, repeats)
        once = play_once(drive, device, current, expected=expected, earlier=forces)
        raise_if_stopped(once.fault, once.remedy, f"pass {len(tried) + 1}")
        forces.append(once.rows[2])
    measured, scored = np.stack(forces), drive.scored
    output = metrics.mean_over_repeats(measured)
    errors = metrics.tracking(drive.target[scored], measured[:, scored], drive.full_force)
    spread = metrics.repeat_spread(measured[:, scored]) * MEAN_OF_NORMAL
    in_band = np.stack([smooth(metrics.mean_over_repeats(row[None])) for row in measured])[:, scored]
    error = metrics.root_mean_square(smooth(drive.target - output)[scored])
    return _Pressed(
        current,
        output,
        _repeats(metrics.repeat_spread(in_band), error),
        RefinePass(
            repeats=repeats,
            mean_abs_error_percent=errors.mean_abs_error_percent,
            max_abs_error_percent=errors.max_abs_error_percent,
            noise_percent=100.0 * spread / drive.full_force,
        ),
    )


def _repeats(noise: float, error: float) -> int:
    """Repeats whose mean has at most ``_SHARE`` of the error as noise: rms in the band that is learnt."""
    if not error > 0:
        return MOST
    return int(np.clip(np.ceil((noise / (_SHARE * error)) ** 2), FEWEST, MOST))


def _note(tried: list[_Pressed], best: int) -> str:
    """Say what was gained, and what is left."""
    first, kept = tried[0].errors, tried[best].errors
    gained = (
        f"the mean error fell from {first.mean_abs_error_percent:.2f} to {kept.mean_abs_error_percent:.2f} % "
        f"of full force in pass {best + 1}, which is kept"
        if best
        else "none was better than the first, which is kept, with a mean error of "
        f"{kept.mean_abs_error_percent:.2f} % of full force"
    )
    if len(tried) == 1:
        gained = gained.replace("none was better than the first, which is kept", "it only measured the drive")
    passes = "1 pass" if len(tried) == 1 else f"{len(tried)} passes"
    return f"refined in {passes}: {gained}; the noise alone gives {kept.noise_percent:.2f} %"
