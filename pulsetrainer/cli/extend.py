"""``pulsetrainer extend``: a model with the causes a diagnosis found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.next_step import with_files
from pulsetrainer.cli.options import AsJson, Out, Overwrite
from pulsetrainer.errors import DataError, in_words
from pulsetrainer.files.input_file import likely_kind


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
    job = Job(context, inputs=(diagnosis, model, verify), outputs=(out,))
    kind = "" if verify is None else likely_kind(verify)
    if kind not in ("", "run") and likely_kind(diagnosis) in ("", "diagnosis"):  # else that is told first
        raise DataError(
            f"{verify} (--verify) is a {in_words([kind])}, expected a run",
            hint=f"give a run that was used neither to identify {model} nor for the diagnosis",
        )
    from pulsetrainer.files import provenance, store
    from pulsetrainer.report import diagnosis_results, facts

    with job.working("extending"):
        found = job.load(diagnosis, pt.Diagnosis)
        plain = job.load(model, pt.Model)
        other = None if verify is None else job.load(verify, pt.Run)
        try:
            extended = pt.extend(plain, found, verify=other, names=(str(model), str(diagnosis)))
        except DataError as error:
            made_from = map(Path, store.read_header(diagnosis).provenance.inputs)
            runs = [path for path in made_from if likely_kind(path) == "run"]
            error.hint = with_files(error.hint, {"runs": runs})
            raise
        added = [one.cause for one in extended.extensions]
        proof = () if other is None else pt.evaluate(other, [plain, extended]).models
        job.save(out, extended, f"Model extended by {', '.join(added)}")
    if verify is None:
        job.notes(diagnosis_results.doubts_of(found, extended))
    elif provenance.sha256_of(verify) in store.read_header(model).provenance.inputs.values():
        job.notes([f"{model} was identified from {verify}: a run that neither has seen proves more"])
    job.show(*diagnosis_results.extended(out, extended, found, verify, proof))
    for one in extended.extensions:
        job.screen.facts(f"with {one.cause}", facts.extension_words(one))
