"""Transfer: play one pulse with what refining learnt on another, without a force sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.artefacts import Model, Waveform
from pulsetrainer.core import learning, metrics
from pulsetrainer.core.missed import Path, elsewhere, told_by_the_rest
from pulsetrainer.core.plane import FloatArray, IntArray
from pulsetrainer.diagnosis.prediction import predict
from pulsetrainer.errors import DataError
from pulsetrainer.steps.arguments import named
from pulsetrainer.steps.invert import slew_limit
from pulsetrainer.steps.invertible import Invertible, invertible
from pulsetrainer.steps.refine import beats, check, whole_current

_STEP_S = 0.016  # between the samples that are looked at: half a period of the band
_PARTS = 5  # of a beat, of which each is foretold by the others
# Set together with the deviations of ``core.missed``: docs/how-to/refine.md says on what
_REFINED = 1.2  # times the noise: what refining could not take out of its own pulse says nothing of another
_TOLD = 0.65  # of the square of what is missed in a part of the beat: so much the other parts must predict
_UNCERTAIN = 0.007  # of the variance: with more left, the new pulse goes where the other never was


def transfer(
    drive: Waveform, refined: Waveform, *, slew: float | None = None, names: Sequence[str] = ()
) -> Waveform:
    """Return a drive that also asks for what refining found missing on another pulse.

        ask' = target + E[missed on the path of this drive | missed on the path of the refined one]

    What is missed is M[u] less the force measured, with M the model; it is modelled as a zero, a lag and a
    density on the Preisach plane that the model lacks (``core.missed``). What belongs to one place of one
    pulse is not transferred. Where it may not hold for the new pulse, DataError is raised instead.

    Parameters
    ----------
    drive
        The drive of the new pulse, which ``invert`` made.
    refined
        The drive of another pulse, refined on the same device, by the same model.
    slew
        Fastest the current may move, A/s; None: as ``invert``.
    names
        Names of the refined drive and of the model of the new one, for messages.

    Raises
    ------
    DataError
        ``refined`` was not refined, or another model, method or rate made it; refining did not get down to
        the noise; the parts of its beat do not predict each other; or this pulse goes where that one never
        was.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> model = pt.load("tests/data/files-0.1/model.h5")
    >>> with pt.open_device("bench:") as device:
    ...     refined = pt.refine(pt.invert("normal", model, periods=2), device, passes=2)
    >>> pt.transfer(pt.invert("bifid", model, periods=2), refined).inversion
    'transferred'
    """
    model = check_transfer(drive, refined, names)
    part = invertible(model, drive.rate_Hz)
    smooth = learning.LowPass(learning.BAND_HZ, 1.0 / drive.rate_Hz)
    low, high = part.reach
    missing = smooth(part.whole(refined.compensated) - refined.predicted) / (high - low)
    noise = 0.01 * refined.passes[refined.kept - 1].noise_percent * refined.full_force / (high - low)
    step = max(1, round(_STEP_S * drive.rate_Hz))
    known_at = np.flatnonzero(beats(refined))[::step]
    missed, new_at = missing[known_at], np.arange(0, drive.time_s.size, step)
    if metrics.root_mean_square(missed) <= noise:
        added = np.zeros(drive.time_s.size)
    else:
        known = _path(part, refined, part.whole(refined.compensated), smooth, known_at)
        new = _path(part, drive, drive.target, smooth, new_at)
        expected, variance = elsewhere(known, missed, new)
        phase = known_at / refined.rate_Hz / refined.period_s % 1.0
        scored = drive.scored[new_at]
        _check_general(
            refined,
            drive,
            told_by_the_rest(known, missed, (_PARTS * phase).astype(np.int64)),
            float(variance[scored].mean() / new.variance[scored].mean()),
        )
        faded = smooth(beats(drive).astype(np.float64))  # a step would put a kink into the current
        added = faded * np.interp(np.arange(drive.time_s.size), new_at, (high - low) * expected)
    found = part.inverse((drive.target + added)[part.lead.size : drive.time_s.size - part.tail.size])
    current = whole_current(drive, part, found.input, slew_limit(slew, model))
    told = 100.0 * metrics.root_mean_square(added[drive.scored]) / drive.full_force
    return replace(
        drive,
        compensated=current,
        predicted=predict(model, current, 1.0 / drive.rate_Hz) - added,
        inversion="transferred",
        clipped_samples=found.clipped,
        notes=(*drive.notes, f"what was learnt on {refined.name} adds {told:.2g} % of full force (rms)"),
    )


def check_transfer(drive: Waveform, refined: Waveform, names: Sequence[str] = ()) -> Model:
    """Return the model of both drives; DataError, as of ``transfer``, where nothing can be carried over."""
    model, of_refined = check(drive, passes=1), check_refined(refined)
    if drive.inversion != "continuous":
        raise DataError(
            f"{drive.name} is made by {drive.inversion} inversion; only continuous inversion can use what "
            "was learnt",
            hint="leave `learnt` out, and refine this drive itself",
        )
    if model.fingerprint != of_refined.fingerprint:
        of_refined_name, name = named(names, (f"the refined {refined.name}", f"the drive of {drive.name}"))
        raise DataError(
            f"{of_refined_name} was made with another model than {name}: what was learnt belongs to that one",
            hint="give the model that it was made with (pulsetrainer show REFINED.h5 names it), or "
            "refine a drive of this model",
        )
    if abs(drive.rate_Hz - refined.rate_Hz) > 1e-6:
        raise DataError(
            f"{refined.name} was refined at {refined.rate_Hz:g} samples a second, but {drive.name} has "
            f"{drive.rate_Hz:g}",
            hint="invert both at one rate",
        )
    return model


def check_refined(refined: Waveform) -> Model:
    """Return the model of a drive; DataError where nothing was learnt on it."""
    if not refined.passes:
        raise DataError(
            f"the drive of {refined.name} given as `learnt` was never refined, so it has learnt nothing",
            hint="refine it, pulsetrainer refine REFINED.h5 -o refined.h5, and give `learnt` refined.h5",
        )
    return check(refined, passes=1)


def _check_general(refined: Waveform, drive: Waveform, told: float, uncertain: float) -> None:
    """Refuse what was learnt where it is not known to hold for another pulse."""
    last, more = refined.passes[refined.kept - 1], ""
    if last.mean_abs_error_percent > _REFINED * last.noise_percent:
        why = (
            f"refining {refined.name} left {last.mean_abs_error_percent:.2f} % of full force, which is more "
            f"than {_REFINED:g} times the noise of {last.noise_percent:.2f} %"
        )
        more = (
            f"refine it with more `passes` than {len(refined.passes)}, or " if len(refined.passes) < 5 else ""
        )
    elif told < _TOLD:
        why = (
            f"what was learnt on {refined.name} belongs to that pulse alone: the rest of the beat predicts "
            f"only {100 * max(told, 0.0):.0f} % of each part, and {100 * _TOLD:.0f} % is needed"
        )
    elif uncertain > _UNCERTAIN:
        why = (
            f"{drive.name} goes where {refined.name} never was: {100 * uncertain:.1f} % of the variance is "
            f"left to chance, and at most {100 * _UNCERTAIN:.1f} % is allowed"
        )
    else:
        return
    raise DataError(
        f"{why}; another pulse might become worse",
        hint=f"{more}refine the other drive itself, or identify a better model first",
    )


def _path(
    part: Invertible, drive: Waveform, output: FloatArray, smooth: learning.LowPass, at: IntArray
) -> Path:
    """Path of a drive's current, which gives the output (n,), at some of its samples."""
    low, high = part.reach
    rate = smooth(np.gradient(output / (high - low), 1.0 / drive.rate_Hz))
    return Path.of((part.low, part.high), drive.compensated, rate, at)
