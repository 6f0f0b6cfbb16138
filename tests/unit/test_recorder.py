"""The recorder: what was appended survives whatever ends the program; no final name is half-written."""

from __future__ import annotations

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
from pulsetrainer.files.growing import lookup3
from pulsetrainer.files.provenance import Header
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.store import read, read_header, write

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
        tree = {"/": dict(file.attrs)}

        def take(name, item):
            links = ("DIMENSION_LIST", "REFERENCE_LIST")
            plain = {key: str(value) for key, value in item.attrs.items() if key not in links}
            axes = [(axis.label, list(axis.keys())) for axis in item.dims]
            tree[name] = (plain, axes, item.dtype, item[...].tolist())

        file.visititems(take)
    return tree


def test_the_same_file_as_the_store_writes(tmp_path):
    """A run recorded in batches and the same run written at once are equal trees, and read as equal."""
    run = examples.run(100, signal="identification", dropped_samples=2)
    write(tmp_path / "store.h5", run, examples.header())
    with RunRecorder(tmp_path / "recorder.h5", examples.header(), signal="identification") as recorder:
        _record(recorder, run)
        assert recorder.samples == 100
        assert recorder.finish(dropped_samples=2) == tmp_path / "recorder.h5"
    assert _tree(tmp_path / "recorder.h5") == _tree(tmp_path / "store.h5")
    assert examples.equal(read(tmp_path / "recorder.h5", Run), run)
    assert read_header(tmp_path / "recorder.h5") == examples.header()
    assert _names(tmp_path) == ["recorder.h5", "store.h5"]


def test_units_and_quantities_are_the_callers(tmp_path):
    """Another bench, other units."""
    words = {"input_unit": "V", "output_unit": "mN", "input_quantity": "voltage", "output_quantity": "thrust"}
    with RunRecorder(tmp_path / "a.h5", examples.header(), **words) as recorder:
        recorder.append(0.0, 1.0, 2.0, 3.0)
    run = read(tmp_path / "a.h5", Run)
    assert {word: getattr(run, word) for word in words} == words
    assert run.complete


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
    assert examples.equal(read(tmp_path / "a.h5", Run), examples.run(40, complete=False, dropped_samples=3))
    assert _names(tmp_path) == ["a.h5"]


def test_nothing_recorded_leaves_nothing(tmp_path):
    """A device that does not start leaves no file; a capture that ends well without samples is an error."""

    def capture(error):
        with RunRecorder(tmp_path / "a.h5", examples.header()) as recorder:
            recorder.append([], [], [], [])
            if error:
                raise error

    with pytest.raises(RuntimeError, match="port"):
        capture(RuntimeError("no port"))
    assert not _names(tmp_path)
    with pytest.raises(DataError, match="nothing was recorded"):
        capture(None)
    assert not _names(tmp_path)


def test_an_existing_output_is_refused_at_once(tmp_path):
    """Before the device moves: an existing file without force, a folder that is not there."""
    (tmp_path / "a.h5").write_text("old")
    with pytest.raises(ExistsError):
        RunRecorder(tmp_path / "a.h5", examples.header())
    with pytest.raises(UsageError, match="does not exist"):
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
    with pytest.raises(UsageError, match=r"kept in .*a\.h5\.partial"):
        recorder.finish()
    assert (tmp_path / "a.h5").read_text() == "first"
    assert len(read(tmp_path / "a.h5.partial", Run).input) == 5

    def capture():
        with RunRecorder(tmp_path / "b.h5", examples.header()) as second:
            _record(second, examples.run(5))
            (tmp_path / "b.h5").write_text("first")
            raise RuntimeError("link lost")

    with pytest.raises(RuntimeError, match="link lost") as caught:
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
    with pytest.raises(ArgumentError, match="finished"):
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
    with pytest.raises(DataError, match=r"is full: \d+ bytes are left") as caught:
        recorder.append(9.0, 0.0, 0.0, 0.0)
    assert "kept" in caught.value.hint
    recorder.finish(complete=False)
    assert examples.equal(read(tmp_path / "a.h5", Run), examples.run(30, complete=False))
    with pytest.raises(DataError, match="is full"):
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
        _record(RunRecorder(tmp_path / "a.h5", examples.header()), examples.run(300))
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    return tmp_path / "a.h5.partial"


def test_a_damaged_partial_file_is_an_error_soon(partial):
    """A killed capture that then was truncated or damaged: an error, and not after an endless wait."""
    content = partial.read_bytes()
    assert examples.equal(read(partial, Run), examples.run(300, complete=False))
    rng = random.Random(SEED)
    print("seed", SEED)
    for _ in range(20):
        partial.write_bytes(content[: rng.randrange(len(content))])
        with pytest.raises(DataError):
            read(partial, Run)
    for place in [*range(8, 12), 30, 45, *(rng.randrange(48, 3000) for _ in range(60))]:
        damaged = bytearray(content)
        damaged[place] ^= 1 << rng.randrange(8)
        partial.write_bytes(damaged)
        try:
            read(partial, Run)
        except DataError as error:
            assert error.hint  # noqa: PT017 - either outcome is right, as long as it comes soon


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


def test_checksum_of_hdf5():
    """The checksum is the one published with the algorithm, for every length of the last block."""
    assert lookup3(b"Four score and seven years ago") == 0x17770551
    assert len({lookup3(b"x" * n) for n in range(1, 30)}) == 29
