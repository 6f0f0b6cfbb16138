"""``pulsetrainer invert``: from a pulse to the current that presses it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Out, Overwrite, setting


def invert(
    context: Context,
    waveform: Annotated[str, Argument(help="A name of the library (normal, bifid, ...) or a CSV file.")],
    model: Annotated[Path, Option(help="Model to invert.")],
    out: Out,
    method: Annotated[
        Literal["continuous", "closest-match", "extended"] | None,
        Option(
            help="continuous (default), closest-match as in the paper, or extended (default of an extended "
            "model)."
        ),
    ] = None,
    force_min: Annotated[
        float | None,
        Option(help="Force at the foot of the pulse, N or the output's unit; default: the lowest."),
    ] = None,
    force_max: Annotated[
        float | None,
        Option(help="Force at the top of the pulse, N or the output's unit; default: the model's highest."),
    ] = None,
    beat: Annotated[
        str | None,
        Option(
            metavar="N|mean",
            help="Beat of a recorded pulse: its number from 1, or mean. "
            "Default: the whole record is one period.",
        ),
    ] = None,
    periods: Annotated[
        int, setting("periods", "--periods", "Periods to play; of several the first is not scored.", min=1)
    ] = 4,
    slew_A_per_s: Annotated[
        float | None,
        setting(
            "slew_A_per_s",
            "--slew",
            "Fastest that the drive may move, A/s or input units a second; default: 30 for a model of our "
            "own device, none for any other.",
        ),
    ] = None,
    learnt: Annotated[
        Path | None,
        Option(help="Another pulse, refined with this model, whose corrections are used here too."),
    ] = None,
    despite_warning: Annotated[
        bool, Option("--despite-warning", help="Invert a model even if it does not describe its own record.")
    ] = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Find the drive that presses a pulse.

    Writes the compensated drive and, for comparison, the merely scaled one with the same extremes.

    With --learnt it also uses what was learnt by refining another pulse.

    Example: pulsetrainer invert normal --model model.h5 -o drive.h5
    """
    from pulsetrainer.files.pulses import pulse_file, read_pulse
    from pulsetrainer.steps.arguments import check_beat, check_force_range

    pulse = pulse_file(waveform)
    job = Job(context, inputs=(model, learnt), outputs=(out,))
    check_beat(beat)
    check_force_range(force_min, force_max)
    from pulsetrainer.steps.invert import invert as inverse_of
    from pulsetrainer.steps.transfer import check_refined

    with job.working(f"inverting {waveform}") as progress:
        source = job.load(model, pt.Model)
        refined = None if learnt is None else job.load(learnt, pt.Waveform)
        if refined is not None:
            check_refined(refined)
        drive = inverse_of(
            read_pulse(waveform),
            source,
            method=method,
            force_min=force_min,
            force_max=force_max,
            beat=beat,
            periods=periods,
            slew=slew_A_per_s,
            despite_warning=despite_warning,
            name=str(model),
            progress=progress,
        )
        if refined is not None:
            names = (str(learnt), str(model))
            drive = pt.transfer(drive, refined, slew=slew_A_per_s, names=names)
        from pulsetrainer.report.results import drive_title, inverted

        if pulse == Path(waveform):  # a file of the user's, wherever it lies
            job.uses(pulse)
        job.save(out, drive, drive_title(drive))
    job.notes(drive.notes)
    job.notes(drive.warnings, "warning: ")
    job.show(*inverted(out, drive))
