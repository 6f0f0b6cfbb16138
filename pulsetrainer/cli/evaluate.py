"""``pulsetrainer evaluate``: force errors of played pulses, prediction errors of models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pulsetrainer.cli.console import Screen, plain
from pulsetrainer.cli.options import AsJson, Force

if TYPE_CHECKING:
    from pulsetrainer.artefacts import DriveError, Evaluation
    from pulsetrainer.steps.evaluate import Result


def evaluate(
    inputs: Annotated[
        list[Path], typer.Argument(help="Playbacks, or one run.", metavar="PLAYED.h5...|RUN.h5")
    ],
    model: Annotated[list[Path], typer.Option(help="Model to test on the run; may be given again.")] = [],  # noqa: B006
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File to write.", show_default=False)
    ] = None,
    html: Annotated[Path | None, typer.Option(help="Report to write.", show_default=False)] = None,
    bounds: Annotated[
        Path | None, typer.Option(help="TOML file of bounds; outside them exit 1.", show_default=False)
    ] = None,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Report how large the errors are.

    Force errors of playbacks, or prediction errors of models on a run that they were not fitted to.

    Example: pulsetrainer evaluate played.h5 -o evaluation.h5 --html report.html
    """
    from pulsetrainer.steps import preflight

    preflight.check_files(outputs=(out, html), force=force, artefacts=(*inputs, *model), others=(bounds,))
    from pulsetrainer.errors import QualityError
    from pulsetrainer.steps import evaluate as flow

    screen = Screen("evaluate", as_json=json)
    options = flow.Options(tuple(inputs), tuple(model), out, html, bounds, force)
    with screen.working("evaluating") as context:
        result = flow.run(options, context)
    problem = _problem(result, str(bounds))
    payload = _payload(result)
    if problem:
        payload["error"] = {"kind": QualityError.kind, "message": problem, "hint": _HINT}
    screen.result(payload)
    tables(screen, result.evaluation)
    for path in (result.output, result.html):
        if path is not None:
            screen.whole(f"wrote {path}")
    if problem:
        typer.echo(f"error: {problem}\n  try: {_HINT}", err=True)
        raise typer.Exit(QualityError.exit_code)
    if result.checked:
        screen.whole(f"all {result.checked} bounds of {bounds} hold")


_HINT = "look at what changed; if the new figure is right, change the bound knowingly"


def _problem(result: Result, bounds: str) -> str:
    """Return what is outside its bounds, or nothing."""
    broken = [f"{b.metric} = {b.value:.4g} is outside [{b.low:g}, {b.high:g}]" for b in result.breaches]
    return (
        f"{len(broken)} of {result.checked} bounds of {bounds} are broken: {'; '.join(broken)}"
        if broken
        else ""
    )


def _payload(result: Result) -> dict[str, Any]:
    evaluation = result.evaluation
    payload: dict[str, Any] = {}
    if evaluation.waveforms:
        payload["waveforms"] = [
            {
                "name": w.name,
                "inversion": w.inversion,
                "repeats": w.repeats,
                "full_force": w.full_force,
                "unit": w.output_unit,
                "scaled": _figures(w.scaled),
                "compensated": _figures(w.compensated),
                "mean_error_reduction_percent": w.mean_error_reduction_percent,
                "noise_percent": w.noise_percent,
            }
            for w in evaluation.waveforms
        ]
    if evaluation.models:
        from pulsetrainer.steps.evaluate import MODEL_METRICS

        names = ("name", *MODEL_METRICS, "start", "outside_percent")
        payload["models"] = [{name: getattr(m, name) for name in names} for m in evaluation.models]
    return payload | {
        "output": plain(result.output),
        "html": plain(result.html),
        "bounds_checked": result.checked,
        "breaches": plain(result.breaches),
    }


def _figures(errors: DriveError) -> dict[str, float]:
    from pulsetrainer.steps.evaluate import METRICS

    return {name: getattr(errors, name) for name in METRICS}


_FIGURES = (
    ("mean error, scaled", "scaled.mean_abs_error_percent"),
    ("mean error, compensated", "compensated.mean_abs_error_percent"),
    ("reduction of the mean error", "mean_error_reduction_percent"),
    ("max error, scaled", "scaled.max_abs_error_percent"),
    ("max error, compensated", "compensated.max_abs_error_percent"),
    ("loop area, scaled", "scaled.hysteresis_percent"),
    ("loop area, compensated", "compensated.hysteresis_percent"),
    ("current tracking, worst", "compensated.current_tracking_max_percent"),
)
_LABEL_WIDTH, _COLUMN_WIDTH = 32, 13


def tables(screen: Screen, evaluation: Evaluation) -> None:
    """Print the figures of an evaluation beside those of the published device."""
    if evaluation.waveforms:
        _pulses(screen, evaluation)
    if evaluation.models:
        screen.table(
            "prediction error on the run",
            ["model", "rms", "rms %", "max %", "gain %", "offset", "rms % without it"],
            [
                [m.name, m.rms, m.rms_percent, m.max_percent, m.gain_percent, m.offset, m.shape_rms_percent]
                for m in evaluation.models
            ],
        )


def _pulses(screen: Screen, evaluation: Evaluation) -> None:
    """One table of all pulses where it fits the screen, else one for each pulse."""
    from pulsetrainer.steps.evaluate import PUBLISHED, metrics_of

    figures = metrics_of(evaluation)
    columns: dict[str, list[tuple[str, dict[str, float]]]] = {}  # by pulse: heading and figures
    for w in evaluation.waveforms:
        stem = f"{w.name}.{w.inversion}."
        published = [("published", PUBLISHED[w.name])] if w.name in PUBLISHED else []
        found = {name[len(stem) :]: value for name, value in figures.items() if name.startswith(stem)}
        columns.setdefault(w.name, published).append((w.inversion, found))
    width = _LABEL_WIDTH + _COLUMN_WIDTH * sum(len(group) for group in columns.values())
    pages = [list(columns)] if width <= screen.width else [[name] for name in columns]
    for page in pages:
        shown = [
            (f"{name}\n{heading}".replace("-", "-\n"), found)
            for name in page
            for heading, found in columns[name]
        ]
        screen.table(
            "force error, % of full force",
            ["", *(heading for heading, _ in shown)],
            [[label, *(found.get(metric) for _, found in shown)] for label, metric in _FIGURES],
        )
