"""Invert: from the shape of a pulse and a model to the drive that presses it, by the inversion asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from pulsetrainer.artefacts import Model, Waveform
from pulsetrainer.artefacts.units import (
    counted,
    with_seconds,
    with_unit,
)
from pulsetrainer.core import inversion
from pulsetrainer.core.learning import BAND_HZ
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import FloatArray, positive
from pulsetrainer.core.pulses import Shape, train
from pulsetrainer.device.limits import ON_TIME_S
from pulsetrainer.diagnosis.prediction import extended_of, predict
from pulsetrainer.errors import ArgumentError, DataError, UsageError
from pulsetrainer.steps import drive_notes, fit_notes
from pulsetrainer.steps.arguments import check_force_range
from pulsetrainer.steps.drive_layout import Layout, laid_out
from pulsetrainer.steps.invertible import Invertible, invertible
from pulsetrainer.steps.one_beat import one_beat, say_if_several
from pulsetrainer.steps.one_thread import one_thread
from pulsetrainer.steps.progress import Progress, silent

Inversion = Literal["continuous", "closest-match", "extended"]

DEVICE_SLEW_A_PER_S = 30.0  # as fast as the coil of our own device follows
_LONG_S = 60.0  # of a period: no pulse of a heart
_AROUND_S = 3.0  # of a drive beside its beats: the stroke before them, ramps, rest
EXPECTED = 5.0  # % of full force: a larger error that the model itself expects is a warning
DEVICE_RATE_HZ = 1000.0  # as our own device plays; the parts around the beats have samples for it
FEWEST = 20  # samples of a period: with fewer a drive does not follow the pulse
_FEW, _MANY = 50, 100_000  # samples of a period: outside, the drive of any other device has its own rate
_OWN = (200, 5000)  # samples of a period then: as many as the pulse has, within these


@one_thread
def invert(
    pulse: Shape,
    model: Model,
    *,
    method: Inversion | None = None,
    force_min: float | None = None,
    force_max: float | None = None,
    beat: str | int | None = None,
    periods: int = 4,
    slew: float | None = None,
    despite_warning: bool = False,
    rate_Hz: float | None = None,
    name: str = "the model",
    progress: Progress = silent,
) -> Waveform:
    """Find the drive that makes a device follow a pulse, and beside it the merely scaled one.

        compensated = P^-1(target),    scaled = low + (high - low) (target - min) / (max - min)

    Both have the same extremes. They begin with one major loop, which wipes out what came before, and end at
    rest.

    Parameters
    ----------
    pulse
        One period of any height; or a recording of several beats together with ``beat``. ``pt.invert`` takes
        its name in the library, a table, a drive, or times (s) and values.
    method
        "continuous", "closest-match" as in the paper, or "extended". None: what suits the model.
    force_min, force_max
        Force at the foot and at the top of the pulse, output unit; None: the ends of the model's reach.
    beat
        Number of a beat from 1, or "mean"; None: the whole pulse is one period.
    periods
        Periods to play; of several the first one is not scored.
    slew
        Fastest the drive may move, input unit per second. None: ``DEVICE_SLEW_A_PER_S`` for a model of a run
        that our own device recorded, no limit for any other.
    despite_warning
        Invert a model although its fit says that its form does not describe the record.
    rate_Hz
        Samples of the drive per second. None: 1000, as our own device plays. For a model of any other device,
        where a period would have fewer than 50 samples or more than 100 000: as many as the pulse itself has.
    name
        Name of the model, for messages.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    UsageError
        There is no pulse of that name, the method does not suit the model, ``beat`` is none, or the force
        range is empty.
    DataError
        The table cannot be used; the force range is beyond the model's reach or, of a signed model, beyond
        the range in which it has an inverse; the recording holds no such beat; a period has too few samples;
        or the model does not describe its own record.

    Source: Tan, Venkataraman, Krishnaprasad 2001 (closest match); docs/theory.md (the other inverses).

    Examples
    --------
    >>> import numpy as np, pulsetrainer as pt
    >>> u = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 0, 200)])
    >>> model = pt.identify(pt.Run(time_s=np.arange(400) / 100, input=u, output=2 * u), levels=8)
    >>> drive = pt.invert("normal", model)
    >>> drive.inversion, bool(drive.predicted_max_error_percent < 0.1)
    ('continuous', True)
    """
    notes = [pulse.note] if pulse.note else []
    shape = one_beat(pulse, beat, notes)
    own_Hz = DEVICE_RATE_HZ if rate_Hz is None else rate_Hz  # of what comes before and after the beats
    rate_Hz = _rate_for(shape, model, notes) if rate_Hz is None else rate_Hz
    _check_sampled(shape, rate_Hz)
    _check_length(shape, model, periods)
    warnings = _check_describes(model, name, despite_warning=despite_warning)
    notes += fit_notes.of_guessed_turns(model) + fit_notes.of_noisy_ends(model)
    chosen = _method(method, model, name)
    part = invertible(model, own_Hz)
    if model.form == "signed":
        notes.append(part.limits(model) + part.around(model))
    forces = _force_range(part, model, force_min, force_max, name)
    if chosen == "extended":
        forces = _within_beats(shape, model, part, forces, (force_min, force_max), rate_Hz, own_Hz)
    if beat is None:
        say_if_several(shape, notes)  # after what can be refused: to find beats loads filters
    notes += drive_notes.of_stretched(shape, forces, (force_min, force_max), model)
    notes += drive_notes.of_jumps(shape)
    progress(0.2)
    layout = laid_out(shape, part, forces, periods, rate_Hz, own_Hz)
    if chosen == "extended":
        exact, clipped = _tracked(model, part, layout, notes, BAND_HZ * (rate_Hz / own_Hz))
    else:
        exact, clipped = _compensated(part, chosen, layout)
    limit = slew_limit(slew, model)
    current = exact if limit is None else inversion.slew_limited(exact, rate_Hz, limit)
    compensated = np.concatenate((part.lead, current, part.tail))
    progress(0.9)
    drive = Waveform(
        time_s=np.arange(compensated.size) / rate_Hz,
        target=layout.target(part),
        compensated=compensated,
        scaled=layout.scaled(current, part, forces),
        predicted=predict(model, compensated, 1.0 / rate_Hz),
        scored=layout.scored(compensated.size, shape, periods),
        name=shape.name,
        source=shape.source,
        inversion=chosen,
        clipped_samples=clipped,
        input_unit=model.input_unit,
        output_unit=model.output_unit,
        model=model,
        period_s=shape.period_s,
        notes=tuple(notes),
    )
    notes += drive_notes.of_more_than_recorded(drive, model)
    if drive.predicted_max_error_percent > EXPECTED:
        warning = drive_notes.expected(drive, float(np.abs(current - exact).max()), limit)
        return replace(drive, notes=tuple(notes), warnings=(*warnings, warning))
    return replace(drive, notes=(*notes, *drive_notes.of_clipped(drive)), warnings=warnings)


def _check_describes(model: Model, name: str, *, despite_warning: bool) -> tuple[str, ...]:
    """Refuse a model whose fit says that its form does not describe the record, or return that warning."""
    warning = model.fit.warning if model.fit else ""
    if not warning:
        return ()
    said = f"{name} does not describe the record it was identified on. {warning}"
    if not despite_warning:
        raise DataError(said, hint="give `despite_warning` to invert it all the same")
    return (said,)


def _rate_for(shape: Shape, model: Model, notes: list[str]) -> float:
    """Return the samples a second of a drive: our own device's, or of another one those the pulse needs."""
    samples = shape.period_s * DEVICE_RATE_HZ
    if model.captured or _FEW <= samples <= _MANY:
        return DEVICE_RATE_HZ
    own = int(np.clip(shape.time_s.size, *_OWN))
    period = with_seconds(shape.period_s)
    notes.append(
        f"one period of {shape.name} lasts {period}: the drive has {counted(own, 'sample')} in it, "
        f"one every {with_seconds(shape.period_s / own)}"
    )
    return own / shape.period_s


