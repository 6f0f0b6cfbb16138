"""``pulsetrainer compare``: evaluations, or sessions of learners, side by side."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pulsetrainer.cli.console import plain
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Overwrite
from pulsetrainer.report.forms import figure_form
from pulsetrainer.steps.asked import check_several

if TYPE_CHECKING:
    from pulsetrainer.steps.compare import Metric


def compare(
    context: typer.Context,
    evaluations: Annotated[
        list[Path],
        typer.Argument(help="Evaluations or sessions, the oldest first.", metavar="EVALUATION.h5..."),
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Figure (png, svg, pdf) or table (csv).")
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="All figures, not only the headlines.")] = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Compare evaluations or sessions side by side.

    Before and after, device against device, week against week, learner against learner.

    Example: pulsetrainer compare before.h5 after.h5 -o change.png
    """
    check_several(evaluations)
    form = figure_form(out, "a comparison", "csv") if out is not None else ""
    job = Job(context, inputs=evaluations, outputs=(out,), overwrite=overwrite, as_json=json)
    from pulsetrainer.artefacts import Evaluation, Session
    from pulsetrainer.files import store
    from pulsetrainer.steps.compare import compare as side_by_side

    labels = labels_of(evaluations)
    with job.working("comparing"):
        loaded = [job.load_any(path, Evaluation, Session) for path in evaluations]
        headers = [store.read_header(path) for path in evaluations]
        metrics = side_by_side(loaded, names=list(map(str, evaluations)), everything=everything)
        if out is not None and form == "csv":
            job.write(out, _csv(evaluations, metrics))
        elif out is not None:
            from pulsetrainer.report import comparison_figure, render

            job.write(
                out, render.encode(comparison_figure.draw(labels, {m.name: m.values for m in metrics}), form)
            )
    sources = [
        {"file": path, "title": header.title, "created": header.created}
        for path, header in zip(evaluations, headers, strict=True)
    ]
    job.screen.result({"evaluations": sources, "metrics": plain(metrics), "output": out})
    words = {True: "better", False: "worse", None: ""}
    job.screen.table(
        "errors, %, the change from the first to the last",
        ["", *labels, "change", ""],
        [
            [_label(m.name), *m.values, None if m.change is None else f"{m.change:+.2f}", words[m.better]]
            for m in metrics
        ],
    )
    job.wrote(out)


def _csv(files: Sequence[Path], metrics: Sequence[Metric]) -> str:
    """Return a tidy table: a row for each file, a column for each figure."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["file", *(m.name for m in metrics)])
    writer.writerows([str(file), *(m.values[k] for m in metrics)] for k, file in enumerate(files))
    return text.getvalue()


def labels_of(files: Sequence[Path]) -> list[str]:
    """Return short names of files that still tell them apart: the parts of their paths that differ."""
    parts = [path.with_suffix("").parts for path in files]
    if len({p[-1] for p in parts}) == len(parts):
        return [p[-1] for p in parts]
    if len({p[:-1] for p in parts}) == len(parts) and len({p[-1] for p in parts}) == 1:
        return [Path(*p[:-1]).name or str(path) for p, path in zip(parts, files, strict=True)]
    return [str(path) for path in files]


_SHORT = {
    "mean_error_reduction_percent": "reduction",
    "compensated.mean_abs_error_percent": "mean error",
    "compensated.max_abs_error_percent": "max error",
    "rms_percent": "rms error",
    "max_percent": "max error",
    "right_percent": "right",
    "right_from_percent": "right, 95 % from",
    "right_to_percent": "right, 95 % to",
    "response_s": "time to the answer, s",
    "pressed.mean_abs_error_percent": "mean error",
}


def _label(name: str) -> str:
    """Return the name of a figure as a person says it."""
    for metric, short in _SHORT.items():
        if name.endswith(f".{metric}"):
            return f"{name.removesuffix(metric)[:-1]}: {short}"
    return name
