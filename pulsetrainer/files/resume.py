"""Resuming a recording: which file holds it, is it the same? How far it came: ``steps.recording``."""

from __future__ import annotations

import glob
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pulsetrainer.artefacts import Run
from pulsetrainer.errors import DataError, DeviceError, ExistsError, UsageError
from pulsetrainer.files import atomic_write, store
from pulsetrainer.files.file_lock import Lease, is_abandoned
from pulsetrainer.files.input_file import check_resumable
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import interrupted


@dataclass(frozen=True, slots=True)
class Earlier:
    """An interrupted recording; ``close`` it when it is taken over, or is not."""

    path: Path
    run: Run
    header: Header
    lease: Lease  # so that nobody else goes on with it meanwhile
    contains_final: bool  # what has the final name is the beginning of this recording

    def close(self) -> None:
        """Let others go on with it."""
        self.lease.end()

    def check_device(self, serial: str) -> None:
        """Raise DeviceError where it was recorded on the device of another serial number."""
        recorded = self.header.provenance.device
        if recorded is not None and recorded.serial != serial:
            raise DeviceError(
                f"{self.path} was recorded on {recorded.serial}, this is {serial}",
                hint="connect that device, or leave --resume out and name another output",
            )


def earlier_of(path: Path, asked: Mapping[str, Any], *, overwrite: bool) -> Earlier:
    """Find the recording into ``path`` that was interrupted.

    That is the longest of the files that killed programs left beside it, or ``path`` itself if it is not
    complete.

    UsageError where there is nothing to resume, it is being written, or it was recorded with other options;
    DataError where what is there cannot be read.
    """
    atomic_write.check_output(path, overwrite=True)
    check_resumable(path)
    found = interrupted(path)
    final = _unfinished(path, must_read=not found) if path.exists() else None
    if path.exists() and final is None:
        if not found:
            raise UsageError(
                f"there is nothing to resume: {path} is complete",
                hint="use it as it is; to record again, leave --resume out and name another output",
            )
        if not overwrite:
            raise ExistsError(path, f"{found[0][0]} can be resumed, but {path} already exists")
    if final is not None:
        found.insert(0, (path, final.input.size))  # of equals this one counts
    if not found:
        cut_off = f"{path.name}.partial"
        beside = min((one.name for one in path.parent.glob(f"{glob.escape(cut_off)}*")), default=cut_off)
        raise UsageError(
            f"{beside} is being written by another program, or is not a readable capture",
            hint=f"wait for it, or look at it: pulsetrainer show {beside}",
        )
    source, _ = max(found, key=lambda pair: pair[1])
    lease = Lease(source)
    try:
        run, header = store.read(source, Run), store.read_header(source)
        _check_same(source, header.provenance.parameters, asked)
    except BaseException:
        lease.end()
        raise
    contains = final is not None and all(
        np.array_equal(now[: before.size], before, equal_nan=True)
        for now, before in ((run.input, final.input), (run.output, final.output))
    )
    return Earlier(source, run, header, lease, contains)


def _unfinished(path: Path, *, must_read: bool) -> Run | None:
    """Read a recording that a fault or Ctrl-C ended early; None for what will have to make room."""
    try:
        run = store.read(path, Run)
    except DataError:
        if must_read:
            raise
        return None
    if run.complete:
        return None
    if not is_abandoned(path):
        raise UsageError(f"{path} is being continued by another program", hint="wait for it")
    return run


def _check_same(source: Path, before: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """Raise UsageError where the recording was begun with other options."""
    differ = [
        f"`{name}` was {before[name]}, now it is {value}"
        for name, value in asked.items()
        if name in before and before[name] != value
    ]
    if differ:
        raise UsageError(
            f"{source} was recorded with other options: {'; '.join(differ)}",
            hint="resume with the same options, or leave --resume out and name another output",
        )
