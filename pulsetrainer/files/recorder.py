"""A run that is on disk while it is measured: a program that dies loses nothing that was appended.

The samples go into a journal beside the final name. When the recording ends, the journal is written as HDF5
in one step and removed.
"""

from __future__ import annotations

import contextlib
import itertools
import re
import shutil
from pathlib import Path
from typing import Any, ClassVar, Self

import h5py
import numpy as np
from numpy.typing import ArrayLike

from pulsetrainer.artefacts import FloatArray, Run, Session
from pulsetrainer.artefacts.run import Coil, seam_of
from pulsetrainer.errors import ArgumentError, DataError, PulsetrainerError
from pulsetrainer.files import journal, store
from pulsetrainer.files.atomic_write import cannot_write, check_output
from pulsetrainer.files.encode import Later
from pulsetrainer.files.file_lock import Lease, create_locked, is_abandoned, sweep
from pulsetrainer.files.input_file import is_journal
from pulsetrainer.files.journal import COLUMNS, PIECE, Journal, Recording
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.schema import plan_of

_RESERVE_BYTES = 1 << 20  # beside the samples: for the texts and for HDF5's own structures
_BYTES_PER_SAMPLE = 8 * len(COLUMNS) + 1  # and the seam


class RunRecorder:
    """Writes a run batch by batch; use it in a ``with`` block.

    A block that ends well finishes the run as complete, one that ends with an exception (Ctrl-C too) keeps
    what was recorded as ``complete=False``; if nothing was recorded, nothing is left behind. ``earlier`` is a
    recording that was cut off, with its file: a journal goes on, an artefact is copied.

    UsageError as ``atomic_write.check_output``; DataError where the disk is full or failed.
    """

    _kind: ClassVar[type] = Run
    _columns: ClassVar[tuple[str, ...]] = COLUMNS
    _tag: ClassVar[bytes] = journal.DATA

    def __init__(
        self,
        path: Path | str,
        header: Header,
        *,
        overwrite: bool = False,
        signal: str = "",
        earlier: tuple[Path, Run] | None = None,
    ) -> None:
        check_output(path, overwrite)
        self._final = Path(path)
        self._overwrite = overwrite
        self._header = header
        by = header.provenance.device
        self._texts: dict[str, Any] = {
            "captured": True, "signal": signal, "serial": by.serial if by is not None else "",
        }  # fmt: skip
        self.samples = 0  # that are safe on disk
        self.end_s = -np.inf  # time of the last one
        self._seams: list[int] = []  # numbers of the samples that come first after a pause
        self._complete: bool | None = None  # None: not finished
        self.coil: Coil | None = None  # set it before the end, where it is known
        self.dropped_samples = 0  # set it as losses become known: an interrupted run tells them too
        if earlier is not None and is_journal(earlier[0]):
            self.partial, self._lease = earlier[0], Lease(earlier[0])
            end = Recording.read(self.partial).end
        else:
            self.partial, self._lease = _claim_partial(self._final)
            end = 0
        try:
            self._check_space(0)
            self._journal = Journal(self.partial, end)
            self._journal.describe(header, self._texts)
            if earlier is not None:
                self._take_over(earlier[1], copied=end == 0)
        except BaseException as error:
            if end == 0:
                self.partial.unlink(missing_ok=True)
            self._lease.end()
            if isinstance(error, OSError):
                raise cannot_write(self.partial, error) from error
            raise

    def append(self, *batch: ArrayLike) -> None:
        """Append a batch: time, reference, input and output (n,). It now survives the death of the program.

        ArgumentError where the arrays differ in length, or the time does not increase, also from the batch
        before; DataError where the disk is full or failed; what was appended before is kept.
        """
        columns = [np.atleast_1d(np.asarray(a, dtype="<f8")) for a in batch]
        count = self._check_batch(columns)
        if count == 0:
            return
        self._check_space(count)
        tag = journal.PART if self._seams[-1:] == [self.samples] else self._tag
        self._add(tag, np.stack(columns).tobytes())
        self.samples += count
        self.end_s = float(columns[0][-1])

    def _add(self, tag: bytes, content: bytes) -> None:
        try:
            self._journal.append(tag, content, self.dropped_samples)
        except OSError as error:
            raise cannot_write(self.partial, error) from error

    def begin_part(self) -> None:
        """Say that the device was off since the last sample: the next one is the first of a new part."""
        if self.samples and self._seams[-1:] != [self.samples]:
            self._seams.append(self.samples)

    def _take_over(self, run: Run, *, copied: bool) -> None:
        """Begin with the samples of a recording that was cut off; those of a journal are there already."""
        if run.time_s is None or run.reference is None:
            raise ArgumentError("a recording has a time and a reference", hint="this is a bug in the caller")
        self.dropped_samples = run.dropped_samples
        for part in run.parts():
            self.begin_part()
            if copied:
                arrays = [getattr(part, name) for name in COLUMNS]
                for start in range(0, part.input.size, PIECE):
                    self.append(*(array[start : start + PIECE] for array in arrays))
            else:
                self.samples += part.input.size
        self.end_s = float(run.time_s[-1])

    def _check_batch(self, columns: list[FloatArray]) -> int:
        """Return the length of a batch that can be appended."""
        if self._complete is not None:
            raise ArgumentError("the run is finished: nothing can be appended", hint="record a new run")
        if len({column.shape for column in columns}) != 1 or columns[0].ndim != 1:
            shapes = ", ".join(f"{n} {one.shape}" for n, one in zip(self._columns, columns, strict=True))
            raise ArgumentError(
                f"a batch needs arrays of one length: {shapes}", hint="this is a bug in the caller"
            )
        time = np.concatenate(([self.end_s], columns[0]))
        fits = (np.diff(time) > 0) & np.isfinite(time[1:])
        if not fits.all():
            k = int(np.argmin(fits))
            raise ArgumentError(
                f"the time of sample {self.samples + k} is {time[k + 1]:g} s after {time[k]:g} s: "
                "it must increase",
                hint="this is a bug in the caller",
            )
        return len(columns[0])

    def _check_space(self, count: int) -> None:
        """Raise DataError while there still is room for the file that the recording will become."""
        try:
            free = shutil.disk_usage(self.partial.parent).free
        except OSError:
            return
        if free < _RESERVE_BYTES + (self.samples + 2 * count) * _BYTES_PER_SAMPLE:
            raise DataError(
                f"the disk of {self.partial.parent} is full: {free} bytes are left",
                hint="free some space, or write to another disk; what was recorded so far is kept",
            )

    def finish(self, *, complete: bool = True) -> Path:
        """Give the run its final name and return it; ``complete``: all that was asked for was recorded.

        DataError where nothing was recorded, or the disk failed: the recording is kept in ``partial``;
        UsageError where another process wrote the final name meanwhile; the recording is kept in ``partial``.
        """
        if self._complete is None:
            self._complete = complete
        if not self.partial.exists():  # the run has its name, or nothing was recorded
            return self._final
        try:
            if not self.samples:
                self.partial.unlink()
                raise DataError(
                    f"nothing was recorded, so {self._final} was not written", hint="check the device"
                )
            self._convert()
            self.partial.unlink(missing_ok=True)
        except PulsetrainerError as error:
            if self.partial.exists():
                error.message = f"{error.message}; the recording is kept in {self.partial}"
                error.args = (error.message,)
            raise
        finally:
            self._journal.close()
            self._lease.end()
        return self._final

    def _convert(self) -> None:
        """Write the journal as an artefact, piece by piece."""
        values = {plan.name: plan.default for plan in plan_of(self._kind)} | self._known_fields()
        values |= dict.fromkeys(self._columns, Later(self.samples))
        values |= {"complete": self._complete, "dropped_samples": self.dropped_samples}
        store.write_fields(
            self._final, self._kind, values, self._header, overwrite=self._overwrite, fill=self._fill
        )

    def _known_fields(self) -> dict[str, Any]:
        """Return the fields of the artefact that are no columns."""
        measured = {"input_quantity": "current", "output_quantity": "force"}
        return {**self._texts, **measured, "seam": seam_of(self._seams, self.samples), "coil": self.coil}

    def _fill(self, file: h5py.File) -> None:
        paths = {plan.name: plan.path for plan in plan_of(self._kind)}
        start, count, kept = 0, 0, list[FloatArray]()
        for block in itertools.chain(journal.blocks(self.partial), [None]):
            if block is not None and block.samples.size:
                kept.append(block.samples)
                count += block.samples.shape[1]
            if count and (block is None or count >= PIECE):
                for name, values in zip(self._columns, np.concatenate(kept, axis=1), strict=True):
                    file[paths[name]][start : start + count] = values
                start, count, kept = start + count, 0, []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _traceback: object) -> None:
        if error is None:
            self.finish()
        elif self.samples:
            try:
                self.finish(complete=False)
            except PulsetrainerError as second:
                # the first error tells why the block ended; this one, where the samples are
                error.add_note(f"{second.message} ({second.hint})")
        else:
            self._complete = False
            self._journal.close()
            self.partial.unlink(missing_ok=True)
            self._lease.end()


