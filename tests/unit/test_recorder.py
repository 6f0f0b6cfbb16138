"""The recorder: what was appended survives whatever ends the program; no final name is half-written."""

from __future__ import annotations

import errno
import os
import random
import signal
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import store_examples as examples

from pulsetrainer.artefacts import Run
from pulsetrainer.errors import ArgumentError, DataError, ExistsError, UsageError
from pulsetrainer.files import recorder as recorder_module
from pulsetrainer.files.file_lock import is_abandoned
from pulsetrainer.files.journal import Journal, Recording, blocks
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.resume import earlier_of
from pulsetrainer.files.store import read, read_header, write
from pulsetrainer.steps.stopped import kept_in
from wording import raises

SEED = 20260102


def _record(recorder, run, batch=16):
    """Append a run in batches."""
    for start in range(0, len(run.time_s), batch):
        part = slice(start, start + batch)
        recorder.append(run.time_s[part], run.reference[part], run.input[part], run.output[part])


def _names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def _tree(path):
    """Return names, attributes, dtypes and values of a file; how the arrays are packed does not count."""
    with h5py.File(path) as file:
        tree = {"/": {key: np.asarray(value).tolist() for key, value in file.attrs.items()}}

        def take(name, item):
            links = ("DIMENSION_LIST", "REFERENCE_LIST")
            plain = {key: str(value) for key, value in item.attrs.items() if key not in links}
            axes = [(axis.label, list(axis.keys())) for axis in item.dims]
            tree[name] = (plain, axes, item.dtype, item[...].tolist())

        file.visititems(take)
    return tree


@pytest.mark.parametrize(("many", "said"), [(1, "1 beat was kept"), (2, "2 beats were kept")])
def test_what_was_kept_is_counted(many, said):
    """It said "1 beats were kept"."""
    assert kept_in(Path("run.h5"), many, "beat") == f"; {said} in run.h5 (complete=false)"


def test_the_same_file_as_the_store_writes(tmp_path):
    """A run recorded in batches and the same run written at once are equal trees, and read as equal."""
    run = examples.run(100, signal="identification", dropped_samples=2, captured=True, serial="1")
    write(tmp_path / "store.h5", run, examples.header())
    with RunRecorder(tmp_path / "recorder.h5", examples.header(), signal="identification") as recorder:
        _record(recorder, run)
        assert recorder.samples == 100
        recorder.dropped_samples = 2
        assert recorder.finish() == tmp_path / "recorder.h5"
    assert _tree(tmp_path / "recorder.h5") == _tree(tmp_path / "store.h5")
    assert examples.equal(read(tmp_path / "recorder.h5", Run), run)
    assert read_header(tmp_path / "recorder.h5") == examples.header()
    assert _names(tmp_path) == ["recorder.h5", "store.h5"]


@pytest.mark.parametrize("error", [RuntimeError("link lost"), KeyboardInterrupt()])
def test_an_exception_keeps_what_was_recorded(tmp_path, error):
    """A lost link or Ctrl-C in the block: the run is there under its name, complete=False."""

    def capture():
        with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
            _record(recorder, examples.run(40))
            recorder.dropped_samples = 3
            raise error

    with pytest.raises(type(error)):
        capture()
    assert examples.equal(
        read(tmp_path / "a.h5", Run),
        examples.run(40, complete=False, dropped_samples=3, captured=True, serial="1"),
    )
    assert _names(tmp_path) == ["a.h5"]


def test_nothing_recorded_leaves_nothing(tmp_path):
    """A device that does not start leaves no file; a capture that ends well without samples is an error."""

    def capture(error):
        with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
            recorder.append([], [], [], [])
            if error:
                raise error

    with pytest.raises(RuntimeError):
        capture(RuntimeError())
    assert not _names(tmp_path)
    with raises(DataError, "nothing recorded"):
        capture(None)
    assert not _names(tmp_path)


def test_an_existing_output_is_refused_at_once(tmp_path):
    """Before the device moves: an existing file, a folder that is not there."""
    (tmp_path / "a.h5").write_text("old")
    with pytest.raises(ExistsError):
        RunRecorder(tmp_path / "a.h5", examples.header())
    with raises(UsageError, "no folder", folder=tmp_path / "no"):
        RunRecorder(tmp_path / "no" / "a.h5", examples.header())
    with RunRecorder(tmp_path / "a.h5", examples.header(), overwrite=True) as recorder:
        _record(recorder, examples.run(5))
        assert (tmp_path / "a.h5").read_text() == "old"
    assert len(read(tmp_path / "a.h5", Run).input) == 5


