"""``pulsetrainer extend``: a model with the causes a diagnosis found."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

import pulsetrainer as pt
from pulsetrainer.cli.console import picked
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Out, Overwrite

_FIGURES = (
    "rms_percent", "extended_rms_percent", "static_percent", "extended_percent", "held_out_gain_percent",
)  # fmt: skip


def extend(
    context: typer.Context,
    diagnosis: Annotated[Path, typer.Argument(help="Diagnosis of the model.", metavar="DIAGNOSIS.h5")],
    model: Annotated[Path, typer.Option(help="Model that was diagnosed.")],
    out: Out,
    verify: Annotated[
        Path | None, typer.Option(help="Run, not diagnosed, that each cause must predict better.")
    ] = None,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Write the model with the causes found.

    Its static part is identified again beside them.

    Example: pulsetrainer extend diagnosis.h5 --model model.h5 -o extended.h5
    """
    inputs = (diagnosis, model, *([] if verify is None else [verify]))
    job = Job(context, inputs=inputs, outputs=(out,), overwrite=overwrite, as_json=json)
    from pulsetrainer.report.diagnosis_text import parameters

    with job.working("extending"):
        found = job.load(diagnosis, pt.Diagnosis)
        plain = job.load(model, pt.Model)
        other = None if verify is None else job.load(verify, pt.Run)
        extended = pt.extend(plain, found, verify=other, names=(str(model), str(diagnosis)))
        added = [one.cause for one in extended.extensions]
        proof = () if other is None else pt.evaluate(other, [plain, extended]).models
        job.save(out, extended, f"Model extended by {', '.join(added)}")
    if verify is None:
        job.notes(_doubts(found, extended))
    elif _was_fitted(model, verify):
        job.notes([f"{model} was identified from {verify}: a run that neither has seen proves more"])
    verified = (
        {"without_percent": proof[0].rms_percent, "with_percent": proof[1].rms_percent} if proof else {}
    )
    job.screen.result(
        {
            "output": out,
            "added": added,
            "extensions": extended.extensions,
            "levels": extended.levels,
            **picked(found, *_FIGURES),
            **({"verified": verified} if verified else {}),
        }
    )
    rows = _left(found, extended) | _apart(found, extended)
    if verified:
        rows["verified"] = (
            f"{verify} is predicted to {verified['with_percent']:.3f} % of its span (rms), by the model as "
            f"it was to {verified['without_percent']:.3f} %"
        )
    job.screen.facts(f"{out}: extended model of {extended.levels} levels", rows)
    for one in extended.extensions:
        job.screen.facts(f"with {one.cause}", parameters(one.parameters))


def _doubts(found: pt.Diagnosis, extended: pt.Model) -> list[str]:
    """Say which causes were added although something speaks against them."""
    added = {one.cause for one in extended.extensions}
    return [
        f"{one.cause} is in doubt ({'; '.join(one.doubts)}): `verify` RUN.h5, a run that was not diagnosed, "
        "tells whether it repeats"
        for one in found.found
        if one.cause in added and one.doubts
    ]


def _was_fitted(model: Path, run: Path) -> bool:
    """Return whether a model was identified from the run in a file."""
    from pulsetrainer.files import provenance, store

    digest = set(provenance.digests([run]).values())
    return bool(digest & set(store.read_header(model).provenance.inputs.values()))


def _apart(found: pt.Diagnosis, extended: pt.Model) -> dict[str, str]:
    """Say how the extended model differs from what the diagnosis told."""
    added = {one.cause: [p.value for p in one.parameters] for one in extended.extensions}
    rows = {
        f"left out {one.cause}": "comes from the measurement: pulsetrainer correct"
        if one.cause in found.correctable
        else "; ".join(one.doubts) or "does not last"
        for one in found.found
        if one.cause not in added
    }
    told = {one.cause: [p.value for p in one.parameters] for one in found.found}
    if any(len(told[name]) == len(now) and told[name] != now for name, now in added.items() if name in told):
        rows["parameters"] = "fitted again as the model is used: from rest"
    return rows


def _left(found: pt.Diagnosis, extended: pt.Model) -> dict[str, str]:
    """Say what both models leave of the recordings, rms of single samples."""
    assert found.extended is not None
    if not math.isfinite(found.extended_rms_percent) or found.extended.extensions != extended.extensions:
        return {}  # a file of 0.1; or --verify took a cause out
    before, after = found.rms_percent, found.extended_rms_percent
    return {
        "error before": f"{before:.3f} % of the span, rms of single samples",
        "error now": f"{after:.3f} %; noise alone is {found.noise_percent:.3f} %",
    }
