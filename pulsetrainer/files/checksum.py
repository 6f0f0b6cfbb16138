"""A checksum behind the last byte of an artefact, where HDF5 does not look.

HDF5 guards only part of a file by itself: a flipped bit in a text can crash the library, one in a dataset is
a wrong number. A file that a user edits with h5py loses the seal (HDF5 cuts what it does not know) and
is read without it.
"""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from pulsetrainer.errors import DamagedFileError, DataError

_FORMAT = b"\npulsetrainer crc32 %08x\n"
_PATTERN = re.compile(rb"\npulsetrainer crc32 ([0-9a-f]{8})\n")
SEAL_LENGTH = len(_FORMAT % 0)
_BLOCK = 1 << 20


def seal_of(crc: int) -> bytes:
    """Return the bytes to append to a file whose content has this checksum."""
    return _FORMAT % crc


def append_seal(path: Path) -> None:
    """Append the seal to a file that is complete.

    Raises
    ------
    OSError
        The disk is full or failed.
    """
    crc = _crc(path, path.stat().st_size)
    with path.open("ab") as stream:
        stream.write(seal_of(crc))


def check_seal(path: Path) -> None:
    """Raise where the content of a sealed file is not what it was; a file without a seal passes.

    Raises
    ------
    DataError
        The checksum differs, or the file cannot be read.
    """
    try:
        length = path.stat().st_size - SEAL_LENGTH
        if length < 0:
            return
        with path.open("rb") as stream:
            stream.seek(length)
            seal = _PATTERN.fullmatch(stream.read())
        if seal is None or int(seal[1], 16) == _crc(path, length):
            return
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror or error}", hint="check the disk") from error
    raise DamagedFileError(f"{path} is damaged: its checksum is not the one it was written with", path=path)


def _crc(path: Path, length: int) -> int:
    """Return the checksum of the first ``length`` bytes, read in blocks."""
    crc = 0
    with path.open("rb") as stream:
        while length > 0 and (block := stream.read(min(_BLOCK, length))):
            crc = zlib.crc32(block, crc)
            length -= len(block)
    return crc
