"""A recording under way: an append-only file of checked blocks, beside the name that the run will have.

What ``append`` has returned from survives the death of the program. The file is

    JOURNAL, block, block, ...
    block = head, content
    head  = tag (4 letters), samples lost so far and length (8 bytes each), two crc32: of content and head

A ``HEAD`` is JSON: the header of the artefact and the run's texts. Whoever goes on with a recording adds
another, and the last one counts. ``DATA`` is little-endian float64 (4, n): time, reference, input, output.
``PART`` is the same, and its first sample comes after a pause. The journal of a session has ``GOAL`` instead,
(5, n) with the targets, and ``BEAT``, written as beats are over: JSON with the beats and the windows of
temperature that are new since the block before it, the quiz as far as it is answered, and the other fields of
the session as they stand now. The last block may be incomplete, where the writer was killed or is writing: it
is ignored. Anything else that does not fit is damage.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np

from pulsetrainer.artefacts import Beats, FloatArray, Quiz, Run, Session
from pulsetrainer.artefacts.run import seam_of
from pulsetrainer.artefacts.session import BEAT_COLUMNS
from pulsetrainer.errors import DamagedFileError, DataError
from pulsetrainer.files.input_file import JOURNAL
from pulsetrainer.files.provenance import Header, Provenance

COLUMNS = ("time_s", "reference", "input", "output")
PRESSED = ("time_s", "target", "reference", "input", "output")
WINDOW = ("temperature_s", "temperature_K")
CUT_OFF = "the record ends before the session does: it was cut off, or is still going on"
PIECE = 1 << 16  # samples at a time, where not all are to be in memory
DATA, PART, GOAL, BEAT = b"DATA", b"PART", b"GOAL", b"BEAT"
_WIDTHS = {DATA: len(COLUMNS), PART: len(COLUMNS), GOAL: len(PRESSED)}  # of blocks that hold samples
_HEAD = struct.Struct("<4sQQII")
_LARGEST = 1 << 32  # bytes of a block; a batch of samples has some thousands


@dataclass(frozen=True, slots=True)
class Block:
    """One block of a journal."""

    tag: bytes
    dropped: int  # samples lost on the wire since the recording began
    content: bytes
    end: int  # in the file

    @property
    def samples(self) -> FloatArray:
        """The columns (c, n) of its samples; (0, 0) where it holds none."""
        if self.tag not in _WIDTHS:
            return np.zeros((0, 0))
        return np.frombuffer(self.content, dtype="<f8").reshape(_WIDTHS[self.tag], -1)


class Journal:
    """A journal that is being written; ``at`` is the end of its last whole block.

    Its methods raise OSError where the file cannot be opened, or the disk is full or failed.
    """

    def __init__(self, path: Path, at: int = 0) -> None:
        self._stream = path.open("r+b", buffering=0)
        self._stream.truncate(at)
        self._end = self._stream.seek(at)
        if at == 0:
            self._write(JOURNAL)

    def describe(self, header: Header, texts: Mapping[str, str]) -> None:
        """Say what is recorded."""
        self.append(b"HEAD", json.dumps({"header": asdict(header), "run": dict(texts)}).encode())

    def append(self, tag: bytes, content: bytes, dropped: int = 0) -> None:
        """Append one block; where that fails the journal is as it was before."""
        head = _HEAD.pack(tag, dropped, len(content), zlib.crc32(content), 0)[:-4]
        self._write(head + struct.pack("<I", zlib.crc32(head)) + content)

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        try:
            while view:
                view = view[self._stream.write(view) :]
        except BaseException:
            self._stream.truncate(self._end)
            self._stream.seek(self._end)
            raise
        self._end += len(data)

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def blocks(path: Path) -> Iterator[Block]:
    """Yield the whole blocks of a journal.

    DamagedFileError where a block is not as it was written; OSError where the file cannot be read.
    """
    with path.open("rb") as stream:
        start = stream.read(len(JOURNAL))
        if not JOURNAL.startswith(start):
            raise _damage(path, stream.tell())
        if start != JOURNAL:
            return  # its writer was killed before it had written anything
        while block := _next_block(stream, path):
            yield block


def _next_block(stream: BinaryIO, path: Path) -> Block | None:
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    tag, dropped, length, crc, crc_of_head = _HEAD.unpack(head)
    if crc_of_head != zlib.crc32(head[:-4]) or length > _LARGEST:
        raise _damage(path, stream.tell())
    content = stream.read(length)
    if len(content) < length:
        return None
    if crc != zlib.crc32(content):
        raise _damage(path, stream.tell())
    return Block(tag, dropped, content, stream.tell())


def _damage(path: Path, place: int) -> DamagedFileError:
    return DamagedFileError(f"{path} is damaged before byte {place}", path=path, artefact="run")


@dataclass(frozen=True, slots=True)
class Recording:
    """What a journal holds."""

    header: Header
    artefact: Run | Session  # not complete
    end: int  # of the last whole block

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a whole journal.

        DamagedFileError where a block is not as it was written, or the journal has no HEAD; OSError where the
        file cannot be read.
        """
        found = list(blocks(path))
        heads = [block for block in found if block.tag == b"HEAD"]
        if not heads:
            raise DamagedFileError(f"{path} holds no recording yet", path=path, artefact="run")
        header, texts = _described(path, heads[-1])
        said = [block.content for block in found if block.tag == BEAT]
        names = PRESSED if said else COLUMNS
        samples = [block.samples for block in found if _WIDTHS.get(block.tag) == len(names)]
        columns = np.concatenate([np.zeros((len(names), 0)), *samples], axis=1)
        arrays: dict[str, Any] = dict(zip(names, columns, strict=True))
        if said:
            return cls(header, _session_of(path, arrays, said), found[-1].end)
        ends = np.cumsum([block.samples.shape[1] for block in found]).tolist()
        starts = [
            begin for begin, block in zip([0, *ends], found, strict=False) if begin and block.tag == PART
        ]
        seam, dropped = seam_of(starts, columns.shape[1]), found[-1].dropped
        run = Run(**arrays, **texts, seam=seam, complete=False, dropped_samples=dropped)
        return cls(header, run, found[-1].end)


