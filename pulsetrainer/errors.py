"""One family of errors, each with its exit code and a next step.

Every message says what happened, where (file, dataset, port, argument), what was
expected and what was got; ``hint`` says what to do next. Only ``cli`` turns an
error into an exit.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Final

UPDATE: Final = "update pulsetrainer in the folder that it came in (git pull, then make install)"
TRY: Final = "try: "  # the note with which a traceback shows a hint begins so


class PulsetrainerError(Exception):
    """Base of the family: a message for a person, a hint, an exit code, a stable kind for scripts.

    ``kept`` is the artefact that a play had recorded when it was stopped, None where there is none.
    """

    exit_code = 70
    kind = "bug"

    def __init__(self, message: str, *, hint: str = "", kept: object = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.kept = kept
        if hint:  # for Python; the command line words it anew
            self.add_note(f"{TRY}{hint}")


class QualityError(PulsetrainerError):
    """A quality gate failed: the work was done, its result is not good enough."""

    exit_code = 1
    kind = "quality"


class UsageError(PulsetrainerError):
    """The command line does not make sense, or would overwrite a file."""

    exit_code = 2
    kind = "usage"


class ExistsError(UsageError):
    """The output is there already, and nobody said that it may be overwritten."""

    usual: ClassVar[str] = "give overwrite=True, or name another file"

    def __init__(self, path: Path | str, message: str = "", *, hint: str = usual) -> None:
        super().__init__(message or f"the output {path} already exists", hint=hint)
        self.path = Path(path)


class EndingError(UsageError):
    """The name of an output promises another format than it gets, or none; the hint has a better one."""

    def __init__(self, path: Path, what: str, ending: str, *, usual: str = "out", then: str = "") -> None:
        without = "has no name before its ending" if path.name.startswith(".") else "has no such ending"
        got = f"ends in {path.suffix.lower()!r}" if path.suffix else without
        got = "is standard output" if path.name == "-" else got
        other = path.parent / f"{path.stem.removesuffix(ending).strip('-. ') or usual}{ending}"
        super().__init__(f"{what}, but {path} {got}", hint=f"name it {shlex.quote(str(other))}{then}")


class DataError(PulsetrainerError):
    """A file, an artefact or the numbers in it cannot be used."""

    exit_code = 3
    kind = "data"


class AbsentError(DataError):
    """A file that is to be read is not there."""

    def __init__(self, path: Path | str, *, hint: str) -> None:
        super().__init__(f"{path} does not exist", hint=hint)
        self.path = Path(path)


class WrongKindError(DataError):
    """A file holds another kind of artefact than is wanted here."""

    def __init__(self, path: Path | str, expected: Sequence[str], found: str) -> None:
        *others, last = map(_with_article, expected)
        wanted = f"{', '.join(others)} or {last}" if others else last
        super().__init__(
            f"{path}: expected {wanted}, got {_with_article(found)}", hint=f"give {wanted} instead"
        )
        self.path = Path(path)
        self.expected = tuple(expected)
        self.found = found


class DamagedFileError(DataError):
    """A file of ours that cannot be read; ``artefact`` is its kind, empty where nobody can tell."""

    def __init__(self, message: str, *, path: Path | str, artefact: str = "") -> None:
        super().__init__(message, hint="restore it from a copy, or make it again")
        self.path = Path(path)
        self.artefact = artefact


class NotAnArtefactError(DataError):
    """A file that this program did not write; ``foreign``: an HDF5 file, which cannot be imported either."""

    foreign_hint: ClassVar[str] = (
        "export it as CSV with the program that wrote it, and import that: "
        "pulsetrainer import FILE.csv --input COLUMN --output COLUMN -o run.h5"
    )

    def __init__(self, message: str, *, path: Path | str, foreign: bool = False) -> None:
        own = "give a file that pulsetrainer wrote; of a table: "
        own += f"pt.read_table({str(path)!r}, input=..., output=...)"
        super().__init__(message, hint=self.foreign_hint if foreign else own)
        self.foreign = foreign
        self.path = Path(path)


class ArgumentError(DataError, ValueError):
    """A number or array handed to the core has the wrong shape or value; also a ``ValueError``."""

    kind = "argument"


class DeviceError(PulsetrainerError):
    """The device, its port or its firmware did not do what was asked."""

    exit_code = 4
    kind = "device"


class ConvergenceError(PulsetrainerError):
    """An iteration ended before its stopping rule was met."""

    exit_code = 5
    kind = "not-converged"


class Interrupted(PulsetrainerError):  # noqa: N818 - the user's wish, not a fault
    """The user pressed Ctrl-C; the output was stopped and what was recorded was kept."""

    exit_code = 130
    kind = "interrupted"


def in_words(kinds: Sequence[str]) -> str:
    """Return kinds of artefacts as a person calls them: a file with a waveform in it is a drive."""
    return " or ".join("drive" if kind == "waveform" else kind for kind in kinds)


def _with_article(kind: str) -> str:
    return f"{'an' if kind[:1] in 'aeiou' else 'a'} {in_words([kind])}"
