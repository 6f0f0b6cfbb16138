"""A file for HDF5 to write that never seems to fail.

HDF5 that meets a full disk fails again while closing and crashes when the program ends. So the first error is
kept for the caller, and what HDF5 writes after it is dropped; a record of any size needs no second copy in
memory for that.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path


class Sheltered(io.RawIOBase):
    """A new file at ``path`` to write and read; ask ``check`` at the end whether all of it is there.

    Raises
    ------
    OSError
        The file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._stream = path.open("w+b", buffering=0)
        self._error: BaseException | None = None

    def check(self) -> None:
        """Raise what went wrong.

        Raises
        ------
        OSError
            The disk is full or failed.
        """
        if self._error is not None:
            raise self._error

    def readable(self) -> bool:
        """It can be read."""
        return True

    def writable(self) -> bool:
        """It can be written."""
        return True

    def seekable(self) -> bool:
        """It can be positioned."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move to a place."""
        return self._stream.seek(offset, whence)

    def tell(self) -> int:
        """Return the place of the next access."""
        return self._stream.tell()

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override] # h5py gives a memoryview
        """Read; what was dropped, or never written, is zero."""
        view = memoryview(buffer).cast("B")
        count = self._stream.readinto(view)
        view[count:] = bytes(len(view) - count)
        return len(view)

    def write(self, data: memoryview) -> int:  # type: ignore[override] # h5py gives a memoryview
        """Write all, or keep the error and pretend."""
        view = memoryview(data).cast("B")
        done = 0
        try:
            while self._error is None and done < len(view):
                done += self._stream.write(view[done:])
        except BaseException as error:  # noqa: BLE001 - Ctrl-C too: HDF5 must not see it here
            self._error = error
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or keep the error and pretend."""
        try:
            if self._error is None:
                return self._stream.truncate(size)
        except BaseException as error:  # noqa: BLE001 - as above
            self._error = error
        return size or 0

    def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
        super().close()