def _described(path: Path, block: Block) -> tuple[Header, dict[str, Any]]:
    """Return the header and the texts of a HEAD."""
    try:
        said = json.loads(block.content)
        fields = said["header"]
        provenance = Provenance.from_json(json.dumps(fields["provenance"]))
        header = Header(fields["title"], fields["created"], tuple(fields["history"]), provenance)
        known = {field.name for field in dataclasses.fields(Run)}
        return header, {name: text for name, text in said["run"].items() if name in known}
    except (ValueError, KeyError, TypeError, AttributeError, DataError) as error:
        raise DamagedFileError(
            f"{path} does not say what it records: {error}", path=path, artefact="run"
        ) from error


def _session_of(path: Path, samples: Mapping[str, FloatArray], blocks: Sequence[bytes]) -> Session:
    """Return the session in a journal, not complete, from its samples and its BEAT blocks.

    DamagedFileError where these are not as they were written.
    """
    try:
        said = [json.loads(block) for block in blocks]
        rows = np.asarray([row for one in said for row in one["beats"]], dtype=np.float64)
        beats = Beats.of(rows.reshape(-1, len(BEAT_COLUMNS)).T)
        windows = np.asarray([row for one in said for row in one["windows"]], dtype=np.float64)
        warm = dict(zip(WINDOW, windows.reshape(-1, len(WINDOW)).T, strict=True)) if windows.size else {}
        plain = {name: _tupled(value) for name, value in said[-1]["fields"].items()}
        fields: dict[str, Any] = {**samples, **plain, **warm, "complete": False, "fault": CUT_OFF}
        return Session(beats=beats, quiz=_quiz(said[-1]["quiz"]), **fields)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DamagedFileError(
            f"{path} does not say what was pressed: {error}", path=path, artefact="session"
        ) from error


def _quiz(said: Mapping[str, Any] | None) -> Quiz | None:
    if said is None:
        return None
    times = {"response_s": np.asarray(said["response_s"], dtype=np.float64)}
    return Quiz(**{name: _tupled(value) for name, value in said.items()} | times)


def _tupled(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
