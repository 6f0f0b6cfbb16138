"""``pulsetrainer evaluate``: force errors of played pulses, prediction errors of models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pulsetrainer.cli.console import Screen, plain
from pulsetrainer.cli.options import AsJson, Force

if TYPE_CHECKING:
    from pulsetrainer.artefacts.kinds import DriveError, Evaluation
    from pulsetrainer.flows.evaluate import Result


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
    """Report the force error of playbacks, or the prediction error of models on a run.

    Example: pulsetrainer evaluate played.h5 -o evaluation.h5 --html report.html
    """
    from pulsetrainer.errors import QualityError
    from pulsetrainer.flows import evaluate as flow

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
        if path is not None and not json:
            typer.echo(f"wrote {path}")
    if problem:
        typer.echo(f"error: {problem}\n  try: {_HINT}", err=True)
        raise typer.Exit(QualityError.exit_code)
    if result.checked and not json:
        typer.echo(f"all {result.checked} bounds of {bounds} hold")


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
        names = ("name", "rms", "rms_percent", "max_percent", "gain_percent")
        payload["models"] = [{name: getattr(m, name) for name in names} for m in evaluation.models]
    return payload | {
        "output": plain(result.output),
        "html": plain(result.html),
        "bounds_checked": result.checked,
        "breaches": plain(result.breaches),
    }


def _figures(errors: DriveError) -> dict[str, float]:
    from pulsetrainer.flows.evaluate import METRICS

    return {name: getattr(errors, name) for name in METRICS}


def tables(screen: Screen, evaluation: Evaluation) -> None:
    """Print the figures of an evaluation beside those of the published device."""
    from pulsetrainer.flows.evaluate import PUBLISHED

    rows = []
    for w in evaluation.waveforms:
        paper = PUBLISHED.get(w.name, {})
        rows += [
            [
                f"{w.name}, {w.inversion}",
                w.scaled.mean_abs_error_percent,
                w.compensated.mean_abs_error_percent,
                w.mean_error_reduction_percent,
                paper.get("mean_error_reduction_percent"),
                w.scaled.max_abs_error_percent,
                w.compensated.max_abs_error_percent,
                paper.get("compensated.max_abs_error_percent"),
                w.compensated.hysteresis_percent,
                w.compensated.current_tracking_max_percent,
            ]
        ]
    if rows:
        columns = [
            "pulse, inversion", "mean scaled", "mean comp.", "reduction", "published",
            "max scaled", "max comp.", "published", "loop comp.", "current",
        ]  # fmt: skip
        screen.table(
            "force error in % of full force; current: tracking error in % of its range", columns, rows
        )
    if evaluation.models:
        screen.table(
            "prediction error on the run",
            ["model", "rms", "rms %", "max %", "gain %"],
            [[m.name, m.rms, m.rms_percent, m.max_percent, m.gain_percent] for m in evaluation.models],
        )
