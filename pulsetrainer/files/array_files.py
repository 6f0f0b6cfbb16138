"""Records that are not text: numpy's .npz and .npy, MATLAB's .mat of any version, .wav.

Every vector in the file is a column under its own name; a matrix gives one column for each of its shorter
side. What is nested (a MATLAB structure, an HDF5 group) has its path for a name: ``run.force``. The time
is a column named so, or the rate in the file.
"""

from __future__ import annotations

import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pulsetrainer.artefacts import FloatArray
from pulsetrainer.artefacts.units import counted
from pulsetrainer.errors import DataError
from pulsetrainer.files.input_file import HDF5

RATE_NAMES = frozenset(["fs", "rate", "rate_hz", "sample_rate", "samplerate", "sampling_rate", "f_s"])
STEP_NAMES = frozenset(["dt", "dt_s", "ts", "tinterval", "sample_time"])
_KINDS = {"c": "complex numbers", "U": "text", "S": "text"}
_WIDEST = 64  # columns that one matrix may give


@dataclass(frozen=True, slots=True)
class Columns:
    """The longest vectors of a file, and its rate; ``left_out`` says why all else is no column."""

    values: Mapping[str, FloatArray]  # each (n,)
    rate_Hz: float | None
    units: Mapping[str, str]
    left_out: Mapping[str, str] = field(default_factory=dict)


def reader_of(path: Path) -> Callable[[Path], Columns] | None:
    """Return what reads a file of this name, or None for text."""
    readers = {".npz": _read_npz, ".npy": _read_npy, ".mat": _read_mat, ".wav": _read_wav}
    return readers.get(path.suffix.lower())


def _read_npz(path: Path) -> Columns:
    damage = (ValueError, EOFError, zipfile.BadZipFile, zlib.error, AttributeError, TypeError)
    with _read_as(path, "an .npz archive of numbers", *damage), np.load(path, allow_pickle=False) as file:
        return _columns(path, dict(_arrays_in(file)))


def _arrays_in(archive: Any) -> Iterator[tuple[str, Any]]:
    """Yield the members by name, but for those of Python's own objects: these are never loaded."""
    for name in archive.files:
        try:
            yield name, archive[name]
        except ValueError as error:
            if "allow_pickle" not in str(error):
                raise


def _read_npy(path: Path) -> Columns:
    with _read_as(path, "a .npy array of numbers", ValueError, EOFError), path.open("rb") as stream:
        array = np.lib.format.read_array(stream, allow_pickle=False)  # np.load would take an archive, too
    if array.dtype.names:
        return _columns(path, {name: array[name] for name in array.dtype.names})
    return _columns(path, {"column": array})


def _read_mat(path: Path) -> Columns:
    with path.open("rb") as stream:
        head = stream.read(520)
    # version 7.3 is HDF5 behind a block of 512 bytes of text
    if HDF5 in (head[512:520], head[:8]):
        return _read_mat_73(path)
    # half a second that text files need not wait for
    from scipy.io import loadmat  # noqa: PLC0415
    from scipy.io.matlab import MatReadError  # noqa: PLC0415

    damage = (MatReadError, ValueError, TypeError, NotImplementedError, LookupError, zlib.error)
    with _read_as(path, "a MATLAB file", *damage):
        content = loadmat(path, squeeze_me=True, struct_as_record=True)
    found: dict[str, Any] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            _flatten(name, value, found)
    return _columns(path, found)


def _flatten(name: str, value: Any, found: dict[str, Any]) -> None:
    """Put the fields of a structure under their paths."""
    array = np.asarray(value)
    if array.dtype.names is None:
        found[name] = array
        return
    if array.size == 1:
        for key in array.dtype.names:
            _flatten(f"{name}.{key}", array[key].item() if array[key].dtype == object else array[key], found)


