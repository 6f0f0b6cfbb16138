"""``pulsetrainer check``: say whether a model is still true of its device, and what moved."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.console import plain
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, LimitCurrent, LimitForce, Overwrite, Port


def check(
    context: Context,
    model: Annotated[Path, Argument(help="Model of the device.", metavar="MODEL.h5")],
    port: Port = None,
    update: Annotated[
        bool, Option("--update", help="Write a model with the present offset and gain; needs -o.")
    ] = False,
    out: Annotated[Path | None, Option("-o", "--out", help="File to write, with --update.")] = None,
    limit_current_A: LimitCurrent = None,
    limit_force_N: LimitForce = None,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Check in ten seconds whether a model still describes its device.

    It measures on the model's own device, with the force sensor in place.

    The verdict is true, shifted (offset, gain or temperature) or changed (the shape: identify again).

    Example: pulsetrainer check model.h5 --update -o updated.h5
    """
    from pulsetrainer.errors import UsageError

    if update != (out is not None):
        raise UsageError(
            "--update, which writes the updated model, and -o, which names its file, must be given together",
            hint="give both, or neither",
        )
    job = Job(context, inputs=(model,), outputs=(out,))
    from pulsetrainer.report.results import checked
    from pulsetrainer.steps.check import AGAIN, GAIN, OFFSET_N, check_updatable, hindrance, updated

    loaded = job.load(model, pt.Model)
    if update:
        check_updatable(loaded)
    with job.working(f"checking {model.name}") as progress, job.open_device() as device:
        found = pt.check(loaded, device, progress=progress)
        info = device.info
    if out is not None:
        job.save(out, updated(loaded, found), f"{model.name} as {info.serial} is now", info)
    title, rows = checked(found, limit_N=OFFSET_N, limit_gain=GAIN)
    if out is not None:
        rows["next"] = (
            f"use {out} in the place of {model}, and invert drives again with it"
            if found.verdict == "shifted"
            else f"go on with {model}: nothing moved more than on a device left alone, {out} is no better"
        )
    elif found.verdict == "shifted" and not hindrance(loaded):
        rows["next"] = f"pulsetrainer check {shlex.quote(str(model))} --update -o updated.h5"
        if job.port:
            rows["next"] += f" --port {shlex.quote(job.port)}"
    elif found.verdict != "true":
        rows["next"] = AGAIN
    job.show(plain(found) | {"output": out}, f"{model} on {info.serial}: {title}", rows)
    job.wrote(out)
