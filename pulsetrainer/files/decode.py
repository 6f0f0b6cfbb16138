"""An HDF5 group back into an artefact dataclass; a field that does not fit is a ``DataError``.

The file may come from anywhere: truncated, damaged, edited, or made by other programs. Nothing is
believed before it is checked, not even a shape: a damaged size must not fill the memory.
"""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass
from typing import Any

import h5py
import numpy as np

from pulsetrainer.artefacts.units import counted
from pulsetrainer.errors import DamagedFileError, DataError
from pulsetrainer.files.schema import TIME, FieldPlan, plan_of

_DEFLATE_RATIO = 1100  # deflate packs at most 1032 to 1
_ALLOWANCE_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Origin:
    """Whose data these are, for the messages."""

    file: str
    kind: str

    def fault(self, where: str, what: str) -> DamagedFileError:
        """Return the error about one dataset, group or attribute."""
        return DamagedFileError(
            f"{self.file}: {where} of this {self.kind} {what}", path=self.file, artefact=self.kind
        )


def decode(
    group: h5py.Group, cls: type, origin: Origin, *, samples: int | None = None, inherited: int | None = None
) -> Any:
    """Read a dataclass from a group.

    ``samples`` is the length of the time axis of this group, where the file says it; ``inherited`` that of
    the group above.

    DataError where something is missing, or is not what it must be.
    """
    plans = plan_of(cls)
    lengths: dict[str, int] = {}
    if samples is not None:
        lengths[TIME] = samples
    elif inherited is not None and not any(plan.is_time_axis for plan in plans):
        lengths[TIME] = inherited
    ordered = sorted(plans, key=lambda plan: not plan.is_time_axis)
    values = {plan.name: _field(group, plan, origin, lengths) for plan in ordered}
    try:
        return cls(**values)
    except DataError as error:
        place = "" if group.name == "/" else f"{group.name}: "
        raise DataError(f"{origin.file}: {place}{error.message}", hint=error.hint) from error


def _field(group: h5py.Group, plan: FieldPlan, origin: Origin, lengths: dict[str, int]) -> Any:
    is_attribute = plan.role in ("attribute", "list")
    if plan.path not in (group.attrs if is_attribute else group):
        return _absent(group, plan, origin)
    if is_attribute:
        return _attribute(group, plan, origin)
    item = group[plan.path]
    if plan.role in ("array", "number"):
        if not isinstance(item, h5py.Dataset):
            raise origin.fault(f"{item.name!r}", "is a group, expected a dataset")
        return _dataset(item, plan, origin, lengths)
    if not isinstance(item, h5py.Group):
        raise origin.fault(f"{item.name!r}", "is a dataset, expected a group")
    time_length = lengths.get(TIME)
    if plan.role == "group":
        return decode(item, plan.type, origin, inherited=time_length)
    names = sorted(item, key=lambda name: (len(name), name))
    if names != [f"{k:04d}" for k in range(len(names))]:
        raise origin.fault(
            f"group {item.name!r}", f"must hold the groups 0000, 0001, ..., but holds {names[:4]}"
        )
    for name in names:
        if not isinstance(item[name], h5py.Group):
            raise origin.fault(f"{item[name].name!r}", "is a dataset, expected a group")
    return tuple(decode(item[name], plan.type, origin, inherited=time_length) for name in names)


def _absent(group: h5py.Group, plan: FieldPlan, origin: Origin) -> Any:
    """Return what stands for a field that is not in the file."""
    if plan.optional:
        return None
    if plan.default is not MISSING:
        return plan.default  # a field that came into the format after the file was written
    what = {"array": "dataset", "number": "dataset", "attribute": "attribute", "list": "attribute"}
    name = f"{group.name.rstrip('/')}/{plan.path}"
    raise origin.fault(f"the {what.get(plan.role, 'group')} {name!r}", "is missing")


def _dataset(dataset: h5py.Dataset, plan: FieldPlan, origin: Origin, lengths: dict[str, int]) -> Any:
    """Read one array or number."""
    where = f"dataset {dataset.name!r}"
    _check_type(dataset, plan, origin)
    shape = dataset.shape
    if shape is None or len(shape) != len(plan.dims):
        expected = f"the axes ({', '.join(plan.dims)})" if plan.dims else "a single number"
        raise origin.fault(where, f"has the shape {shape}, expected {expected}")
    for axis, length in zip(plan.dims, shape, strict=True):
        if length != lengths.setdefault(axis, length):
            raise origin.fault(
                where, f"has {counted(length, 'value')} along {axis}, expected {lengths[axis]}"
            )
    _check_size(dataset, origin)
    values = np.asarray(dataset[()]).astype(plan.type)
    if said := plan.fault_in(values):
        raise origin.fault(where, said)
    return values if plan.dims else plan.type(values)


def _check_type(dataset: h5py.Dataset, plan: FieldPlan, origin: Origin) -> None:
    """Raise DataError unless the dataset holds numbers of a kind that can stand for the field's."""
    allowed = "biu" if plan.type in (bool, int, np.bool_, np.int64) else "biuf"
    if dataset.dtype.kind not in allowed:
        expected = "whole numbers" if allowed == "biu" else "numbers"
        raise origin.fault(f"dataset {dataset.name!r}", f"holds {dataset.dtype}, expected {expected}")


def _check_size(dataset: h5py.Dataset, origin: Origin) -> None:
    """Raise DataError where the shape promises more than the file can hold: a damaged size."""
    promised = math.prod(dataset.shape) * dataset.dtype.itemsize
    if promised > _DEFLATE_RATIO * dataset.id.get_storage_size() + _ALLOWANCE_BYTES:
        raise origin.fault(
            f"dataset {dataset.name!r}", f"claims {promised:.3g} bytes that the file does not hold"
        )


def _attribute(group: h5py.Group, plan: FieldPlan, origin: Origin) -> Any:
    value = group.attrs[plan.path]
    place = "" if group.name == "/" else f" of {group.name!r}"
    where = f"the attribute {plan.path!r}{place}"
    if plan.role == "list":
        return tuple(_item(item, plan.type, where, origin) for item in np.ravel(value))
    return _item(value, plan.type, where, origin)


def _item(value: Any, expected: type, where: str, origin: Origin) -> Any:
    if expected is str:
        if not isinstance(value, str | bytes):
            raise origin.fault(where, f"is {value!r}, expected a text")
        return text_of(value)
    number = np.asarray(value)
    if number.shape != () or number.dtype.kind not in "biuf":
        raise origin.fault(where, f"is {value!r}, expected a number")
    if expected is not float and number != np.trunc(number):
        raise origin.fault(where, f"is {value!r}, expected a whole number")
    return expected(number[()])


def text_of(value: str | bytes) -> str:
    """Return the text of an attribute; bytes that are not UTF-8 (a damaged text) become replacement signs."""
    raw = value if isinstance(value, bytes) else value.encode("utf-8", "surrogateescape")
    return raw.decode("utf-8", "replace")
