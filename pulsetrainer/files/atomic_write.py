"""Files appear whole or not at all, and replace another only with ``--overwrite``: renamed when complete."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import shlex
from collections.abc import Iterator
from pathlib import Path

from pulsetrainer.errors import DataError, ExistsError, UsageError
from pulsetrainer.files.file_lock import Lease, create_locked, sweep

_LONGEST_STEM = 180  # of 255 bytes; the rest is for the unique part
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT)


def check_output(path: Path | str, overwrite: bool = False) -> None:
    """Raise UsageError BEFORE the work that would be lost, where an output cannot be written.

    It exists and ``overwrite`` is not set, its folder is missing or not writable, or its name ends in
    a blank.
    DataError where the disk has no room for another file, or the output is write-protected.
    """
    path = Path(path)
    if path.name != path.name.strip():
        whole = path.with_name(path.name.strip() or "out.h5")
        raise UsageError(
            f"the output {str(path)!r} has a space at an end of its name", hint=f"name it {str(whole)!r}"
        )
    try:
        folder = path.resolve().parent if path.is_symlink() else path.parent
        _check_target(path, folder, overwrite=overwrite)
        _check_new_file(path, folder)
    except (OSError, RuntimeError) as error:  # a name too long, a forbidden folder, a link to itself
        reason = getattr(error, "strerror", None) or error
        if isinstance(error, PermissionError):
            reason = f"you have no permission for the folder {path.parent}"
        raise UsageError(
            f"the output {path} cannot be written: {reason}", hint="name an output in another place"
        ) from error


def _check_target(path: Path, folder: Path, *, overwrite: bool) -> None:
    if path.is_dir():
        raise UsageError(f"the output {str(path)!r} is a folder", hint="name a file in it")
    if path.exists() and not path.is_file():
        raise UsageError(f"the output {path} is not an ordinary file", hint="name a file on disk")
    if not folder.exists():
        raise UsageError(
            f"the output {path} cannot be written: the folder {folder} does not exist",
            hint="write the name without quotes: in quotes the shell takes it as it is"
            if str(folder).startswith(("~", "$"))
            else f"make the folder: mkdir -p {shlex.quote(str(folder))}",
        )
    if not folder.is_dir():
        raise UsageError(f"{folder} is a file, so {path} cannot be written", hint="name another output")
    if path.exists() and not overwrite:
        raise ExistsError(path)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(
            f"the output {path} cannot be written: the folder {folder} is not writable",
            hint="write to another folder, or change its permissions",
        )
    if path.exists() and not os.access(path, os.W_OK):
        raise DataError(
            f"the output {path} is write-protected",
            hint=f"name another file, or allow it: chmod u+rw {shlex.quote(str(path))}",
        )


def _check_new_file(path: Path, folder: Path) -> None:
    """Make a file beside the output and take it away: permissions tell nothing to root, nor of /proc."""
    try:
        with _claimed(path.resolve()):
            pass
    except OSError as error:
        if error.errno in _NO_ROOM:
            raise cannot_write(path, error) from error
        raise UsageError(
            f"the output {path} cannot be written: no file can be made in {folder} ({error.strerror})",
            hint="write to another folder",
        ) from error


@contextlib.contextmanager
def replacing(path: Path | str, *, overwrite: bool) -> Iterator[Path]:
    """Give a new, empty temporary file, which becomes ``path`` when the block ends well.

    Whatever goes wrong, the temporary file is removed and a file that was at ``path`` is untouched. A process
    that is killed leaves its temporary file; the next one that writes the same output removes it.

    UsageError as ``check_output``, and where another process wrote ``path`` meanwhile and ``overwrite`` is
    not set; DataError where the disk is full or failed.
    """
    check_output(path, overwrite)
    target = Path(path).resolve()  # through a symbolic link, not over it
    for leftover in _leftovers(target):
        sweep(leftover)
    try:
        with _claimed(target) as temporary:
            yield temporary
            _publish(temporary, target, overwrite=overwrite)
    except OSError as error:
        raise cannot_write(path, error) from error


@contextlib.contextmanager
def _claimed(target: Path) -> Iterator[Path]:
    """Give a new temporary file with a lease on it; what is left of it at the end is removed."""
    lease: Lease | None = None
    while lease is None:
        temporary = target.with_name(f".{_stem(target)}.{os.getpid()}-{secrets.token_hex(4)}.tmp")
        lease = create_locked(temporary)
    try:
        yield temporary
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        lease.end()


def _stem(target: Path) -> str:
    return os.fsdecode(os.fsencode(target.name)[:_LONGEST_STEM])


def _leftovers(target: Path) -> list[Path]:
    """Return the temporary files of this output that other processes made, whether they live or not."""
    pattern = re.compile(rf"\.{re.escape(_stem(target))}\.\d+-[0-9a-f]{{8}}\.tmp")
    with contextlib.suppress(OSError):
        return [entry for entry in target.parent.iterdir() if pattern.fullmatch(entry.name)]
    return []


def _publish(temporary: Path, target: Path, *, overwrite: bool) -> None:
    """Give a finished file its final name, at once and for good.

    UsageError where another process wrote ``target`` meanwhile and ``overwrite`` is not set; OSError where
    the disk failed.
    """
    _sync(temporary)
    if overwrite:
        temporary.replace(target)
    else:
        try:
            os.link(temporary, target)  # unlike a rename, fails where the name is taken
            temporary.unlink()
        except FileExistsError:
            raise ExistsError(target) from None
        except OSError:  # a file system without hard links
            if target.exists():
                raise ExistsError(target) from None
            temporary.replace(target)
    with contextlib.suppress(OSError):  # a folder cannot be synced everywhere; the file already is
        _sync(target.parent)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def cannot_write(path: Path | str, error: Exception) -> DataError:
    """Return the error for a file that could not be written, with the system's reason in it."""
    text = str(error)
    in_hdf5 = re.search(r"error message = '([^']*)'", text)  # HDF5 wraps it in its own account
    reason = in_hdf5[1] if in_hdf5 else getattr(error, "strerror", None) or text
    full = any(sign in text for sign in ("No space left", "quota", "File too large"))
    hint = "free some space, or write to another disk" if full else "check the disk and its permissions"
    return DataError(f"{path} could not be written: {reason}", hint=hint)
