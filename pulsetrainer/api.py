"""The Python API: the verbs, and the few functions around them that know files, ports and the clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from inspect import signature
from pathlib import Path
from typing import Any, Literal, TypeVar

from numpy.typing import ArrayLike

import pulsetrainer.simulation  # noqa: F401 - announces the ports bench: and qemu:
from pulsetrainer.artefacts import Diagnosis, Evaluation, Model, Playback, Run, Session, Waveform
from pulsetrainer.core.plane import float_array
from pulsetrainer.core.pulses import Shape
from pulsetrainer.device import opening as _device
from pulsetrainer.device.device import Device
from pulsetrainer.device.gains import Gains
from pulsetrainer.device.limits import Limits, Rehearsal
from pulsetrainer.device.schemes import find_opener
from pulsetrainer.errors import ArgumentError, UsageError
from pulsetrainer.files import provenance, pulses, store
from pulsetrainer.files.output_name import check_artefact_name
from pulsetrainer.files.run_from_table import runs_from_tables
from pulsetrainer.files.tuning import read_tuned
from pulsetrainer.steps.arguments import several
from pulsetrainer.steps.import_ import import_parts
from pulsetrainer.steps.invert import invert as _invert
from pulsetrainer.steps.one_beat import shape_of
from pulsetrainer.steps.session import session as _session
from pulsetrainer.steps.tune import Tuned
from pulsetrainer.steps.tune import tune as _tune

F = TypeVar("F", bound=Callable[..., Any])
# a name in the library, a table, a drive, or times (s) and values
Pulse = str | Path | Waveform | Shape | tuple[ArrayLike, ArrayLike]


def load(path: Path | str) -> Any:
    """Return the artefact in a file: a Run, Model, Waveform, Playback, Evaluation, Diagnosis or Session.

    Raises
    ------
    DataError
        The file is absent, damaged, not an artefact, or of a newer format.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> pt.load("tests/data/files-0.1/model.h5").levels
    8
    """
    return store.read_any(path)


def save(
    artefact: Run | Model | Waveform | Playback | Evaluation | Diagnosis | Session,
    path: Path | str,
    *,
    overwrite: bool = False,
    title: str = "",
) -> None:
    """Write an artefact to a file: whole, or not at all.

    Raises
    ------
    ArgumentError
        It is not an artefact.
    UsageError
        The file exists and ``overwrite`` is not set, its folder is missing or not writable, or its name ends
        like a table or a figure.
    DataError
        The disk is full or failed.

    Examples
    --------
    >>> import pulsetrainer as pt, tempfile, pathlib
    >>> model = pt.load("tests/data/files-0.1/model.h5")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     pt.save(model, pathlib.Path(folder) / "copy.h5")
    """
    check_artefact_name(Path(path), "an artefact is saved as HDF5")
    header = provenance.make_header(
        title or f"{artefact.kind} saved from Python",
        program="Python",  # what was done there nobody can tell but whoever did it
        argv=("pulsetrainer.save", artefact.kind, str(path)),
        now=datetime.now(UTC),
        libraries=provenance.library_versions(),
    )
    store.write(path, artefact, header, overwrite=overwrite)


def open_device(
    port: str | None = None, *, limits: Limits | None = None, tuned: Path | str | None = None
) -> Device:
    """Open a device: ``bench:``, ``qemu:``, a serial port, ``socket://host:port``; None: the default.

    Use it as a context manager: leaving it stops and disarms the device, always. ``tuned`` is a file of
    settings; gains that `tune` wrote there under the device's serial number are set.

    Raises
    ------
    UsageError
        The text names no kind of port, or the file of settings cannot be used.
    DeviceError
        There is no such device, or it does not answer.
    ArgumentError
        A limit is not positive, or above the device's own.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> with pt.open_device("bench:") as device:
    ...     device.info.current_limit_A
    1.5
    """
    if port is not None and not port.strip():
        raise UsageError("`port` must name a port, got nothing", hint='the simulated device is "bench:"')
    known = _known_gains(tuned)
    device = _device.open_device(port, limits=limits)
    try:
        if device.info.serial in known:
            device.set_gains(known[device.info.serial])
    except BaseException:
        device.close()
        raise
    return device


def check_device(port: str | None, *, limits: Limits, tuned: Path | str | None = None) -> None:
    """Refuse what ``open_device`` would for a device as it is delivered, without touching a port.

    Raises as ``open_device``, as far as the texts tell; UsageError also where there is no such bench.
    """
    _known_gains(tuned)
    text = port or _device.DEFAULT_PORT
    find_opener(text)
    if text.startswith("bench:"):
        from pulsetrainer.simulation.bench import check_bench  # noqa: PLC0415 - what a bench alone needs

        check_bench(text)
    Rehearsal(limits)


def _known_gains(tuned: Path | str | None) -> dict[str, Gains]:
    entries = {} if tuned is None else read_tuned(tuned)
    try:
        return {serial: Gains.of(entry) for serial, entry in entries.items()}
    except ArgumentError as error:
        raise UsageError(f"{tuned}: {error.message}", hint=error.hint) from error


def _as(verb: Callable[..., Any]) -> Callable[[F], F]:
    """Give a function the docstring of the verb that it calls, and its parameters for ``**options``."""

    def told(function: F) -> F:
        own = signature(function)
        both = [own.parameters.get(name, one) for name, one in signature(verb).parameters.items()]
        documented: Any = function
        documented.__doc__, documented.__signature__ = verb.__doc__, own.replace(parameters=both)
        return function

    return told


@_as(_tune)
def tune(device: Device, *, pulses: Sequence[Pulse] = ("normal", "bifid"), **options: Any) -> Tuned:  # noqa: D103
    return _tune(
        device, pulses=[one if isinstance(one, Waveform) else _shape(one) for one in pulses], **options
    )


@_as(_invert)
def invert(pulse: Pulse, model: Model, **options: Any) -> Waveform:  # noqa: D103
    return _invert(_shape(pulse), model, **options)


@_as(_session)
def session(  # noqa: D103
    model: Model, device: Device, *, pulses: str | Shape | Sequence[Pulse] = "normal", **options: Any
) -> Session:
    return _session(model, device, pulses=[_shape(one) for one in several(pulses)], **options)


def read_table(
    paths: Path | str | Sequence[Path | str],
    *,
    input: str | None = None,  # noqa: A002 - the name of the run's field
    output: str | None = None,
    time: str | None = None,
    reference: str | None = None,
    input_unit: str | None = None,
    output_unit: str | None = None,
    rate_Hz: float | None = None,
    no_time: bool = False,
    resample: float | Literal["even"] | None = None,
    skip_bad_rows: bool = False,
) -> Run:
    """Return the run in a table from any bench: CSV and its relatives, .npz, .npy, .mat or .wav.

    Several files are parts of one run. How a text is laid out, its separator and decimal sign for instance,
    is recognised.

    Parameters
    ----------
    input, output, time, reference
        Names of columns. The first two are needed; without a time it is the column that is named so, or the
        first one.
    input_unit, output_unit
        Where the headings do not say them.
    rate_Hz, no_time
        Instead of a column of time: samples per second, or only the order of the samples.
    resample
        Makes the time steps even: at a rate, Hz, or at the median step, "even".
    skip_bad_rows
        Leaves out rows with blank cells or text.

    Raises
    ------
    ArgumentError
        The column of the input or of the output is not named.
    UsageError
        Two options contradict each other, or there is no time to resample.
    DataError
        A file cannot be read, a column is missing or not finite, a unit is not known, or time does not
        increase: file, line and column are named.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> run = pt.read_table("tests/data/pneu_oring_3bar.csv", input="u", output="y", output_unit="N")
    >>> run.output.size, run.output_unit
    (7833, 'N')
    """
    files = several(paths)
    if not files:
        raise ArgumentError("read_table needs a file, got none", hint="give its name, such as 'a.csv'")
    if input is None or output is None:
        missing = [name for name, column in (("input", input), ("output", output)) if column is None]
        raise ArgumentError(
            f"read_table needs the name of a column for {' and for '.join(missing)}",
            hint=f'such as pt.read_table("{files[0]}", input="u", output="y")',
        )
    tables = runs_from_tables(
        files,
        input=input,
        output=output,
        time=time,
        reference=reference,
        input_unit=input_unit,
        output_unit=output_unit,
        rate_Hz=rate_Hz,
        no_time=no_time,
        skip_bad_rows=skip_bad_rows,
    )
    return import_parts([table.run for table in tables], resample=resample).run


def _shape(pulse: Pulse) -> Shape:
    if isinstance(pulse, Shape):
        return pulse
    if isinstance(pulse, Waveform):
        return shape_of(pulse)
    if isinstance(pulse, str | Path):
        return pulses.read_pulse(str(pulse))
    try:
        time_s, value = pulse
    except (TypeError, ValueError) as error:
        raise ArgumentError(
            f"a pulse must be a name, a file, a drive, or times and values, got a {type(pulse).__name__}",
            hint="give the two together: (time_s, value)",
        ) from error
    return Shape("pulse", float_array("time", time_s), float_array("value", value))
