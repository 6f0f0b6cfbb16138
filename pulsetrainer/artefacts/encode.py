"""An artefact dataclass into an HDF5 group: datasets with units, named axes, checksums.

Nothing here knows what a field means: ``schema.plan_of`` says what it becomes. Axes are HDF5
dimension scales, so that h5py, xarray and netCDF readers see them by name. Every dataset carries a
checksum (Fletcher-32, or that of the object header it lies in): a flipped bit is an error, not a number.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from pulsetrainer.artefacts.provenance import clean
from pulsetrainer.artefacts.schema import TIME, FieldPlan, plan_of
from pulsetrainer.errors import DataError

if TYPE_CHECKING:
    from collections.abc import Mapping

INDEX_AXIS = "sample"  # the axis of records without time: a dataset "time" always is a time in seconds
_CHUNK = 16384
_COMPRESS_ABOVE_BYTES = 4096
_BLOCK = 1 << 18  # samples copied at a time from one file to another
_WRITE_AGAIN = "write the artefact again with the command that makes it"

Axes = dict[str, h5py.Dataset]


def values_of(artefact: Any) -> dict[str, Any]:
    """Return the fields of an artefact by name."""
    cls: type = type(artefact)
    return {plan.name: getattr(artefact, plan.name) for plan in plan_of(cls)}


def encode(group: h5py.Group, cls: type, values: Mapping[str, Any], inherited: Axes | None = None) -> None:
    """Write the fields of a dataclass into a group.

    Parameters
    ----------
    group
        An empty group, or the root of a file.
    cls
        The dataclass.
    values
        Its fields by name; an array may be an ``h5py.Dataset`` of another file, then it is copied in blocks.
    inherited
        The axis ``time`` of the group above, used where the dataclass has none of its own.

    Raises
    ------
    DataError
        A value does not fit its annotation.
    """
    plans = plan_of(cls)
    axes: Axes = dict(inherited or {})
    if any(plan.is_time_axis for plan in plans):
        axes.pop(TIME, None)
    # the scale first, for the others are attached to it
    for plan in sorted(plans, key=lambda plan: not plan.is_time_axis):
        if values[plan.name] is not None:
            _put(group, plan, values, axes)
        elif not plan.optional:
            raise DataError(f"{plan.name!r} is missing and must be there", hint=_WRITE_AGAIN)


def _put(group: h5py.Group, plan: FieldPlan, values: Mapping[str, Any], axes: Axes) -> None:
    """Write one field of any role."""
    value = values[plan.name]
    if plan.role == "array":
        _put_array(group, plan, value, values, axes)
    elif plan.role == "number":
        _put_number(group, plan, value, values)
    elif plan.role == "attribute":
        group.attrs[plan.path] = _attribute(plan, value)
    elif plan.role == "list":
        _put_list(group, plan, value)
    elif plan.role == "group":
        encode(group.create_group(plan.path), plan.type, values_of(value), _time_of(axes))
    else:
        numbered = group.create_group(plan.path)
        for k, item in enumerate(value):
            encode(numbered.create_group(f"{k:04d}"), plan.type, values_of(item), _time_of(axes))


def _time_of(axes: Axes) -> Axes:
    return {TIME: axes[TIME]} if TIME in axes else {}


def _put_array(group: h5py.Group, plan: FieldPlan, value: Any, values: Mapping[str, Any], axes: Axes) -> None:
    """Write one array and attach its axes."""
    if not isinstance(value, h5py.Dataset):
        value = np.asarray(value)
    if len(value.shape) != len(plan.dims):
        raise DataError(
            f"{plan.name!r} has the shape {value.shape}, expected the axes ({', '.join(plan.dims)})",
            hint=_WRITE_AGAIN,
        )
    is_bool = plan.type is np.bool_
    dataset = group.create_dataset(
        plan.path, value.shape, np.uint8 if is_bool else plan.type, **_storage(value)
    )
    _copy(plan, value, dataset)
    _describe(dataset, plan, values)
    if is_bool:
        dataset.attrs["dtype"] = "bool"  # xarray's own sign for a boolean in an integer
    if plan.is_time_axis:
        dataset.make_scale(TIME)
        axes[TIME] = dataset
        return
    for k, axis in enumerate(plan.dims):
        scale = _scale(group, axes, axis, value.shape[k])
        if scale.shape[0] != value.shape[k]:
            raise DataError(
                f"{plan.name!r} has {value.shape[k]} values along {axis}, expected {scale.shape[0]}",
                hint=_WRITE_AGAIN,
            )
        dataset.dims[k].attach_scale(scale)
        dataset.dims[k].label = scale.name.rsplit("/", 1)[-1]


def _copy(plan: FieldPlan, value: Any, dataset: h5py.Dataset) -> None:
    """Write the numbers, in blocks where they come from another file."""
    length = value.shape[0]
    step = _BLOCK if isinstance(value, h5py.Dataset) else max(length, 1)
    for start in range(0, length, step):
        block = np.asarray(value[start : start + step])
        if block.dtype.kind not in "biuf":
            raise DataError(f"{plan.name!r} holds {block.dtype}, expected numbers", hint=_WRITE_AGAIN)
        if plan.data is not None and plan.data.finite and not np.all(np.isfinite(block)):
            raise DataError(
                f"{plan.name!r} holds a value that is not finite and must not",
                hint="mend the data it came from",
            )
        if block.size:
            dataset[start : start + step] = block


def _storage(value: Any) -> dict[str, Any]:
    """Return how an array lies in the file: one chunk, or several and compressed; always a checksum."""
    shape = value.shape
    if not np.prod(shape):
        return {}  # nothing to protect, and a chunk of size 0 is refused
    if np.prod(shape) * 8 <= _COMPRESS_ABOVE_BYTES:
        return {"chunks": shape, "fletcher32": True}
    chunks = (*(1 for _ in shape[:-1]), min(shape[-1], _CHUNK))
    # level 1: noise does not get smaller at higher levels, only slower
    return {
        "chunks": chunks,
        "fletcher32": True,
        "shuffle": True,
        "compression": "gzip",
        "compression_opts": 1,
    }


def _scale(group: h5py.Group, axes: Axes, axis: str, length: int) -> h5py.Dataset:
    """Return the scale of an axis; one that is not known yet becomes a plain index."""
    if axis not in axes:
        name = INDEX_AXIS if axis == TIME else axis
        index = np.arange(length)
        scale = group.create_dataset(name, data=index, **_storage(index))
        scale.attrs["units"] = "1"
        scale.attrs["quantity"] = f"index of {name}"
        scale.make_scale(name)
        axes[axis] = scale
    return axes[axis]


def _put_number(group: h5py.Group, plan: FieldPlan, value: Any, values: Mapping[str, Any]) -> None:
    """Write one number with its units."""
    number = np.asarray(plan.type(value))
    if plan.data is not None and plan.data.finite and not np.isfinite(number):
        raise DataError(f"{plan.name!r} is {value} and must be finite", hint="mend the data it came from")
    layout = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    layout.set_layout(h5py.h5d.COMPACT)  # inside the object header, under its checksum
    stored = number.astype(np.uint8) if plan.type is bool else number
    dataset = group.create_dataset(plan.path, data=stored, dcpl=layout)
    _describe(dataset, plan, values)
    if plan.type is bool:
        dataset.attrs["dtype"] = "bool"


def _describe(dataset: h5py.Dataset, plan: FieldPlan, values: Mapping[str, Any]) -> None:
    """Write units and quantity, taken from a sibling field where the annotation says ``@name``."""
    if plan.data is None:
        return
    for name in ("units", "quantity"):
        text = getattr(plan.data, name)
        dataset.attrs[name] = clean(values[text[1:]] if text.startswith("@") else text)


def _attribute(plan: FieldPlan, value: Any) -> Any:
    """Return the value as an HDF5 attribute takes it."""
    if plan.type is str:
        return clean(value)
    if plan.type is bool:
        return np.uint8(bool(value))
    return np.int64(value) if plan.type is int else np.float64(value)


def _put_list(group: h5py.Group, plan: FieldPlan, value: Any) -> None:
    """Write a tuple of texts or numbers as one attribute."""
    items = [_attribute(plan, item) for item in value]
    if plan.type is str:
        items_array = np.array(items, dtype=object)
        group.attrs.create(plan.path, items_array, shape=(len(items),), dtype=h5py.string_dtype())
    else:
        group.attrs.create(plan.path, np.array(items, dtype=plan.type), shape=(len(items),))
