"""An artefact dataclass into an HDF5 group: datasets with units, named axes, checksums.

Nothing here knows what a field means: ``schema.plan_of`` says what it becomes. Axes are HDF5
dimension scales, so that h5py, xarray and netCDF readers see them by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np

from pulsetrainer.artefacts.units import counted
from pulsetrainer.errors import DataError
from pulsetrainer.files.provenance import clean
from pulsetrainer.files.schema import TIME, FieldPlan, plan_of

INDEX_AXIS = "sample"  # the axis of records without time: a dataset "time" always is a time in seconds
_CHUNK = 16384
_COMPRESS_ABOVE_BYTES = 4096
_WRITE_AGAIN = "make the artefact again"

Axes = dict[str, h5py.Dataset]


@dataclass(frozen=True, slots=True)
class Later:
    """Stands for an array (size,) that is written piece by piece when its dataset is there."""

    size: int


def values_of(artefact: Any) -> dict[str, Any]:
    """Return the fields of an artefact by name."""
    cls: type = type(artefact)
    return {plan.name: getattr(artefact, plan.name) for plan in plan_of(cls)}


def encode(group: h5py.Group, cls: type, values: Mapping[str, Any], *, inherited: Axes | None = None) -> None:
    """Write the fields of a dataclass into an empty group; ``Later`` stands for an array to be filled in.

    ``inherited`` is the axis ``time`` of the group above, used where the dataclass has none of its own.

    DataError where a value does not fit its annotation.
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
    value = values[plan.name]
    if plan.role in ("array", "number"):
        _put_dataset(group, plan, values, axes)
    elif plan.role == "attribute":
        group.attrs[plan.path] = _attribute(plan, value)
    elif plan.role == "list":
        _put_list(group, plan, value)
    elif plan.role == "group":
        encode(group.create_group(plan.path), plan.type, values_of(value), inherited=_time_of(axes))
    else:
        numbered = group.create_group(plan.path)
        for k, item in enumerate(value):
            encode(numbered.create_group(f"{k:04d}"), plan.type, values_of(item), inherited=_time_of(axes))


def _time_of(axes: Axes) -> Axes:
    return {TIME: axes[TIME]} if TIME in axes else {}


def _put_dataset(group: h5py.Group, plan: FieldPlan, values: Mapping[str, Any], axes: Axes) -> None:
    value = values[plan.name]
    is_bool = plan.type in (bool, np.bool_)
    stored = np.uint8 if is_bool else plan.type
    if isinstance(value, Later):
        # a view of one number: it has a shape, and takes no memory
        array = np.broadcast_to(np.zeros(1, dtype=stored), value.size)
        dataset = group.create_dataset(plan.path, array.shape, stored, **_storage(array))
    else:
        array = _checked(plan, np.asarray(value))
        dataset = group.create_dataset(plan.path, data=array.astype(stored, copy=False), **_storage(array))
    _describe(dataset, plan, values)
    if is_bool:
        dataset.attrs["dtype"] = "bool"  # xarray's own sign for a boolean in an integer
    if plan.is_time_axis:
        dataset.make_scale(TIME)
        axes[TIME] = dataset
        return
    for k, axis in enumerate(plan.dims):
        scale = _scale(group, axes, axis, array.shape[k])
        if scale.shape[0] != array.shape[k]:
            raise DataError(
                f"{plan.name!r} has {counted(array.shape[k], 'value')} along {axis}, "
                f"expected {scale.shape[0]}",
                hint=_WRITE_AGAIN,
            )
        dataset.dims[k].attach_scale(scale)
        dataset.dims[k].label = scale.name.rsplit("/", 1)[-1]


def _checked(plan: FieldPlan, array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return the array if its axes and values are what the annotation says."""
    if array.ndim != len(plan.dims):
        raise DataError(
            f"{plan.name!r} has the shape {array.shape}, expected the axes ({', '.join(plan.dims)})",
            hint=_WRITE_AGAIN,
        )
    if array.dtype.kind not in "biuf":
        raise DataError(f"{plan.name!r} holds {array.dtype}, expected numbers", hint=_WRITE_AGAIN)
    if said := plan.fault_in(array):
        raise DataError(f"{plan.name!r} {said}", hint="correct the data it was made from")
    return array


def _storage(array: np.ndarray[Any, Any]) -> dict[str, Any]:
    if array.nbytes <= _COMPRESS_ABOVE_BYTES:
        return {}
    chunks = (*(1 for _ in array.shape[:-1]), min(array.shape[-1], _CHUNK))
    # level 1: noise does not get smaller at higher levels, only slower
    return {"chunks": chunks, "shuffle": True, "compression": "gzip", "compression_opts": 1}


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


def _describe(dataset: h5py.Dataset, plan: FieldPlan, values: Mapping[str, Any]) -> None:
    """Write units and quantity, taken from a sibling field where the annotation says ``@name``."""
    assert plan.data is not None
    for name in ("units", "quantity"):
        text = getattr(plan.data, name)
        dataset.attrs[name] = clean(values[text[1:]] if text.startswith("@") else text)


def _attribute(plan: FieldPlan, value: Any) -> Any:
    if plan.type is str:
        return clean(value)
    if plan.type is bool:
        return np.uint8(bool(value))
    return np.int64(value) if plan.type is int else np.float64(value)


def _put_list(group: h5py.Group, plan: FieldPlan, value: Any) -> None:
    items = np.array(
        [_attribute(plan, item) for item in value], dtype=object if plan.type is str else plan.type
    )
    group.attrs.create(plan.path, items, dtype=h5py.string_dtype() if plan.type is str else None)