def _check_sampled(shape: Shape, rate_Hz: float) -> None:
    """Refuse a pulse that is over within a few samples of the drive."""
    samples = shape.period_s * rate_Hz
    if samples < FEWEST:
        raise DataError(
            f"one period of {shape.name} lasts {with_seconds(shape.period_s)}, and a drive of {rate_Hz:g} "
            f"samples a second has {samples:.2g} samples of it: it takes at least {FEWEST}",
            hint=f"stretch the pulse to {with_seconds(FEWEST / rate_Hz)} or more; or in Python, for a faster "
            f"driver of your own: pt.invert(..., rate_Hz={FEWEST / shape.period_s:.2g})",
        )


def _check_length(shape: Shape, model: Model, periods: int) -> None:
    """Refuse for our own device what it could not play in one go."""
    longest_s = ON_TIME_S - _AROUND_S
    if model.input_unit == "A" and model.captured and periods * shape.period_s > longest_s:
        most = int(longest_s / shape.period_s)
        last = counted(periods, "period", f"of {shape.name} lasts", f"of {shape.name} last")
        raise ArgumentError(
            f"{last} {periods * shape.period_s:.5g} s; the device stays on "
            f"for at most {ON_TIME_S:g} s at a time",
            hint=f"give `periods` at most {most}; pulsetrainer session presses for as long as you like"
            if shape.period_s < _LONG_S
            else "a pulse this long usually means that its time is not in seconds: write its unit in the "
            "heading, such as t_ms",
        )


