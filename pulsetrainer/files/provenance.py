"""Where an artefact comes from: program, command, seed, inputs, libraries, device; and its ancestry.

Built by pure functions: the clock and the command line are handed in. Every text that goes
into an artefact passes through ``clean``, which cuts the parameters off a ``bench:`` URL. They say what
is hidden in the simulated plant, and a diagnosis that could read them would prove nothing.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
import platform
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.files.input_file import unreadable
from pulsetrainer.version import __version__

PROGRAM = "pulsetrainer"
_LIBRARIES = ("numpy", "scipy", "h5py")

# From the question mark to the END of the text, not to the next blank: a quoted value may hold blanks,
# and a title cut short costs less than a parameter let through.
_QUERY = re.compile(r"([\"']?)((?:bench|qemu):[^?\s\"']*)\?(.*)", re.IGNORECASE | re.DOTALL)
_WHICH_DEVICE = re.compile(r"(seed|serial)=\d{1,9}")  # no secret, and needed to replay
_CONTROL = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")


def redact(text: str) -> str:
    """Return the text without what follows the ``?`` of a simulated device's URL, but for which device it is.

    A quote that was opened before the URL is closed after it.
    """
    return _QUERY.sub(_device_only, text)


def _device_only(url: re.Match[str]) -> str:
    quote, port, parameters = url.groups()
    given = re.split(r"[\s\"']", parameters, maxsplit=1)[0].split("&")
    kept = "&".join(one for one in given if _WHICH_DEVICE.fullmatch(one))
    return f"{quote}{port}?{kept}{quote}" if kept else f"{quote}{port}{quote}"


def clean(text: str) -> str:
    """Return the text as it may be stored: redacted, valid UTF-8, without NUL.

    A file name that is not UTF-8 reaches Python with lone surrogates, which HDF5 refuses; they
    are written as escapes, for a name must not cost a capture.
    """
    escaped = text.encode("utf-8", "backslashreplace").decode("utf-8").replace("\0", "\\x00")
    return redact(escaped)


def _one_line(text: str) -> str:
    """Return the text with line breaks and other control characters as escapes."""
    return _CONTROL.sub(lambda match: f"\\x{ord(match[0]):02x}", clean(text))


def _plain(value: Any) -> Any:
    """Return the value as JSON knows it, every text cleaned, numbers that JSON lacks as text."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {clean(str(key)): _plain(item) for key, item in value.items()}
    if isinstance(value, AbstractSet):
        return sorted((_plain(item) for item in value), key=str)
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        return [_plain(item) for item in value]
    return clean(str(value))


@dataclass(frozen=True, slots=True)
class Device:
    """What a device said about itself when the data were taken."""

    serial: str = ""
    firmware: str = ""
    port: str = ""


@dataclass(frozen=True, slots=True)
class Provenance:
    """How an artefact was made; cleaned when it is built, so nothing hidden can be carried by it."""

    version: str = __version__
    program: str = PROGRAM
    argv: tuple[str, ...] = ()  # the words after the program's name
    parameters: Mapping[str, Any] = field(default_factory=dict)  # effective: defaults and files included
    seed: int | None = None
    inputs: Mapping[str, str] = field(default_factory=dict)  # name as the user gave it: sha256
    libraries: Mapping[str, str] = field(default_factory=dict)
    device: Device | None = None

    def __post_init__(self) -> None:
        for name in ("argv", "parameters", "inputs", "libraries"):
            value = _plain(getattr(self, name))
            object.__setattr__(self, name, tuple(value) if name == "argv" else value)
        if self.device is not None:
            object.__setattr__(self, "device", Device(**_plain(asdict(self.device))))

    @property
    def command(self) -> str:
        """The command line, quoted so that a shell takes it again."""
        return shlex.join((self.program, *self.argv))

    def to_json(self) -> str:
        """Return the provenance as one JSON object."""
        return json.dumps(asdict(self), ensure_ascii=False, allow_nan=False)

    @classmethod
    def from_json(cls, text: str) -> Provenance:
        """Return the provenance that ``to_json`` wrote; DataError where the text is something else."""
        try:
            fields = json.loads(text)
            maps = (fields.get(name, {}) for name in ("parameters", "inputs", "libraries"))
            if not all(isinstance(value, dict) for value in maps):
                raise TypeError("parameters, inputs and libraries must be objects")  # noqa: TRY301 - one exit
            fields["argv"] = tuple(fields.get("argv", ()))
            device = fields.get("device")
            fields["device"] = None if device is None else Device(**device)
            # what a later version added to the format is of no use to this one
            return cls(**{key: fields[key] for key in cls.__dataclass_fields__ if key in fields})
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            raise DataError(
                f"the provenance is not the JSON object it should be: {error}",
                hint="the file was damaged or edited: make it again, or restore it from a copy",
            ) from error


@dataclass(frozen=True, slots=True)
class Header:
    """What every artefact says about itself, whatever its kind."""

    title: str
    created: str  # ISO 8601, UTC
    history: tuple[str, ...] = ()  # one line per command, oldest first, those of the inputs included
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        object.__setattr__(self, "title", clean(self.title))
        object.__setattr__(self, "history", tuple(_one_line(line) for line in self.history))


def make_header(
    title: str, *, argv: Sequence[str], now: datetime, ancestors: Sequence[Header] = (), **made: Any
) -> Header:
    """Return the header of a new artefact, with what ``made`` it: the fields of ``Provenance``.

    The time is that of making, with its time zone; ``ancestors`` are the headers of the artefacts that this
    one was made from, whose histories are taken over.

    ArgumentError where ``now`` has no time zone.
    """
    if now.tzinfo is None:
        raise ArgumentError(
            f"the time {now.isoformat()} has no time zone", hint="pass datetime.now(UTC), not datetime.now()"
        )
    provenance = Provenance(argv=tuple(argv), **made)
    created = now.astimezone(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
    # two inputs share ancestors; the sort is stable, so lines of one second keep their order
    lines = dict.fromkeys(line for header in ancestors for line in header.history)
    inherited = sorted(lines, key=lambda line: line.partition(" ")[0])
    return Header(title, created, (*inherited, f"{created} {provenance.command}"), provenance)


def library_versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that the numbers depend on."""
    return {"python": platform.python_version()} | {
        name: importlib.metadata.version(name) for name in _LIBRARIES
    }


def sha256_of(path: Path | str) -> str:
    """Return the sha256 of a file as hexadecimal text; DataError where it cannot be read."""
    try:
        with Path(path).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise unreadable(path, error) from error


def digests(paths: Iterable[Path | str]) -> dict[str, str]:
    """Return the sha256 of each file under the name the user gave it; raises as ``sha256_of``."""
    return {str(path): sha256_of(path) for path in paths}


def same_files(paths: Iterable[Path | str]) -> list[list[str]]:
    """Return the names of files that are the same, byte for byte; raises as ``sha256_of``."""
    same: dict[str, list[str]] = {}
    for path in paths:
        same.setdefault(sha256_of(path), []).append(str(path))
    return [names for names in same.values() if len(names) > 1]
