"""A command whose errors about a file name the argument that the file was given as."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand

from pulsetrainer.cli.next_step import MAKES
from pulsetrainer.errors import AbsentError, ExistsError
from pulsetrainer.files.input_file import near_names

# what the file of an argument holds; others take any artefact, or a table
_HOLDS = {
    "model": ("model",),
    "run": ("run",),
    "runs": ("run",),
    "verify": ("run",),
    "drive": ("waveform",),
    "diagnosis": ("diagnosis",),
    "inputs": ("playback", "run"),
    "evaluations": ("evaluation", "session"),
    "file": (),
}

# (command, kind of file): what to do instead of making one in the usual way
_WANTED = {
    ("diagnose", "run"): "to make one: pulsetrainer capture diagnostic -o run.h5, or import your own table",
    ("correct", "run"): "give the run that was diagnosed: pulsetrainer show DIAGNOSIS.h5 says which",
}


class Command(TyperCommand):
    """A command that adds to an error about a file what only the command line knows."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command.

        Raises
        ------
        PulsetrainerError
            As the command; a file that is absent, or in the way, is named with its argument.
        """
        try:
            return super().invoke(ctx)
        except (AbsentError, ExistsError) as error:
            given = _given_as(ctx, error.path)
            if given is not None:
                _name(error, given, ctx.info_name or "")
            raise


def _given_as(context: typer.Context, path: Path) -> Any:
    """Return the parameter that a file was given as."""
    for parameter in context.command.params:
        value = context.params.get(parameter.name or "")
        given = value if isinstance(value, list | tuple) else (value,)
        if any(isinstance(one, str | Path) and Path(one) == path for one in given):
            return parameter
    return None


def _name(error: AbsentError | ExistsError, given: Any, command: str) -> None:
    """Say which argument it is, and for an input which files of its kind are near."""
    option = next((name for name in given.opts if name.startswith("-")), "")
    typed = option or f"argument {str(given.human_readable_name).rstrip('.')}"
    error.message = error.message.replace(f"{error.path} ", f"{error.path} ({typed}) ", 1)
    kinds, folder = _HOLDS.get(given.name or ""), error.path.parent
    if isinstance(error, ExistsError) or kinds is None or not folder.is_dir():
        return
    where = "here" if folder == Path() else f"in {folder}"
    near = [shlex.quote(str(error.path.with_name(name))) for name in near_names(error.path, kinds)]
    if near:
        error.hint = f"{' or '.join(kinds) or 'pulsetrainer'} files {where}: {', '.join(near)}"
    elif kinds:
        error.hint = f"there is no {' or '.join(kinds)} file {where}; " + _WANTED.get(
            (command, kinds[0]), f"to make one: {MAKES[kinds[0]]}"
        )
    else:
        error.hint = f"there is no .h5 file of pulsetrainer {where}: give the path of one"