def slew_limit(asked: float | None, model: Model) -> float | None:
    """Return the limit that was asked for, else that of our own device for its own models, else none.

    ArgumentError where the limit is not positive.
    """
    if asked is not None:
        positive(slew=asked)
        return asked
    ours = model.input_unit == "A" and model.captured
    return DEVICE_SLEW_A_PER_S if ours else None


def _method(asked: Inversion | None, model: Model, name: str) -> Inversion:
    """Return the method: the one asked for if it suits the model, or the one that suits it best."""
    relay = model.reading == "relay"
    if asked == "extended" and not model.extensions:
        raise UsageError(
            f"{name} has no extensions, so there is no extended inverse",
            hint="leave `method` out, or extend the model first: "
            "pulsetrainer capture diagnostic -o diagnostic.h5, "
            "then pulsetrainer diagnose diagnostic.h5 --model MODEL.h5 -o diagnosis.h5, "
            "then pulsetrainer extend diagnosis.h5 --model MODEL.h5 -o extended.h5; and invert that one: "
            "`model` extended.h5",
        )
    if asked in ("continuous", "extended") and relay:
        raise UsageError(
            f"the weights of {name} are read as relays, which have no continuous inverse",
            hint="give `method` closest-match, or identify with `reading` continuous",
        )
    if asked == "closest-match" and model.form != "direct":
        raise UsageError(
            f"{name} has the form {model.form}, and closest-match is a method for direct models",
            hint="leave `method` out",
        )
    if asked is not None and asked not in ("continuous", "closest-match", "extended"):
        raise ArgumentError(
            f"method must be continuous, closest-match or extended, got {asked!r}", hint="leave it out"
        )
    if asked is not None:
        return asked
    return "extended" if model.extensions else "closest-match" if relay else "continuous"


