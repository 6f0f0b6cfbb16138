"""Files that are wrong, writes that fail: a clear error each, the old file intact, nothing left behind."""

from __future__ import annotations

import itertools
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import store_examples as examples

from pulsetrainer import artefacts as kinds
from pulsetrainer.artefacts import KINDS
from pulsetrainer.cli.next_step import next_step
from pulsetrainer.errors import DataError, ExistsError, NotAnArtefactError, UsageError, WrongKindError
from pulsetrainer.files import atomic_write, store
from pulsetrainer.files.atomic_write import cannot_write, check_output
from pulsetrainer.files.checksum import CHECKSUM_LENGTH
from pulsetrainer.files.input_file import is_sound
from pulsetrainer.files.store import read, read_any, read_header, write
from wording import raises

SEED = 20260102


@pytest.fixture
def run_file(tmp_path):
    """Return a good run on disk."""
    write(tmp_path / "run.h5", examples.run(), examples.header())
    return tmp_path / "run.h5"


def _edit(path, change):
    """Change a file as a user with h5py would; that cuts the checksum off."""
    with h5py.File(path, "r+") as file:
        change(file)


def _refused(path, kind, *words):
    """Assert that reading is a DataError whose message names the file and has these words; return it."""
    with pytest.raises(DataError) as caught:
        read(path, kind)
    assert caught.value.exit_code == 3
    for word in (str(path), *words):
        assert word in caught.value.message
    assert caught.value.hint
    return caught.value


# --- the wrong file ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("expected", "got"), list(itertools.permutations(sorted(KINDS), 2)))
def test_wrong_kind_names_both_and_the_next_command(expected, got, tmp_path):
    """For every pair of kinds the message says what was expected, what came, and what to run."""
    path = tmp_path / "my file.h5"
    write(path, examples.EXAMPLES[got](), examples.header())
    error = _refused(path, KINDS[expected])
    assert isinstance(error, WrongKindError)
    assert (error.path, error.expected, error.found) == (path, (expected,), got)
    hint = next_step(error)
    assert "pulsetrainer " in hint or "give the" in hint
    if str(path) in hint:
        assert f"'{path}'" in hint  # a shell can take it


def test_a_run_where_a_model_is_wanted(run_file):
    """The case that happens every day, word for word."""
    error = _refused(run_file, kinds.Model)
    assert error.message == f"{run_file}: expected a model, got a run"
    assert next_step(error) == f"run `pulsetrainer identify {run_file} -o model.h5`"


def test_absent(run_file):
    """An absent file: the nearest names of its folder are offered; an interrupted capture too."""
    error = _refused(run_file.with_name("rum.h5"), kinds.Run, "does not exist")
    assert "run.h5" in error.hint
    shutil.copy(run_file, run_file.with_name("long.h5.partial"))
    assert "long.h5.partial" in _refused(run_file.with_name("long.h5"), kinds.Run).hint
    assert "does not exist either" in _refused(run_file.parent / "no" / "a.h5", kinds.Run).hint
    for k in range(6):
        shutil.copy(run_file, run_file.with_name(f"monday{k}.h5"))
    assert "monday3.h5, monday4.h5" in (some := _refused(run_file.with_name("zzzzzzzzzz.h5"), kinds.Run).hint)
    assert "monday5" not in some  # five are enough where none is near


def test_folder_and_special_files(run_file):
    """A folder, a device, a pipe and an impossible name are not opened."""
    assert f"name a file in it: {run_file}" in _refused(run_file.parent, kinds.Run, "is a folder").hint
    (run_file.parent / "bare").mkdir()
    assert "none that can be read" in _refused(run_file.with_name("bare"), kinds.Run, "is a folder").hint
    _refused(Path("/dev/null"), kinds.Run, "not an ordinary file")
    os.mkfifo(run_file.with_name("pipe"))
    _refused(run_file.with_name("pipe"), kinds.Run, "not an ordinary file")
    _refused(run_file.with_name("x" * 300), kinds.Run, "cannot be read")


def test_not_hdf5(tmp_path):
    """An empty file, a text, a table: each its own words."""
    for name, content, word in [("e.h5", "", "is empty"), ("t.h5", "hello", "is not an HDF5 file")]:
        (tmp_path / name).write_text(content)
        assert "table" not in next_step(_refused(tmp_path / name, kinds.Run, word))
    (tmp_path / "t.csv").write_text("t,u,y\n1,2,3\n")
    error = _refused(tmp_path / "t.csv", kinds.Run)
    assert isinstance(error, NotAnArtefactError)
    assert f"the table first: pulsetrainer import {tmp_path / 't.csv'}" in next_step(error)


