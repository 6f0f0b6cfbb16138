"""A run that is on disk while it is measured: a program that dies loses nothing that was appended.

The file grows under a name of its own beside the final one. HDF5's single-writer mode keeps its structure
readable at every moment, and the sample count is written last: a reader trusts that many samples.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import re
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np

from pulsetrainer.artefacts import FloatArray, Run
from pulsetrainer.errors import ArgumentError, DataError, PulsetrainerError
from pulsetrainer.files.atomic_write import cannot_write, check_output, publish
from pulsetrainer.files.checksum import append_seal
from pulsetrainer.files.encode import encode
from pulsetrainer.files.file_lock import Lease, is_abandoned, sweep
from pulsetrainer.files.schema import plan_of
from pulsetrainer.files.store import LIBVER, read, read_samples, write_root

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from pulsetrainer.files.provenance import Header

# HDF5 must never meet a full disk: it would fail while closing and crash when the program ends. One
# batch allocates four chunks of 32 KB at most per 4096 samples; the rest is for its own structures.
_RESERVE_BYTES = 1 << 20
_BYTES_PER_SAMPLE = 32
_CACHE_BYTES = 1 << 16
_COLUMNS = ("time_s", "reference", "input", "output")
_COPIED_SAMPLES = 1 << 16  # at a time
_CHUNK_BYTES = 1 << 15  # a smaller file holds no sample


class RunRecorder:
    """Writes a run batch by batch; use it in a ``with`` block.

    A block that ends well finishes the run as complete, one that ends with an exception (Ctrl-C too) keeps
    what was recorded as ``complete=False``; if nothing was recorded, nothing is left behind.

    Parameters
    ----------
    path
        The final name.
    header
        What the artefact says about itself.
    overwrite
        Replace an existing file.
    input_unit, output_unit, input_quantity, output_quantity, signal
        As in ``Run``.
    in_parts
        Whether there will be seams; without, ``begin_part`` is an error.

    Raises
    ------
    UsageError
        See ``store.check_output``.
    DataError
        The disk is full or failed.
    """

    def __init__(
        self,
        path: Path | str,
        header: Header,
        *,
        overwrite: bool = False,
        input_unit: str = "A",
        output_unit: str = "N",
        input_quantity: str = "current",
        output_quantity: str = "force",
        signal: str = "",
        in_parts: bool = False,
    ) -> None:
        check_output(path, overwrite)
        self._final = Path(path)
        self._overwrite = overwrite
        self._samples = 0
        self._last_time = -np.inf
        self._finished = False
        self._at_seam = False
        self._lease: Lease | None = None
        self._superseded: list[Path] = []
        self.dropped_samples = 0  # set it as losses become known: an interrupted run tells them too
        empty = np.zeros(0)
        values: dict[str, Any] = dict.fromkeys(_COLUMNS, empty) | {
            "input_unit": input_unit,
            "output_unit": output_unit,
            "input_quantity": input_quantity,
            "output_quantity": output_quantity,
            "signal": signal,
            "complete": False,
            "dropped_samples": 0,
            "seam": np.zeros(0, dtype=np.bool_) if in_parts else None,
        }
        self.partial = _claim_partial(self._final)
        try:
            self._check_space(0)
            # the cache holds one chunk: the samples before it are not needed any more
            self._file = h5py.File(
                self.partial, "w", libver=LIBVER, locking="best-effort", rdcc_nbytes=_CACHE_BYTES
            )
            write_root(self._file, Run, header, samples=0)
            encode(self._file, Run, values, growing=True)
            self._file.swmr_mode = True
            self._lease = Lease(self.partial)  # not before: HDF5 has the file locked until here
            if not self._lease.is_on(self.partial):  # between its making and HDF5's lock
                raise FileNotFoundError(errno.ENOENT, "another process removed it, try again")  # noqa: TRY301
        except BaseException as error:
            self.partial.unlink(missing_ok=True)
            self._end_lease()
            if isinstance(error, OSError | RuntimeError):
                raise cannot_write(self.partial, error) from error
            raise
        paths = {plan.name: plan.path for plan in plan_of(Run)}
        self._datasets = {name: self._file[paths[name]] for name in _COLUMNS}
        self._seam = self._file[paths["seam"]] if in_parts else None

    @property
    def samples(self) -> int:
        """How many samples are safe on disk."""
        return self._samples

    @property
    def end_s(self) -> float:
        """Time of the last sample."""
        return self._last_time

    def append(self, time_s: ArrayLike, reference: ArrayLike, input: ArrayLike, output: ArrayLike) -> None:  # noqa: A002 - the field's name
        """Append a batch; when this returns, it survives the death of the program.

        Raises
        ------
        ArgumentError
            The arrays differ in length, or the time does not increase, also from the batch before.
        DataError
            The disk is full or failed; what was appended before is kept.
        """
        arrays: dict[str, FloatArray] = {
            name: np.atleast_1d(np.asarray(array, dtype=np.float64))
            for name, array in zip(_COLUMNS, (time_s, reference, input, output), strict=True)
        }
        count = self._check_batch(arrays)
        if count == 0:
            return
        self._check_space(count)
        total = self._samples + count
        try:
            for name, dataset in self._datasets.items():
                dataset.resize(total, axis=0)
                dataset[self._samples :] = arrays[name]
                dataset.flush()
            if self._seam is not None:
                self._seam.resize(total, axis=0)  # with zeros
                self._seam[self._samples] = self._at_seam
                self._seam.flush()
            self._file.attrs.modify("samples", np.int64(total))
            self._file.flush()
        except (OSError, RuntimeError) as error:
            raise cannot_write(self.partial, error) from error
        self._samples = total
        self._last_time = float(arrays["time_s"][-1])
        self._at_seam = False

    def begin_part(self) -> None:
        """Say that the device was off since the last sample: the next one is the first of a new part.

        Raises
        ------
        ArgumentError
            The recorder was not made for parts.
        """
        if self._seam is None:
            raise ArgumentError("this recorder was not made for parts", hint="this is a bug in the caller")
        self._at_seam = self._samples > 0

    def take_over(self, path: Path | str, run: Run) -> None:
        """Begin with the samples of an interrupted recording.

        When this one has its name, that one is removed, and what it had been begun with.

        Raises
        ------
        ArgumentError, DataError
            As ``append``; the run lacks time or reference.
        """
        if run.time_s is None or run.reference is None:
            raise ArgumentError("a recording has a time and a reference", hint="this is a bug in the caller")
        for part in run.parts():
            self.begin_part()
            arrays = [getattr(part, name) for name in _COLUMNS]
            for start in range(0, part.input.size, _COPIED_SAMPLES):
                self.append(*(array[start : start + _COPIED_SAMPLES] for array in arrays))
        self.dropped_samples = run.dropped_samples
        self._superseded = [Path(path), *(left for left, _ in interrupted(self._final) if _begins(run, left))]

    def _check_batch(self, arrays: dict[str, FloatArray]) -> int:
        """Return the length of a batch that can be appended."""
        if self._finished:
            raise ArgumentError("the run is finished: nothing can be appended", hint="record a new run")
        if len({array.shape for array in arrays.values()}) != 1 or arrays["time_s"].ndim != 1:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
            raise ArgumentError(
                f"a batch needs four arrays of one length: {shapes}", hint="this is a bug in the caller"
            )
        time = np.concatenate(([self._last_time], arrays["time_s"]))
        if not (np.all(np.diff(time) > 0) and np.all(np.isfinite(time[1:]))):
            k = int(np.argmin((np.diff(time) > 0) & np.isfinite(time[1:])))
            raise ArgumentError(
                f"the time of sample {self._samples + k} is {time[k + 1]:g} s after {time[k]:g} s: "
                "it must increase",
                hint="this is a bug in the caller",
            )
        return len(arrays["time_s"])

    def _check_space(self, count: int) -> None:
        """Raise DataError while there still is room to keep what was recorded."""
        if not hasattr(os, "statvfs"):
            return
        try:
            disk = os.statvfs(self.partial.parent)
        except OSError:
            return
        free = disk.f_bavail * disk.f_frsize
        if free < _RESERVE_BYTES + count * _BYTES_PER_SAMPLE:
            raise DataError(
                f"the disk of {self.partial.parent} is full: {free} bytes are left",
                hint="free some space, or write to another disk; what was recorded so far is kept",
            )

    def finish(self, *, complete: bool = True, dropped_samples: int | None = None) -> Path:
        """Give the run its final name and return it.

        Parameters
        ----------
        complete
            Whether everything that was asked for was recorded.
        dropped_samples
            How many samples were lost on the wire; default: the attribute ``dropped_samples``.

        Raises
        ------
        DataError
            Nothing was recorded, or the disk failed.
        UsageError
            Another process wrote the final name meanwhile; the run is kept under its partial name.
        """
        if self._finished:
            return self._final
        self._finished = True
        dropped = self.dropped_samples if dropped_samples is None else dropped_samples
        try:
            if self._samples:
                self._file.attrs.modify("complete", np.uint8(complete))
                self._file.attrs.modify("dropped_samples", np.int64(dropped))
            self._file.close()
            if not self._samples:
                self.partial.unlink(missing_ok=True)
                raise DataError(
                    f"nothing was recorded, so {self._final} was not written",
                    hint="check the device: pulsetrainer ports",
                )
            with contextlib.suppress(OSError):  # without a seal the file is only less guarded
                append_seal(self.partial)
            publish(self.partial, self._final.resolve(), overwrite=self._overwrite)
        except (OSError, RuntimeError) as error:
            raise self._kept(cannot_write(self._final, error)) from error
        except PulsetrainerError as error:
            self._kept(error)
            raise
        finally:
            self._end_lease()
        for path in self._superseded:
            if path != self._final:
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)
        return self._final

    def _end_lease(self) -> None:
        if self._lease is not None:
            self._lease.end()

    def _kept(self, error: PulsetrainerError) -> PulsetrainerError:
        """Return the error with the place where the samples are."""
        if not self.partial.exists():
            return error
        error.message = f"{error.message}; the recording is kept in {self.partial}"
        error.args = (error.message,)
        return error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            self.finish()
            return
        if not self._samples and not self._finished:
            self._finished = True
            with contextlib.suppress(OSError, RuntimeError):
                self._file.close()
            self.partial.unlink(missing_ok=True)
            self._end_lease()
            return
        try:
            self.finish(complete=False)
        except PulsetrainerError as second:
            # the first error tells why the block ended; this one, where the samples are
            error.add_note(f"{second.message} ({second.hint})")


def interrupted(final: Path | str) -> list[tuple[Path, int]]:
    """Return what killed programs left of captures into ``final``, with the number of samples, longest first.

    Files that hold no sample are removed; one whose writer is alive, or that cannot be read, is not listed.
    """
    final = Path(final)
    pattern = re.compile(rf"{re.escape(final.name)}\.partial(-\d+)?")
    found: list[tuple[Path, int]] = []
    with contextlib.suppress(OSError):  # no such folder: another check says so
        for path in sorted(entry for entry in final.parent.iterdir() if pattern.fullmatch(entry.name)):
            if not is_abandoned(path):
                continue
            try:
                samples = read_samples(path)
            except DataError:
                if path.stat().st_size < _CHUNK_BYTES:
                    sweep(path)
                continue
            if samples:
                found.append((path, samples))
            else:
                sweep(path)
    return sorted(found, key=lambda pair: -pair[1])


def _begins(run: Run, path: Path) -> bool:
    """Whether a run begins with all the samples of this recording."""
    with contextlib.suppress(DataError):
        part = read(path, Run)
        size = part.input.size
        return (
            size <= run.input.size
            and np.array_equal(part.input, run.input[:size], equal_nan=True)
            and np.array_equal(part.output, run.output[:size], equal_nan=True)
        )
    return False


def _claim_partial(final: Path) -> Path:
    """Create an empty file beside the final name and return its name.

    An older partial file is the recording of a program that was killed: it is never overwritten.
    """
    for k in itertools.count(1):
        partial = final.with_name(f"{final.name}.partial" if k == 1 else f"{final.name}.partial-{k}")
        try:
            partial.open("xb").close()
        except FileExistsError:
            continue
        except OSError as error:
            raise cannot_write(partial, error) from error
        return partial
    raise AssertionError  # itertools.count does not end
