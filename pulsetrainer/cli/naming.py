"""A command that adds to errors what only the command line knows: which argument, and what was written."""

from __future__ import annotations

import contextlib
import difflib
import shlex
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand

from pulsetrainer.cli.next_step import to_make, with_files
from pulsetrainer.errors import AbsentError, ExistsError, Interrupted, PulsetrainerError
from pulsetrainer.files.input_file import is_sound, near_names
from pulsetrainer.files.pulses import library

# what the file of an argument holds; others take any artefact, or a table
_HOLDS = {
    "model": ("model",),
    "run": ("run",),
    "runs": ("run",),
    "verify": ("run",),
    "drive": ("waveform",),
    "diagnosis": ("diagnosis",),
    "inputs": ("playback",),
    "evaluations": ("evaluation", "session"),
    "file": (),
}

# of commands that take a run: what to do instead of making one in the usual way
_DIAGNOSTIC = "to make one: pulsetrainer capture diagnostic -o diagnostic.h5, or import your own table"
_RUN_FOR = {
    "diagnose": _DIAGNOSTIC,
    "evaluate": _DIAGNOSTIC,
    "correct": "give the run that was diagnosed: pulsetrainer show DIAGNOSIS.h5 says which",
}
# what else an argument takes that may be a table; tables nearby are mostly something else
_TABLES = {
    "signal": "give identification, diagnostic, or a table with a column of time and one of current",
    "waveform": "name a pulse of the library, such as normal, or give a table with a column of time "
    "and one of values",
}
_NEAR = 0.7  # how alike a name must be to be taken for the one that was meant


class Command(TyperCommand):
    """A command that names the argument of a file, and says what there is after Ctrl-C."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command.

        Raises
        ------
        PulsetrainerError
            As the command; a file that is absent, or in the way, is named with its argument.
        Interrupted
            Also where Ctrl-C came while nothing was played.
        """
        before = _files(ctx)
        try:
            return super().invoke(ctx)
        except (Interrupted, KeyboardInterrupt) as error:
            stopped = error if isinstance(error, Interrupted) else Interrupted("stopped by you")
            if not stopped.hint:  # the command has not said it
                written = [str(path) for path, at in _files(ctx).items() if before.get(path) != at]
                stopped.message += f"; {' and '.join(written) or 'nothing'} was written"
                stopped.hint = "run the command again" + (" with --overwrite" if written else "")
            raise stopped from error
        except (AbsentError, ExistsError) as error:
            given = _given_as(ctx, error.path)
            if given is not None:
                _name(error, given, ctx)
            error.hint = with_files(error.hint, ctx.params)
            raise
        except PulsetrainerError as error:
            error.hint = with_files(error.hint, ctx.params)
            raise


def _files(context: typer.Context) -> dict[Path, int]:
    """Return the files that arguments name, each with the time of its last change."""
    paths = [context.params.get(one.name or "") for one in context.command.params if one.type.name == "path"]
    named = [Path(value) for value in paths if isinstance(value, str | Path)]
    with contextlib.suppress(OSError):
        return {path: path.stat().st_mtime_ns for path in named if path.is_file()}
    return {}


def _given_as(context: typer.Context, path: Path) -> Any:
    for parameter in context.command.params:
        value = context.params.get(parameter.name or "")
        given = value if isinstance(value, list | tuple) else (value,)
        if any(isinstance(one, str | Path) and Path(one) == path for one in given):
            return parameter
    return None


def _name(error: AbsentError | ExistsError, given: Any, context: typer.Context) -> None:
    """Say which argument it is, and for an input which files of its kind are near."""
    name, command = given.name or "", context.info_name or ""
    option = next((one for one in given.opts if one.startswith("-")), "")
    kinds, folder = _HOLDS.get(name), error.path.parent
    word = str(given.human_readable_name).partition("|")[0].rstrip(".")
    if name == "inputs" and context.params.get("model"):  # then it is models on a run
        kinds, word = ("run",), "RUN.h5"
    typed = option or f"argument {word}"
    error.message = error.message.replace(f"{error.path} ", f"{error.path} ({typed}) ", 1)
    if name == "drive" and str(error.path) in library():
        error.hint = f"{error.path} is a pulse: pulsetrainer invert {error.path} --model model.h5 -o drive.h5"
        return
    if isinstance(error, AbsentError) and name in _TABLES:
        tables = sorted(path.name for path in folder.glob("*.csv") if is_sound(path))
        near = difflib.get_close_matches(error.path.name, tables, n=1, cutoff=_NEAR)
        error.hint = (f"did you mean {error.path.with_name(near[0])}? " if near else "") + _TABLES[name]
        return
    if isinstance(error, ExistsError) or kinds is None or not folder.is_dir():
        return
    where = "here" if folder == Path() else f"in {folder}"
    near = [shlex.quote(str(error.path.with_name(name))) for name in near_names(error.path, kinds)]
    if near:
        error.hint = f"{' or '.join(kinds) or 'pulsetrainer'} files {where}: {', '.join(near)}"
    elif kinds:
        usual = f"to make one: {to_make(kinds[0], error.path)}"
        instead = _RUN_FOR.get(command, usual) if kinds == ("run",) else usual
        error.hint = f"there is no {' or '.join(kinds)} file {where}; {instead}"
    else:
        error.hint = f"there is no .h5 file of pulsetrainer {where}: give the path of one"