def test_hdf5_of_another_program(tmp_path):
    """An HDF5 file that is not ours says so."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = 1
    assert isinstance(_refused(tmp_path / "a.h5", kinds.Run), NotAnArtefactError)


def test_newer_format_names_both_versions(run_file):
    """A file of a later format: both versions and the remedy."""
    _edit(run_file, lambda file: file.attrs.modify("format_version", 7))
    error = _refused(run_file, kinds.Run, "format version 7", "up to version 1")
    assert "git pull" in error.hint


def _instead(name, **how):
    """Return a change that replaces a dataset by another."""

    def change(file):
        del file[name]
        file.create_dataset(name, **how)

    return change


def _attribute(name, value):
    """Return a change that sets an attribute of the root."""
    return lambda file: file.attrs.create(name, value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f.__delitem__("input"), ["'/input'", "is missing", "run"]),
        (lambda f: (f.__delitem__("input"), f.create_group("input")), ["'/input'", "is a group"]),
        (_instead("input", data=1.0), ["'/input'", "()", "(time)"]),
        (_instead("input", data=np.ones((50, 2))), ["(50, 2)"]),
        (_instead("input", data=np.ones(3)), ["3 values along time", "50"]),
        (_instead("input", data=["a"] * 50), ["expected numbers"]),
        (_instead("input", data=np.ones(50, "c16")), ["complex"]),
        (_instead("input", data=h5py.Empty("f8")), ["None"]),
        (_instead("time", data=np.ones(50)), ["does not increase"]),
        (_instead("time", data=np.full(50, np.nan)), ["not a number"]),
        (_attribute("signal", 3), ["'signal'", "expected a text"]),
        (_attribute("complete", "yes"), ["'complete'", "expected a number"]),
        (_attribute("dropped_samples", 0.5), ["'dropped_samples'", "whole number"]),
        (_attribute("dropped_samples", [1, 2]), ["'dropped_samples'", "expected a number"]),
        (_attribute("dropped_samples", np.nan), ["'dropped_samples'", "whole number"]),
        (_attribute("samples", -1), ["'samples'", "count"]),
        (_attribute("samples", "many"), ["'samples'", "count"]),
        (_attribute("samples", 99), ["50 values along time", "expected 99"]),
        (_attribute("format_version", "x"), ["'format_version'"]),
        (_attribute("kind", "moon"), ["unknown kind 'moon'"]),
        (_attribute("kind", 3), ["from another program"]),
    ],
)
def test_edited_run(run_file, change, words):
    """Whatever a user does to a run with h5py: the message names file and dataset or attribute."""
    _edit(run_file, change)
    _refused(run_file, kinds.Run, *words)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f["weights"].__setitem__(2, np.nan), ["'/weights'", "not finite", "index 2"]),
        (lambda f: f["offset"].__setitem__((), np.inf), ["'/offset'", "finite"]),
        (lambda f: f["weights"].__setitem__(2, -2e100), ["'/weights'", "goes from -2e+100 to", "1e+100"]),
        (_instead("offset", data=[1.0]), ["'/offset'", "(1,)"]),
        (_instead("levels", data=[0.0, 1]), ["1 levels has 1 cells"]),
        (_instead("covered", data=[0.0] * 6), ["whole numbers"]),
        (lambda f: f.__delitem__("extensions/0000"), ["'/extensions'", "0001"]),
        (lambda f: f.__delitem__("extensions/0001/parameters"), ["'/extensions/0001/parameters'", "missing"]),
        (lambda f: f["extensions/0001"].attrs.__delitem__("cause"), ["'/extensions/0001/cause'", "missing"]),
        (_instead("extensions", data=1), ["expected a group"]),
        (_instead("extensions/0001", data=1), ["expected a group"]),
    ],
)
def test_edited_model(tmp_path, change, words):
    """The same for numbers, groups and numbered groups."""
    extension = kinds.Extension("creep", (kinds.Parameter("amplitude", 0.1, "1", 0, 1),))
    write(tmp_path / "m.h5", examples.model(extensions=(extension, extension)), examples.header())
    _edit(tmp_path / "m.h5", change)
    error = _refused(tmp_path / "m.h5", kinds.Model, *words)
    assert "/: " not in error.message


def test_an_edited_model_within_a_waveform(tmp_path):
    """What is wrong with a part is said of the part."""
    write(tmp_path / "w.h5", examples.waveform(model=examples.model()), examples.header())
    _edit(tmp_path / "w.h5", lambda f: _instead("levels", data=[0.0, 1])(f["model"]))
    _refused(tmp_path / "w.h5", kinds.Waveform, "/model: ", "1 levels has 1 cells")


def test_damaged_size_does_not_fill_the_memory(run_file):
    """A dataset that claims a terabyte is refused before memory is asked for."""

    def inflate(file):
        for name in ("time", "input", "output", "reference"):
            del file[name]
            file.create_dataset(name, shape=(1 << 37,), chunks=(4096,), dtype="f8")
        file.attrs["samples"] = 1 << 37

    _edit(run_file, inflate)
    _refused(run_file, kinds.Run, "'/time'", "claims")


def test_broken_header(run_file):
    """A header that is missing or broken is an error of read_header only."""
    _edit(run_file, _attribute("provenance", "{"))
    with raises(DataError, "no sound provenance", file="run.h5"):
        read_header(run_file)
    _edit(run_file, lambda file: file.attrs.__delitem__("provenance"))
    with raises(DataError, "no provenance", file="run.h5"):
        read_header(run_file)
    assert examples.equal(read_any(run_file), examples.run())


@pytest.mark.parametrize(("libver", "version"), [("earliest", 0), ("v108", 2), ("latest", 3)])
def test_a_file_that_was_cut_is_not_offered(tmp_path, libver, version):
    """Whatever form of HDF5 another program wrote: its first bytes say how long it is."""
    path = tmp_path / "other.h5"
    with h5py.File(path, "w", libver=libver) as file:
        file["numbers"] = np.arange(1000.0)
    content = path.read_bytes()
    assert (content[8], is_sound(path)) == (version, True)
    path.write_bytes(content[:-1])
    assert not is_sound(path)


def test_truncated_anywhere(run_file):
    """Cut after any number of bytes, a file is refused; only without its checksum alone is it whole."""
    rng = random.Random(SEED)
    print("seed", SEED)
    content = run_file.read_bytes()
    whole = len(content) - CHECKSUM_LENGTH
    for size in [0, 1, 7, 8, 9, 511, whole - 1, *(rng.randrange(whole) for _ in range(60))]:
        run_file.write_bytes(content[:size])
        _refused(run_file, kinds.Run)
    for size in (whole, len(content) - 1):
        run_file.write_bytes(content[:size])
        assert examples.equal(read(run_file, kinds.Run), examples.run())


def test_flipped_bits(run_file):
    """One flipped bit: an error, or, in the checksum, the right data; never wrong data, never a crash."""
    rng = random.Random(SEED)
    print("seed", SEED)
    content = run_file.read_bytes()
    for _ in range(400):
        place, bit = rng.randrange(len(content)), rng.randrange(8)
        flipped = bytearray(content)
        flipped[place] ^= 1 << bit
        run_file.write_bytes(flipped)
        try:
            artefact = read(run_file, kinds.Run)
        except DataError:
            continue
        assert place >= len(content) - CHECKSUM_LENGTH
        assert examples.equal(artefact, examples.run())


def test_locked_by_another_program(run_file):
    """A file that another program has open for writing says so, or is read where the system lets it."""
    code = (
        f"import h5py, time; f = h5py.File({str(run_file)!r}, 'r+'); print('open', flush=True); time.sleep(9)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as holder:
        try:
            assert holder.stdout.readline() == b"open\n"
            error = _refused(run_file, kinds.Run)
            assert "locked" in error.message
        finally:
            holder.kill()


# --- writing ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("artefact", "words"),
    [
        (lambda: examples.run(input=np.array(["x"] * 50)), ["'input'", "expected numbers"]),
        (lambda: examples.run(input=np.ones((50, 50))), ["'input'", "(50, 50)", "(time)"]),
        (lambda: kinds.Evaluation(waveforms=None), ["'waveforms'", "missing"]),
        (lambda: replace(examples.waveform(), scaled=np.full(20, np.nan)), ["'scaled'", "not finite"]),
        (lambda: replace(examples.run(20), output=np.full(20, np.inf)), ["'output'", "to inf", "1e+100"]),
        (lambda: replace(examples.model(), offset=np.nan), ["'offset'", "finite"]),
        (
            lambda: replace(examples.model(), covered=np.ones(2, bool)),
            ["'covered'", "2 values along cell", "6"],
        ),
    ],
)
def test_artefacts_that_do_not_fit_are_not_written(artefact, words, tmp_path):
    """An artefact against its own annotations: an error that names the field, and no file."""
    with pytest.raises(DataError) as caught:
        write(tmp_path / "a.h5", artefact(), examples.header())
    assert all(word in caught.value.message for word in (str(tmp_path / "a.h5"), *words))
    assert not list(tmp_path.iterdir())


def test_existing_output_is_not_overwritten_unasked(run_file):
    """An existing file is refused before and while writing, unless overwriting is allowed."""
    before = run_file.read_bytes()
    for attempt in (
        lambda: check_output(run_file),
        lambda: write(run_file, examples.model(), examples.header()),
    ):
        with pytest.raises(ExistsError) as caught:
            attempt()
        assert caught.value.exit_code == 2
        assert caught.value.path == run_file
        assert "--overwrite" in next_step(caught.value)
    assert run_file.read_bytes() == before
    check_output(run_file, overwrite=True)
    write(run_file, examples.model(), examples.header(), overwrite=True)
    assert examples.equal(read_any(run_file), examples.model())


def test_outputs_that_cannot_be(tmp_path, monkeypatch):
    """A missing or read-only folder, a folder as name, a file as folder, an odd name: a usage error."""
    (tmp_path / "file").touch()
    (tmp_path / "astray.h5").symlink_to(tmp_path / "no" / "a.h5")
    (tmp_path / "itself.h5").symlink_to(tmp_path / "itself.h5")
    for path, words in [
        (tmp_path / "no" / "a.h5", f"the folder {tmp_path / 'no'} does not exist"),
        (tmp_path / "astray.h5", f"the folder {tmp_path / 'no'} does not exist"),
        (tmp_path / "itself.h5", "cannot be written"),
        (tmp_path, "is a folder"),
        (tmp_path / "file" / "a.h5", "is a file"),
        (Path("/dev/null"), "not an ordinary file"),
        (tmp_path / ("x" * 300), "cannot be written"),
    ]:
        with raises(UsageError, "not an output", said=words):
            check_output(path, overwrite=True)
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write anywhere
    with raises(UsageError, "not writable", folder=tmp_path):
        check_output(tmp_path / "a.h5")


def test_an_output_that_is_write_protected_stays(tmp_path, monkeypatch):
    """Somebody protected it: ``--overwrite`` is no leave to replace it."""
    kept = tmp_path / "kept.h5"
    kept.write_bytes(b"mine")
    kept.chmod(0o444)
    monkeypatch.setattr(os, "access", lambda path, _: path != kept)  # root may write anywhere
    with raises(DataError, "write-protected", file=kept), atomic_write.replacing(kept, overwrite=True):
        pass
    assert kept.read_bytes() == b"mine"


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="no /proc, where not even root makes files")
def test_a_folder_where_nobody_makes_files(tmp_path):
    """Its permissions allow it, or root may do anything: told before the work, not after it."""
    with raises(UsageError, "not an output", said="no file can be made in /proc"):
        check_output("/proc/a.h5")
    (tmp_path / "astray.h5").symlink_to("/proc/a.h5")
    with raises(UsageError, "not an output", said="no file can be made in /proc"):
        check_output(tmp_path / "astray.h5")


def test_looking_whether_an_output_can_be_written_leaves_nothing(tmp_path, monkeypatch):
    """What is tried is taken away; a full disk is told as such."""
    (tmp_path / "a.h5").write_text("kept")
    check_output(tmp_path / "a.h5", overwrite=True)
    check_output(tmp_path / "b.h5")
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("a.h5", "kept")]

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(atomic_write, "create_locked", full)
    with raises(DataError, "no room for an output", file=tmp_path / "b.h5"):
        check_output(tmp_path / "b.h5")


@pytest.mark.parametrize(
    "error", [RuntimeError("bug"), KeyboardInterrupt(), OSError(28, "No space left on device")]
)
@pytest.mark.parametrize("step", ["encode", "_publish"])
def test_an_exception_in_the_middle_changes_nothing(run_file, error, step, monkeypatch):
    """Whatever fails, at whatever step: the old file is intact, nothing else is in the folder."""
    before = run_file.read_bytes()

    def fail(*_, **__):
        raise error

    monkeypatch.setattr({"encode": store, "_publish": atomic_write}[step], step, fail)
    with pytest.raises(DataError if isinstance(error, OSError) else type(error)):
        write(run_file, examples.model(), examples.header(), overwrite=True)
    assert [entry.name for entry in run_file.parent.iterdir()] == ["run.h5"]
    assert run_file.read_bytes() == before


def test_a_file_that_came_meanwhile_is_not_overwritten(tmp_path):
    """Two processes, one output, no force: the first wins, the second says so."""

    def second():
        with atomic_write.replacing(tmp_path / "a.h5", overwrite=False) as mine:
            mine.write_text("second")
            (tmp_path / "a.h5").write_text("first")

    with pytest.raises(ExistsError):
        second()
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("a.h5", "first")]


def test_without_hard_links(tmp_path, monkeypatch):
    """On a file system without hard links the file appears by a rename, still without overwriting."""

    def no_links(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_links)
    write(tmp_path / "a.h5", examples.run(), examples.header())
    assert examples.equal(read_any(tmp_path / "a.h5"), examples.run())

    def second():
        with atomic_write.replacing(tmp_path / "b.h5", overwrite=False) as mine:
            mine.touch()
            (tmp_path / "b.h5").write_text("first")

    with pytest.raises(ExistsError):
        second()
    assert (tmp_path / "b.h5").read_text() == "first"


def test_through_a_symbolic_link(tmp_path):
    """A link as output stays a link; the file it points to is replaced."""
    (tmp_path / "there").mkdir()
    (tmp_path / "link.h5").symlink_to(tmp_path / "there" / "a.h5")
    write(tmp_path / "link.h5", examples.run(), examples.header())
    assert (tmp_path / "link.h5").is_symlink()
    assert examples.equal(read_any(tmp_path / "there" / "a.h5"), examples.run())


def test_permissions_are_those_of_any_new_file(tmp_path):
    """An artefact is as readable for others as any file the user makes."""
    (tmp_path / "plain").touch()
    write(tmp_path / "a.h5", examples.run(), examples.header())
    assert (tmp_path / "a.h5").stat().st_mode == (tmp_path / "plain").stat().st_mode


_WRITER = """
import resource, sys
import store_examples as examples
from pulsetrainer.files.store import write
from pulsetrainer.errors import DataError

