"""The store: every kind comes back as it went in, and reads well for those who use plain h5py or xarray."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from typing import Annotated, ClassVar

import h5py
import numpy as np
import pint
import pytest
import store_examples as examples
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pulsetrainer import artefacts as kinds
from pulsetrainer.artefacts import KINDS, Data, FloatArray
from pulsetrainer.errors import WrongKindError
from pulsetrainer.files.schema import plan_of
from pulsetrainer.files.store import read, read_any, read_header, read_one_of, write

EXAMPLES = settings.default.max_examples  # a file costs more than a number: a share of what laws get
ANY_KIND = pytest.mark.parametrize("kind", sorted(KINDS))


@ANY_KIND
@settings(max_examples=EXAMPLES // 5, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_round_trip(kind, data, tmp_path_factory):
    """Whatever its shapes, NaN, missing parts and texts: what is read equals what was written."""
    artefact = data.draw(examples.artefacts(KINDS[kind]))
    path = tmp_path_factory.mktemp("round") / "a.h5"
    write(path, artefact, examples.header())
    assert examples.equal(read(path, KINDS[kind]), artefact)
    assert examples.equal(read_any(path), artefact)


@settings(max_examples=EXAMPLES // 3, deadline=None)
@given(title=st.text(max_size=20), lines=st.lists(st.text(max_size=20), max_size=3))
def test_header_round_trip(title, lines, tmp_path_factory):
    """Title, history and provenance come back; lone surrogates and NUL as escapes, never as an error."""
    path = tmp_path_factory.mktemp("header") / "a.h5"
    header = examples.header(title, parameters={"t": title}, seed=3, inputs={"x": "00"})
    header = type(header)(header.title, header.created, tuple(lines), header.provenance)
    write(path, kinds.Evaluation(), header)
    if lines == [""]:
        header = type(header)(header.title, header.created, (), header.provenance)
    assert read_header(path) == header


def test_text_that_hdf5_refuses_is_escaped(tmp_path):
    """A file name that is not UTF-8 does not cost the run, nor does it smuggle a parameter."""
    write(tmp_path / "a.h5", examples.run(signal="caf\udce9\0 bench:?creep=1"), examples.header())
    assert read(tmp_path / "a.h5", kinds.Run).signal == "caf\\udce9\\x00 bench:"


def _datasets(path):
    with h5py.File(path) as file:
        found = {}
        file.visititems(
            lambda name, item: found.update({name: item}) if isinstance(item, h5py.Dataset) else None
        )
        yield from found.items()


@cache
def _units():
    return pint.UnitRegistry()


def _fields(cls, group=""):
    """Yield the plan of every field of a kind and of all that is inside it, with the group it lies in."""
    for plan in plan_of(cls):
        yield plan, group
        if plan.role in ("group", "groups"):
            inside = f"{group}/{plan.path}" if plan.role == "group" else f"{group}/{plan.path}/0000"
            yield from _fields(plan.type, inside)


@ANY_KIND
@settings(max_examples=EXAMPLES // 25, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_every_field_of_every_kind_is_readable_without_us(kind, data, tmp_path_factory):
    """Whatever fields a kind has: h5py finds each, xarray opens it with named axes, pint knows its units."""
    artefact = data.draw(examples.artefacts(KINDS[kind], full=True))
    path = tmp_path_factory.mktemp("foreign") / "a.h5"
    write(path, artefact, examples.header())
    registry = _units()
    groups = set()
    with h5py.File(path) as file:
        for plan, group in _fields(KINDS[kind]):
            place = file[group or "/"]
            if plan.role in ("attribute", "list"):
                assert plan.path in place.attrs, (group, plan.name)
                continue
            assert plan.path in place, (group, plan.name)
            if plan.data is not None:
                groups.add(place[plan.path].parent.name)
                assert place[plan.path].attrs["quantity"], plan.name
                registry.parse_units(place[plan.path].attrs["units"])
    for name, dataset in _datasets(path):
        assert isinstance(dataset.attrs["units"], str), name
        registry.parse_units(dataset.attrs["units"])
        assert dataset.attrs["quantity"], name
        if dataset.is_scale:
            continue
        for axis, length in zip(dataset.dims, dataset.shape, strict=True):
            assert len(axis) == 1, name
            assert axis[0].shape == (length,)
            assert axis.keys() == [axis.label]
    for group in groups:
        with xarray.open_dataset(path, group=group, engine="h5netcdf") as opened:
            assert opened.variables
            assert all("phony" not in str(axis) for axis in opened.sizes), opened.sizes
            for variable in opened.variables.values():
                np.asarray(variable.values)


def test_layout_of_a_run(tmp_path):
    """The names that the format promises, and the attributes at the root."""
    write(tmp_path / "a.h5", examples.run(7), examples.header("my run"))
    with h5py.File(tmp_path / "a.h5") as file:
        assert sorted(file) == ["input", "output", "reference", "time"]
        assert file["time"].attrs["units"] == "s"
        assert (file["input"].attrs["units"], file["input"].attrs["quantity"]) == ("A", "current")
        assert file["input"].dims[0].keys() == ["time"]
        assert file.attrs["kind"] == "run"
        assert file.attrs["format_version"] == 1
        assert file.attrs["title"] == "my run"
        assert file.attrs["created"] == "2026-01-02T03:04:05Z"
        assert file.attrs["history"] == "2026-01-02T03:04:05Z pulsetrainer capture -o run.h5"
        assert file.attrs["samples"] == 7
        assert file.attrs["complete"] == 1
        assert json.loads(file.attrs["provenance"])["device"]["serial"] == "1"


def test_layout_of_a_playback(tmp_path):
    """Drives lie under the path of their annotation; measured repeats share the time of the file."""
    write(tmp_path / "a.h5", examples.playback(), examples.header())
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["waveform/drive/compensated"].dims[0][0] == file["waveform/time"]
        measured = file["compensated/output"]
        assert [axis.label for axis in measured.dims] == ["repeat", "time"]
        assert measured.dims[1][0] == file["time"]
        scored = file["waveform/scored"]
        assert (scored.dtype, scored.attrs["dtype"]) == (np.uint8, "bool")


def test_records_without_time_have_an_index(tmp_path):
    """Where there is no time, there is no dataset of that name: the axis is called sample."""
    write(tmp_path / "a.h5", examples.run(time_s=None), examples.header())
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["input"].dims[0].keys() == ["sample"]
        assert "time" not in file
    assert read(tmp_path / "a.h5", kinds.Run).time_s is None


def test_large_arrays_are_compressed(tmp_path):
    """A regular record of 100 000 samples takes a fraction of its size in memory."""
    write(tmp_path / "a.h5", examples.run(100_000, output=np.zeros(100_000)), examples.header())
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["output"].compression == "gzip"
        assert file["output"].shuffle
        assert file["output"].id.get_storage_size() < 8000


def test_xarray_opens_it(tmp_path):
    """With xarray the axes have names, time is a coordinate with units, booleans are booleans."""
    write(tmp_path / "a.h5", examples.playback(), examples.header())
    with xarray.open_dataset(tmp_path / "a.h5", group="compensated", engine="h5netcdf") as opened:
        assert dict(opened.sizes) == {"repeat": 2, "time": 20}
    with xarray.open_dataset(tmp_path / "a.h5", group="waveform", engine="h5netcdf") as opened:
        assert opened.coords["time"].attrs["units"] == "s"
        assert opened["scored"].dtype == bool


def test_pint_parses_every_unit():
    """The fixed units of the annotations are ones that pint knows."""
    registry = _units()
    for unit in ("1", "s", "percent", "A", "N", "N/A^2"):
        registry.parse_units(unit)


def test_a_file_edited_by_the_user_is_read(tmp_path):
    """Mending a title with h5py cuts the checksum off; the file is read without it."""
    path = tmp_path / "a.h5"
    write(path, examples.run(), examples.header())
    with h5py.File(path, "r+") as file:
        file.attrs["title"] = "mended"
    assert b"pulsetrainer crc32" not in path.read_bytes()[-40:]
    assert read_header(path).title == "mended"
    assert examples.equal(read(path, kinds.Run), examples.run())


def test_fields_that_came_later_take_their_default(tmp_path):
    """An attribute that an older file lacks takes its default; a missing optional dataset is None."""
    path = tmp_path / "a.h5"
    write(path, examples.run(), examples.header())
    with h5py.File(path, "r+") as file:
        del file.attrs["signal"], file["reference"]
    run = read(path, kinds.Run)
    assert run.signal == ""
    assert run.reference is None


def test_whole_numbers_are_read_as_floats(tmp_path):
    """A dataset of integers, as other programs write it, is as good as one of floats."""
    path = tmp_path / "a.h5"
    write(path, examples.run(3), examples.header())
    with h5py.File(path, "r+") as file:
        del file["input"]
        file["input"] = np.arange(3, dtype=np.int16)
    np.testing.assert_array_equal(read(path, kinds.Run).input, [0.0, 1.0, 2.0])


def test_read_one_of(tmp_path):
    """Where a command takes several kinds, any of them is read, and the message names all."""
    write(tmp_path / "run.h5", examples.run(), examples.header())
    assert isinstance(read_one_of(tmp_path / "run.h5", kinds.Playback, kinds.Run), kinds.Run)
    with pytest.raises(WrongKindError) as caught:
        read_one_of(tmp_path / "run.h5", kinds.Playback, kinds.Evaluation)
    assert (caught.value.expected, caught.value.found) == (("playback", "evaluation"), "run")


@dataclass(frozen=True)
class _Notes:
    """A kind of the future: lists of texts and numbers, whole-number data."""

    kind: ClassVar[str] = "notes"
    evidence: tuple[str, ...]
    orders: tuple[int, ...]
    weights: tuple[float, ...]
    count: Annotated[int, Data("1", "count")]
    found: Annotated[bool, Data("1", "found")]
    loud: Annotated[FloatArray | None, Data("dB", "loudness", "cell")] = None


@settings(max_examples=25, deadline=None)
@given(notes=examples.artefacts(_Notes))
def test_lists_and_whole_numbers(notes, tmp_path_factory):
    """The roles that no kind uses yet work too."""
    path = tmp_path_factory.mktemp("notes") / "a.h5"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(KINDS, "notes", _Notes)
        write(path, notes, examples.header())
        assert examples.equal(read(path, _Notes), notes)


@pytest.mark.parametrize("hint", [dict, int | str, tuple[int, str], list[int]])
def test_a_field_nobody_can_store_is_a_mistake_at_once(hint):
    """A type without a way to store it is refused when the plan is made."""
    cls = dataclass(type("Odd", (), {"__annotations__": {"odd": hint}}))
    with pytest.raises(TypeError):
        plan_of(cls)
