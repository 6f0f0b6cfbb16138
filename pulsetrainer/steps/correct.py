"""Correct: a run without drift, steps, hum, wild samples and the like, and with what a rail cut off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Run
from pulsetrainer.core import wild
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.diagnosis.causes import library, upright_values
from pulsetrainer.diagnosis.causes.base import Cause, Taken, Values
from pulsetrainer.diagnosis.question import measured_of, told_in
from pulsetrainer.diagnosis.raw import Raw
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.steps.arguments import named

_ROUNDING = 1e-6  # of a time step
_DELAY = "delay"  # told by the caller: no record tells a recorder's from the device's


def correct(
    run: Run, diagnosis: Diagnosis | None = None, *, delay_s: float = 0.0, names: Sequence[str] = ()
) -> Run:
    """Take out of a run those faults of the measurement that a diagnosis of it found.

        y <- y - b - g (y - y0), y - b t, y0 + (y - y0) / (1 + g t), y - A sin(2 pi f t + phi),
             y(t / (1 + e)), y(t + d), y(t - d)
        u <- u + tau u'

    Samples that cannot be restored (wild, far beyond a rail, beside a step) are interpolated between their
    neighbours and marked in ``masked``: no fit counts them. Coarse steps are replaced by what lies between
    them, and a sample at a rail by the output expected just beyond it. What was taken out is in ``corrected``
    of the new run.

    Parameters
    ----------
    diagnosis
        None: only the delay is taken out.
    delay_s
        Constant delay of the output's recorder, s, if there is one: a diagnosis cannot tell it from a delay
        of the device.
    names
        Names of the run and of the diagnosis, for messages.

    Raises
    ------
    UsageError
        The delay is no finite number, or below 0; or there is neither a diagnosis nor a delay.
    DataError
        The diagnosis is of another run, found nothing beyond doubt that can be corrected, or there is a
        delay and the run has no time or is shorter.

    Source: Ljung, System Identification, 1999, section 14.1: what is done to data before a fit.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> run, found = pt.load("tests/data/files-0.1/run.h5"), pt.load("tests/data/files-0.1/diagnosis.h5")
    >>> pt.correct(run, found)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    pulsetrainer.errors.DataError: ...
    """
    if not 0.0 <= delay_s < np.inf:
        raise UsageError(
            f"`delay` must be a finite number, 0 or more, got {delay_s:g}", hint="give it in seconds: 0.001"
        )
    run_name, diagnosis_name = named(names, ("the run", "the diagnosis"))
    if diagnosis is None:
        return _without_delay(run, delay_s, run_name)
    known = {one.fingerprint: k for k, one in enumerate(diagnosis.records)}
    parts = [(where, run.cut(where)) for where in run.slices]
    if not any(part.fingerprint in known for _, part in parts):
        raise DataError(
            f"{diagnosis_name} is not a diagnosis of {run_name}: none of the records in it has these samples",
            hint="give the run that was diagnosed (pulsetrainer show DIAGNOSIS.h5 names it), or diagnose "
            "this one: pulsetrainer diagnose RUN.h5 --model MODEL.h5 -o new-diagnosis.h5",
        )
    _check_delay(run, delay_s, [part for _, part in parts if part.fingerprint in known], run_name)
    faults = _faults(diagnosis)
    if not faults and not delay_s:
        raise DataError(_nothing(diagnosis, diagnosis_name), hint=_instead(diagnosis))
    input_, output = run.input.copy(), run.output.copy()
    masked = ~run.counts
    for where, part in parts:
        if part.fingerprint in known:
            input_[where], restored = _restored(part, diagnosis, faults, known[part.fingerprint], delay_s)
            lost = np.isnan(restored) & np.isfinite(part.output)
            output[where] = wild.repaired(restored, lost)
            masked[where] |= lost
    ids = [*([_DELAY] if delay_s else []), *(cause.id for cause, _ in faults)]
    taken_out = tuple(dict.fromkeys((*run.corrected, *ids)))
    whole = masked if masked.any() else None
    return replace(run, input=input_, output=output, masked=whole, corrected=taken_out)


def _check_delay(run: Run, delay_s: float, parts: Sequence[Run], name: str) -> None:
    """Raise DataError where there is a delay, but no time, or a part that is shorter."""
    if delay_s and run.dt_s is None:
        raise DataError(
            f"{name} has no time, so no delay can be taken out of it",
            hint="import it again with `time` COLUMN or `rate_Hz` HZ",
        )
    for part in parts:
        length_s = (part.output.size - 1) * (run.dt_s or 0.0)
        if delay_s >= length_s > 0.0:
            raise DataError(
                f"a delay of {delay_s:g} s was given, but {name} is only {length_s:g} s long"
                + ("" if len(run.slices) == 1 else " in one of its parts"),
                hint="give the delay of the output's recorder in seconds",
            )


def _without_delay(run: Run, delay_s: float, name: str) -> Run:
    """Return the run with its output earlier by a known delay; the end of each part is masked."""
    if not delay_s:
        raise UsageError(
            "there is neither a diagnosis nor a delay, so it is not known what to take out",
            hint="give the `diagnosis` of the run, or the `delay` of its recorder in seconds",
        )
    _check_delay(run, delay_s, run.parts(), name)
    output, masked = run.output.copy(), ~run.counts
    assert run.time_s is not None
    for where in run.slices:
        time_s, y = run.time_s[where], run.output[where]
        good = np.isfinite(y)
        if not good.any():
            continue
        lost = time_s + delay_s > time_s[good][-1] + _ROUNDING * (run.dt_s or 0.0)
        output[where] = wild.repaired(np.interp(time_s + delay_s, time_s[good], y[good]), lost)
        masked[where] |= lost
    return replace(
        run, output=output, masked=masked, corrected=tuple(dict.fromkeys((*run.corrected, _DELAY)))
    )


def _faults(diagnosis: Diagnosis) -> list[tuple[Cause, Values]]:
    """Faults of the measurement that can be taken out, in the order in which they are undone."""
    polarity = diagnosis.polarity if diagnosis.as_measured else 1
    found = [
        (library()[one.cause], upright_values(one, polarity))
        for one in diagnosis.found
        if one.cause in diagnosis.correctable
    ]
    # wild and clipped samples must not reach the others; what lies between steps is told from what is left
    rank = {"record": 0, "output": 1, "input": 2}
    return sorted(found, key=lambda pair: (3 if pair[0].jagged else rank[pair[0].stage], -pair[0].order))


def _restored(
    part: Run, diagnosis: Diagnosis, faults: Sequence[tuple[Cause, Values]], number: int, delay_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return input and output (n,) of one part; the output is NaN where nothing can be restored."""
    step_s, begin_s = diagnosis.records[number].step_s, diagnosis.records[number].begin_s
    low, high = float(np.nanmin(part.input)), float(np.nanmax(part.input))
    record, stamps = measured_of("the run", part, diagnosis.polarity, low, high)
    good = told_in(part)
    begun = record.time_s if stamps is None else stamps
    # the first average lies in the middle of its samples
    late = 0.5 * (step_s - record.step) if record.timed else 0.0
    raw = Raw(record, low, high, stamps=stamps)
    for firing in [cause.gate(raw) for cause, _ in faults if cause.wild]:
        raw = raw if firing is None else replace(raw, wild=firing.mask)
    taken = Taken(raw, begun - late, step_s, diagnosis.empty, number, begin_s)
    y = record.output
    if delay_s:
        y = np.interp(begun + delay_s, begun, y, right=np.nan)
    u = record.input
    for cause, values in faults:
        u, y = cause.undo_input(u, values, taken), cause.undo(y, values, taken)
    input_, output = part.input.copy(), part.output.copy()
    input_[good], output[good] = u, diagnosis.polarity * y
    return input_, output


def _nothing(diagnosis: Diagnosis, name: str) -> str:
    if diagnosis.quick:
        return f"{name} only screened for causes and fitted none: there is nothing to correct"
    tied = [
        f"; {one.cause} could equally be {' or '.join(one.confounded_with)}"
        for one in diagnosis.found
        if library()[one.cause].corrects and one.confounded_with
    ]
    return (
        f"{name} ended with the verdict {diagnosis.verdict!r} and found no fault of the measurement that is "
        f"beyond doubt and can be taken out: there is nothing to correct{''.join(tied)}"
    )


def _instead(diagnosis: Diagnosis) -> str:
    if diagnosis.extended is not None:
        return "extend the model: pulsetrainer extend DIAGNOSIS.h5 --model MODEL.h5 -o extended.h5"
    if diagnosis.quick:
        return "diagnose without `quick`: pulsetrainer diagnose RUN.h5 --model MODEL.h5 -o full.h5"
    in_doubt = any(one.confounded_with or one.doubts for one in diagnosis.found)
    if in_doubt or diagnosis.verdict in ("unknown", "inconclusive"):
        return f"follow the advice of the diagnosis: {diagnosis.advice[0]}"
    return "use the run as it is"