path, limit = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), -1))
try:
    write(path, examples.run(20_000), examples.header(), overwrite=True)
except DataError as error:
    sys.exit(f"{error.message} | {error.hint}")
"""


def _writer(path, limit):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    command = [sys.executable, "-c", _WRITER, str(path), str(limit)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.mark.parametrize(
    ("error", "reason", "word"),
    [
        (OSError(28, "No space left on device"), "No space left on device", "space"),
        (OSError(5, "Input/output error"), "Input/output error", "permissions"),
        (
            RuntimeError("Can't write (error message = 'File too large', errno = 27)"),
            "File too large",
            "space",
        ),
        (RuntimeError("a bad day"), "a bad day", "permissions"),
    ],
)
def test_the_reason_of_the_system_is_told(error, reason, word):
    """Without the wrapping of HDF5 and of Python; a full disk has a remedy of its own."""
    told = cannot_write("a.h5", error)
    assert str(told).endswith(f": {reason}")
    assert word in told.hint


@pytest.mark.parametrize("limit", [1000, 60_000])
def test_full_disk(run_file, limit):
    """Where the file cannot grow: a message with the reason, a clean end, the old file."""
    with _writer(run_file, limit) as writer:
        _, said = writer.communicate(timeout=60)
    assert writer.returncode == 1, said
    assert b"could not be written: File too large | free some space" in said
    assert b"Traceback" not in said
    assert [entry.name for entry in run_file.parent.iterdir()] == ["run.h5"]
    assert examples.equal(read_any(run_file), examples.run())


@pytest.mark.slow
def test_killed_at_random_moments(tmp_path):
    """Kill -9 while artefacts replace each other: whatever is there under the name is whole, every time."""
    rng = random.Random(SEED)
    print("seed", SEED)
    whole = [examples.run(20_000), examples.model(40), examples.playback(2000)]
    path = tmp_path / "a.h5"
    begun = time.perf_counter()
    for artefact in whole:  # how long one round takes on this machine, now
        write(path, artefact, examples.header(), overwrite=True)
    one_round = time.perf_counter() - begun
    kinds_seen = set()
    for _ in range(30):
        child = os.fork()
        if child == 0:
            while True:
                for artefact in whole:
                    write(path, artefact, examples.header(), overwrite=True)
        time.sleep(rng.uniform(0.0, 3.0) * one_round)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        artefact = read_any(path)
        assert any(examples.equal(artefact, expected) for expected in whole)
        kinds_seen.add(artefact.kind)
    assert len(kinds_seen) > 1