def test_a_name_taken_meanwhile_keeps_the_recording(tmp_path):
    """Two captures into one output: the second is not lost, the message says where it is."""
    recorder = RunRecorder(tmp_path / "a.h5", examples.header())
    _record(recorder, examples.run(5))
    (tmp_path / "a.h5").write_text("first")
    with raises(UsageError, "kept elsewhere", file="a.h5.partial"):
        recorder.finish()
    assert (tmp_path / "a.h5").read_text() == "first"
    assert len(read(tmp_path / "a.h5.partial", Run).input) == 5

    def capture():
        with RunRecorder(tmp_path / "b.h5", examples.header()) as second:
            _record(second, examples.run(5))
            (tmp_path / "b.h5").write_text("first")
            raise RuntimeError

    with pytest.raises(RuntimeError) as caught:
        capture()
    assert "b.h5.partial" in caught.value.__notes__[0]


def test_an_older_partial_file_is_not_overwritten(tmp_path):
    """What a killed capture left stays; the new one grows under another name."""
    (tmp_path / "a.h5.partial").write_text("an hour")
    with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
        assert recorder.partial.name == "a.h5.partial-2"
        _record(recorder, examples.run(5))
    assert _names(tmp_path) == ["a.h5", "a.h5.partial"]
    assert (tmp_path / "a.h5.partial").read_text() == "an hour"


@pytest.mark.parametrize(
    "batch",
    [
        ([1.0, 2.0], [0.0], [0.0], [0.0]),
        ([[1.0]], [[0.0]], [[0.0]], [[0.0]]),
        ([2.0, 2.0], [0, 0], [0, 0], [0, 0]),
        ([np.nan], [0.0], [0.0], [0.0]),
        ([np.inf], [0.0], [0.0], [0.0]),
        ([0.5], [0.0], [0.0], [0.0]),
    ],
)
def test_batches_that_do_not_fit(tmp_path, batch):
    """Unequal lengths, a time that does not increase, within or between batches: refused, nothing changed."""
    with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
        recorder.append(0.5, 1.0, 1.0, 1.0)
        with pytest.raises(ArgumentError):
            recorder.append(*batch)
        recorder.append(0.6, 1.0, 1.0, 1.0)
    with raises(ArgumentError, "recording is finished"):
        recorder.append(0.7, 1.0, 1.0, 1.0)
    np.testing.assert_array_equal(read(tmp_path / "a.h5", Run).time_s, [0.5, 0.6])


def test_missing_samples_may_be_nan(tmp_path):
    """A value that the device could not measure is NaN, not an error."""
    with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
        recorder.append([0.0, 1.0], [1.0, 1.0], [np.nan, 1.0], [1.0, np.nan])
    assert np.isnan(read(tmp_path / "a.h5", Run).output[1])


def test_full_disk_keeps_what_is_there(tmp_path, monkeypatch):
    """When the disk fills up the capture stops in time, and what was recorded gets its name."""
    recorder = RunRecorder(tmp_path / "a.h5", examples.header())
    _record(recorder, examples.run(30))
    monkeypatch.setattr(recorder_module, "_RESERVE_BYTES", 1 << 62)
    with raises(DataError, "disk is full", folder=tmp_path):
        recorder.append(9.0, 0.0, 0.0, 0.0)
    recorder.finish(complete=False)
    assert examples.equal(
        read(tmp_path / "a.h5", Run), examples.run(30, complete=False, captured=True, serial="1")
    )
    with raises(DataError, "disk is full", folder=tmp_path):
        RunRecorder(tmp_path / "b.h5", examples.header())
    assert _names(tmp_path) == ["a.h5"]


def test_header_carries_no_plant_parameter(tmp_path):
    """A header made by hand with a full port is cut all the same."""
    header = Header("on bench:?creep=0.05", "2026-01-02T03:04:05Z", ("capture bench:?creep=0.05",))
    with RunRecorder(tmp_path / "a.h5", header, signal="bench:?creep=0.05") as recorder:
        recorder.append(0.0, 1.0, 1.0, 1.0)
    assert b"creep" not in (tmp_path / "a.h5").read_bytes()


