"""Records that are no text: .npz, .npy, .mat of both kinds and .wav."""

from __future__ import annotations

import re

import h5py
import numpy as np
import pytest
from scipy.io import savemat, wavfile

from pulsetrainer.errors import DataError
from pulsetrainer.files.run_from_table import run_from_table
from pulsetrainer.files.table import read_table
from wording import raises


def read_run(path, **columns):
    """Return the run in a table."""
    return run_from_table(path, **columns).run


N = 500
T = np.arange(N) / 250.0
U = np.sin(3.0 * T)
Y = U**3 + 0.1


def _same(path, u, y, **options):
    run = read_run(path, input=u, output=y, **options)
    np.testing.assert_array_equal(run.input, U)
    np.testing.assert_array_equal(run.output, Y)
    np.testing.assert_allclose(run.time_s, T, rtol=0, atol=1e-12)
    return run


def test_npz_with_a_time_vector(tmp_path):
    """Vectors are columns, a column named time is the time, settings beside them are none."""
    np.savez(tmp_path / "r.npz", force_N=Y, time_s=T, current_A=U, gain=2.0, note="hello", limits=[0.0, 1.0])
    run = _same(tmp_path / "r.npz", "current_A", "force_N")
    assert (run.input_unit, run.output_unit, run.input_quantity) == ("A", "N", "current")


def test_npz_with_a_rate(tmp_path):
    """A number called fs is the rate; a matrix gives a column for each of its shorter side."""
    np.savez_compressed(tmp_path / "r.npz", data=np.stack([U, Y]), fs=250)
    _same(tmp_path / "r.npz", "data1", "data2")


def test_a_picture_gives_no_columns(tmp_path):
    """A matrix gives up to 64, whichever way it lies."""
    matrices = {"most": np.ones((N, 64)), "more": np.ones((N, 65)), "flat": np.ones((64, N))}
    np.savez(tmp_path / "r.npz", **matrices, t=T)
    expected = {f"{name}{k + 1}" for name in ("most", "flat") for k in range(64)} | {"t"}
    assert set(read_table(tmp_path / "r.npz").columns) == expected


def test_npz_with_objects(tmp_path):
    """What numpy would only load by running code is left alone; the numbers beside it are read."""
    np.savez(tmp_path / "r.npz", who=np.array([{}], dtype=object), t=T, u=U, y=Y)
    _same(tmp_path / "r.npz", "u", "y")


def test_npy_with_named_fields(tmp_path):
    """A structured array has its fields for columns."""
    array = np.zeros(N, dtype=[("t", float), ("u", float), ("y", float)])
    array["t"], array["u"], array["y"] = T, U, Y
    np.save(tmp_path / "r.npy", array)
    _same(tmp_path / "r.npy", "u", "y")


def test_mat_version_5_with_a_structure(tmp_path):
    """Fields of structures have their path for a name."""
    content = {"run": {"t": T[:, None], "u": U, "meta": {"who": "bench"}, "y": Y[None, :]}, "dt": 1 / 250}
    savemat(tmp_path / "r.mat", content)
    _same(tmp_path / "r.mat", "run.u", "run.y")


