"""``pulsetrainer extend``: a model with the causes a diagnosis found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Out, Overwrite


def extend(
    context: Context,
    diagnosis: Annotated[Path, Argument(help="Diagnosis of the model.", metavar="DIAGNOSIS.h5")],
    model: Annotated[Path, Option(help="Model that was diagnosed.")],
    out: Out,
    verify: Annotated[
        Path | None, Option(help="A run that was not diagnosed, which each cause must predict better.")
    ] = None,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Add the causes found to the model.

    Its static part is identified again together with them.

    Example: pulsetrainer extend diagnosis.h5 --model model.h5 -o extended.h5
    """
    inputs = (diagnosis, model, *([] if verify is None else [verify]))
    job = Job(context, inputs=inputs, outputs=(out,))
    from pulsetrainer.report.facts import extension_words
    from pulsetrainer.report.results import extended as extended_by

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
    job.show(*extended_by(out, extended, found, verify, proof))
    for one in extended.extensions:
        job.screen.facts(f"with {one.cause}", extension_words(one))


def _doubts(found: pt.Diagnosis, extended: pt.Model) -> list[str]:
    """Say which causes were added although something speaks against them, or were seen at one rate only."""
    from pulsetrainer.diagnosis.causes import library

    added = {one.cause for one in extended.extensions}
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


def _was_fitted(model: Path, run: Path) -> bool:
    """Return whether a model was identified from the run in a file."""
    from pulsetrainer.files import provenance, store

    return provenance.sha256_of(run) in store.read_header(model).provenance.inputs.values()
