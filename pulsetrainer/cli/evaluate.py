"""``pulsetrainer evaluate``: force errors of played pulses, prediction errors of models."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.console import Screen, plain
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Overwrite, Report
from pulsetrainer.steps.arguments import check_measured, check_once


def evaluate(
    context: Context,
    inputs: Annotated[
        list[Path],
        Argument(help="Playbacks, one run, or one session.", metavar="PLAYED.h5...|RUN.h5|SESSION.h5"),
    ],
    model: Annotated[list[Path], Option(help="Model to test on the run; may be given again.")] = [],  # noqa: B006
    out: Annotated[Path | None, Option("-o", "--out", help="File to write.")] = None,
    html: Report = None,
    bounds: Annotated[
        Path | None, Option(help="TOML file of bounds; exit code 1 if a figure is outside them.")
    ] = None,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Report how large the errors are.

    Force errors of playbacks, or prediction errors of models on a run that they were not fitted to. For a
    session it reports what was pressed and answered, and --html writes its score sheet.

    Example: pulsetrainer evaluate played.h5 -o evaluation.h5 --html report.html
    """
    check_once(inputs)
    job = Job(context, inputs=(*inputs, *model), outputs=(out, html))
    from pulsetrainer.files.bounds import read_bounds

    limits = read_bounds(bounds) if bounds else {}
    with job.working("evaluating") as progress:
        measured = [job.load_any(path, pt.Playback, pt.Run, pt.Session) for path in inputs]
        if len(measured) == 1 and isinstance(measured[0], pt.Session):
            _of_session(job, inputs[0], measured[0], html, alone=not (model or out or bounds))
            return
        models = [job.load(path, pt.Model) for path in model]
        check_measured(list(map(str, inputs)), measured, models)  # before the verb, which is slow to import
        from pulsetrainer.steps.evaluate import breaches

        progress(0.2)
        evaluation = pt.evaluate(
            measured, models, names=list(map(str, inputs)), model_names=list(map(str, model))
        )
        broken = breaches(evaluation, limits)
        progress(0.6)
        pulses = dict.fromkeys(w.name for w in evaluation.waveforms) or [path.name for path in inputs]
        header = job.save(out, evaluation, f"Evaluation of {', '.join(pulses)}")
        if html is not None:
            from pulsetrainer.report.html import render_evaluation

            job.page(html, render_evaluation, evaluation, header)
    from pulsetrainer.artefacts.units import counted
    from pulsetrainer.errors import QualityError
    from pulsetrainer.files import store
    from pulsetrainer.report.results import evaluated

    failed = None
    if broken:
        listed = "; ".join(f"{b.metric} = {b.value:.4g} is outside [{b.low:g}, {b.high:g}]" for b in broken)
        failed = QualityError(
            f"{len(broken)} of {counted(len(limits), 'bound')} in {bounds} not met: {listed}",
            hint="find out what changed; if the new figure is right, change the bound on purpose",
        )
    job.alike(model)
    job.one_device(dict(zip(model, models, strict=True)), dict(zip(inputs, measured, strict=True)))
    job.notes(evaluation.warnings, "warning: ")
    job.notes(evaluation.notes)
    for path, one in zip(model, models, strict=True):
        # a static model holds the record that it was fitted to; of an extended one the history tells
        if one.extensions and store.is_made_from(path, inputs[0]):
            job.notes([f"{path} was made with {inputs[0]}: only another run shows how good it is"])
    job.screen.result(
        evaluated(evaluation)
        | {"output": out, "html": html, "bounds_checked": len(limits), "breaches": plain(broken)},
        failed,
    )
    show_tables(job.screen, evaluation)
    job.wrote(out, html)
    job.screen.end(failed)
    if limits:
        hold = "the one bound" if len(limits) == 1 else f"all {len(limits)} bounds"
        job.screen.whole(f"{hold} of {bounds} {'holds' if len(limits) == 1 else 'hold'}")


def _of_session(job: Job, path: Path, session: pt.Session, html: Path | None, *, alone: bool) -> None:
    from pulsetrainer.cli.score import say_stored
    from pulsetrainer.errors import DataError, UsageError

    if not alone:
        raise UsageError(
            f"{path} is a session, which keeps its own errors: it has no models, no bounds and no evaluation",
            hint=f"pulsetrainer evaluate {path} --html sheet.html",
        )
    if not session.beats.start_s.size:
        raise DataError(
            f"{path} has no whole beat: {session.fault or 'it ended before the first was over'}",
            hint="press it again: pulsetrainer session",
        )
    say_stored(job, path, html, session)


def show_tables(screen: Screen, evaluation: pt.Evaluation) -> None:
    """Print the figures of an evaluation beside those of the published device."""
    from pulsetrainer.artefacts.evaluation import PUBLISHED
    from pulsetrainer.report.results import full_force, worse
    from pulsetrainer.report.text import tables_of

    screen.parts(tables_of(evaluation, screen.width))
    if said := full_force(evaluation):
        screen.line("full force: ", said)
    if any("#" in w.inversion for w in evaluation.told_apart().waveforms):
        screen.line("#2: ", "the second playback of that pulse and inversion, in the order given")
    if len(evaluation.models) > 1:
        screen.line("improvement: ", "how much less rms error than by the first model")
    for said in worse(evaluation):
        screen.line("worse: ", said)
    if any(w.name in PUBLISHED for w in evaluation.waveforms):
        screen.line("published: ", "the device of Carneiro, Abreu, Restivo, Sensors 2018, 18(5), 1631")
