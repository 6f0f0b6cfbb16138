"""Compare: several evaluations side by side, before and after, device against device, week against week."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pulsetrainer.artefacts import Evaluation
from pulsetrainer.errors import DataError
from pulsetrainer.files import atomic_write, store
from pulsetrainer.steps import preflight
from pulsetrainer.steps.evaluate import metrics_of

if TYPE_CHECKING:
    from pulsetrainer.steps.context import Context

# What a person wants to see first; the others on request.
HEADLINES = (
    "mean_error_reduction_percent",
    "compensated.mean_abs_error_percent",
    "compensated.max_abs_error_percent",
    "rms_percent",
    "max_percent",
)
_RISING = ("mean_error_reduction_percent", "gain_percent")  # more is better
_SAME = 0.005  # smaller changes are no change: a figure is shown with two digits


@dataclass(frozen=True, slots=True)
class Options:
    """Which evaluations, and what is written."""

    files: tuple[Path, ...]
    output: Path | None = None  # a figure, or a table when it ends in .csv
    everything: bool = False  # all metrics instead of the headlines
    force: bool = False


@dataclass(frozen=True, slots=True)
class Source:
    """One evaluation."""

    file: Path
    title: str
    created: str


@dataclass(frozen=True, slots=True)
class Metric:
    """One figure in all evaluations; None where an evaluation does not have it."""

    name: str
    values: tuple[float | None, ...]
    change: float | None  # last minus first of those that have it
    better: bool | None  # None: no change, or nothing to compare


@dataclass(frozen=True, slots=True)
class Result:
    """The comparison."""

    evaluations: tuple[Source, ...]
    metrics: tuple[Metric, ...]
    output: Path | None


def run(options: Options, context: Context) -> Result:
    """Lay the figures of several evaluations side by side.

    Raises
    ------
    UsageError
        Fewer than two files, or an output that exists or is of no known form.
    DataError
        A file is no evaluation, or the evaluations have no figure in common.
    """
    form = preflight.comparison_form(options.files, options.output)
    preflight.check_files(outputs=(options.output,), force=options.force)
    evaluations = [store.read(path, Evaluation) for path in options.files]
    headers = [store.read_header(path) for path in options.files]
    context.progress(0.4)
    sources = tuple(
        Source(path, header.title, header.created)
        for path, header in zip(options.files, headers, strict=True)
    )
    every = _figures(evaluations)
    names = [n for n in dict.fromkeys(n for one in every for n in one) if options.everything or _headline(n)]
    metrics = tuple(_metric(name, tuple(one.get(name) for one in every)) for name in names)
    if not any(sum(v is not None for v in m.values) > 1 for m in metrics):
        raise DataError(
            f"no two of {', '.join(map(str, options.files))} have a figure in common",
            hint="evaluate the same pulses, with the same inversion, or the same models",
        )
    if options.output is not None:
        _write(options, form, sources, metrics)
    context.progress(1.0)
    return Result(sources, metrics, options.output)


def _figures(evaluations: Sequence[Evaluation]) -> list[dict[str, float]]:
    """Figures of each evaluation by name, alike where they are to be compared.

    Where no evaluation holds a pulse twice its inversion is left out of the name: before and after may
    differ by just that. A single model is "model", whatever its file is called.
    """
    by_pulse = all(len({w.name for w in one.waveforms}) == len(one.waveforms) for one in evaluations)
    one_model = all(len(one.models) < 2 for one in evaluations)
    found = []
    for one in evaluations:
        renamed = {f"{w.name}.{w.inversion}.": f"{w.name}." for w in one.waveforms} if by_pulse else {}
        if one_model:
            renamed |= {f"{Path(m.name).stem}.": "model." for m in one.models}
        figures = metrics_of(one)
        for old, new in renamed.items():
            figures = {
                new + name.removeprefix(old) if name.startswith(old) else name: value
                for name, value in figures.items()
            }
        found.append(figures)
    return found


def _headline(name: str) -> bool:
    return any(name.endswith(f".{one}") for one in HEADLINES)


def _metric(name: str, values: tuple[float | None, ...]) -> Metric:
    there = [v for v in values if v is not None]
    change = there[-1] - there[0] if len(there) > 1 else None
    better = None
    if change is not None and abs(change) >= _SAME:
        better = (change > 0) == name.endswith(_RISING)
    return Metric(name, values, change, better)


def _write(options: Options, form: str, sources: tuple[Source, ...], metrics: tuple[Metric, ...]) -> None:
    assert options.output is not None
    if form == "csv":
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["metric", *(str(s.file) for s in sources), "change"])
        writer.writerows([m.name, *m.values, m.change] for m in metrics)
        content = text.getvalue().encode()
    else:
        from pulsetrainer.report import comparison_figure, render  # draws: a table need not wait for it

        labels = labels_of(options.files)
        picture = comparison_figure.draw(labels, {m.name: m.values for m in metrics})
        content = render.encode(picture, form)
    with atomic_write.replacing(options.output, overwrite=options.force) as temporary:
        temporary.write_bytes(content)


def labels_of(files: tuple[Path, ...]) -> list[str]:
    """Return short names of files that still tell them apart: the parts of their paths that differ."""
    parts = [path.with_suffix("").parts for path in files]
    if len({p[-1] for p in parts}) == len(parts):
        return [p[-1] for p in parts]
    if len({p[:-1] for p in parts}) == len(parts) and len({p[-1] for p in parts}) == 1:
        return [Path(*p[:-1]).name or str(path) for p, path in zip(parts, files, strict=True)]
    return [str(path) for path in files]