def _force_range(
    part: Invertible, model: Model, force_min: float | None, force_max: float | None, name: str
) -> tuple[float, float]:
    """Return the forces that the ends of the normalised pulse stand for."""
    check_force_range(force_min, force_max)
    reach, unit = part.reach, model.output_unit
    low = reach[0] if force_min is None else force_min
    high = reach[1] if force_max is None else force_max
    slack = 1e-9 * (reach[1] - reach[0])
    if low < reach[0] - slack or high > reach[1] + slack or not low < high:
        step = 10.0 ** (np.floor(np.log10(max(reach[1] - reach[0], np.finfo(float).tiny))) - 2.0)
        raise DataError(
            f"{model.output_quantity} from {low:.4g} to {with_unit(f'{high:.4g}', unit)} is asked for, but "
            f"{name} reaches {reach[0]:.4g} to {with_unit(f'{reach[1]:.4g}', unit)}"
            + (f": {part.limits(model)}" if model.form == "signed" else ""),
            hint="stay inside, such as "
            + f"`force_min` {np.ceil(reach[0] / step) * step:g} " * (force_min is not None)
            + f"`force_max` {np.floor(reach[1] / step) * step:g}" * (force_max is not None),
        )
    return low, high


def _within_beats(
    shape: Shape,
    model: Model,
    part: Invertible,
    forces: tuple[float, float],
    asked: tuple[float | None, float | None],
    rate_Hz: float,
    own_Hz: float,
) -> tuple[float, float]:
    """Return the force range, its free ends moved to what every beat reaches with the range of the input.

    A lag, a creep or heat keep a pulse from the ends that the hysteresis would reach in a long time.
    """
    low, high = part.low, part.high
    inputs = train(shape, periods=4, rate_Hz=rate_Hz, low=low, high=high)
    if part.polarity < 0:
        inputs = low + high - inputs
    settle = np.full(round(own_Hz), inputs[0])
    lead = part.lead
    made = predict(model, np.concatenate((lead, settle, inputs)), 1.0 / rate_Hz)[lead.size + settle.size :]
    period = round(shape.period_s * rate_Hz)
    beats = [made[k * period : (k + 1) * period] for k in range(1, made.size // period)]
    reached = max(float(b.min()) for b in beats), min(float(b.max()) for b in beats)
    within = (
        max(forces[0], reached[0]) if asked[0] is None else forces[0],
        min(forces[1], reached[1]) if asked[1] is None else forces[1],
    )
    if not within[0] < within[1]:
        named = ", ".join(one.cause for one in model.extensions)
        moved = float(np.median([np.ptp(b) for b in beats]))
        other = "a slower pulse" if moved < 0.5 * (forces[1] - forces[0]) else "a faster pulse"
        raise DataError(
            f"there is no {model.output_quantity} that every beat reaches: with {named} the output wanders "
            "further from beat to beat than the pulse moves it",
            hint=f"give `force_min` and `force_max`, {other}, or the model without extensions",
        )
    return within


def _compensated(part: Invertible, method: Inversion, layout: Layout) -> tuple[FloatArray, int]:
    """Return the input that gives what is wanted after the major loop, and what was clipped."""
    if method == "continuous":
        exact = part.inverse(layout.wanted)
        return exact.input, exact.clipped
    operator = part.whole
    assert isinstance(operator, Preisach)
    plane = operator.plane
    matched = inversion.closest_match(operator, layout.wanted)
    step = float(np.diff(plane.edges).mean())
    time_s = np.arange(layout.wanted.size) / layout.rate_Hz
    return inversion.smoothed(matched.input, time_s, step, plane.low, plane.high), matched.clipped


def _tracked(
    model: Model, part: Invertible, layout: Layout, notes: list[str], band_Hz: float
) -> tuple[FloatArray, int]:
    """Return the input that makes the extended model give what is wanted, and what was clipped."""
    found = extended_of(model).invert(
        layout.wanted,
        1.0 / layout.rate_Hz,
        lead=layout.lead,
        inverse=None if model.form == "direct" else part.inverse,  # of others a range, and not all
        band_Hz=band_Hz,
    )
    left, static = (with_unit(f"{rms:.3g}", model.output_unit) for rms in (found.rms, found.rms_static))
    notes.append(
        f"by the extended model the drive misses the pulse by {left} (rms), the static inverse by {static}"
    )
    if found.steps == 0:
        notes.append("no step improved on the static inverse, which is kept")
    return found.input, found.clipped
