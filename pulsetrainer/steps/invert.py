"""Invert: from a pulse shape and a model to the current that presses it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from pulsetrainer.artefacts import Model, Waveform
from pulsetrainer.core import inversion, signals
from pulsetrainer.core.beats import find_beats
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.waveforms import Shape, train
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files import atomic_write, provenance, run_from_table, store, table
from pulsetrainer.steps import preflight
from pulsetrainer.steps.modelling import extended_of, operator_of, predict

if TYPE_CHECKING:
    from pulsetrainer.core.operator import Preisach
    from pulsetrainer.steps.context import Context

Inversion = Literal["continuous", "closest-match", "extended"]

CONDITIONING_TIME_S = 0.5  # for each way of the major loop that comes first
REST_S = 0.2
EXTENDED_BAND_HZ = 30.0  # an arterial pulse holds little above
RAMP_S = 0.4  # from rest to the first target, and back after the last


@dataclass(frozen=True, slots=True)
class Options:
    """Which pulse, which model, and how."""

    waveform: str  # a library name or a CSV file
    model: Path
    output: Path
    beat: str | None = (
        None  # of a record of several beats: its number from 1, or "mean"; None: all is one period
    )
    inversion: Inversion | None = None  # None: what suits the model's reading
    force_min: float | None = None  # None: the lowest the model can reach
    force_max: float | None = None
    periods: int = 4  # the first one is not scored
    slew_A_per_s: float = 30.0  # what the current loop follows within 1 % of its range
    rate_Hz: float = 1000.0
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """What will be played."""

    output: Path
    name: str
    inversion: str
    samples: int
    seconds: float
    force_range: tuple[float, float]
    current_range: tuple[float, float]
    clipped_samples: int
    predicted_max_error_percent: float
    input_unit: str
    output_unit: str


def read_shape(waveform: str) -> tuple[Shape, Path]:
    """Return a pulse shape from the library or a file, and the file it came from.

    Raises
    ------
    UsageError
        It is neither in the library nor a file.
    DataError
        The file cannot be used.
    """
    path = preflight.waveform_file(waveform)
    columns = table.read_table(path)
    if len(columns.names) < 2:
        raise DataError(
            f"{path} has {len(columns.names)} column; a waveform needs a time and a value",
            hint="write two columns: t_s,p",
        )
    time_s, value = run_from_table.seconds(columns, columns.names[0]), columns.check_finite(columns.names[1])
    source = next((c.partition(":")[2].strip() for c in columns.comments if c.startswith("source:")), "")
    return Shape(path.stem, time_s, value, source or path.name), path


def _one_beat(record: Shape, beat: str | None, context: Context) -> Shape:
    """Return the beat that is asked for, out of a record of several."""
    if beat is None:
        return record
    found = find_beats(record)
    lengths = found.periods_s
    context.note(
        f"{record.name} holds {found.count} whole beats of {lengths.min():.3f} to {lengths.max():.3f} s "
        f"({60.0 / float(np.mean(lengths)):.0f} a minute)"
    )
    if beat == "mean":
        return found.mean()
    return found.single(int(beat))


def run(options: Options, context: Context) -> Result:
    """Compute the compensated and the scaled drive and store both.

    Raises
    ------
    UsageError
        The output exists, or the waveform is unknown.
    DataError
        The model or the waveform cannot be used, or the force range is beyond the model's reach.
    """
    atomic_write.check_output(options.output, options.force)
    preflight.check_beat(options.beat)
    model = store.read(options.model, Model)
    shape, path = read_shape(options.waveform)
    shape = _one_beat(shape, options.beat, context)
    operator = operator_of(model)
    usual: Inversion = "closest-match" if operator.reading == "relay" else "continuous"
    method = options.inversion or ("extended" if model.extensions else usual)
    if method == "extended" and not model.extensions:
        raise UsageError(
            f"{options.model} has no extensions, so there is no extended inverse",
            hint="pulsetrainer diagnose RUN.h5 --model model.h5 -o diagnosis.h5, then extend",
        )
    if method in ("continuous", "extended") and operator.reading == "relay":
        raise UsageError(
            f"{options.model} was identified with the relay reading, which has no continuous inverse",
            hint="give --method closest-match, or identify with --reading continuous",
        )
    low, high = _force_range(options, operator, model.output_unit)
    if method == "extended":
        low, high = _within_beats(options, shape, model, (low, high))
    context.progress(0.2)
    waveform = _drives(shape, operator, model, method, (low, high), options, context)
    header = provenance.make_header(
        f"{shape.name} by {method} inversion",
        argv=context.argv,
        now=context.now(),
        parameters={
            key: value for key, value in asdict(options).items() if key not in ("model", "output", "force")
        },
        inputs=provenance.digests(
            [options.model, path] if path.name == options.waveform else [options.model]
        ),
        ancestors=[store.read_header(options.model)],
        libraries=provenance.library_versions(),
    )
    store.write(options.output, waveform, header, overwrite=options.force)
    context.progress(1.0)
    if waveform.clipped_samples:
        context.note(f"{waveform.clipped_samples} samples of the target were out of reach and were clipped")
    scored = waveform.scored
    error = np.abs(waveform.predicted - waveform.target)[scored].max()
    return Result(
        output=options.output,
        name=shape.name,
        inversion=method,
        samples=waveform.time_s.size,
        seconds=waveform.time_s.size / options.rate_Hz,
        force_range=(low, high),
        current_range=(float(waveform.compensated.min()), float(waveform.compensated.max())),
        clipped_samples=waveform.clipped_samples,
        predicted_max_error_percent=100.0 * float(error) / max(abs(high), abs(low)),
        input_unit=model.input_unit,
        output_unit=model.output_unit,
    )


def _force_range(options: Options, operator: Preisach, unit: str) -> tuple[float, float]:
    """Return the forces that the ends of the normalised waveform stand for."""
    reach = sorted(operator.saturation)
    low = reach[0] if options.force_min is None else options.force_min
    high = reach[1] if options.force_max is None else options.force_max
    slack = 1e-9 * (reach[1] - reach[0])
    if low < reach[0] - slack or high > reach[1] + slack:
        raise DataError(
            f"forces from {low:g} to {high:g} {unit} are asked for, but the model in {options.model} reaches "
            f"{reach[0]:.3f} to {reach[1]:.3f} {unit}",
            hint=f"choose --force-min and --force-max inside, such as "
            f"--force-min {np.ceil(reach[0] * 10) / 10:g} --force-max {np.floor(reach[1] * 10) / 10:g}",
        )
    preflight.check_force_range(low, high)
    return low, high


def _within_beats(
    options: Options, shape: Shape, model: Model, forces: tuple[float, float]
) -> tuple[float, float]:
    """Return the force range, its free ends moved to what every beat reaches with the range of the input.

    A lag, a creep or heat keep a pulse from the ends that the hysteresis would reach in a long time.
    """
    low, high = float(model.edges[0]), float(model.edges[-1])
    rate = options.rate_Hz
    rising = model.polarity > 0
    inputs = train(shape, periods=4, rate_Hz=rate, low=low if rising else high, high=high if rising else low)
    settle = np.full(round(rate), inputs[0])
    lead = signals.conditioning(
        low, high, speed=(high - low) / CONDITIONING_TIME_S, rate_Hz=rate, rest_s=REST_S
    )
    made = predict(model, np.concatenate((lead, settle, inputs)), 1.0 / rate)[lead.size + settle.size :]
    period = round(shape.period_s * rate)
    beats = [made[k * period : (k + 1) * period] for k in range(1, made.size // period)]
    reached = max(float(b.min()) for b in beats), min(float(b.max()) for b in beats)
    return (
        max(forces[0], reached[0]) if options.force_min is None else forces[0],
        min(forces[1], reached[1]) if options.force_max is None else forces[1],
    )


def _drives(
    shape: Shape,
    operator: Preisach,
    model: Model,
    method: Inversion,
    forces: tuple[float, float],
    options: Options,
    context: Context,
) -> Waveform:
    """Lay out conditioning, ramp, beats and ramp back, and find the currents for them."""
    rate = options.rate_Hz
    plane = operator.plane
    beats = train(shape, periods=options.periods, rate_Hz=rate, low=forces[0], high=forces[1])
    lead = signals.conditioning(
        plane.low,
        plane.high,
        speed=(plane.high - plane.low) / CONDITIONING_TIME_S,
        rate_Hz=rate,
        rest_s=REST_S,
    )
    rest = float(operator(lead)[-1])
    ramp = np.linspace(0.0, 1.0, round(RAMP_S * rate), endpoint=False)
    wanted = np.concatenate(
        (rest + (beats[0] - rest) * ramp, beats, beats[0] + (rest - beats[0]) * ramp, [rest])
    )
    if method == "extended":
        exact, clipped = _tracked(model, wanted, lead, rate, context)
    else:
        exact, clipped = _compensated(operator, method, wanted, rate)
    current = inversion.slew_limited(exact, rate, options.slew_A_per_s)
    body = slice(ramp.size, ramp.size + beats.size)
    ends = sorted((float(current[body].min()), float(current[body].max())), reverse=operator.polarity < 0)
    scaled_beats = ends[0] + (ends[1] - ends[0]) * (beats - forces[0]) / (forces[1] - forces[0])
    up = plane.low + (scaled_beats[0] - plane.low) * ramp
    down = scaled_beats[-1] + (plane.low - scaled_beats[-1]) * ramp
    scaled = np.concatenate((lead, up, scaled_beats, down, [plane.low]))
    compensated = np.concatenate((lead, current))
    period = round(shape.period_s * rate)
    scored = np.zeros(compensated.size, dtype=bool)
    first = lead.size + ramp.size + (period if options.periods > 1 else 0)
    scored[first : lead.size + ramp.size + beats.size] = True
    return Waveform(
        time_s=np.arange(compensated.size) / rate,
        target=np.concatenate((operator(lead), wanted)),
        compensated=compensated,
        scaled=scaled,
        predicted=predict(model, compensated, 1.0 / rate),
        scored=scored,
        name=shape.name,
        source=shape.source,
        inversion=method,
        clipped_samples=clipped,
        input_unit=model.input_unit,
        output_unit=model.output_unit,
        model=model,
    )


def _compensated(
    operator: Preisach, method: Inversion, wanted: FloatArray, rate: float
) -> tuple[FloatArray, int]:
    """Return the input that gives ``wanted`` from the state the conditioning leaves, and what was clipped."""
    if method == "continuous":
        exact = inversion.invert(operator, wanted)
        return exact.input, exact.clipped
    plane = operator.plane
    steps = inversion.closest_match(operator, wanted)
    step = float(np.diff(plane.edges).mean())
    time_s = np.arange(wanted.size) / rate
    return inversion.smoothed(steps.input, time_s, step, plane.low, plane.high), steps.clipped


def _tracked(
    model: Model, wanted: FloatArray, lead: FloatArray, rate: float, context: Context
) -> tuple[FloatArray, int]:
    """Return the input that makes the extended model give ``wanted`` after ``lead``, and what was clipped."""
    found = extended_of(model).invert(wanted, 1.0 / rate, lead=lead, band_Hz=EXTENDED_BAND_HZ)
    context.note(
        f"by the extended model the rms tracking error is {found.rms:.3g} {model.output_unit} "
        f"after {found.steps} steps, {found.rms_static:.3g} with the static inverse"
    )
    if found.steps == 0:
        context.note("no step improved on the static inverse, which is kept")
    return found.input, found.clipped
