"""``pulsetrainer diagnose``: what the model gets wrong, and why."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pulsetrainer.cli.console import Screen, plain
from pulsetrainer.cli.options import AsJson, Force, Out

if TYPE_CHECKING:
    from pulsetrainer.artefacts import Cause, Diagnosis, Parameter

_SHOWN = 8


def diagnose(
    runs: Annotated[list[Path], typer.Argument(help="Runs of the device.", metavar="RUN.h5...")],
    model: Annotated[Path, typer.Option(help="Model to be diagnosed.")],
    out: Out,
    html: Annotated[Path | None, typer.Option(help="Report to write.", show_default=False)] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Screen only: seconds, but no refit.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated null distribution.")] = 0,
    force: Force = False,
    json: AsJson = False,
) -> None:
    """Say what a model gets wrong on runs, name the cause, and what to measure next.

    Example: pulsetrainer diagnose diagnostic.h5 --model model.h5 -o diagnosis.h5 --html diagnosis.html
    """
    from pulsetrainer.steps import preflight

    preflight.check_files(outputs=(out, html), force=force, artefacts=(*runs, model))
    from pulsetrainer.steps import diagnose as flow

    screen = Screen("diagnose", as_json=json)
    options = flow.Options(tuple(runs), model, out, html, quick, seed, force)
    with screen.working("diagnosing") as context:
        result = flow.run(options, context)
    found = result.diagnosis
    screen.result(payload(found) | {"output": result.output, "html": result.html, "seconds": result.seconds})
    tables(screen, found)
    for path in (result.output, result.html):
        if path is not None:
            screen.whole(f"wrote {path}")


def payload(found: Diagnosis) -> dict[str, Any]:
    """Return the contract's JSON object."""
    return {
        "verdict": found.verdict,
        "quick": found.quick,
        "baseline": {
            "rms": found.rms,
            "rms_percent": found.rms_percent,
            "noise_percent": found.noise_percent,
            "static_percent": found.static_percent,
            "extended_percent": found.extended_percent,
            "floor_percent": found.floor_percent,
        },
        "causes": [
            {
                "id": one.cause,
                "found": one.found,
                "p_value": one.p_value,
                "explains_percent": one.explains_percent,
                "parameters": {
                    p.name: {"value": plain(p.value), "unit": p.unit, "interval": plain([p.lower, p.upper])}
                    for p in one.parameters
                },
                "confounded_with": list(one.confounded_with),
                "held_out_gain_percent": plain(one.held_out_gain_percent),
                "text": one.text,
            }
            for one in found.causes
        ],
        "evidence": list(found.evidence),
        "next_experiment": found.next_experiment,
    }


def tables(screen: Screen, found: Diagnosis) -> None:
    """Print a diagnosis for a person."""
    screen.facts(
        f"verdict: {found.verdict}" + (" (quick screen)" if found.quick else ""),
        {
            "model as given": f"{found.rms_percent:.3f} % rms of the span, single samples",
            "noise": f"{found.noise_percent:.3f} % rms, single samples",
            "weights refitted": f"{found.static_percent:.3f} % rms, short averages",
            **({} if found.quick else {"extended": f"{found.extended_percent:.3f} % rms, short averages"}),
            "floor": f"{found.floor_percent:.3f} % rms: noise and levels",
        },
    )
    named = [one for one in found.causes if one.found]
    others = [one for one in found.causes if not one.found][: max(_SHOWN - len(named), 0)]
    screen.table(
        "causes, strongest first",
        ["cause", "found", "p", "explains %", "held-out gain %"],
        [_row(one) for one in (*named, *others)],
    )
    if named:
        screen.facts("found", {one.cause: _found(one) for one in named})
    screen.facts("evidence", {str(k): text for k, text in enumerate(found.evidence, start=1)})
    screen.facts("next", {"": found.next_experiment})


def _found(one: Cause) -> str:
    tied = f"; not told from {', '.join(one.confounded_with)}" if one.confounded_with else ""
    return f"{one.text}: {'; '.join(words_of(p) for p in one.parameters)}{tied}"


def words_of(p: Parameter) -> str:
    """Return a parameter with its unit and its interval."""
    interval = f" [{p.lower:.4g}, {p.upper:.4g}]" if math.isfinite(p.lower) else ""
    from pulsetrainer.artefacts.units import shown

    return " ".join(f"{p.name} {p.value:.4g} {shown(p.unit)}".split()) + interval


def _row(one: Cause) -> list[Any]:
    measured = one.found and math.isfinite(one.held_out_gain_percent)
    gain = one.held_out_gain_percent if measured else None
    return [one.cause, one.found, f"{one.p_value:.3f}", one.explains_percent, gain]
