"""A checksum behind the last byte of an artefact, where HDF5 does not look.

HDF5 guards only part of a file by itself: a flipped bit in a text can crash the library, one in a dataset is
a wrong number. A file that a user edits with h5py loses the checksum (HDF5 cuts what it does not know) and
is read without it.
"""

from __future__ import annotations

import re
import zlib
from pathlib import Path

_FORMAT = b"\npulsetrainer crc32 %08x\n"
_PATTERN = re.compile(rb"\npulsetrainer crc32 ([0-9a-f]{8})\n")
CHECKSUM_LENGTH = len(_FORMAT % 0)
_BLOCK = 1 << 20


def append_checksum(path: Path) -> None:
    """Append its checksum to a file that is complete; OSError where the disk is full or failed."""
    crc = _crc(path, path.stat().st_size)
    with path.open("ab") as stream:
        stream.write(_FORMAT % crc)


def is_as_written(path: Path) -> bool:
    """Whether a file is what it was; one without a checksum is. OSError where it cannot be read."""
    length = path.stat().st_size - CHECKSUM_LENGTH
    if length < 0:
        return True
    with path.open("rb") as stream:
        stream.seek(length)
        found = _PATTERN.fullmatch(stream.read())
    return found is None or int(found[1], 16) == _crc(path, length)


def _crc(path: Path, length: int) -> int:
    """Return the checksum of the first ``length`` bytes, read in blocks."""
    crc = 0
    with path.open("rb") as stream:
        while length > 0 and (block := stream.read(min(_BLOCK, length))):
            crc = zlib.crc32(block, crc)
            length -= len(block)
    return crc
