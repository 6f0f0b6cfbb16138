"""The series of an artefact as columns of one table, each heading with its unit: ``force [N]``.

What lies along one axis stands side by side. Where an artefact holds several series of unequal length, as an
evaluation of several waveforms does, they stand one below another, and a column of numbers tells them apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pulsetrainer.artefacts import DrivePlayback, Evaluation, FloatArray, Model, Playback
from pulsetrainer.artefacts.units import plain
from pulsetrainer.errors import DataError
from pulsetrainer.files.schema import TIME, FieldPlan, plan_of
from pulsetrainer.files.table import numbered

Columns = dict[str, FloatArray]


def series_of(artefact: Any) -> Columns:
    """Return the columns (n,) of an artefact by their headings; a repeated heading gets a number.

    DataError where the artefact holds no series.
    """
    if isinstance(artefact, Model):
        found = _cells(artefact)
    elif isinstance(artefact, Playback):
        found = _repeats(artefact)
    elif isinstance(artefact, Evaluation):
        found = _evaluated(artefact)
    else:
        found = _along_time(artefact)
    if not found or found[0][1].size == 0:
        raise DataError(f"this {artefact.kind} holds no series", hint="see what it holds: pulsetrainer show")
    names = numbered([name for name, _ in found])
    return dict(zip(names, (column for _, column in found), strict=True))


def _heading(quantity: str, unit: str) -> str:
    """A heading that ``import`` reads: the unit in square brackets, in which others cannot stand."""
    return f"{quantity} [{unit}]"


def _text(artefact: Any, text: str) -> str:
    return str(getattr(artefact, text[1:])) if text.startswith("@") else text


def _column(artefact: Any, plan: FieldPlan, values: FloatArray, before: str = "") -> tuple[str, FloatArray]:
    assert plan.data is not None
    quantity = TIME if plan.is_time_axis else _text(artefact, plan.data.quantity)
    heading = _heading(before + quantity, _text(artefact, plan.data.units))
    return heading, np.asarray(values, dtype=np.float64)


def _along_time(artefact: Any, before: str = "") -> list[tuple[str, FloatArray]]:
    kind: type = type(artefact)
    return [
        _column(artefact, plan, getattr(artefact, plan.name), "" if plan.is_time_axis else before)
        for plan in plan_of(kind)
        if plan.role == "array" and plan.dims == (TIME,) and getattr(artefact, plan.name) is not None
    ]


def _cells(model: Model) -> list[tuple[str, FloatArray]]:
    """The density of a model, a row a cell: the edges between which its relays switch up and down."""
    up, down = np.tril_indices(model.levels)  # the order of core.plane
    model = replace(model, weights_unit=plain(model.weights_unit))
    unit = model.edges_unit
    edges = [
        (_heading(f"switches {way} {end}", unit), model.edges[at])
        for way, at in (("up", up), ("down", down))
        for end, at in (("from", at), ("to", at + 1))
    ]
    fields = [
        _column(model, plan, getattr(model, plan.name))
        for plan in plan_of(Model)
        if plan.role == "array" and plan.dims == ("cell",) and getattr(model, plan.name) is not None
    ]
    return edges + fields


def _repeats(played: Playback) -> list[tuple[str, FloatArray]]:
    """What was asked for and what was measured, repeats one below another."""
    repeats = max(one.output.shape[0] for one in (played.compensated, played.scaled))
    target = _heading("target", played.waveform.output_unit)
    found = [
        ("repeat", np.repeat(np.arange(1.0, repeats + 1.0), played.time_s.size)),
        (_heading(TIME, "s"), np.tile(played.time_s, repeats)),
        (target, np.tile(played.waveform.target, repeats)),
    ]
    for name, drive in (("compensated", played.compensated), ("scaled", played.scaled)):
        for plan in plan_of(DrivePlayback):
            if plan.dims == ("repeat", TIME):
                values: FloatArray = getattr(drive, plan.name)
                missing = np.full((repeats - values.shape[0], played.time_s.size), np.nan)
                found.append(_column(drive, plan, np.vstack((values, missing)).ravel(), f"{name}: "))
    return found


def _evaluated(evaluation: Evaluation) -> list[tuple[str, FloatArray]]:
    """The waveforms that were played, or the models on a run, one below another."""
    parts: list[list[tuple[str, FloatArray]]] = []
    for waveform in evaluation.waveforms:
        drives = [
            column
            for name, drive in (("compensated", waveform.compensated), ("scaled", waveform.scaled))
            for column in _along_time(drive, f"{name}: ")
        ]
        parts.append(_along_time(waveform) + drives)
    parts = parts or [_along_time(model) for model in evaluation.models]
    return _below(parts)


def _below(parts: Sequence[Sequence[tuple[str, FloatArray]]]) -> list[tuple[str, FloatArray]]:
    """Parts one below another, numbered; NaN where a part has no such column."""
    named: list[Mapping[str, FloatArray]] = [dict(part) for part in parts]
    sizes = [next(iter(part.values())).size for part in named]
    headings = list(dict.fromkeys(name for part in named for name in part))
    number = np.repeat(np.arange(1.0, len(named) + 1.0), sizes)
    columns = [
        np.concatenate(
            [part.get(name, np.full(size, np.nan)) for part, size in zip(named, sizes, strict=True)]
        )
        for name in headings
    ]
    return [("number", number), *zip(headings, columns, strict=True)] if named else []
