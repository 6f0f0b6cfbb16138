"""A command that adds to errors what only the command line knows: which argument, and what was written."""

from __future__ import annotations

import contextlib
import difflib
import re
import shlex
from collections import Counter
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperOption

from pulsetrainer.cli.help_text import HelpContext
from pulsetrainer.cli.next_step import HOLDS, as_options, next_step, the_other_way, to_make, with_files
from pulsetrainer.cli.values import check_finite, named, set_by
from pulsetrainer.errors import AbsentError, ExistsError, Interrupted, PulsetrainerError, UsageError, in_words
from pulsetrainer.files.input_file import apart, cut_off, in_quotes, is_sound, near_names
from pulsetrainer.files.pulses import library

# of commands that take a run: what to do instead of making one in the usual way
_DIAGNOSTIC = (
    "to record one: pulsetrainer capture diagnostic -o {path}, or to make one of a table: "
    "pulsetrainer import TABLE.csv --input COLUMN --output COLUMN -o {path}"
)
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
_WHOLE = 200  # letters, more than any first sentence has
_NEAR = 0.7  # how alike a name must be to be taken for the one that was meant


class Command(TyperCommand):
    """A command that names the argument of a file, and says what there is after Ctrl-C."""

    context_class = HelpContext

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse; UsageError where an option of one file was given twice, or what is typed names no file."""
        ctx.meta[__name__] = args[:]
        if ctx.resilient_parsing:  # a line that is completed is not all there
            return super().parse_args(ctx, args)
        try:
            typed, _, order = self.make_parser(ctx).parse_args(list(args))
        except Exception as error:
            setattr(error, "ctx", ctx)  # noqa: B010 - of a value that is missing the parser does not tell where
            raise
        options = [one for one in order if isinstance(one, TyperOption) and not one.multiple]
        once = [one for one in options if one.type.name == "path" or one.name == "port" or one.secondary_opts]
        for twice, times in Counter(once).items():
            if twice.secondary_opts and {*(both := [twice.opts[-1], *twice.secondary_opts])} <= {*args}:
                said = f"{' and '.join(both)} were both given, and are opposites"
                raise UsageError(said, hint="give one of the two, or neither")
            if times > 1 and not twice.secondary_opts:
                takes = "port" if twice.name == "port" else "file"
                raise UsageError(
                    f"{twice.opts[-1]} was given {times} times, and takes one {takes}",
                    hint="give it once, or run the command once for each",
                )
        for one in self.params:
            _check_names(one, typed.get(one.name or ""))
            kind: Any = one.type
            if kind.name == "path":
                kind.readable = False  # else the parser tells of it, in words of its own
        left = super().parse_args(ctx, args)
        check_finite(ctx)
        return left

    def get_short_help_str(self, limit: int = 45) -> str:
        """Return the first sentence of the help, whole: a narrow terminal folds it."""
        return super().get_short_help_str(max(limit, _WHOLE))

    def invoke(self, ctx: Any) -> Any:
        """Run the command.

        PulsetrainerError as the command; a file that is absent, or in the way, is named with its argument;
        Interrupted also where Ctrl-C came while nothing was played.
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
        except PulsetrainerError as error:
            if isinstance(error, AbsentError | ExistsError):
                given = _given_as(ctx, error.path, to_write=isinstance(error, ExistsError))
                if given is not None:
                    _name(error, given, ctx)
            error.message = _with_file(error.message, ctx.params)
            error.hint = with_files(error.hint, ctx.params)
            if exchanged := the_other_way(error, ctx.params, ctx.meta[__name__]):
                error.hint = f"exchange the two: pulsetrainer {ctx.info_name} {exchanged}"
            _tell_who_set_it(error, ctx)
            raise


def _with_file(said: str, given: Any) -> str:
    """Return a message with the file of the model, the drive or the bounds that it begins with."""
    found = re.match(r"the (model|drive|bounds) (?=takes |is of |is in |have |holds |has )", said)
    file = given.get(found[1]) if found else None
    file = file[0] if isinstance(file, list | tuple) and len(file) == 1 else file
    return f"{found[0]}{file} {said[found.end() :]}" if found and isinstance(file, str | Path) else said


def _tell_who_set_it(error: PulsetrainerError, context: Any) -> None:
    """Name the variable or the file behind an option that is wrong, but was not typed."""
    said = as_options(error.message)
    for one in context.command.params:
        about = rf"{one.opts[0]}(?![\w-])" + "|there is no port " * (one.name == "port")
        if re.search(about, said) and (elsewhere := set_by(one, context)):
            error.message = said.replace(f"({one.opts[0]})", f"({elsewhere[0]})")
            if error.message == said:
                error.message += f" (it comes from {elsewhere[0]})"
            first, also, other = error.hint.partition("; or ")  # what else can be done still holds
            if higher := re.match(r"raise `\w+` to (([\d.]+)(?: or more)?)", first):
                first = f"raise it there to {higher[1]}, or give {one.opts[0]} {higher[2]}"
            error.hint = (first if higher else elsewhere[1]) + also + other


