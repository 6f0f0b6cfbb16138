"""``pulsetrainer show``: what is in a file."""

from __future__ import annotations

from typer import Context

import pulsetrainer as pt
from pulsetrainer.cli.evaluate import show_tables
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AnyFile, AsJson
from pulsetrainer.report.tables import picked


def show(context: Context, file: AnyFile, json: AsJson = False) -> None:
    """Show what is in a file.

    Its kind, its main figures, and the commands that made it.

    Example: pulsetrainer show model.h5
    """
    job = Job(context, inputs=(file,))
    from pulsetrainer.files import store
    from pulsetrainer.report.diagnosis_text import sections
    from pulsetrainer.report.facts import facts
    from pulsetrainer.report.names import headed

    with job.working("reading"):
        artefact, header = job.load_any(file), store.read_header(file)
        found = facts(artefact)
    said = {"file": file, "kind": artefact.kind, **picked(header, "title", "created", "history")}
    job.screen.result({**said, "facts": found})
    title = f"{file}: {headed(artefact.kind, header.title)}, {header.created}"
    tables = isinstance(artefact, pt.Evaluation | pt.Diagnosis)
    job.screen.facts(title, {} if tables else found)
    if isinstance(artefact, pt.Evaluation):
        show_tables(job.screen, artefact)
    elif isinstance(artefact, pt.Diagnosis):
        job.screen.parts(sections(artefact))
    job.screen.whole("\n".join(["history", *(f"  {line}" for line in header.history)]))
