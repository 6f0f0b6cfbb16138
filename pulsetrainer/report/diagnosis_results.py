"""What `diagnose`, `extend` and `correct` say of their results, as ``results`` does for other commands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Model, ModelEvaluation, Run
from pulsetrainer.artefacts.units import with_unit
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.report.results import Said
from pulsetrainer.report.tables import picked

_OF_A_CAUSE: Final = (
    "found", "p_value", "explains_percent", "confounded_with", "held_out_gain_percent",
    "detectable_from_percent", "text", "doubts",
)  # fmt: skip
_BASELINE: Final = (
    "rms", "rms_percent", "noise_percent", "extended_rms_percent", "static_percent", "extended_percent",
    "floor_percent",
)  # fmt: skip
_EXTENDED: Final = (
    "rms_percent", "extended_rms_percent", "static_percent", "extended_percent", "held_out_gain_percent",
)  # fmt: skip
LONG = 0.01  # of a run: no recorder is so late
# why a corrected run is as it was: of coarse steps; of a fault that another of the recordings has
UNSEEN = "nothing shows what lies between the steps"
ELSEWHERE = "what was found lies wholly outside this run, in another of the recordings that were diagnosed"


def diagnosed(found: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis for a script."""
    return {
        **picked(found, "verdict", "quick"),
        "baseline": picked(found, *_BASELINE),
        "left": found.left._asdict(),
        "causes": [
            {
                "id": one.cause,
                **picked(one, *_OF_A_CAUSE),
                "parameters": {
                    p.name: picked(p, "value", "unit", "meaning") | {"interval": (p.lower, p.upper)}
                    for p in one.parameters
                },
            }
            for one in found.causes
        ],
        **picked(found, "in_model", "lacks", "evidence", "next_experiment"),
    }


def extended(
    out: Path, model: Model, found: Diagnosis, run: Path | None, proof: Sequence[ModelEvaluation]
) -> Said:
    """Say what a diagnosed model was extended by; ``proof`` has the errors without and with it on ``run``."""
    payload = {
        "output": out,
        "added": [one.cause for one in model.extensions],
        "extensions": model.extensions,
        "levels": model.levels,
        **picked(found, *_EXTENDED),
    }
    rows = _left(found, model) | _apart(found, model)
    if proof:
        before, after = (one.rms_percent for one in proof)
        payload["verified"] = {"without_percent": before, "with_percent": after}
        rows["verified"] = (
            f"{run} is predicted to {after:.3f} % of its span (rms), by the model as it was to {before:.3f} %"
        )
    return payload, f"{out}: extended model of {model.levels} levels", rows


def doubts_of(found: Diagnosis, model: Model) -> list[str]:
    """Say which causes were added although something speaks against them, or were seen at one rate only."""
    added = {one.cause for one in model.extensions}
    at_one_rate = [name for name in sorted(added) if "rates" in found.lacks and library()[name].widens]
    rates = (
        "was seen at one rate of change, or nearly so, and at others it is a guess: "
        "`verify` RUN.h5 at others would show it"
    )
    doubts = dict.fromkeys(
        f"{one.cause} is in doubt ({'; '.join(one.doubts)}): `verify` RUN.h5, a run that was not diagnosed, "
        "shows whether it repeats"
        for one in found.found
        if one.cause in added and one.doubts
    )
    part = "this is not all of the error, and on other recordings the rest may outweigh the improvement"
    partly = [] if found.whole else [f"{part}: check with `verify` RUN.h5"]
    return [*(f"{name} {rates}" for name in at_one_rate), *doubts, *partly]


def _apart(found: Diagnosis, model: Model) -> dict[str, str]:
    """Say how the extended model differs from what the diagnosis told."""
    added = {one.cause: {p.name: p.value for p in one.parameters} for one in model.extensions}
    rows = {
        f"left out {one.cause}": "comes from the measurement: pulsetrainer correct"
        + "; the model is of the time before it" * library()[one.cause].sudden
        if one.cause in found.correctable
        else "; ".join(one.doubts) or "does not last"
        for one in found.found
        if one.cause not in added
    }
    told = {(one.cause, p.name): p.value for one in found.found for p in one.parameters}
    now = {(cause, name): value for cause, several in added.items() for name, value in several.items()}
    if any(told.get(which, value) != value for which, value in now.items()):
        rows["parameters"] = (
            "fitted again as the model is used, from rest; the intervals hold this fit and that of the "
            "diagnosis"
        )
    return rows


def _left(found: Diagnosis, model: Model) -> dict[str, str]:
    """Say what both models leave of the recordings, rms of single samples."""
    assert found.extended is not None
    if not math.isfinite(found.extended_rms_percent) or found.extended.extensions != model.extensions:
        return {}  # a file of 0.1; or --verify took a cause out
    return {
        "error before": f"{found.rms_percent:.3f} % of the span, rms of single samples",
        "error now": f"{found.extended_rms_percent:.3f} %; noise alone is {found.noise_percent:.3f} %",
    }


def corrected(out: Path, measured: Run, made: Run) -> Said:
    """Say what was taken out of a run."""
    masked = int((~made.counts).sum())
    unchanged = is_unchanged(measured, made)
    payload = {"output": out, "corrected": () if unchanged else made.corrected, "masked_samples": masked}
    of_input, change = (_largest_change(of, measured, made) for of in ("input", "output"))
    rows = {"taken out": "nothing" if unchanged else ", ".join(made.corrected)}
    if of_input:
        rows["largest change, input"] = with_unit(f"{of_input:.3g}", made.input_unit)
    if change or not (unchanged or of_input or masked):
        beside = ", beside the samples left out" if masked else ""
        rows["largest change"] = with_unit(f"{change:.3g}", made.output_unit) + beside
    filled = ", filled in between their neighbours" if masked else ""
    rows["samples left out"] = f"{masked} of {made.output.size}{filled}"
    return payload, f"{out}: corrected run", rows


def notes_on(measured: Run, made: Run, delay_s: float) -> list[str]:
    """Say what a person should know of a corrected run, and of a delay (s) that was given."""
    notes = []
    if is_unchanged(measured, made):
        why = UNSEEN if "quantisation" in made.corrected else ELSEWHERE
        notes.append(f"{why}, so the output is left as it was")
    if measured.time_s is not None and delay_s > LONG * float(np.ptp(measured.time_s)):
        notes.append(
            f"{delay_s:g} s is a long delay for this run; --delay is in seconds: 5 ms are --delay 0.005"
        )
    return [*notes, "a run that the model is tested on may have the same fault: diagnose and correct it too"]


def is_unchanged(measured: Run, made: Run) -> bool:
    """Tell whether nothing was taken out of a corrected run."""
    moved = any(_largest_change(of, measured, made) for of in ("input", "output"))
    return not moved and bool(made.counts.sum() == measured.counts.sum())


def _largest_change(of: str, measured: Run, made: Run) -> float:
    """How far a corrected run is from what was measured, in the samples that count."""
    changed = abs(getattr(made, of) - getattr(measured, of))[made.counts]  # what is left out was filled in
    return float(changed[changed >= 0].max(initial=0.0))  # lost samples are not numbers
