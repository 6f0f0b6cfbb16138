"""A file for HDF5 to write that never seems to fail.

HDF5 that meets a full disk fails again while closing and crashes when the program ends. So the first error is
kept for the caller, and what HDF5 writes after it is dropped.
"""

from __future__ import annotations

import io
from pathlib import Path


class UnfailingFile(io.FileIO):
    """A new file at ``path``, to write and read; ask ``check`` at the end whether all of it is there."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self._error: BaseException | None = None

    def check(self) -> None:
        """Raise what went wrong: OSError where the disk is full or failed."""
        if self._error is not None:
            raise self._error

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override] # h5py gives a memoryview
        """Read; what was dropped, or never written, is zero."""
        view = memoryview(buffer).cast("B")
        count = super().readinto(view) or 0
        view[count:] = bytes(len(view) - count)
        return len(view)

    def write(self, data: memoryview) -> int:  # type: ignore[override] # h5py gives a memoryview
        """Write all, or keep the error and pretend."""
        view = memoryview(data).cast("B")
        done = 0
        try:
            while self._error is None and done < len(view):
                done += super().write(view[done:]) or 0
        except BaseException as error:  # noqa: BLE001 - Ctrl-C too: HDF5 must not see it here
            self._error = error
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or keep the error and pretend."""
        try:
            if self._error is None:
                return super().truncate(size)
        except BaseException as error:  # noqa: BLE001 - as above
            self._error = error
        return size or 0
