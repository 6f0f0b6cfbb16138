"""How each field of an artefact dataclass is stored: read off its type and its ``Data`` annotation."""

from __future__ import annotations

import dataclasses
import types
from dataclasses import MISSING, dataclass
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.artefacts import Attribute, Data, beyond_all_quantities

Role = Literal["array", "number", "attribute", "list", "group", "groups"]
TIME = "time"


@dataclass(frozen=True, slots=True)
class FieldPlan:
    """One field: what it becomes in the file, of which type, whether it may be absent."""

    name: str
    role: Role
    type: Any  # element type of an array or list, type of a number or attribute, dataclass of a group
    optional: bool
    default: Any = MISSING
    data: Data | None = None
    attribute: Attribute | None = None

    @property
    def path(self) -> str:
        """The dataset's, group's or attribute's name in the file."""
        mark = self.data or self.attribute
        return self.name if mark is None or mark.path is None else mark.path

    @property
    def dims(self) -> tuple[str, ...]:
        """The names of the axes."""
        return () if self.data is None else tuple(self.data.dims.split())

    @property
    def is_time_axis(self) -> bool:
        """Whether this dataset is the scale of the axis ``time`` in its group."""
        return self.path == TIME and self.dims == (TIME,)

    def fault_in(self, values: NDArray[Any]) -> str:
        """Say what is wrong with the values of this dataset, nothing where nothing is."""
        if self.data is not None and self.data.finite and not np.all(np.isfinite(values)):
            first = ", ".join(map(str, np.argwhere(~np.isfinite(values))[0]))
            return "holds a value that is not finite" + (f", the first at index {first}" if first else "")
        return beyond_all_quantities(values)


def _without_none(hint: Any) -> tuple[Any, bool]:
    """Return the type without ``None``, and whether ``None`` was allowed."""
    if get_origin(hint) not in (Union, types.UnionType):
        return hint, False
    members = [member for member in get_args(hint) if member is not types.NoneType]
    if len(members) != 1:
        raise TypeError(f"a field cannot be stored as one of several types: {hint}")
    return members[0], True


def _role(hint: Any, *, is_dataset: bool) -> tuple[Role, Any]:
    """Return what a type becomes, and its element type."""
    if is_dataset and get_origin(hint) is np.ndarray:
        return "array", get_args(get_args(hint)[1])[0]
    if is_dataset and hint in (int, float, bool):
        return "number", hint
    if is_dataset:
        raise TypeError(f"a dataset holds an array or a number, not {hint}")
    if hint in (str, int, float, bool):
        return "attribute", hint
    if dataclasses.is_dataclass(hint):
        return "group", hint
    if get_origin(hint) is tuple and get_args(hint)[1:] == (Ellipsis,):
        item = get_args(hint)[0]
        if dataclasses.is_dataclass(item):
            return "groups", item
        if item in (str, int, float):
            return "list", item
    raise TypeError(f"no way to store a field of type {hint}")


@cache
def plan_of(cls: type) -> tuple[FieldPlan, ...]:
    """Return the plan of every field of an artefact dataclass, in order.

    TypeError where a field has a type that the store does not know: a mistake in ``artefacts``.
    """
    hints = get_type_hints(cls, include_extras=True)
    plans = []
    for field in dataclasses.fields(cls):
        hint, data, attribute = hints[field.name], None, None
        if get_origin(hint) is Annotated:
            hint, *marks = get_args(hint)
            data = next((mark for mark in marks if isinstance(mark, Data)), None)
            attribute = next((mark for mark in marks if isinstance(mark, Attribute)), None)
        hint, optional = _without_none(hint)
        role, item = _role(hint, is_dataset=data is not None)
        plans.append(FieldPlan(field.name, role, item, optional, field.default, data, attribute))
    return tuple(plans)
