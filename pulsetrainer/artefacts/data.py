"""How a field of an artefact is stored, and what every artefact is checked for.

How a field is stored follows from its type and its ``Data`` annotation:

- an array or a number annotated with ``Data``: a dataset with attributes ``units`` and
  ``quantity``; ``dims`` names its axes, and the axis ``time`` is the dataset ``time`` itself as a
  dimension scale. ``units="@name"`` takes the text of the sibling field ``name`` (units come
  with the data: A and N here, A/m and T for somebody else's bench).
- ``finite``: neither NaN nor infinity is written or read (what drives a device, what a model is).
  In any array, and in numbers but for infinity, what is beyond ``LARGEST`` is refused too; NaN is missing.
- ``path``: the dataset's name in the file where it is not the field's name.
- ``str``, ``int``, ``float``, ``bool``: an attribute; ``Attribute(path)`` names it in the file where that is
  not the field's name.
- a dataclass: a group; a tuple of dataclasses: a group of numbered groups.
- ``None``: nothing is written.

Sizes in the comments: n samples, L = n_h + 1 nodes, q = n_h (n_h + 1) / 2 cells, r repeats.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pulsetrainer.errors import DataError

LARGEST = 1e100  # no quantity in any unit is larger, and its squares and sums are numbers still
FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Data:
    """Marks a field as a dataset."""

    units: str
    quantity: str  # in words
    dims: str = ""  # names of the axes, between blanks
    path: str | None = None
    finite: bool = False  # NaN is refused


def percent(quantity: str, dims: str = "") -> Data:
    """Mark a field as a dataset in percent."""
    return Data("percent", quantity, dims)


@dataclass(frozen=True, slots=True)
class Attribute:
    """Marks a text or number whose attribute in the file has another name than the field."""

    path: str


def beyond_all_quantities(values: NDArray[Any]) -> str:
    """Say which values (...) are beyond ``LARGEST``, nothing where none is.

    NaN is none of them, nor is a single infinity.
    """
    if values.dtype.kind != "f" or (values.ndim == 0 and not np.isfinite(values)):
        return ""
    low, high = np.fmin.reduce(values, None, initial=0.0), np.fmax.reduce(values, None, initial=0.0)
    return (
        ""
        if max(-low, high) <= LARGEST
        else f"goes from {low:g} to {high:g}, beyond the limit of {LARGEST:g}"
    )


def check_equal_length(artefact: Any, names: tuple[str, ...]) -> None:
    """Raise DataError unless the named arrays, where present, share the length of their last axis."""
    sizes = {n: np.shape(getattr(artefact, n))[-1] for n in names if getattr(artefact, n) is not None}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{n} has {k}" for n, k in sizes.items())
        raise DataError(
            f"a {artefact.kind} needs arrays of one length along time: {listed}",
            hint="give every one a value for each sample; if this comes from a file, make that again",
        )


def check_time(artefact: Any) -> None:
    """Raise DataError unless ``time_s`` is finite and strictly increasing."""
    t = artefact.time_s
    if t is None:
        return
    if not np.all(np.isfinite(t)):
        where = int(np.flatnonzero(~np.isfinite(t))[0])
        raise DataError(
            f"time of this {artefact.kind} is not a number at sample {where}", hint="correct the time column"
        )
    back = np.flatnonzero(t[1:] <= t[:-1])  # no array of differences: the record may be long
    if back.size:
        k = int(back[0])
        raise DataError(
            f"time of this {artefact.kind} does not increase: sample {k + 1} is at {t[k + 1]:g} s, "
            f"the one before it at {t[k]:g} s",
            hint="sort the record, drop repeated rows, or give `rate` instead of a time column",
        )
