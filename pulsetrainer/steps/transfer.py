"""Transfer: play one pulse with what refining learnt on another, without a force sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pulsetrainer.artefacts import Model, Waveform
from pulsetrainer.core import learning, metrics
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes.base import low_pass
from pulsetrainer.diagnosis.prediction import predict
from pulsetrainer.errors import DataError
from pulsetrainer.steps.invert import slew_limit
from pulsetrainer.steps.invertible import Invertible, invertible
from pulsetrainer.steps.refine import beats, check, whole_current

# Of the mean square of what was learnt. Where less goes with any pulse the model is the wrong one, and
# another pulse became worse as often as better
_GENERAL = 0.88
_RIDGE = 0.01  # of the columns' mean square: one pulse hardly tells low-passes apart, another one does
_TAUS_S = (0.03, 0.1, 0.3, 1.0, 3.0)  # of what creeps: from a tenth of a beat to a few beats


def transfer(drive: Waveform, refined: Waveform, *, slew: float | None = None) -> Waveform:
    """Return a drive that also asks for what refining found missing on another pulse.

        ask' = target + F[target] c,   c by least squares from F[target_r] c = M[u_r] - target_r

    where u_r is the refined current, M the model and F the columns 1, y, dy/dt, and y through five
    low-passes, with a ridge of a hundredth of their mean squares. What the device does with any pulse goes
    along: a zero, a gain, a lag, a creep. What belongs to one place of one pulse stays behind.

    Parameters
    ----------
    drive
        The drive of the new pulse, which ``invert`` made.
    refined
        The drive of another pulse, refined on the same device, by the same model.
    slew
        Fastest the current may move, A/s; None: as ``invert``.

    Raises
    ------
    DataError
        ``refined`` was not refined, or another model, method or rate made it, or what was learnt belongs to
        that pulse alone.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> model = pt.load("tests/data/files-0.1/model.h5")
    >>> with pt.open_device("bench:") as device:
    ...     refined = pt.refine(pt.invert("normal", model, periods=2), device, passes=2)
    >>> pt.transfer(pt.invert("bifid", model, periods=2), refined).inversion
    'transferred'
    """
    model = check_transfer(drive, refined)
    part = invertible(model, drive.rate_Hz)
    smooth = learning.LowPass(learning.BAND_HZ, 1.0 / drive.rate_Hz)
    there = beats(refined)
    columns = _columns(refined, smooth)[there]
    missing = (part.whole(refined.compensated) - refined.target)[there]
    _check_general(refined, columns, missing)
    share, base = _shares(columns, missing)
    faded = smooth(beats(drive).astype(np.float64))  # a step would put a kink into the current
    added = faded * (base + _columns(drive, smooth) @ share)
    current, clipped = _current(drive, part, drive.target + added, slew)
    told = 100.0 * metrics.root_mean_square(added[drive.scored]) / drive.full_force
    return replace(
        drive,
        compensated=current,
        predicted=predict(model, current, 1.0 / drive.rate_Hz) - added,
        inversion="transferred",
        clipped_samples=clipped,
        notes=(*drive.notes, f"what was learnt on {refined.name} adds {told:.2g} % of full force (rms)"),
    )


def check_transfer(drive: Waveform, refined: Waveform) -> Model:
    """Return the model of both drives; refuse drives between which nothing can be carried over.

    Raises
    ------
    DataError
        As ``transfer``.
    """
    for one in (drive, refined):
        check(one, passes=1)
    assert drive.model is not None
    assert refined.model is not None
    if not refined.passes:
        raise DataError(
            f"the drive {refined.name} was not refined, so there is nothing to learn from",
            hint="refine it first: pulsetrainer refine drive.h5 -o refined.h5",
        )
    if drive.model.fingerprint != refined.model.fingerprint or abs(drive.rate_Hz - refined.rate_Hz) > 1e-6:
        raise DataError(
            f"{refined.name} was refined with another model or rate than {drive.name} is made with",
            hint="invert with the model of the refined drive",
        )
    if drive.inversion != "continuous":
        raise DataError(
            f"{drive.name} is made by {drive.inversion} inversion; only continuous takes what was learnt",
            hint="refine this drive itself",
        )
    return drive.model


def _check_general(refined: Waveform, columns: FloatArray, missing: FloatArray) -> None:
    """Refuse what was learnt (n,) where too little of it goes with what any pulse has (n, k).

    What is left of it and no larger than the sensor's noise says nothing.
    """
    whole = np.column_stack((np.ones(missing.size), columns))
    best, *_ = np.linalg.lstsq(whole, missing, rcond=None)
    noise = 0.01 * refined.passes[refined.kept - 1].noise_percent * refined.full_force
    own = missing - whole @ best
    if metrics.root_mean_square(own) <= noise:
        return
    told = 1.0 - float(np.sum(own**2) / np.sum(missing**2))
    if told < _GENERAL:
        raise DataError(
            f"what was learnt on {refined.name} belongs to that pulse: {100 * told:.0f} % of it go "
            f"with any pulse, and {100 * _GENERAL:.0f} % are needed",
            hint="refine the other drive itself, or identify a better model first",
        )


def _columns(drive: Waveform, smooth: learning.LowPass) -> FloatArray:
    """F of a drive's target but its constant, (n, 2 + taus), output unit."""
    target, dt_s = drive.target, 1.0 / drive.rate_Hz
    slow = [low_pass(target, tau, dt_s) for tau in _TAUS_S]
    return np.stack((target, smooth(np.gradient(target, dt_s)), *slow), axis=1)


def _shares(columns: FloatArray, missing: FloatArray) -> tuple[FloatArray, float]:
    """Shares (k,) of columns (n, k) in what is missing (n,), and the constant beside them."""
    mean, spread = columns.mean(axis=0), columns.std(axis=0)
    unit = (columns - mean) / spread
    gram = unit.T @ unit / missing.size + _RIDGE * np.eye(spread.size)
    share = np.linalg.solve(gram, unit.T @ (missing - missing.mean()) / missing.size) / spread
    return share, float(missing.mean() - mean @ share)


def _current(
    drive: Waveform, part: Invertible, asked: FloatArray, slew: float | None
) -> tuple[FloatArray, int]:
    """Current (n,) that the model needs for what is asked, and how many samples were out of reach."""
    assert drive.model is not None
    middle = slice(part.lead.size, drive.time_s.size - part.tail.size)
    found = part.inverse(asked[middle])
    return whole_current(drive, part, found.input, slew_limit(slew, drive.model)), found.clipped
