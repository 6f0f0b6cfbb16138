"""Plot: one figure of whatever an artefact holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pulsetrainer.errors import DataError
from pulsetrainer.files import atomic_write, store
from pulsetrainer.steps import preflight

if TYPE_CHECKING:
    from pulsetrainer.steps.context import Context


@dataclass(frozen=True, slots=True)
class Options:
    """Which file, and where the figure goes."""

    file: Path
    output: Path
    force: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """The figure's file and the kind it shows."""

    output: Path
    kind: str


def run(options: Options, context: Context) -> Result:
    """Draw the artefact.

    Raises
    ------
    UsageError
        The output exists, or its format is unknown.
    DataError
        The file cannot be read, is not an artefact, or holds values that no axis can show.
    """
    form = preflight.figure_form(options.output, "a figure")
    atomic_write.check_output(options.output, options.force)
    artefact = store.read_any(options.file)
    from pulsetrainer.report import figures, render  # draws: half a second that an error need not wait for

    context.progress(0.3)
    try:
        picture = render.encode(figures.draw(artefact), form)
    except (ValueError, ArithmeticError) as error:
        raise DataError(
            f"{options.file} cannot be drawn: {error}",
            hint=f"look at its values: pulsetrainer show {options.file}",
        ) from error
    with atomic_write.replacing(options.output, overwrite=options.force) as temporary:
        temporary.write_bytes(picture)
    context.progress(1.0)
    return Result(options.output, artefact.kind)
