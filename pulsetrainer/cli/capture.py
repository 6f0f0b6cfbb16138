"""``pulsetrainer capture``: play an excitation and record."""

from __future__ import annotations

import contextlib
from typing import Annotated

from typer import Argument, Context, Option

from pulsetrainer.cli import options
from pulsetrainer.cli.job import Job
from pulsetrainer.errors import UsageError

# what must be the same when a capture is resumed
_SAME = ("signal", "levels", "current_max_A", "speed_A_per_s", "rate_Hz", "condition", "repeats")


def capture(
    context: Context,
    signal: Annotated[
        str, Argument(help="identification, diagnostic, or a CSV file with the columns t_s and current_A.")
    ],
    out: options.Out,
    port: options.Port = None,
    levels: Annotated[
        int,
        options.setting(
            "levels", "--levels", "Levels of the plane whose cells the signal switches.", min=2, max=10_000
        ),
    ] = 48,
    current_max_A: Annotated[
        float, options.setting("current_max_A", "--current-max", "Top of the range, A.")
    ] = 1.5,
    speed_A_per_s: Annotated[
        float, options.setting("speed_A_per_s", "--speed", "Speed of the identification signal, A/s.")
    ] = 0.75,
    rate_Hz: Annotated[float, options.setting("rate_Hz", "--rate", "Sample rate, Hz.")] = 1000.0,
    condition: Annotated[bool, Option(help="Go around the major loop once before recording.")] = True,
    repeats: Annotated[int, Option(min=1, help="How often the signal is played, without a pause.")] = 1,
    resume: Annotated[
        bool, Option("--resume", help="Continue an interrupted recording into this output.")
    ] = False,
    limit_current_A: options.LimitCurrent = None,
    limit_force_N: options.LimitForce = None,
    live: options.ShowLive = False,
    dry_run: options.DryRun = False,
    overwrite: options.Overwrite = False,
    json: options.AsJson = False,
) -> None:
    """Play a signal on the device and record current and force.

    Example: pulsetrainer capture identification -o run.h5
    """
    from pulsetrainer.files.input_file import check_resumable
    from pulsetrainer.files.signal_table import read_signal, signal_file
    from pulsetrainer.steps.arguments import EXCITATIONS

    table = signal_file(signal, EXCITATIONS)
    job = Job(context, outputs=() if resume else (out,))
    if resume:
        check_resumable(out)
    from pulsetrainer.artefacts import Run
    from pulsetrainer.artefacts.units import counted
    from pulsetrainer.core.course import Course
    from pulsetrainer.steps.capture import excitation, plan, remarks
    from pulsetrainer.steps.recording import samples_played

    played = excitation(
        signal if table is None else read_signal(table, rate_Hz),
        levels=levels,
        current_max_A=current_max_A,
        speed_A_per_s=speed_A_per_s,
        rate_Hz=rate_Hz,
    )
    if table is not None:
        job.uses(table)
    told = _of_options(context, signal, float(played.value.max()), own=table is None)
    job.notes([*([played.note] if played.note else []), *told, *remarks(played, levels)])
    course, earlier, at = Course(played, repeats), None, 0
    if resume:
        from pulsetrainer.files.resume import earlier_of

        earlier = earlier_of(out, {name: context.params[name] for name in _SAME}, overwrite=overwrite)
    else:
        job.left_over(out, Run, "an interrupted capture: continue it with --resume, or delete it")
    with contextlib.nullcontext() if earlier is None else contextlib.closing(earlier):
        if earlier is not None:
            at = samples_played(earlier.run, course)
        if dry_run:
            from pulsetrainer.report.planned import to_be_captured

            job.check_device()
            planned = plan(
                played, levels=levels, condition=condition, repeats=repeats, limits=job.limits, at=at
            )
            share = 100 * at / course.size
            does = f"continue {played.name} at {share:.0f} %" if at else f"play {played.name}"
            job.would(does, planned, to_be_captured(planned, limit_force_N))
            return
        view = job.view(float(played.value.max()), live=live)
        with job.working(f"capturing {signal}", view) as progress, job.open_device() as device:
            from pulsetrainer.recorded import capture_into  # a port that is none waits for no HDF5

            info, ancestors = device.info, []
            if earlier is not None:
                earlier.check_device(info.serial)
                job.uses(earlier.path)
                ancestors, share = [earlier.header], 100.0 * at / course.size
                done = f"{counted(earlier.run.input.size, 'sample')}, {share:.0f} % of the signal"
                job.notes([f"continuing {earlier.path} after {done}"])
            got = capture_into(
                out, job.header(f"{played.name} on {info.serial}", info, ancestors=ancestors), course, device,
                earlier=earlier, at=at, overwrite=overwrite, condition=condition, levels=levels,
                progress=progress, watch=view.take if view else None,
            )  # fmt: skip
    if got.dropped_samples:
        lost = counted(got.dropped_samples, "sample", "was", "were")
        job.notes([f"{lost} lost on the wire; the rest is right"])
    from pulsetrainer.report.results import captured

    job.show(*captured(out, played.name, got, info))


def _of_options(context: Context, signal: str, top_A: float, *, own: bool) -> list[str]:
    """Return what is told of options that do not suit the signal, or UsageError; ``own``: it is no table."""
    asked, by_us, told = context.params, signal == "identification", []
    for option, name, counts in (
        ("--levels", "levels", by_us),
        ("--speed", "speed_A_per_s", by_us),
        ("--current-max", "current_max_A", own),
    ):
        source = context.get_parameter_source(name)
        if counts or source is None or source.name != "COMMANDLINE":
            continue
        if name == "current_max_A" and top_A > asked[name]:
            raise UsageError(
                f"{signal} goes up to {top_A:.4g} A, more than --current-max {asked[name]:g}",
                hint="scale the table, or leave --current-max out",
            )
        but = " but for the count of cells" * (name == "levels")
        told.append(f"{option} does not count here{but}: the signal {signal} has its own")
    return told