def _child(path, batch, written):
    """Record without end, and tell the parent how many samples are safe."""
    recorder = RunRecorder(path, examples.header())
    os.write(written, b"0\n")
    while True:
        values = recorder.samples + np.arange(float(batch))
        recorder.append(values, values, values, values)
        os.write(written, b"%d\n" % recorder.samples)


def test_killed_at_random_moments(tmp_path):
    """Kill -9 during a capture: every sample whose append had returned is there, and no final name."""
    rng = random.Random(SEED)
    print("seed", SEED)
    for k in range(25):
        path = tmp_path / f"{k}.h5"
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            _child(path, rng.choice([1, 20, 500]), writer)
        os.close(writer)
        os.read(reader, 1)  # it has begun
        time.sleep(rng.uniform(0, 0.08))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        with os.fdopen(reader, "rb") as told:
            safe = int((told.read().split(b"\n")[-2:-1] or [b"0"])[0] or 0)
        assert not path.exists()
        run = read(tmp_path / f"{k}.h5.partial", Run)
        assert len(run.input) >= safe
        assert not run.complete
        for values in (run.time_s, run.reference, run.input, run.output):
            np.testing.assert_array_equal(values, np.arange(len(run.input)))


def test_readable_while_it_grows(tmp_path):
    """Another program reads the capture while it runs, and sees it grow."""
    path = tmp_path / "a.h5"
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        _child(path, 20, writer)
    os.close(writer)
    try:
        os.read(reader, 2)
        lengths = []
        for _ in range(10):
            time.sleep(0.02)
            os.read(reader, 1 << 20)
            lengths.append(len(read(tmp_path / "a.h5.partial", Run).input))
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(reader)
    assert lengths == sorted(lengths)
    assert lengths[0] < lengths[-1]


@pytest.fixture
def partial(tmp_path):
    """Return what a killed capture of 300 samples leaves."""
    child = os.fork()
    if child == 0:
        header = examples.header(parameters={"levels": 12})
        _record(RunRecorder(tmp_path / "a.h5", header), examples.run(300))
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    return tmp_path / "a.h5.partial"


def test_a_cut_journal_keeps_every_whole_block(partial):
    """Cut after any byte: the samples of the whole blocks before it, in order, and nothing else."""
    content = partial.read_bytes()
    assert examples.equal(read(partial, Run), examples.run(300, complete=False, captured=True, serial="1"))
    ends = [(block.end, block.samples.shape[1]) for block in blocks(partial)]
    rng = random.Random(SEED)
    print("seed", SEED)
    first = ends[0][0]
    assert next(blocks(partial)).dropped == 0
    for size in [first, ends[1][0] - 1, *(rng.randrange(first, len(content)) for _ in range(40))]:
        partial.write_bytes(content[:size])
        run = read(partial, Run)
        whole = sum(samples for end, samples in ends if end <= size)
        assert np.array_equal(run.input, examples.run(300).input[:whole])
    for size in (0, 5, 30, first - 1):
        partial.write_bytes(content[:size])
        with pytest.raises(DataError):
            read(partial, Run)


