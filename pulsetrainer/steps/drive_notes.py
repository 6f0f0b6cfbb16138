"""What a person should know of a drive: its error as the model expects it, its reach, its pulse, in words."""

from __future__ import annotations

import numpy as np

from pulsetrainer.artefacts import Model, Waveform
from pulsetrainer.artefacts.units import counted, quantity_in_words, same_units, shown, with_unit
from pulsetrainer.core.plane import FloatArray
from pulsetrainer.core.pulses import Shape

# % of full force, or of the recorded span: below what presses and sensors of such devices repeat
_SLIGHT = 1.0
_SEAM = 0.02  # of the height of a pulse: a smaller jump from its end to its beginning is not told ...
_SEAM_STEPS = 3.0  # ... nor one of fewer of its own largest steps
_NORMALISED = 0.02  # how far the ends of a mere shape may lie from 0 and 1


def expected(drive: Waveform, slowed: float, limit: float | None) -> str:
    """Say how large an error the model itself expects of a drive, and why."""
    if limit is not None and slowed > 0:
        unit = with_unit(f"{limit:g}", f"{drive.input_unit}/s")
        why = f"the drive may move at most {unit}, which this pulse exceeds"
    elif drive.clipped_samples:
        why = (
            "parts of the pulse are out of the model's reach: try a smaller pulse (`force_min`, `force_max`) "
            "or a slower one"
        )
    elif drive.inversion == "closest-match":
        why = "the drive moves in steps of the levels"
    else:
        why = "the model's output does not follow the pulse even without a limit"
    error = f"{drive.predicted_max_error_percent:.1f} % of {_full(drive)}"
    return f"the model itself expects errors of up to {error}: {why}"


def of_clipped(drive: Waveform) -> list[str]:
    """Say what it costs that the drive stays at an end of its range; nothing where it never has to."""
    if not drive.clipped_samples:
        return []
    left = counted(drive.clipped_samples, "sample")
    error = f"{drive.predicted_max_error_percent:.2g} % of {_full(drive)}"
    found = f"for {left} the drive would have to leave the model's range, and stays at its end"
    matters = (
        f"this does not matter, the model expects errors of at most {error}"
        if drive.predicted_max_error_percent <= _SLIGHT
        else f"the model expects errors of up to {error}; a smaller pulse (`force_min`, `force_max`) has less"
    )
    return [f"{found}: {matters}"]


def of_stretched(
    shape: Shape, forces: tuple[float, float], asked: tuple[float | None, float | None], model: Model
) -> list[str]:
    """Say it where the values of a pulse are not those that are played; one from 0 to 1 is only a shape."""
    own = float(shape.value.min()), float(shape.value.max())
    another = _of_another_unit(shape, model)
    as_it_is = np.allclose(own, forces, atol=1e-8 * (forces[1] - forces[0]))
    if None not in asked or np.allclose(own, (0.0, 1.0), atol=_NORMALISED) or as_it_is:
        return another
    ends = with_unit(f"{forces[0]:.4g} .. {forces[1]:.4g}", model.output_unit)
    said = f"the values of {shape.name} go from {own[0]:.4g} to {own[1]:.4g}; they are stretched to {ends}"
    return [*another, f"{said}: give `force_min` and `force_max` for other ends"]


def _of_another_unit(shape: Shape, model: Model) -> list[str]:
    """Say that a pulse is in another unit than the model's output; a pure number is in none."""
    if shape.unit in ("", "1") or same_units((shape.unit,), (model.output_unit,)):
        return []
    made, unit = quantity_in_words(model.output_quantity), shown(model.output_unit)
    said = f"{shape.name} is a pulse in {shown(shape.unit)}, and the {made} of the model is in {unit or '1'}"
    return [f"{said}: only its shape is used"]


def of_more_than_recorded(drive: Waveform, model: Model) -> list[str]:
    """Say where the model expects more of the output than was recorded, or nothing is known of the input."""
    seen = model.known
    given, made = quantity_in_words(model.input_quantity), quantity_in_words(model.output_quantity)
    if seen is None:  # the ends of any other form are those of the record
        taken = with_unit(_ends(drive.compensated), model.input_unit)
        said = (
            f"the {given} goes over {taken}, ends that follow from the weights: this model does not say what"
        )
        return [f"{said} was recorded"] if model.form == "dual" else []
    least = 0.01 * _SLIGHT * (seen.output_high - seen.output_low)

    def within(output: FloatArray) -> bool:
        return bool(output.min() >= seen.output_low - least and output.max() <= seen.output_high + least)

    if within(drive.predicted):
        return []
    foretold = with_unit(_ends(drive.predicted), model.output_unit)
    recorded = with_unit(f"{seen.output_low:.4g} .. {seen.output_high:.4g}", model.output_unit)
    where = " in the strokes before and after the pulse" if within(drive.predicted[drive.scored]) else ""
    said = f"by the model the {made} goes over {foretold}{where}, and its record holds {recorded}"
    return [f"{said}: what the device does beyond was never seen"]


def of_jumps(shape: Shape) -> list[str]:
    """Say it where a pulse does not end where it begins, since one period follows another."""
    value = shape.value
    apart = abs(float(value[0] - value[-1]))
    if apart <= max(_SEAM * float(np.ptp(value)), _SEAM_STEPS * float(np.abs(np.diff(value)).max())):
        return []
    said = f"{shape.name} ends at {value[-1]:.4g}, but begins at {value[0]:.4g}"
    return [f"{said}: each period begins with a jump, unless the values lead back to the first"]


def _full(drive: Waveform) -> str:
    return f"full {drive.model.output_quantity if drive.model else 'force'}"


def _ends(values: FloatArray) -> str:
    return f"{values.min():.4g} .. {values.max():.4g}"
