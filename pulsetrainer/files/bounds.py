"""Bounds of error figures, out of a TOML file: dotted metric name = [low, high]."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pulsetrainer.errors import UsageError


def read_bounds(path: Path) -> dict[str, tuple[float, float]]:
    """Return the two-sided bounds of a TOML file by metric name.

    Raises
    ------
    UsageError
        The file cannot be read, is no TOML, or a bound is not a pair low <= high.
    """
    try:
        tree = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise UsageError(
            f"the file of bounds {path} does not exist",
            hint="check its name, or write it, a line for each figure: "
            "normal.continuous.mean_error_reduction_percent = [90, 100]",
        ) from error
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(
            f"the file of bounds {path} cannot be read: {error}", hint="give a text file (TOML)"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise UsageError(
            f"the file of bounds {path} is not TOML: {error}", hint="correct that line of the file"
        ) from error
    flat: dict[str, tuple[float, float]] = {}

    def descend(prefix: str, node: object) -> None:
        if isinstance(node, dict):
            for key, value in node.items():
                descend(f"{prefix}.{key}" if prefix else key, value)
            return
        pair = node if isinstance(node, list) else []
        numbers = [v for v in pair if isinstance(v, int | float) and not isinstance(v, bool)]
        if len(pair) != 2 or len(numbers) != 2 or not numbers[0] <= numbers[1]:
            raise UsageError(
                f"the bound {prefix} in {path} must be a pair [low, high], got {node!r}",
                hint=f"write {prefix.rpartition('.')[2]} = [0.0, 1.0]",
            )
        flat[prefix] = (float(numbers[0]), float(numbers[1]))

    descend("", tree)
    return flat
