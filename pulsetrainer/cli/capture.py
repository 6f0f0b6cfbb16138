"""``pulsetrainer capture``: play an excitation and record."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pulsetrainer.cli.console import picked
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import (
    AsJson,
    DryRun,
    LimitCurrent,
    LimitForce,
    Out,
    Overwrite,
    Port,
    ShowLive,
    setting,
)

if TYPE_CHECKING:
    from pulsetrainer.core.course import Course
    from pulsetrainer.device.device import Device
    from pulsetrainer.files.resume import Earlier
    from pulsetrainer.steps.recording import Watch


def capture(
    context: typer.Context,
    signal: Annotated[
        str,
        typer.Argument(help="identification, diagnostic, or a CSV file with the columns t_s and current_A."),
    ],
    out: Out,
    port: Port = None,
    levels: Annotated[
        int, setting("levels", "--levels", "Levels whose cells the signal shall switch.", min=2)
    ] = 48,
    current_max_A: Annotated[float, setting("current_max_A", "--current-max", "Top of the range, A.")] = 1.5,
    speed_A_per_s: Annotated[
        float, setting("speed_A_per_s", "--speed", "Speed of the identification signal, A/s.")
    ] = 0.75,
    rate_Hz: Annotated[float, setting("rate_Hz", "--rate", "Samples a second, Hz.")] = 1000.0,
    condition: Annotated[bool, typer.Option(help="Go around the major loop once before recording.")] = True,
    repeats: Annotated[int, typer.Option(min=1, help="How often the signal is played, without a pause.")] = 1,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted recording into this output.")
    ] = False,
    limit_current_A: LimitCurrent = None,
    limit_force_N: LimitForce = None,
    live: ShowLive = False,
    dry_run: DryRun = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Play a signal on the device and record current and force.

    Example: pulsetrainer capture identification -o run.h5
    """
    from pulsetrainer.files.input_file import check_resumable
    from pulsetrainer.files.signal_table import read_signal, signal_file
    from pulsetrainer.steps.asked import EXCITATIONS

    table = signal_file(signal, EXCITATIONS)
    job = Job(context, outputs=() if resume else (out,), overwrite=overwrite, as_json=json)
    if resume:
        check_resumable(out)
    from pulsetrainer.artefacts import Run
    from pulsetrainer.core.course import Course
    from pulsetrainer.device.limits import Limits
    from pulsetrainer.files.resume import earlier_of
    from pulsetrainer.steps.capture import excitation, plan
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
    limits = Limits(limit_current_A, limit_force_N)
    course, earlier, at = Course(played, repeats), None, 0
    if resume:
        earlier = earlier_of(out, {name: context.params[name] for name in _SAME}, overwrite=overwrite)
    else:
        job.left_over(out, Run, "an interrupted capture: continue it with --resume, or delete it")
    with contextlib.nullcontext() if earlier is None else contextlib.closing(earlier):
        if earlier is not None:
            at = samples_played(earlier.run, course)
        if dry_run:
            job.check_device(port, limits)
            planned = plan(played, levels=levels, condition=condition, repeats=repeats, limits=limits, at=at)
            length = f"{planned.seconds - planned.conditioning_s:.1f} s"
            if condition:
                length += f", after {planned.conditioning_s:.1f} s around the major loop"
            rows = {
                "length": length,
                "samples": f"{planned.samples}, {planned.rate_Hz:g} a second",
                "reversals": planned.reversals,
                "cells switched": f"{planned.coverage_percent:.1f} %",
            }
            if limit_force_N is not None:
                rows["force"] = f"known once it is measured; above {limit_force_N:g} N the device stops"
            does = (
                f"continue {played.name} at {100 * at / course.size:.0f} %" if at else f"play {played.name}"
            )
            job.would(does, planned, port, out, rows)
            return
        view = job.view(float(played.value.max()), live=live)
        with job.working(f"capturing {signal}", view) as progress, job.open_device(port, limits) as device:
            payload = _record(
                job, out, course, device, earlier, at,
                condition=condition, levels=levels, progress=progress, watch=view.take if view else None,
            )  # fmt: skip
    _show(job, payload)


