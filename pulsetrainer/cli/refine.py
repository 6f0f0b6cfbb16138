"""``pulsetrainer refine``: learn a drive at the calibration stand, with the force sensor."""

from __future__ import annotations

from typing import Annotated

from typer import Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, Drive, DryRun, LimitCurrent, LimitForce, Out, Overwrite, Port


def refine(
    context: Context,
    drive: Drive,
    out: Out,
    port: Port = None,
    passes: Annotated[
        int, Option(min=1, help="Number of passes at most; the first one plays the drive as it is.")
    ] = 5,
    limit_current_A: LimitCurrent = None,
    limit_force_N: LimitForce = None,
    dry_run: DryRun = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Improve a drive on the device itself.

    The force sensor must be in place. Each pass plays the drive and corrects it by the force that was
    missed; the best pass is written.

    Example: pulsetrainer refine drive.h5 -o refined.h5
    """
    job = Job(context, inputs=(drive,), outputs=(out,))
    from pulsetrainer.errors import DeviceError, Interrupted, PulsetrainerError
    from pulsetrainer.report import planned, results
    from pulsetrainer.steps.refine import check, plan

    waveform = job.load(drive, pt.Waveform)
    check(waveform, passes)
    if dry_run:
        job.check_device()
        rehearsed = plan(waveform, passes=passes, limits=job.limits)
        rows = planned.to_be_refined(rehearsed, passes)
        job.would(f"refine {waveform.name}", rehearsed, rows, name=waveform.name, passes=passes)
        return
    stopped: PulsetrainerError | None = None
    with job.working(f"refining {drive.name}") as progress, job.open_device(waveform.model) as device:
        info = device.info
        try:
            refined = pt.refine(waveform, device, passes=passes, progress=progress)
        except (DeviceError, Interrupted) as error:
            if not isinstance(error.kept, pt.Waveform):
                if isinstance(error, DeviceError):
                    error.message += f"; {out} was not written"
                raise
            stopped, refined = error, error.kept
    job.save(out, refined, f"{refined.name} refined on {info.serial}", info)
    if stopped is not None:  # never in the first pass
        stopped.message += f"; the best of {len(refined.passes)} passes was kept in {out}"
        raise stopped
    job.notes(refined.notes[len(waveform.notes) :])
    job.show(*results.refined(out, refined, info))
