"""``pulsetrainer tune``: measure the coil and set the gains of its current loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Context, Option

import pulsetrainer as pt
from pulsetrainer.cli.console import plain
from pulsetrainer.cli.job import Job
from pulsetrainer.cli.options import AsJson, DryRun, LimitCurrent, LimitForce, Overwrite, Port, positive
from pulsetrainer.cli.outputs import check_ending

if TYPE_CHECKING:
    from pulsetrainer.steps.tune import Tuned

_FOLLOWED = ("normal", "bifid")  # where no drive is given


def tune(
    context: Context,
    port: Port = None,
    out: Annotated[
        Path | None,
        Option("-o", "--out", help="File of settings to write the gains into, such as pulsetrainer.toml."),
    ] = None,
    supply_V: Annotated[
        float | None,
        Option(
            "--supply",
            callback=positive,
            help="Voltage of the supply, V, if you have measured it; default: from the diode's 0.6 V.",
        ),
    ] = None,
    drive: Annotated[
        list[Path],
        Option(
            help="File of a drive that the coil must follow, made by invert; may be given again. "
            "Default: two pulses of the library."
        ),
    ] = [],  # noqa: B006
    limit_current_A: LimitCurrent = None,
    limit_force_N: LimitForce = None,
    dry_run: DryRun = False,
    overwrite: Overwrite = False,
    json: AsJson = False,
) -> None:
    """Measure the coil and set the gains of its current loop.

    Keep fingers off the device meanwhile. The gains go into the file of settings, under the device's serial
    number, where the other commands find them. --overwrite replaces what an earlier tuning of that device
    wrote; the rest of the file stays.

    Example: pulsetrainer tune -o pulsetrainer.toml
    """
    from pulsetrainer.files.atomic_write import check_output

    if out is not None:
        check_ending(out, context)
        check_output(out, overwrite=True)
    job = Job(context, inputs=drive)
    from pulsetrainer.files.tuning import check_tuned, write_tuned

    drives = [job.load(path, pt.Waveform) for path in drive]
    if dry_run:
        _would(job, drives, supply_V, out, overwrite=overwrite)
        return
    with job.working("tuning") as progress, pt.open_device(port, limits=job.limits) as device:
        if out is not None:
            check_tuned(out, device.info.serial, overwrite=overwrite)
        found = pt.tune(device, pulses=drives or _FOLLOWED, supply_V=supply_V, progress=progress)
    if out is not None:
        measured = {"resistance_ohm": found.resistance_ohm, "inductance_H": found.inductance_H}
        write_tuned(out, found.serial, measured | found.gains.values(), overwrite=overwrite)
    _show(job, out, found, supply_V)


def _would(
    job: Job, drives: list[pt.Waveform], supply_V: float | None, out: Path | None, *, overwrite: bool
) -> None:
    from pulsetrainer.api import check_device
    from pulsetrainer.device.opening import DEFAULT_PORT
    from pulsetrainer.files.pulses import read_pulse
    from pulsetrainer.files.tuning import check_tuned, read_tuned
    from pulsetrainer.report.planned import to_be_tuned
    from pulsetrainer.simulation.options import serial_of
    from pulsetrainer.steps.tune import plan

    check_device(job.port, limits=job.limits)
    serial = serial_of(job.port or DEFAULT_PORT)
    if out is not None and out.exists():
        known = ", ".join(read_tuned(out))
        if serial:
            check_tuned(out, serial, overwrite=overwrite)
        elif known and not overwrite:
            job.notes([f"{out} has gains for {known}: a device of that serial needs --overwrite"])
    planned = plan(drives or list(map(read_pulse, _FOLLOWED)), supply_V=supply_V, limits=job.limits)
    job.would("tune the device", planned, to_be_tuned(planned))


def _show(job: Job, out: Path | None, found: Tuned, supply_V: float | None) -> None:
    from pulsetrainer.device.codes import PARAMETER
    from pulsetrainer.report.results import tuned

    job.notes(found.notes)
    if out is None:
        job.notes(["the loop gains are not kept: give -o pulsetrainer.toml to write them down"])
    gains = {name: f"{value} {PARAMETER[name].unit}" for name, value in found.gains.values().items()}
    supply = "by the diode" if supply_V is None else "as given"
    job.show(plain(found) | {"output": out}, *tuned(out, found, gains, supply=supply))
