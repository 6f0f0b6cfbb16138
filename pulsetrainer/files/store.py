"""Artefacts on disk: any kind into HDF5 and back, whole or not at all; a newer format is refused.

The file format: root attributes ``kind``, ``format_version``, ``title``, ``created``, ``history``,
``provenance`` (JSON), ``samples`` where the kind has a time axis; then the kind's fields as ``schema`` says.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from pulsetrainer.artefacts import KINDS
from pulsetrainer.errors import UPDATE, DamagedFileError, DataError, NotAnArtefactError, WrongKindError
from pulsetrainer.files.atomic_write import replacing
from pulsetrainer.files.checksum import append_checksum, is_as_written
from pulsetrainer.files.decode import Origin, decode, text_of
from pulsetrainer.files.encode import Later, encode, values_of
from pulsetrainer.files.input_file import check_artefact, is_journal, unreadable
from pulsetrainer.files.journal import Recording
from pulsetrainer.files.provenance import Header, Provenance, clean
from pulsetrainer.files.schema import TIME, plan_of
from pulsetrainer.files.unfailing_file import UnfailingFile
from pulsetrainer.version import __version__

FORMAT_VERSION = 1
# from 1.10 on a file can be read while it grows, and HDF5 keeps checksums of most of its own structures
LIBVER = ("v110", "v110")
_HDF5_ERRORS = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)

K = TypeVar("K")


def write(path: Path | str, artefact: Any, header: Header, *, overwrite: bool = False) -> None:
    """Write an artefact under its final name, or leave everything as it was.

    UsageError as ``check_output``; DataError where the artefact does not fit its own annotations, or the disk
    is full or failed.
    """
    write_fields(path, type(artefact), values_of(artefact), header, overwrite=overwrite)


def write_fields(
    path: Path | str,
    cls: type,
    values: Mapping[str, Any],
    header: Header,
    *,
    overwrite: bool,
    fill: Callable[[h5py.File], None] = lambda _file: None,
) -> None:
    """Write the fields of an artefact by name, as ``write``; ``fill`` writes those that are ``Later``."""
    with replacing(path, overwrite=overwrite) as temporary:
        try:
            with UnfailingFile(temporary) as stream:
                try:
                    with h5py.File(stream, "w", libver=LIBVER) as file:
                        _write_root(file, cls, header, samples=_samples(cls, values))
                        encode(file, cls, values)
                        fill(file)
                finally:
                    stream.check()  # also where HDF5 missed what had been dropped
        except DataError as error:
            raise DataError(f"{path} was not written: {error.message}", hint=error.hint) from error
        append_checksum(temporary)


def _samples(cls: type, values: Mapping[str, Any]) -> int | None:
    """Return the length of the root's time axis; None where the kind has none."""
    for plan in plan_of(cls):
        value = values[plan.name]
        if plan.dims[-1:] == (TIME,) and (isinstance(value, Later) or np.ndim(value)):
            return value.size if isinstance(value, Later) else int(np.shape(value)[-1])
    return None


def _write_root(file: h5py.File, cls: type[Any], header: Header, *, samples: int | None) -> None:
    texts = {
        "kind": cls.kind,
        "title": clean(header.title),
        "created": clean(header.created),
        "history": "\n".join(clean(line) for line in header.history),
        "provenance": header.provenance.to_json(),  # cleaned item by item when it was built
    }
    for name, text in texts.items():
        file.attrs[name] = text
    file.attrs["format_version"] = np.int64(FORMAT_VERSION)
    if samples is not None:
        file.attrs["samples"] = np.int64(samples)


def read(path: Path | str, kind: type[K]) -> K:
    """Read an artefact that must be of this kind.

    DataError where the file is absent, unreadable, damaged, of another kind, or of a newer format.
    """
    return read_one_of(path, kind)


def read_one_of(path: Path | str, *kinds: type[Any]) -> Any:
    """Read an artefact of any of these kinds; raises as ``read``."""
    expected = [kind.kind for kind in kinds]
    recording = _recording(path)
    if recording is not None:
        if type(recording.artefact) not in kinds:
            raise WrongKindError(path, expected, recording.artefact.kind)
        return recording.artefact
    with _opened(path) as file:
        got = _kind(file, path)
        if got not in expected:
            raise WrongKindError(path, expected, got)
        return decode(file, KINDS[got], Origin(str(path), got), samples=_samples_in(file, path))


