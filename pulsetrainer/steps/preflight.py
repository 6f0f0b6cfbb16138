"""What can be said about a command line before anything is loaded: names, inputs, outputs.

A command asks here before it loads its flow, which takes longer than finding a mistyped name; the flow
asks again, for those who call it without the command.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from pulsetrainer.errors import UsageError
from pulsetrainer.files.atomic_write import check_output
from pulsetrainer.files.input_file import check_artefact, check_file
from pulsetrainer.report.forms import FORMATS
from pulsetrainer.resources import waveforms_dir
from pulsetrainer.simulation.options import check_port

__all__ = [
    "check_beat",
    "check_files",
    "check_force_range",
    "check_port",
    "check_resumable",
    "comparison_form",
    "figure_form",
    "signal_file",
    "waveform_file",
]

EXCITATIONS = ("identification", "diagnostic")


def check_files(
    *,
    outputs: Iterable[Path | None] = (),
    force: bool = False,
    artefacts: Iterable[Path] = (),
    others: Iterable[Path | None] = (),
) -> None:
    """Refuse outputs that cannot be written, then inputs that are not there; None is no file.

    Raises
    ------
    UsageError
        An output exists and ``force`` is not set, or its folder is missing or not writable.
    DataError
        An input cannot be read, or one that must be an artefact is no HDF5 file.
    """
    for path in outputs:
        if path is not None:
            check_output(path, force)
    for path in artefacts:
        check_artefact(path)
    for path in others:
        if path is not None:
            check_file(path)


def check_resumable(path: Path) -> None:
    """Refuse to go on with a recording into ``path`` of which nothing is there.

    Raises
    ------
    UsageError
        Neither the output nor what a killed program leaves beside it is there.
    """
    if not path.exists() and not any(path.parent.glob(f"{path.name}.partial*")):
        raise UsageError(
            f"there is nothing to resume: neither {path} nor {path.name}.partial is there",
            hint="leave --resume out to record from the beginning",
        )


def signal_file(signal: str) -> Path | None:
    """Return the file that a signal is read from, None where it is an excitation.

    Raises
    ------
    UsageError
        The signal is neither an excitation nor a file.
    DataError
        It is a CSV file that cannot be read.
    """
    if signal in EXCITATIONS:
        return None
    path = Path(signal)
    if path.suffix.lower() != ".csv" and not path.exists():
        raise UsageError(
            f"there is no signal {signal!r}; known signals: {', '.join(EXCITATIONS)}, or a CSV file",
            hint="pulsetrainer capture identification -o run.h5",
        )
    check_file(path)
    return path


def library() -> dict[str, Path]:
    """Names and files of the pulse library."""
    return {path.stem: path for path in sorted(waveforms_dir().glob("*.csv"))}


def waveform_file(waveform: str) -> Path:
    """Return the file of a pulse shape of the library, or that is named.

    Raises
    ------
    UsageError
        It is neither in the library nor a file.
    DataError
        It is a CSV file that cannot be read.
    """
    known = library()
    path = known.get(waveform, Path(waveform))
    if waveform not in known and path.suffix.lower() != ".csv" and not path.exists():
        raise UsageError(
            f"there is no waveform {waveform!r}; the library has {', '.join(known)}",
            hint="name one of them, or a CSV file with the columns t_s and p",
        )
    check_file(path)
    return path


def check_beat(beat: str | None) -> None:
    """Refuse what is neither the number of a beat nor the mean; None is no choice.

    Raises
    ------
    UsageError
        It is something else.
    """
    if beat is not None and beat != "mean" and not (beat.isdecimal() and int(beat) > 0):
        raise UsageError(f"--beat must be a number from 1, or mean, got {beat!r}", hint="give --beat mean")


def check_force_range(low: float | None, high: float | None) -> None:
    """Refuse an empty range; None is an end that the model chooses.

    Raises
    ------
    UsageError
        The lower end is not below the upper one.
    """
    if low is not None and high is not None and not high > low:
        raise UsageError(
            f"the force range is empty: --force-min {low:g} is not below --force-max {high:g}",
            hint="swap or change the two",
        )


def figure_form(path: Path, what: str, *more: str) -> str:
    """Return the format that the name of a figure asks for; ``more`` are those that are no figures.

    Raises
    ------
    UsageError
        It is none that can be written.
    """
    form = path.suffix.lower().lstrip(".")
    if form not in (*FORMATS, *more):
        known = [*FORMATS, *more]
        raise UsageError(
            f"{what} is written as {', '.join(known[:-1])} or {known[-1]}, but {path} ends in {form!r}",
            hint=f"name it {path.parent / (path.stem or 'figure')}.png",
        )
    return form


def comparison_form(files: Sequence[Path], out: Path | None) -> str:
    """Return the format that a comparison is written in, empty where it is only shown.

    Raises
    ------
    UsageError
        There are fewer than two evaluations, or the format is none that can be written.
    """
    if len(files) < 2:
        raise UsageError(
            f"compare needs at least two evaluations, got {len(files)}",
            hint="pulsetrainer compare before.h5 after.h5",
        )
    return figure_form(out, "a comparison", "csv") if out is not None else ""
