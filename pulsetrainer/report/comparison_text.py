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


_SHORT = {
    "mean_error_reduction_percent": "reduction",
    "compensated.mean_abs_error_percent": "mean error",
    "compensated.max_abs_error_percent": "max error",
    "rms_percent": "rms error",
    "max_percent": "max error",
    "right_percent": "right",
    "right_from_percent": "right, 95 % from",
    "right_to_percent": "right, 95 % to",
    "response_s": "time to the answer, s",
    "pressed.mean_abs_error_percent": "mean error",
}


def label_of(name: str) -> str:
    """Return the name of a figure as a person says it."""
    for metric, short in _SHORT.items():
        if name.endswith(f".{metric}"):
            return f"{name.removesuffix(metric)[:-1]}: {short}"
    return name