def interrupted(final: Path | str, kind: type = Run) -> list[tuple[Path, int]]:
    """Return what killed programs left of runs, or sessions, into ``final``, with the samples, longest first.

    Files that hold no sample are removed; one whose writer is alive, or that is damaged, is not listed.
    """
    tags = (journal.GOAL,) if kind is Session else (journal.DATA, journal.PART)
    final = Path(final)
    pattern = re.compile(rf"{re.escape(final.name)}\.partial(-\d+)?")
    found: list[tuple[Path, int]] = []
    with contextlib.suppress(OSError):  # no such folder: another check says so
        for path in sorted(entry for entry in final.parent.iterdir() if pattern.fullmatch(entry.name)):
            if not is_abandoned(path):
                continue
            with contextlib.suppress(DataError):
                lengths = [(block.tag, block.samples.shape[1]) for block in journal.blocks(path)]
                if not any(length for _, length in lengths):
                    sweep(path)
                elif samples := sum(length for tag, length in lengths if tag in tags):
                    found.append((path, samples))
    return sorted(found, key=lambda pair: -pair[1])


def _claim_partial(final: Path) -> tuple[Path, Lease]:
    """Create an empty file beside the final name and return its name, with a lease on it.

    An older partial file is the recording of a program that was killed: it is never overwritten.
    """
    for k in itertools.count(1):
        partial = final.with_name(f"{final.name}.partial" if k == 1 else f"{final.name}.partial-{k}")
        try:
            if lease := create_locked(partial):
                return partial, lease
        except FileExistsError:
            continue
        except OSError as error:
            raise cannot_write(partial, error) from error
    raise AssertionError  # itertools.count does not end