def _read_mat_73(path: Path) -> Columns:
    import h5py  # noqa: PLC0415

    found: dict[str, Any] = {}
    units: dict[str, str] = {}

    def visit(name: str, node: Any) -> None:
        is_text = isinstance(node, h5py.Dataset) and node.attrs.get("MATLAB_class") == b"char"
        if isinstance(node, h5py.Dataset) and not name.startswith("#") and not is_text:
            dotted = name.replace("/", ".")
            found[dotted] = np.asarray(node[()]).T  # MATLAB counts columns first
            if "units" in node.attrs:
                units[dotted] = str(np.asarray(node.attrs["units"]).item())

    with _read_as(path, "a MATLAB 7.3 file", OSError, ValueError, TypeError), h5py.File(path) as file:
        file.visititems(visit)
    return _columns(path, found, units)


def _read_wav(path: Path) -> Columns:
    from scipy.io import wavfile  # noqa: PLC0415

    # UnboundLocalError: what scipy makes of a file without its format or its samples
    damage = (ValueError, EOFError, struct.error, wavfile.WavFileWarning, UnboundLocalError)
    with _read_as(path, "a whole .wav file", *damage), warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=wavfile.WavFileWarning)
        warnings.filterwarnings("error", message="Reached EOF", category=wavfile.WavFileWarning)
        rate, samples = wavfile.read(path)
    channels = samples.reshape(samples.shape[0], -1)
    # integers count steps of the converter: 1 is full scale, as in every sound program
    zero, full = 0.0, 1.0
    if samples.dtype == np.uint8:
        zero = full = 128.0
    elif np.issubdtype(samples.dtype, np.integer):
        full = float(np.iinfo(samples.dtype).max) + 1.0
    values = {f"channel{k + 1}": (channels[:, k] - zero) / full for k in range(channels.shape[1])}
    return Columns(values, float(rate), {})


def _columns(path: Path, arrays: Mapping[str, Any], units: Mapping[str, str] | None = None) -> Columns:
    """Return the longest vectors, and the rate if a number says it."""
    vectors: dict[str, FloatArray] = {}
    left_out: dict[str, str] = {}
    rate = None
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            left_out[name] = _KINDS.get(array.dtype.kind, "no numbers")
            continue
        array = np.squeeze(array)
        word = name.rpartition(".")[2].lower()
        if array.ndim == 0:
            number = float(array)
            if number > 0 and word in RATE_NAMES:
                rate = number
            elif number > 0 and word in STEP_NAMES:
                rate = 1.0 / number
        elif array.ndim == 1:
            vectors[name] = np.asarray(array, dtype=np.float64)
        elif array.ndim == 2 and min(array.shape) <= _WIDEST:
            tall = array if array.shape[0] >= array.shape[1] else array.T
            for k in range(tall.shape[1]):
                vectors[f"{name}{k + 1}"] = np.asarray(tall[:, k], dtype=np.float64)
        else:
            left_out[name] = f"an array of {' x '.join(map(str, array.shape))}"
    sizes = [vector.size for vector in vectors.values()]
    if not sizes:
        listed = ", ".join(f"{name} ({left_out.get(name, 'one number')})" for name in arrays) or "nothing"
        raise DataError(
            f"{path} has no column of numbers; it has {listed}",
            hint="save each quantity as a row of real numbers, all of one length",
        )
    # the record's columns are the longest vectors; shorter ones are settings
    longest = max(sizes)
    values = {name: v for name, v in vectors.items() if v.size == longest}
    left_out |= {
        name: f"{counted(v.size, 'value')}, where the columns have {longest}"
        for name, v in vectors.items()
        if v.size < longest
    }
    return Columns(values, rate, units or {}, left_out)


@contextmanager
def _read_as(path: Path, kind: str, *damage: type[Exception]) -> Iterator[None]:
    """Raise DataError for the errors by which a library tells that a file is not of its kind."""
    try:
        yield
    except damage as error:
        # what the library says is for programmers
        said = ": it lacks its format or its samples" if isinstance(error, UnboundLocalError) else ""
        if "pickle" in str(error):
            said = ", or holds objects of Python's"
        raise DataError(
            f"{path} is not {kind} that can be read{said}", hint="save it again, or export it as CSV"
        ) from error
