"""``pulsetrainer compare``: evaluations, or sessions of learners, side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.console import plain
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Overwrite
from pulsetrainer.cli.outputs import figure_format
from pulsetrainer.report.tables import picked
from pulsetrainer.steps.arguments import check_several


def compare(
    context: Context,
    evaluations: Annotated[
        list[Path], Argument(help="Evaluations or sessions, the oldest first.", metavar="EVALUATION.h5...")
    ],
    out: Annotated[Path | None, Option("-o", "--out", help="Figure (png, svg, pdf) or table (csv).")] = None,
    everything: Annotated[bool, Option("--all", help="All figures, not only the main ones.")] = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Compare evaluations or sessions side by side.

    For example before and after, two devices, two weeks, or two learners.

    Example: pulsetrainer compare before.h5 after.h5 -o change.png
    """
    check_several(evaluations)
    form = figure_format(out, "a comparison", "csv") if out is not None else ""
    job = Job(context, inputs=evaluations, outputs=(out,))
    with job.working("comparing"):
        loaded = [job.load_any(path, pt.Evaluation, pt.Session) for path in evaluations]
        from pulsetrainer.artefacts.units import counted
        from pulsetrainer.files import store
        from pulsetrainer.report.results import as_csv, labels_of, side_by_side
        from pulsetrainer.steps.compare import differing_quizzes, differing_units

        labels = labels_of(evaluations)
        headers = [store.read_header(path) for path in evaluations]
        given = list(map(str, evaluations))
        metrics = pt.compare(loaded, names=given, everything=everything)
        values = {m.name: m.values for m in metrics}
        if out is not None and form == "csv":
            job.write(out, as_csv(evaluations, values))
        elif out is not None:
            from pulsetrainer.report import comparison_figure, render

            job.write(out, render.encode(comparison_figure.draw(labels, values), form))
    job.alike(evaluations)
    job.notes([*differing_quizzes(loaded, given), *differing_units(loaded, given)])
    sources = [
        {"file": path, **picked(header, "title", "created")}
        for path, header in zip(evaluations, headers, strict=True)
    ]
    job.screen.result({"evaluations": sources, "metrics": plain(metrics), "output": out})
    learners = isinstance(loaded[0], pt.Session)
    job.screen.table(counted(len(labels), loaded[0].kind), *side_by_side(metrics, labels, learners=learners))
    if not learners:
        judged = any(m.better is not None for m in metrics)
        unsure = "; one within the spread between repeats gets no verdict" * judged
        job.screen.line("change: ", f"from the first to the last{unsure}")
    job.wrote(out)
