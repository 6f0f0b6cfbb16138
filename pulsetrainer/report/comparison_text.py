"""A comparison in words and as a tidy table: short names of files and figures."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path


def as_csv(files: Sequence[Path], metrics: Mapping[str, Sequence[float | None]]) -> str:
    """Return a tidy table: a row for each file, a column for each figure."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["file", *metrics])
    writer.writerows([str(file), *(values[k] for values in metrics.values())] for k, file in enumerate(files))
    return text.getvalue()


def labels_of(files: Sequence[Path]) -> list[str]:
    """Return short names of files that still tell them apart: the parts of their paths that differ."""
    parts = [path.with_suffix("").parts for path in files]
    if len({p[-1] for p in parts}) == len(parts):
        return [p[-1] for p in parts]
    if len({p[:-1] for p in parts}) == len(parts) and len({p[-1] for p in parts}) == 1:
        return [Path(*p[:-1]).name or str(path) for p, path in zip(parts, files, strict=True)]
    return [str(path) for path in files]