def _check_names(parameter: Any, typed: Any) -> None:
    """UsageError for a file without a name, as a script leaves it, or an option in the place of one."""
    for name in typed if isinstance(typed, list | tuple) else (typed,):
        if parameter.type.name != "path" or not isinstance(name, str):
            continue
        option, got = parameter.opts[0], ""
        if not name.strip():
            got = "an empty name"
            hint = "write the name; if a script gives it, check that its variable is set"
        elif name.endswith("/") and option in ("--out", "--html", "-o"):
            got, hint = f"the folder {name}", "write the name of a file in it"
        elif name.startswith("--") and option.startswith("-"):
            got, hint = f"the option {name}", f"write the name after {option}, then {name}"
        if got:
            raise UsageError(f"{named(parameter)} must name a file, got {got}", hint=hint)


def _files(context: typer.Context) -> dict[Path, int]:
    """Return the files that arguments name, each with the time of its last change."""
    paths = [context.params.get(one.name or "") for one in context.command.params if one.type.name == "path"]
    named = [Path(value) for value in paths if isinstance(value, str | Path)]
    with contextlib.suppress(OSError):
        return {path: path.stat().st_mtime_ns for path in named if path.is_file()}
    return {}


def _given_as(context: typer.Context, path: Path, *, to_write: bool) -> Any:
    """Return the parameter that names a file; of a file named twice, the one it is read or written by."""
    for parameter in context.command.params[:: -1 if to_write else 1]:
        value = context.params.get(parameter.name or "")
        given = value if isinstance(value, list | tuple) else (value,)
        if any(isinstance(one, str | Path) and Path(one) == path for one in given):
            return parameter
    return None


def _name(error: AbsentError | ExistsError, given: Any, context: typer.Context) -> None:
    """Say which argument it is, and for an input which files of its kind are near."""
    name, command = given.name or "", context.info_name or ""
    option = next((one for one in given.opts if one.startswith("-")), "")
    kinds, folder = HOLDS.get(name), error.path.parent
    word = named(given).partition("|")[0].rstrip(".")
    if name == "inputs" and context.params.get("model"):  # then it is models on a run
        kinds, word = ("run",), "RUN.h5"
    typed = option or f"argument {word}"
    error.message = error.message.replace(f"{error.path} ", f"{error.path} ({typed}) ", 1)
    error.message = re.sub(r"^(\w+):/(?=\w)", r"\1://", error.message)  # of an address a path keeps one slash
    values = context.params.get(name)
    listed = list(map(str, values)) if isinstance(values, list | tuple) else []
    hint = _for_a_pulse(error.path, name, context) or in_quotes(listed, command)
    if hint := hint or apart(error.path, option, several=given.multiple or given.nargs == -1):
        error.hint = hint
        return
    if isinstance(error, AbsentError) and name in _TABLES:
        tables = sorted(path.name for path in folder.glob("*.csv") if is_sound(path))
        near = difflib.get_close_matches(error.path.name, tables, n=1, cutoff=_NEAR)
        meant = f"did you mean {shlex.quote(str(error.path.with_name(near[0])))}? Or " if near else ""
        error.hint = meant + _TABLES[name]
        return
    if isinstance(error, ExistsError) and command == "capture":
        error.hint = f"{next_step(error)}; --resume continues an interrupted recording"
    if isinstance(error, ExistsError) or kinds is None or not folder.is_dir():
        return
    if hint := cut_off(error.path):
        error.hint = hint
        return
    where = "here" if folder == Path() else f"in {folder}"
    near = [shlex.quote(str(error.path.with_name(name))) for name in near_names(error.path, kinds)]
    if near:
        error.hint = f"{in_words(kinds) or 'pulsetrainer'} files {where}: {', '.join(near)}"
    elif kinds:
        usual = f"to make one: {to_make(kinds[0], error.path)}"
        instead = _RUN_FOR.get(command, usual) if kinds == ("run",) else usual
        instead = instead.replace("{path}", shlex.quote(str(error.path)))
        error.hint = f"there is no {in_words(kinds)} file {where}; {instead}"
    else:
        error.hint = f"there is no pulsetrainer file {where}: give the full path of one"


def _for_a_pulse(path: Path, name: str, context: typer.Context) -> str:
    """Say how a pulse of the library is given that was meant by an argument; empty where none was."""
    if name == "waveform" and path.stem in library():
        return f"{path.stem} is a pulse of the library: write it without {path.suffix}"
    if str(path) not in library() or (name != "drive" and (name, context.info_name) != ("model", "invert")):
        return ""
    other = str(context.params.get("waveform") or "model.h5")  # of invert: the two were exchanged
    there = {str(path): other, other: str(path)}
    if name == "model" and other.endswith(".h5"):
        words = (there.get(word, word) for word in context.meta[__name__])
        return f"{path} is a pulse; exchange the two: pulsetrainer invert {shlex.join(words)}"
    return f"{path} is a pulse; make a drive of it: pulsetrainer invert {path} --model model.h5 -o drive.h5"
