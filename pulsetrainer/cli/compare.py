"""``pulsetrainer compare``: several evaluations side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pulsetrainer.cli.console import Screen
from pulsetrainer.cli.options import AsJson, Force


def compare(
    files: Annotated[
        list[Path], typer.Argument(help="Evaluations, the oldest first.", metavar="EVALUATION.h5...")
    ],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Figure (png, svg, pdf) or table (csv).", show_default=False),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="All figures, not only the headlines.")] = False,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Lay several evaluations side by side.

    Before and after, device against device, week against week.

    Example: pulsetrainer compare before.h5 after.h5 -o change.png
    """
    from pulsetrainer.steps import preflight

    preflight.comparison_form(files, out)
    preflight.check_files(outputs=(out,), force=force, artefacts=files)
    from pulsetrainer.steps import compare as flow

    screen = Screen("compare", as_json=json)
    with screen.working("comparing") as context:
        result = flow.run(flow.Options(tuple(files), out, everything, force), context)
    screen.result(result)
    words = {True: "better", False: "worse", None: ""}
    screen.table(
        "errors, %, the change from the first to the last",
        ["", *flow.labels_of(tuple(files)), "change", ""],
        [
            [_label(m.name), *m.values, None if m.change is None else f"{m.change:+.2f}", words[m.better]]
            for m in result.metrics
        ],
    )
    if result.output is not None:
        screen.whole(f"wrote {result.output}")


_SHORT = {
    "mean_error_reduction_percent": "reduction",
    "compensated.mean_abs_error_percent": "mean error",
    "compensated.max_abs_error_percent": "max error",
    "rms_percent": "rms error",
    "max_percent": "max error",
}


def _label(name: str) -> str:
    """Return the name of a figure as a person says it."""
    for metric, short in _SHORT.items():
        if name.endswith(f".{metric}"):
            return f"{name.removesuffix(metric)[:-1]}: {short}"
    return name
