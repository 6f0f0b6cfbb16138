"""``pulsetrainer check``: say whether a model is still true of its device, and what moved."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.console import plain
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, LimitCurrent, LimitForce, Overwrite, Port

if TYPE_CHECKING:
    from pulsetrainer.steps.check import Checked, Estimate

_VERDICTS = {
    "true": "still true",
    "shifted": "shifted (zero, gain or temperature)",
    "changed": "changed (the hysteresis has another shape)",
}


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
            "--update, which writes the updated model, and -o, which names its file, need each other",
            hint="give both, or neither",
        )
    job = Job(context, inputs=(model,), outputs=(out,))
    from pulsetrainer.steps.check import check_updatable, hindrance, updated

    loaded = job.load(model, pt.Model)
    if update:
        check_updatable(loaded)
    with job.working(f"checking {model.name}") as progress, job.open_device() as device:
        found = pt.check(loaded, device, progress=progress)
        info = device.info
    if out is not None:
        job.save(out, updated(loaded, found), f"{model.name} as {info.serial} is now", info)
    _show(job, model, out, found, info.serial, updatable=not hindrance(loaded))


def _show(job: Job, model: Path, out: Path | None, found: Checked, serial: str, *, updatable: bool) -> None:
    from pulsetrainer.steps import check as limits

    kelvin, error = found.temperature_K, found.error_percent
    unknown = f"not known: {found.temperature_unknown}"
    rows = {
        "offset": _said(found.offset, "N", 3) + f"; {limits.OFFSET_N:g} N either way is still true",
        "gain": _said(found.gain, "", 4) + f"; {limits.GAIN:g} either way is still true",
        "shape": _said(found.shape_percent, "% of the span", 2),
        "temperature": unknown if kelvin is None else _said(kelvin, "K against calibration", 1),
        "error": f"{error.before:.2f} % of the span, {error.after:.2f} % with this offset and gain",
        **{f"reason {number}": reason for number, reason in enumerate(found.reasons, 1)},
    }
    if out is not None:
        rows["next"] = (
            f"use {out} in the place of {model}, and invert drives again with it"
            if found.verdict == "shifted"
            else f"go on with {model}: nothing moved more than on a device left alone, {out} is no better"
        )
    elif found.verdict == "shifted" and updatable:
        rows["next"] = f"pulsetrainer check {shlex.quote(str(model))} --update -o updated.h5"
        if job.port:
            rows["next"] += f" --port {shlex.quote(job.port)}"
    elif found.verdict == "changed" or (found.verdict == "shifted" and not updatable):
        rows["next"] = "identify again: pulsetrainer capture identification, then pulsetrainer identify"
    job.show(plain(found) | {"output": out}, f"{model} on {serial}: {_VERDICTS[found.verdict]}", rows)
    job.wrote(out)


def _said(estimate: Estimate, unit: str, digits: int) -> str:
    low, high = estimate.interval
    return f"{estimate.value:.{digits}f} {unit}".rstrip() + f" ({low:.{digits}f} to {high:.{digits}f})"