def read_any(path: Path | str) -> Any:
    """Read an artefact of whatever kind it is.

    DataError where the file is absent, unreadable, damaged, not an artefact, or of a newer format.
    """
    return read_one_of(path, *KINDS.values())


def is_made_from(path: Path | str, source: Path | str) -> bool:
    """Tell whether the command that made ``source`` is one of those that led to ``path``."""
    return set(read_header(source).history[-1:]) <= set(read_header(path).history)


def read_header(path: Path | str) -> Header:
    """Read what an artefact says about itself; raises as ``read_any``."""
    if recording := _recording(path):
        return recording.header
    with _opened(path) as file:
        _kind(file, path)
        history = _root_text(file, path, "history")
        try:
            provenance = Provenance.from_json(_root_text(file, path, "provenance"))
        except DataError as error:
            raise DataError(f"{path}: {error.message}", hint=error.hint) from error
        return Header(
            title=_root_text(file, path, "title"),
            created=_root_text(file, path, "created"),
            history=tuple(history.split("\n")) if history else (),
            provenance=provenance,
        )


def _recording(path: Path | str) -> Recording | None:
    """Read a recording that is under way or was cut off; None where the file is something else."""
    path = Path(path)
    try:
        return Recording.read(path) if is_journal(path) else None
    except OSError as error:
        raise unreadable(path, error) from error


def _samples_in(file: h5py.File, path: Path | str) -> int | None:
    """Return the length of the root's time axis as the file says it; None where it says none."""
    samples = file.attrs.get("samples")
    if samples is None:
        return None
    if np.ndim(samples) or not np.issubdtype(type(samples), np.integer) or samples < 0:
        raise DamagedFileError(f"{path}: the attribute 'samples' is {samples!r}, expected a count", path=path)
    return int(samples)


def _kind(file: h5py.File, path: Path | str) -> str:
    """Return the kind of an opened file that this version can read."""
    if not isinstance(file.attrs.get("kind"), str | bytes) or "format_version" not in file.attrs:
        raise NotAnArtefactError(
            f"{path} is an HDF5 file from another program: it has no attributes kind and format_version",
            path=path,
            foreign=True,
        )
    kind, version = text_of(file.attrs["kind"]), file.attrs["format_version"]
    if not np.issubdtype(type(version), np.integer):
        raise DamagedFileError(
            f"{path}: the attribute 'format_version' is {version!r}, expected a whole number", path=path
        )
    if version > FORMAT_VERSION:
        raise DataError(
            f"{path} has format version {version}, but pulsetrainer {__version__} "
            f"reads up to version {FORMAT_VERSION}",
            hint=f"{UPDATE}, or make the file again with this version",
        )
    if kind not in KINDS:
        raise DataError(
            f"{path}: unknown kind {kind!r}, expected one of {', '.join(KINDS)}",
            hint=f"{UPDATE}, or check where the file comes from",
        )
    return kind


def _root_text(file: h5py.File, path: Path | str, name: str) -> str:
    value = file.attrs.get(name)
    if not isinstance(value, str | bytes):
        raise DamagedFileError(f"{path}: the attribute {name!r} is missing or not a text", path=path)
    return text_of(value)


@contextlib.contextmanager
def _opened(path: Path | str) -> Iterator[h5py.File]:
    """Open a file for reading; whatever HDF5 finds wrong with it is a DataError."""
    path = Path(path)
    check_artefact(path)
    try:
        if not is_as_written(path):
            said = f"{path} is damaged: its checksum is not the one it was written with"
            raise DamagedFileError(said, path=path)
    except OSError as error:
        raise unreadable(path, error) from error
    try:
        with h5py.File(path, "r", locking="best-effort") as file:
            yield file
    except _HDF5_ERRORS as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> DataError:
    text = str(error)
    if "truncated file" in text:
        return DamagedFileError(
            f"{path} is truncated: only its first {path.stat().st_size} bytes are there", path=path
        )
    if "lock file" in text:
        return DataError(
            f"{path} is locked by another program", hint="close the program that has it open and try again"
        )
    reason = text.strip("'\"").split("\n")[0]
    return DamagedFileError(f"{path} is damaged and cannot be read: {reason}", path=path)
