"""A diagnosis as text: what ``print`` and the command show of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pulsetrainer.artefacts import Cause, Diagnosis, Parameter
from pulsetrainer.artefacts.units import with_unit

_SHOWN = 8  # causes in the table


@dataclass(frozen=True, slots=True)
class Facts:
    """Names and values, one a line."""

    title: str
    rows: dict[str, str]


@dataclass(frozen=True, slots=True)
class Causes:
    """The table of causes: the first column is text, the others are numbers."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


def sections(found: Diagnosis) -> Iterator[Facts | Causes]:
    """Yield what there is to say, in the order in which a person would ask."""
    averages = "rms, short averages"
    yield Facts(
        f"verdict: {found.verdict}" + (" (quick screen)" if found.quick else ""),
        {
            "model as given": f"{found.rms_percent:.3f} % rms of the span, single samples",
            "noise": f"{found.noise_percent:.3f} % rms, single samples",
            "weights refitted": f"{found.static_percent:.3f} % {averages}",
            **({} if found.quick else {"extended": f"{found.extended_percent:.3f} % {averages}"}),
            "floor": f"{found.floor_percent:.3f} % {averages}: noise and levels",
        },
    )
    others = [one for one in found.causes if not one.found][: max(_SHOWN - len(found.found), 0)]
    yield Causes(
        "causes, strongest first",
        ("cause", "found", "p", "explains %", "held-out gain %"),
        tuple(_row(one) for one in (*found.found, *others)),
    )
    if found.found:
        yield Facts("found", {one.cause: _said(one) for one in found.found})
    yield Facts("evidence", {str(k): text for k, text in enumerate(found.evidence, start=1)})
    yield Facts("next", {"": found.next_experiment})


def parameter(one: Parameter) -> str:
    """Return a parameter with its unit and its interval."""
    interval = f" [{one.lower:.4g}, {one.upper:.4g}]" if math.isfinite(one.lower) else ""
    return f"{one.name} {with_unit(f'{one.value:.4g}', one.unit)}{interval}"


def _said(one: Cause) -> str:
    parameters = "; ".join(map(parameter, one.parameters))
    tied = f"; could equally be {' or '.join(one.confounded_with)}" if one.confounded_with else ""
    doubt = f"; in doubt: {'; '.join(one.doubts)}" if one.doubts else ""
    return f"{one.text}{': ' if parameters else ''}{parameters}{tied}{doubt}"


def _row(one: Cause) -> tuple[Any, ...]:
    measured = one.found and math.isfinite(one.held_out_gain_percent)
    return (
        one.cause,
        "in doubt" if one.found and one.doubts else one.found,
        None if one.p_value is None else f"{one.p_value:.3f}",
        one.explains_percent,
        one.held_out_gain_percent if measured else None,
    )
