"""Whether the writer of an unfinished file is alive: a lock that the system drops when its process ends.

The lock is a shared one, so that it is in nobody's way: HDF5 takes a shared lock to read. Only a writer that
wants to throw the file away asks for it alone. Where a file system or computer has no such locks nothing is
ever taken for abandoned.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


class Lease:
    """Held on a file that is being written, until ``end`` or the death of the process."""

    def __init__(self, path: Path) -> None:
        self._handle: int | None = None
        if fcntl is None:
            return
        self._handle = os.open(path, os.O_RDONLY)
        with contextlib.suppress(OSError):  # no locks here: then nobody can take us for dead
            fcntl.flock(self._handle, fcntl.LOCK_SH | fcntl.LOCK_NB)

    def is_on(self, path: Path) -> bool:
        """Whether the file of this name still is the one that the lease is on."""
        if self._handle is None:
            return path.exists()
        try:
            there, here = path.stat(), os.fstat(self._handle)
        except FileNotFoundError:
            return False
        return (there.st_dev, there.st_ino) == (here.st_dev, here.st_ino)

    def end(self) -> None:
        """Give the lease up."""
        handle, self._handle = self._handle, None
        if handle is not None:
            os.close(handle)


def create_locked(path: Path) -> Lease | None:
    """Create an empty file with a lease on it; None where another process swept it away in between.

    OSError where it exists already, or cannot be created.
    """
    path.open("xb").close()
    with contextlib.suppress(FileNotFoundError):
        lease = Lease(path)
        if lease.is_on(path):
            return lease
        lease.end()
    return None


def is_abandoned(path: Path) -> bool:
    """Whether the process that wrote an unfinished file has ended."""
    return _alone_with(path, lambda: None)


def sweep(path: Path) -> bool:
    """Remove an unfinished file whose writer has ended; tell whether it was removed."""
    return _alone_with(path, path.unlink)


def _alone_with(path: Path, act: Callable[[], object]) -> bool:
    """Do something while nobody else can hold a lease on the file; tell whether it was done."""
    if fcntl is None:
        return False
    try:
        handle = os.open(path, os.O_RDWR)  # a network drive gives such a lock only to who could write
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        act()
    except OSError:
        return False
    finally:
        os.close(handle)
    return True