def test_mat_version_73(tmp_path):
    """HDF5 behind MATLAB's block of 512 bytes; vectors are stored as rows."""
    with h5py.File(tmp_path / "r.mat", "w", userblock_size=512) as file:
        for name, vector in (("t", T), ("run/u", U), ("run/y", Y)):
            file[name] = vector[None, :]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["who"] = np.frombuffer(b"bench", dtype=np.uint8).astype(np.uint16)
        file["who"].attrs["MATLAB_class"] = np.bytes_("char")
    with (tmp_path / "r.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    run = _same(tmp_path / "r.mat", "run.u", "run.y")
    assert run.input_quantity == "run.u"


@pytest.mark.parametrize("kind", [np.float32, np.int16, np.int32, np.uint8])
def test_wav(tmp_path, kind):
    """Channels are columns, integers are shares of full scale, the rate is that of the file."""
    both = np.stack([0.5 * np.sin(T), 0.25 * np.cos(T)], axis=1)
    full = {np.float32: 1.0, np.int16: 2.0**15, np.int32: 2.0**31, np.uint8: 128.0}[kind]
    zero = 128.0 if kind is np.uint8 else 0.0
    written = (np.round(both * full + zero) if full > 1 else both).astype(kind)
    wavfile.write(tmp_path / "r.wav", 250, written)
    table = read_table(tmp_path / "r.wav")
    assert table.names == ("channel1", "channel2")
    assert table.rate_Hz == 250.0
    np.testing.assert_allclose(
        np.column_stack(list(table.columns.values())), both, rtol=0, atol=max(0.51 / full, 1e-7)
    )


@pytest.mark.parametrize("suffix", [".npz", ".npy", ".mat", ".wav"])
def test_what_is_no_such_file_is_said(tmp_path, suffix):
    """Another file under that name, a cut one, an empty one."""
    whole = tmp_path / "whole"
    np.savez(f"{whole}.npz", u=U)
    np.save(f"{whole}.npy", U)
    savemat(f"{whole}.mat", {"u": U})
    wavfile.write(f"{whole}.wav", 250, U)
    content = (tmp_path / f"whole{suffix}").read_bytes()
    other = (tmp_path / ("whole.npz" if suffix == ".npy" else "whole.npy")).read_bytes()
    cases = (("text", b"t,u\n0,1\n1,2\n"), ("cut", content[:60]), ("none", b""), ("other", other))
    for name, data in cases:
        path = tmp_path / f"{name}{suffix}"
        path.write_bytes(data)
        with raises(DataError, "names it", named=path.name):
            read_table(path)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            {"u": np.arange(5.0), "y": np.arange(6.0)},
            "u is no column, it has 5 values, where the columns have 6",
        ),
        ({"u": np.array(["a", "b"]), "y": np.arange(2.0)}, "u is no column, it has text; columns: y"),
        ({"u": np.zeros(4, complex)}, "no column of numbers; it has u (complex numbers)"),
        ({"u": np.zeros((3, 3, 3))}, "no column of numbers; it has u (an array of 3 x 3 x 3)"),
        ({"y": np.arange(5.0)}, "has no column 'u'; it has a single one, y"),
    ],
)
def test_what_is_no_column_is_said_with_its_reason(tmp_path, content, said):
    """It is in the file, so that it is not there would be false."""
    np.savez(tmp_path / "r.npz", **content)
    with pytest.raises(DataError, match=re.escape(said)):
        read_table(tmp_path / "r.npz").column("u")


@pytest.mark.parametrize("name", ["r.npz", "r.npy", "r.wav"])
def test_what_a_library_says_to_programmers_is_not_passed_on(tmp_path, name):
    """Neither numpy's advice to unpickle, nor the form type of a sound."""
    (tmp_path / name).write_bytes(b"RIFFgarbage of no kind")
    with pytest.raises(DataError, match="that can be read") as caught:
        read_table(tmp_path / name)
    assert not {"pickle", "RIFF form"} & {
        word for word in ("pickle", "RIFF form") if word in str(caught.value)
    }


def test_objects_are_not_unpickled(tmp_path):
    """An archive of Python objects could run anything: it is refused."""
    np.savez(tmp_path / "r.npz", u=np.asarray([{"a": 1}], dtype=object))
    with raises(DataError, "names it", named="r.npz"):
        read_table(tmp_path / "r.npz")


def test_rows_and_columns_are_named(tmp_path):
    """A NaN is found by its row, a missing column offers the nearest."""
    bad = U.copy()
    bad[7] = np.nan
    np.savez(tmp_path / "r.npz", current=bad, force=Y)
    table = read_table(tmp_path / "r.npz")
    with raises(DataError, "names it", named="has NaN in column current, row 8"):
        table.check_finite("current")
    with raises(DataError, "nearest column", asked="curent", has="force", near="current"):
        table.column("curent")
