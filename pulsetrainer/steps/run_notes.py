"""What a person should know of a run that models are tested on, before its errors are laid to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy  # its parts load when they are first used

from pulsetrainer.artefacts import Model, ModelEvaluation, Run
from pulsetrainer.artefacts.units import counted, quantity_in_words, with_seconds, with_unit
from pulsetrainer.core import wild
from pulsetrainer.core.initial_state import second_stroke
from pulsetrainer.core.plane import BoolArray
from pulsetrainer.diagnosis.causes import cause_named
from pulsetrainer.diagnosis.question import input_range, measured_of, range_of, told_in
from pulsetrainer.diagnosis.raw import Firing, Raw
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.steps.identify import SHORTEST_PART, TRACE_SAMPLES

_AT_THE_END = 0.1  # of the model's range, for a record that begins there
_SETTLED = 3.0  # time constants: then a twentieth is left of where a slow cause began
_SOON = 0.005  # of the record: what has passed within such a time matters little
_FOLLOWS = 1.0 / 3.0  # of the samples: fewer are no measure of the first stroke
_WINDOW = 7  # samples of a median: three wild ones do not move it
_TO_TAKE_OUT = (
    "To take that out: pulsetrainer diagnose RUN.h5 --model MODEL.h5 -o diagnosis.h5, then pulsetrainer "
    "correct RUN.h5 --diagnosis diagnosis.h5 -o corrected.h5; and evaluate corrected.h5"
)


def of_faults(name: str, run: Run) -> list[str]:
    """Say which samples of a run look wild or cut off, and how such faults of its recorder are taken out."""
    wild_ones, clipped = _firings(run)
    notes = [*_wild_words(name, run), *_clipped_words(name, run, clipped)]
    if clipped or (notes and wild_ones):  # a few wild samples the diagnosis does not call a fault
        notes[-1] += f". {_TO_TAKE_OUT}"
    return notes


def _firings(run: Run) -> tuple[list[Firing], list[Firing]]:
    """Return what a diagnosis would see of wild and of clipped samples, in each part of a run."""
    wild_ones, clipped = cause_named("outliers"), cause_named("saturation")
    found: tuple[list[Firing], list[Firing]] = ([], [])
    for part in run.parts(LIMITS.least_samples):
        if told_in(part).sum() < LIMITS.least_samples:
            continue
        low, high = float(np.nanmin(part.input)), float(np.nanmax(part.input))
        record, stamps = measured_of("the run", part, 1, low, high)
        raw = Raw(record, low, high, stamps=stamps)
        if wild_ones.id not in run.corrected and (off := wild_ones.gate(raw)):
            found[0].append(off)
            raw = replace(raw, wild=off.mask)
        if clipped.id not in run.corrected and (cut := clipped.gate(raw)):
            found[1].append(cut)
    return found


def _wild_words(name: str, run: Run) -> list[str]:
    """Say how many samples of a run look wild: a model is not to blame for its error there."""
    parts, reach = run.parts(SHORTEST_PART), float(np.ptp(run.input))
    count = 0
    for part, tamed in zip(parts, wild.tame([(one.input, one.output) for one in parts]), strict=True):
        found = (tamed.wild_input | tamed.wild_output) & part.counts
        count += int(np.count_nonzero(wild.by_chance(found, part.input, reach)))
    looks = counted(count, "sample", "looks", "look")
    return [f"{looks} wild in {name}, and count in its errors"] if count else []


def _clipped_words(name: str, run: Run, found: Sequence[Firing]) -> list[str]:
    """Say how many samples sit at a value at which the output of a run looks cut off."""
    if not found:
        return []
    rails = {one.figures[end] for one in found for end in ("rail", "other")}
    at = with_unit(" or ".join(f"{rail:.4g}" for rail in sorted(rails)), run.output_unit)
    sit = counted(int(sum(one.figures["count"] for one in found)), "sample", "sits", "sit")
    output = quantity_in_words(run.output_quantity)
    return [f"{sit} at exactly {at} in {name}, where its {output} looks cut off, and count in its errors"]


def of_first_stroke(
    name: str, run: Run, one: ModelEvaluation, model: Model, parts: Sequence[tuple[Run, BoolArray]]
) -> list[str]:
    """Say when a model's largest error is, if it is in the first stroke and what follows has far less."""
    (part, kept), *others = parts
    at = np.flatnonzero(kept)
    at = at[:: max(1, at.size // TRACE_SAMPLES)]
    early = at < second_stroke(part.input, *range_of(model, [part]))
    if others or one.time_s is None or run.time_s is None or not early.any() or np.mean(~early) < _FOLLOWS:
        return []
    # a median, for a wild sample is none of the stroke's
    error = np.abs(scipy.ndimage.median_filter(one.output - one.predicted, _WINDOW, mode="nearest"))
    rest, worst = float(error[~early].max()), int(np.argmax(error))
    if not early[worst] or error[worst] <= LIMITS.first_stroke_missed * rest:
        return []
    first, later = (100.0 * size / float(np.ptp(part.output[kept])) for size in (error[worst], rest))
    when = with_seconds(float(one.time_s[worst] - run.time_s[0]))
    said = (
        f"the largest errors of {one.name} are in the first stroke of {name}, {first:.2g} % of the span at "
        f"{when} after its beginning, and at most {later:.2g} % later"
    )
    return [f"{said}: the state before it may be another than the model's"]


def of_beginning(name: str, run: Run, title: str, model: Model) -> list[str]:
    """Say that a slow cause of a model begins at rest, where the run does not begin at the low end."""
    low, high = input_range(model)
    times = [(p.value, e.cause) for e in model.extensions for p in e.parameters if p.unit == "s"]
    tau_s, cause = max(times, default=(0.0, ""))
    if run.time_s is None or tau_s < _SOON * (run.time_s[-1] - run.time_s[0]):
        return []
    if run.input[0] <= low + _AT_THE_END * (high - low):
        return []
    said = f"{name} begins away from the low end of its input, where {title} begins at rest"
    until = with_seconds(_SETTLED * tau_s)
    return [f"{said}: until about {until} have passed, its {cause} may be another than the device's"]
