"""An artefact as text: what ``print`` shows of it, and the tables of the commands."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from pulsetrainer.artefacts import Diagnosis, Evaluation
from pulsetrainer.artefacts.evaluation import PUBLISHED
from pulsetrainer.artefacts.units import shown
from pulsetrainer.report import tables
from pulsetrainer.report.diagnosis_text import sections
from pulsetrainer.report.facts import facts
from pulsetrainer.report.names import FORCE, NAMES, OVERVIEW, beyond_rounding, split
from pulsetrainer.report.tables import Facts, Table

_TITLED = {
    "run": "signal", "model": "cells", "waveform": "waveform", "playback": "waveform", "diagnosis": "verdict",
    "session": "pulses",
}  # fmt: skip
_WIDTH = 110  # of a table, unless a screen says otherwise
_LABEL_WIDTH, _COLUMN_WIDTH = 32, 13
_TEXT_WIDTH = 80
_PREDICTION = ("rms", "rms_percent", "max_percent", "gain_percent", "offset", "shape_rms_percent")
_FIGURES = (*OVERVIEW, "compensated.current_tracking_max_percent")


def title(artefact: Any) -> str:
    """Return one line: the kind, and what tells this one from others."""
    if isinstance(artefact, Evaluation):
        artefact = artefact.told_apart()
        names = [*(f"{w.name} {w.inversion}" for w in artefact.waveforms), *(m.name for m in artefact.models)]
        return f"<evaluation of {', '.join(names) or 'nothing'}>"
    said = facts(artefact).get(_TITLED[artefact.kind])
    return f"<{artefact.kind}: {tables.text(said)}{' cells' if artefact.kind == 'model' else ''}>"


def of(artefact: Any, width: int | None = None) -> str:
    """Return an artefact as text: its main figures, a line each, or its tables; only lines are folded."""
    parts: Iterable[Facts | Table]
    if isinstance(artefact, Evaluation):
        parts = tables_of(artefact)
    elif isinstance(artefact, Diagnosis):
        parts = sections(artefact)
    else:
        parts = [Facts(artefact.kind, facts(artefact))]
    lines = (tables.rendered(part, None if isinstance(part, Table) else width) for part in parts)
    return "".join(lines).rstrip("\n")


def tables_of(evaluation: Evaluation, width: int = _WIDTH) -> Iterator[Table]:
    """Yield the figures of an evaluation, beside those of the published device."""
    if evaluation.waveforms:
        yield from _pulses(evaluation, width)
    if evaluation.models:
        yield _predictions(evaluation)


def _title(width: int) -> str:
    """Name the units: a column of them would leave no room for three methods on 80 columns."""
    figures = {NAMES[one.rpartition(".")[2]] for one in _FIGURES}
    others = sorted(f"{words}: {unit}" for words, unit in figures if unit != FORCE)
    lines = (f"force errors of the pulses, {FORCE}", "; ".join(others))
    return "\n".join(textwrap.fill(line, min(width, _TEXT_WIDTH)) for line in lines)


def _predictions(evaluation: Evaluation) -> Table:
    """How each model predicts the run."""
    models = evaluation.models
    fields = [f for f in _PREDICTION if f != "gain_percent" or len(models) > 1]
    heads = [(NAMES[f].words, NAMES[f].unit or shown(models[0].output_unit)) for f in fields]
    rounded = [replace(m, offset=beyond_rounding(m.offset, m.rms)) for m in models]
    return Table(
        "prediction of the run",
        ("model", *(",\n".join(filter(None, head)) for head in heads)),
        tuple((m.name, *(getattr(m, f) for f in fields)) for m in rounded),
    )


def _pulses(evaluation: Evaluation, width: int) -> Iterator[Table]:
    """One table of all pulses where it fits the width, else one for each pulse."""
    columns: dict[str, list[tuple[str, dict[str, float]]]] = {}  # by pulse: heading and figures
    for w in evaluation.told_apart().waveforms:
        published = [("published", PUBLISHED[w.name])] if w.name in PUBLISHED else []
        columns.setdefault(w.name, published).append((w.inversion, w.figures()))
    needed = _LABEL_WIDTH + _COLUMN_WIDTH * sum(len(group) for group in columns.values())
    for page in [list(columns)] if needed <= width else [[name] for name in columns]:
        named = [
            (f"{name}\n{heading}".replace("-", "-\n"), found)
            for name in page
            for heading, found in columns[name]
        ]
        yield Table(
            _title(width),
            ("", *(heading for heading, _ in named)),
            tuple(
                (split(metric)[1].words, *(found.get(metric) for _, found in named)) for metric in _FIGURES
            ),
        )
