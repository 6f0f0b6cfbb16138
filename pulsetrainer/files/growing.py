"""Reading an HDF5 file that is still being written, or whose writer was killed.

HDF5 refuses such a file unless its own mode for concurrent reading is asked for, and that mode waits,
practically for ever, until a damaged place gets better. Here the file is read through a Python object that
shows HDF5 another superblock (its first 48 bytes): not marked as being written, and without the end that the
writer noted when it last had time to. What the superblock points to is never stale: the writer keeps it so.
"""

from __future__ import annotations

import io
import struct
from typing import TYPE_CHECKING

from pulsetrainer.errors import DamagedFileError

if TYPE_CHECKING:
    from pathlib import Path

# superblock, version 3: signature, version, two sizes, flags, base, extension, end, root, checksum
_SUPERBLOCK = struct.Struct("<8sBBBBQQQQI")
_VERSION = 3
_END = 1 << 48  # beyond any file; less than HDF5's largest address
_MASK = 0xFFFFFFFF


def is_growing(start: bytes) -> bool:
    """Whether a file that starts with these bytes is marked as being written."""
    return len(start) >= _SUPERBLOCK.size and start[8] == _VERSION and start[11] != 0


class GrowingFile(io.RawIOBase):
    """A file that is being written, as HDF5 should see it.

    Raises
    ------
    DataError
        The superblock is damaged, or the file is shorter than its writer left it.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._stream = path.open("rb", buffering=0)
        self._position = 0
        start = self._stream.read(_SUPERBLOCK.size)
        *fields, checksum = _SUPERBLOCK.unpack(start)
        damaged = checksum != lookup3(start[:-4])
        truncated = not damaged and path.stat().st_size < fields[7]
        if damaged or truncated:
            self._stream.close()
            what = "truncated" if truncated else "damaged: its superblock is not as it was written"
            raise DamagedFileError(f"{path} is {what}", path=path, artefact="run")
        fields[4], fields[7] = 0, _END
        self._start = _SUPERBLOCK.pack(*fields, 0)[:-4]
        self._start += struct.pack("<I", lookup3(self._start))

    def readable(self) -> bool:
        """It can be read."""
        return True

    def seekable(self) -> bool:
        """It can be positioned."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move to a place; the end is where the superblock says it is."""
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._position, io.SEEK_END: _END}[whence]
        self._position = base + offset
        return self._position

    def tell(self) -> int:
        """Return the place of the next read."""
        return self._position

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override] # h5py gives a memoryview
        """Read; what lies behind the real end is zero, as HDF5 does it."""
        view = memoryview(buffer).cast("B")
        self._stream.seek(self._position)
        count = self._stream.readinto(view)
        view[count:] = bytes(len(view) - count)
        if self._position < len(self._start):
            shown = self._start[self._position : self._position + len(view)]
            view[: len(shown)] = shown
        self._position += len(view)
        return len(view)

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
        super().close()


def lookup3(data: bytes) -> int:
    """Return the checksum that HDF5 writes behind its structures (Jenkins, lookup3, hashlittle, start 0)."""
    a = b = c = (0xDEADBEEF + len(data)) & _MASK
    padded = data + bytes(-len(data) % 12)
    words = struct.unpack(f"<{len(padded) // 4}I", padded)
    for k in range(0, len(words), 3):
        a, b, c = (a + words[k]) & _MASK, (b + words[k + 1]) & _MASK, (c + words[k + 2]) & _MASK
        if k + 3 < len(words):
            a, b, c = _mix(a, b, c)
    return _final(a, b, c)


def _rotate(x: int, k: int) -> int:
    return ((x << k) | (x >> (32 - k))) & _MASK


def _mix(a: int, b: int, c: int) -> tuple[int, int, int]:
    for k1, k2, k3 in ((4, 6, 8), (16, 19, 4)):
        a, c = ((a - c) & _MASK) ^ _rotate(c, k1), (c + b) & _MASK
        b, a = ((b - a) & _MASK) ^ _rotate(a, k2), (a + c) & _MASK
        c, b = ((c - b) & _MASK) ^ _rotate(b, k3), (b + a) & _MASK
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    source, target, other = b, c, a
    for k in (14, 11, 25, 16, 4, 14, 24):
        source, target, other = ((target ^ source) - _rotate(source, k)) & _MASK, other, source
    return source
