"""Bounds of error figures, from a TOML file: dotted metric name = [low, high]."""

from __future__ import annotations

import contextlib
import json
import math
import re
from pathlib import Path

from pulsetrainer.errors import UsageError
from pulsetrainer.files.settings import leaves, read_toml

_HOW = 'write one bound a line, such as: "normal.continuous.mean_error_reduction_percent" = [90, 100]'


def read_bounds(path: Path) -> dict[str, tuple[float, float]]:
    """Return the two-sided bounds of a TOML file by metric name.

    UsageError where the file cannot be read, is no TOML or is empty, or a bound is not a pair low <= high.
    """
    if not path.exists():
        raise UsageError(f"the bounds file {path} does not exist", hint=f"check its name; to make it, {_HOW}")
    bounds = {}
    for name, pair in leaves(read_toml(path, "bounds")):
        match pair:
            case [low, high] if {type(low), type(high)} <= {int, float} and low <= high:
                bounds[name] = float(low), float(high)
            case _:
                usual = [90.0, 100.0]
                with contextlib.suppress(TypeError, ValueError):  # the wrong way round, or in quotes
                    low, high = sorted(float(str(one).rstrip("% ")) for one in pair)
                    if math.isfinite(high - low):
                        usual = [float(f"{low:.4g}"), float(f"{high:.4g}")]
                tables = re.search(r"^\s*\[", path.read_text(encoding="utf-8"), re.MULTILINE)
                key = name.rpartition(".")[2] if tables else json.dumps(name)
                hint = f"write {key} = {usual}, the lower first"
                if "'" in repr(pair):
                    hint += ", without quotes and without %"
                if type(pair) in (int, float):
                    least = f"[{pair}, {100 if pair <= 100 else 'inf'}] if at least {pair} is meant"
                    hint = f"write {key} = {least}, [0, {pair}] if at most"
                if "." not in name:
                    raise UsageError(
                        f"{name!r} in {path} is not the full name of a value that is judged", hint=_HOW
                    )
                raise UsageError(
                    f"the bound {name} in {path} must be a pair [low, high], got {pair!r}", hint=hint
                )
    if not bounds:
        raise UsageError(f"{path} has no bounds in it, so nothing would be checked", hint=_HOW)
    return bounds