def test_no_flipped_bit_of_a_journal_goes_unseen(partial):
    """One flipped bit anywhere, in lengths and texts too: an error; never fewer or other samples."""
    content = partial.read_bytes()
    rng = random.Random(SEED + 1)
    print("seed", SEED + 1)
    for _ in range(400):
        damaged = bytearray(content)
        damaged[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        partial.write_bytes(damaged)
        with pytest.raises(DataError) as caught:
            read(partial, Run)
        assert caught.value.hint


def test_a_full_disk_in_the_middle_of_a_block(tmp_path, monkeypatch):
    """A block that was half written when the disk was full is taken back: the next one fits."""
    path = tmp_path / "a.journal"
    path.touch()
    journal = Journal(path)
    journal.describe(examples.header(), {"signal": "x"})

    class Short:
        """A stream that writes a little, then fails."""

        def __init__(self, stream):
            self.stream, self.writes = stream, 0

        def write(self, view):
            self.writes += 1
            if self.writes > 1:
                raise OSError(errno.ENOSPC, "")
            return self.stream.write(view[:10])

        def __getattr__(self, name):
            return getattr(self.stream, name)

    stream = journal._stream
    monkeypatch.setattr(journal, "_stream", Short(stream))
    with pytest.raises(OSError) as caught:  # noqa: PT011 - its number is held
        journal.append(b"DATA", np.zeros((4, 5)).tobytes())
    assert caught.value.errno == errno.ENOSPC
    monkeypatch.setattr(journal, "_stream", stream)
    journal.append(b"DATA", np.arange(8.0).tobytes(), dropped=7)
    run = Recording.read(path).artefact
    assert run.output.tolist() == [6.0, 7.0]
    assert run.dropped_samples == 7


def test_a_cut_off_recording_goes_on(partial, tmp_path):
    """Its samples, a seam, the new ones; a torn block is dropped; the last header counts."""
    with partial.open("ab") as stream:
        stream.write(b"DATA torn")
    earlier = read(partial, Run)
    header = examples.header("goes on")
    with RunRecorder(tmp_path / "a.h5", header, signal="x", earlier=(partial, earlier)) as recorder:
        assert recorder.partial == partial
        assert (recorder.samples, recorder.end_s) == (300, earlier.time_s[-1])
        recorder.begin_part()
        recorder.append([1.0, 1.1], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0])
        assert read_header(partial) == header
        assert np.flatnonzero(read(partial, Run).seam).tolist() == [300]
    run = read(tmp_path / "a.h5", Run)
    assert np.array_equal(run.output, [*earlier.output, 3.0, 3.0])
    assert np.flatnonzero(run.seam).tolist() == [300]
    assert run.complete
    assert _names(tmp_path) == ["a.h5"]


def test_a_name_with_brackets_is_resumed(partial, tmp_path):
    """What would be a pattern of names for a shell is one name here."""
    partial.rename(tmp_path / "a[1].h5.partial")
    earlier = earlier_of(tmp_path / "a[1].h5", {}, overwrite=False)
    earlier.close()
    assert earlier.path.name == "a[1].h5.partial"


def test_what_cannot_be_resumed_is_let_go(partial, tmp_path):
    """Refused for its options, it is free for others, as it was before."""
    with raises(UsageError, "recorded with other options"):
        earlier_of(tmp_path / "a.h5", {"levels": 24}, overwrite=False)
    assert is_abandoned(partial)
    earlier = earlier_of(tmp_path / "a.h5", {"levels": 12}, overwrite=False)
    assert not is_abandoned(partial)
    earlier.close()


def test_an_artefact_that_a_fault_ended_goes_on(tmp_path):
    """It is copied into a journal; the artefact stays until the new one takes its name."""
    write(tmp_path / "a.h5", examples.run(100, complete=False, dropped_samples=4), examples.header())
    earlier = (tmp_path / "a.h5", read(tmp_path / "a.h5", Run))
    with RunRecorder(tmp_path / "a.h5", examples.header(), overwrite=True, earlier=earlier) as recorder:
        recorder.begin_part()
        recorder.append(9.0, 1.0, 2.0, 3.0)
        assert read(tmp_path / "a.h5", Run).input.size == 100
        assert read(recorder.partial, Run).input.size == 101
    run = read(tmp_path / "a.h5", Run)
    assert run.dropped_samples == 4
    assert np.flatnonzero(run.seam).tolist() == [100]
    assert _names(tmp_path) == ["a.h5"]


@pytest.mark.parametrize("batch", [7001, 65_536, 100_000])
def test_a_long_recording_becomes_the_same_file(tmp_path, batch):
    """More samples than are copied at a time: in order, none lost between two pieces, nor after the last."""
    time = np.arange(200_000.0 if batch == 7001 else 2.0 * batch)
    with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
        for start in range(0, time.size, batch):
            part = time[start : start + batch]
            recorder.append(part, part + 0.25, part + 0.5, part + 0.75)
    run = read(tmp_path / "a.h5", Run)
    for values, offset in ((run.time_s, 0.0), (run.reference, 0.25), (run.input, 0.5), (run.output, 0.75)):
        np.testing.assert_array_equal(values, time + offset)


def test_memory_stays_flat(tmp_path):
    """Recording for long takes no more memory than recording for a while."""

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    batch = 4096
    with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
        for k in range(300):
            values = k * batch + np.arange(float(batch))
            recorder.append(values, values, values, values)
            if k == 100:
                before = resident()
        assert resident() - before < 10e6