# what must be the same when a capture is resumed
_SAME = ("signal", "levels", "current_max_A", "speed_A_per_s", "rate_Hz", "condition", "repeats")


def _record(
    job: Job,
    out: Path,
    course: Course,
    device: Device,
    earlier: Earlier | None,
    at: int,
    *,
    condition: bool,
    levels: int,
    progress: Callable[[float], None],
    watch: Watch | None,
) -> dict[str, Any]:
    """Record into the file, or go on with one that was cut off, and return the figures."""
    from pulsetrainer.errors import DeviceError, Interrupted
    from pulsetrainer.files.recorder import RunRecorder
    from pulsetrainer.steps.capture import tally_of
    from pulsetrainer.steps.recording import decimation_for, record
    from pulsetrainer.steps.stopped import raise_if_stopped

    info, signal = device.info, course.signal
    decimation_for(info.tick_rate_Hz, signal.rate_Hz)  # before anything is written
    tally = tally_of(signal, levels)
    if earlier is not None:
        earlier.check_device(info.serial)
        job.uses(earlier.path)
        share = 100.0 * at / course.size
        job.notes(
            [f"continuing {earlier.path} after {earlier.run.input.size} samples, {share:.0f} % of the signal"]
        )
        tally.take_over(earlier.run)
    header = job.header(
        f"{signal.name} on {info.serial}",
        device=job.device(info),
        ancestors=[] if earlier is None else [earlier.header],
    )
    recorder = RunRecorder(
        out,
        header,
        signal=signal.name,
        overwrite=job.overwrite or (earlier is not None and earlier.contains_final),
        earlier=None if earlier is None else (earlier.path, earlier.run),
    )
    try:
        with recorder:
            ending = record(
                course, device, recorder, tally,
                at=at, condition_first=condition, progress=progress, watch=watch,
            )  # fmt: skip
            recorder.coil = ending.coil
            recorder.finish(complete=ending.complete)
        raise_if_stopped(ending.fault, ending.remedy, "the capture")
    except (DeviceError, Interrupted, KeyboardInterrupt) as stopped:
        error = Interrupted("stopped by you") if isinstance(stopped, KeyboardInterrupt) else stopped
        if recorder.samples:
            where = recorder.partial if recorder.partial.exists() else out
            error.message += f"; {recorder.samples} samples were kept in {where} (complete=false)"
            error.hint = error.hint or "go on with the same command and --resume"
        raise error from stopped.__cause__
    return {
        "output": out,
        "signal": signal.name,
        "samples": recorder.samples,
        "seconds": recorder.end_s,
        "rate_Hz": signal.rate_Hz,
        "reversals": course.reversals,
        "parts": ending.parts + (0 if earlier is None else len(earlier.run.parts())),
        "coverage_percent": tally.coverage_percent,
        "current_range_A": tally.current_A,
        "force_range_N": tally.force_N,
        "dropped_samples": recorder.dropped_samples,
        "complete": ending.complete,
        **picked(info, "serial", "firmware"),
    }


def _show(job: Job, got: dict[str, Any]) -> None:
    if got["dropped_samples"]:
        job.notes([f"{got['dropped_samples']} samples were lost on the wire; the rest is right"])
    job.screen.result(got)
    current, force = got["current_range_A"], got["force_range_N"]
    job.screen.facts(
        f"{got['output']}: {got['signal']} on {got['serial']}, firmware {got['firmware']}",
        {
            "samples": f"{got['samples']} in {got['seconds']:.1f} s, {got['rate_Hz']:g} a second",
            "current": f"{current[0]:.3f} .. {current[1]:.3f} A",
            "force": f"{force[0]:.3f} .. {force[1]:.3f} N",
            "reversals": got["reversals"],
            **({"parts": got["parts"]} if got["parts"] > 1 else {}),
            "cells switched": f"{got['coverage_percent']:.1f} %",
        },
    )
