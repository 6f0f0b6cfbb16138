"""The library of causes: it holds every ``Cause`` with an id that a module of this folder defines."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from functools import cache

from pulsetrainer.artefacts import Cause as Found
from pulsetrainer.artefacts import Extension
from pulsetrainer.diagnosis.causes.base import Cause, Values
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.raw import Firing, Raw
from pulsetrainer.errors import DataError


@cache
def library() -> dict[str, Cause]:
    """All causes by id, in the order of the chain."""
    found: list[Cause] = []
    for module in pkgutil.iter_modules(__path__):
        loaded = importlib.import_module(f"{__name__}.{module.name}")
        for _, kind in inspect.getmembers(loaded, inspect.isclass):
            if issubclass(kind, Cause) and hasattr(kind, "id") and kind.__module__ == loaded.__name__:
                found.append(kind())
    return {cause.id: cause for cause in sorted(found, key=lambda c: c.order)}


def other_kinds(cause: Cause, frames: Sequence[Frame]) -> list[Cause]:
    """Return the other kinds of a cause with as many parameters; a finer formula is tried elsewhere."""
    known = library()[cause.id].kinds(frames) if cause.id in library() else ()
    count = len(cause.quantities(frames[0]))
    return [one for one in known if one is not cause and len(one.quantities(frames[0])) == count]


def places(causes: Collection[Cause]) -> int:
    """Return how many causes these are, where one whose formula holds another counts with that one."""
    return sum(one.holds not in {other.id for other in causes} for one in causes)


def cause_named(name: str) -> Cause:
    """Return a cause.

    DataError where this version knows no cause of that name.
    """
    if name not in library():
        raise DataError(
            f"the model has the extension {name!r}, which this version does not know",
            hint="update pulsetrainer, or extend the model again",
        )
    return library()[name]


def fired_on(raw: Raw, corrected: Sequence[str] = ()) -> list[Firing]:
    """Ask every gate about a record as it was measured.

    Wild samples are found first and taken out for the others; a gate is not asked where one has fired that
    blinds it, nor about what was taken out of the record already (``corrected``) or is left of that.
    """
    causes = with_gates(taken_out(corrected))
    fired: dict[str, Firing] = {}
    for cause in sorted(causes, key=lambda one: not one.wild):
        if not any(name in fired for name in cause.blinded_by):
            firing = cause.gate(raw)
            if firing is not None:
                fired[cause.id] = firing
                raw = replace(raw, wild=firing.mask) if cause.wild else raw
    return [fired[cause.id] for cause in causes if cause.id in fired]


def with_gates(out: Collection[str] = ()) -> list[Cause]:
    """Return the causes that are found on the raw data, but for some."""
    return [one for one in library().values() if one.stage == "record" and one.id not in out]


def taken_out(corrected: Iterable[str]) -> set[str]:
    """Return the ids of causes taken out of a record, and of those that their remains look like."""
    known = [library()[one] for one in corrected if one in library()]  # a later version may know more
    return {name for one in known for name in (one.id, *one.leaves)}


def upright_values(one: Found | Extension, polarity: int) -> Values:
    """Return the stored values of a cause, for the output times the polarity.

    DataError as ``cause_named``.
    """
    cause = cause_named(one.cause)
    return tuple(cause.sign(p.name, polarity) * p.value for p in one.parameters)
