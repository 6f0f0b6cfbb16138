"""``pulsetrainer play``: press a pulse and record the force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from typer import Context

import pulsetrainer as pt
from pulsetrainer.cli import options
from pulsetrainer.cli.job import Job

if TYPE_CHECKING:
    from pulsetrainer.artefacts import FloatArray
    from pulsetrainer.cli.loop_view import LoopView
    from pulsetrainer.core.plane import IntArray
    from pulsetrainer.steps.play import Watch


def play(
    context: Context,
    drive: options.Drive,
    out: options.Out,
    port: options.Port = None,
    repeats: Annotated[
        int, options.setting("repeats", "--repeats", "How often each of the two drives is played.", min=1)
    ] = 5,
    track_heat: options.TrackHeat = None,
    limit_current_A: options.LimitCurrent = None,
    limit_force_N: options.LimitForce = None,
    live: options.ShowLive = False,
    dry_run: options.DryRun = False,
    overwrite: options.Overwrite = False,
    json: options.AsJson = False,
) -> None:
    """Press a pulse and record the force.

    The compensated and the scaled current take turns.

    Example: pulsetrainer play drive.h5 -o played.h5
    """
    job = Job(context, inputs=(drive,), outputs=(out,))
    from pulsetrainer.errors import DeviceError, Interrupted, PulsetrainerError
    from pulsetrainer.report import planned, results
    from pulsetrainer.steps.play import plan

    waveform = job.load(drive, pt.Waveform)
    title = results.drive_title(waveform)
    if dry_run:
        job.check_device()
        rehearsed = plan(waveform, repeats=repeats, track_heat=track_heat, limits=job.limits)
        what = {"name": waveform.name, "inversion": waveform.inversion, "repeats": repeats}
        job.would(f"play {title}", rehearsed, planned.to_be_played(rehearsed, repeats), **what)
        return
    stopped: PulsetrainerError | None = None
    top = max(waveform.compensated.max(), waveform.scaled.max())
    view = job.view(1.05 * float(top), 1.1 * float(waveform.target.max()), live=live)  # a little room
    watch = _shown_by(view, waveform) if view else None
    with job.working(f"playing {drive.name}", view) as progress, job.open_device(waveform.model) as device:
        info = device.info
        try:
            played = pt.play(
                waveform, device, repeats=repeats, track_heat=track_heat, progress=progress, watch=watch
            )
        except PulsetrainerError as error:
            if not isinstance(error.kept, pt.Playback):
                if isinstance(error, DeviceError | Interrupted):
                    error.message += f"; {out} was not written"
                    error.hint = error.hint or "run the command again"
                raise
            stopped, played = error, error.kept
    whole = played.compensated.output.shape[0]
    job.save(out, played, f"{title}, played on {info.serial}", info)
    if stopped is not None:
        were = "was" if whole == 1 else "were"
        stopped.message += f"; {whole} of {repeats} repeats {were} kept in {out} (complete=false)"
        stopped.hint = stopped.hint or "evaluate what there is, or play all of it again with --overwrite"
        raise stopped
    if played.dropped_samples:
        from pulsetrainer.artefacts.units import counted

        lost = counted(played.dropped_samples, "sample", "was", "were")
        job.notes([f"{lost} lost on the wire, and left out of all errors"])
    job.show(*results.played(out, played, info.serial, info.firmware))


def _shown_by(view: LoopView, drive: pt.Waveform) -> Watch:
    """Return what shows a play on a live view: loop and error of each drive as they grow."""
    from pulsetrainer.steps.play import ErrorsSoFar

    errors = ErrorsSoFar(drive)

    def watch(name: str, repeat: int, place: IntArray, current: FloatArray, force: FloatArray) -> None:
        errors.add(name, place, force)
        view.figures = f"repeat {repeat}, {errors}"
        view.take(current, force)

    return watch
